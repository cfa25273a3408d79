/* SPDX-License-Identifier: BSD-3-Clause */
/* Exitant directions without samples: found, and filled where the incidences around tell what is there. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "fit.h"
#include "scan_lines.h"
#include "seen.h"

enum { SPIRAL = 3000 };

/* An even spiral over the hemisphere, but for what is within `radius` of an axis. */
static void look(const double axis[3], double radius, rbf_seen *seen)
{
	static double outgoing[SPIRAL][3];
	rbf_incidence in = {.outgoing = outgoing[0]};
	for (int i = 0; i < SPIRAL; i++) {
		const double z = (i + .5) / SPIRAL, phi = 2 * RBF_PI * .6180339887 * i, s = sqrt(1 - z*z), d[3] = {s * cos(phi), s * sin(phi), z};
		if (d[0]*axis[0] + d[1]*axis[1] + d[2]*axis[2] < cos(radius))
			memcpy(outgoing[in.count++], d, sizeof d);
	}
	assert_int_equal(rbf_seen_make(&in, seen), 0);
	assert_int_equal(rbf_seen_refine(seen), 0);
	assert_int_equal(rbf_seen_band(seen), 0);
}

static void a_hole_is_found(void **state)
{
	(void)state;
	const double axis[3] = {.6, 0, .8};
	rbf_seen seen;
	look(axis, 0, &seen);
	assert_true(seen.share <= 0);
	rbf_seen_free(&seen);
	const double radius = 16 * DEGREE;
	look(axis, radius, &seen);
	/* what is farther from all samples than 2.5 degrees, or than they are from each other along the widest axis, on a spiral up to 4.5 */
	assert_true((double)seen.share < 1 - cos(radius - 2.5 * DEGREE));
	assert_true((double)seen.share > 1 - cos(radius - 4.5 * DEGREE));
	const float in[3] = {.6f, 0, .8f}, out[3] = {-.6f, 0, .8f};
	assert_true(rbf_seen_lacks(&seen, in));
	assert_false(rbf_seen_lacks(&seen, out));
	assert_true(rbf_seen_certainty(&seen, in, 0) <= 0);
	assert_true(rbf_seen_certainty(&seen, out, 1) >= 1);
	size_t band = 0;
	for (size_t i = 0; i < seen.measured.count; i++) {
		const float *p = seen.measured.point[i];
		const double angle = (double)rbf_angle(p, in) / DEGREE;
		band += seen.band[i];
		if (seen.band[i] && (angle > 16 + 11.6 || angle < 15.9))
			fail_msg("a sample at %.1f degrees is not next to the hole", angle);
	}
	assert_true(band > 50);
	/* what was filled tells, but not for the band */
	const float certainty = .25f;
	assert_int_equal(rbf_seen_fill(&seen, 1, (const float (*)[3])in, &certainty), 0);
	assert_true(fabsf(rbf_seen_certainty(&seen, in, 0) - certainty) < 1e-6f);
	assert_true(rbf_seen_certainty(&seen, in, 1) <= 0);
	rbf_seen_free(&seen);
}

/* L1 beyond a polar angle, of all light, at an incidence. */
static double error_beyond(const bsdfrbf_model *m, bsdf *f, double reach, double theta)
{
	double difference = 0, total = 0, in[3], truth[3];
	polar(theta, 0, in);
	for (int q = 0; q < 20000; q++) {
		const double r = sqrt((q + .5) / 20000), phi = 2 * RBF_PI * .6180339887 * q, out[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
		const float i[3] = {(float)in[0], (float)in[1], (float)in[2]}, o[3] = {(float)out[0], (float)out[1], (float)out[2]};
		float value[3];
		f(in, out, truth);
		bsdfrbf_eval(m, i, o, value);
		total += truth[0];
		if (out[2] < cos(reach * DEGREE))
			difference += fabs((double)value[0] - truth[0]);
	}
	return difference / total;
}

/* A mirrored gloss. */
static void gloss(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1], z = out[2] - in[2];
	xyz[0] = xyz[1] = xyz[2] = .01 + exp(-80 * (x*x + y*y + z*z)) / out[2];
}

static int mirrored(const double in[3], double beam[][3])
{
	beam[0][0] = -in[0];
	beam[0][1] = -in[1];
	beam[0][2] = in[2];
	return 1;
}

/* The same, as bright as it stands out from its ground, which does not move: a beam through a fixed exit. */
static void fixed(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + .8, z = out[2] - .6;
	xyz[0] = xyz[1] = xyz[2] = .3 + in[2] * exp(-12 * (x*x + out[1]*out[1] + z*z));
}

typedef int sight(const double out[3]);

/* From those samples that are in sight. */
static bsdfrbf_model *build_seen(const plan *p, bsdf *f, maxima *beams, sight *seen)
{
	static double out[FIXTURE_SAMPLES][3], value[FIXTURE_SAMPLES];
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *all = fixture_data(context, f, beams, 0, 1, p), *data = bsdfrbf_data_new(context);
	for (size_t i = 0; i < bsdfrbf_data_incidences(all, BSDFRBF_RF); i++) {
		bsdfrbf_samples s;
		size_t count = 0;
		assert_int_equal(bsdfrbf_data_get(all, BSDFRBF_RF, i, &s), BSDFRBF_OK);
		for (size_t k = 0; k < s.count; k++) {
			if (!seen(s.outgoing + 3 * k))
				continue;
			memcpy(out[count], s.outgoing + 3 * k, sizeof *out);
			value[count++] = (double)s.dsf[k];
		}
		assert_int_equal(bsdfrbf_data_add(context, data, s.direction, count, out[0], value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	}
	bsdfrbf_model *model = fixture_build_data(context, data, p->lobes, 2);
	bsdfrbf_data_free(all);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return model;
}

static int within_63(const double out[3])
{
	return out[2] > cos(63 * DEGREE);
}

static int within_75(const double out[3])
{
	return out[2] > cos(75 * DEGREE);
}

/* Behind the instrument's arm. */
static int not_behind(const double out[3])
{
	return fabs(atan2(out[1], out[0]) / DEGREE - 155) > 20;
}

static void what_others_show_is_filled(void **state)
{
	(void)state;
	static const plan p = {"gloss", 8, 1, {0, 10, 20, 30, 40, 50, 60, 70}, 0, 0, 100};
	bsdfrbf_model *m = build_seen(&p, gloss, mirrored, within_63);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_true(info.filled > .25f && info.filled < .45f); /* cos 63 degrees is .454, less the reach of samples that are 5 degrees apart */
	const double at_60 = error_beyond(m, gloss, 63, 60), at_70 = error_beyond(m, gloss, 63, 70);
	print_message("missed beyond 63 degrees: %.3f at 60, %.3f at 70\n", at_60, at_70);
	if (!(at_60 < .006) || !(at_70 < .01))
		fail_msg("the beam ends with the samples");
	bsdfrbf_close(m);
}

/* An isotropic material is the same on the other side of the plane of incidence. */
static void what_symmetry_shows_is_filled(void **state)
{
	(void)state;
	static const plan p = {"gloss", 6, 1, {0, 15, 30, 45, 60, 75}, 0, 0, 100};
	bsdfrbf_model *m = build_seen(&p, gloss, mirrored, not_behind);
	const double at_30 = error_beyond(m, gloss, 0, 30), at_60 = error_beyond(m, gloss, 0, 60);
	print_message("behind the arm: %.3f at 30, %.3f at 60\n", at_30, at_60);
	if (!(at_30 < .006) || !(at_60 < .006))
		fail_msg("nothing behind the arm");
	bsdfrbf_close(m);
}

static void what_they_do_not_show_is_left(void **state)
{
	(void)state;
	static const plan p = {"fixed", 6, 1, {0, 15, 30, 45, 60, 75}, 0, 0, 100};
	bsdfrbf_model *m = build_seen(&p, fixed, NULL, within_75);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_true(info.filled <= 0);
	bsdfrbf_close(m);
}

/* A broad gloss over a ground. */
static void broad(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1], z = out[2] - in[2];
	xyz[0] = xyz[1] = xyz[2] = .1 + exp(-5 * (x*x + y*y + z*z));
}

/* Samples of f along a line through the normal at an azimuth, as many a degree, to 85 degrees on both sides, after `count`. Returns the new count. */
static size_t scan_line(bsdf *f, const double in[3], int azimuth, int step, int degree, size_t count, double out[][3], double value[])
{
	for (int at = -85 * degree; at <= 85 * degree; at += step) {
		double xyz[3];
		polar(abs(at) / (double)degree, at < 0 ? azimuth + 180 : azimuth, out[count]);
		f(in, out[count], xyz);
		value[count++] = xyz[0];
	}
	return count;
}

/* Lines through the normal, samples along the first as close as an instrument can: what lies between is not dark for that. A narrow gloss,
 * which no other line meets, is not spread for that. Both are as the plane of incidence tells; see one_plane(). */
static void scan_lines(void **state)
{
	(void)state;
	static double out[2000][3], value[2000];
	static bsdf *const material[2] = {broad, gloss};
	static const char *const name[2] = {"broad", "narrow"};
	for (int n = 0; n < 2; n++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = bsdfrbf_data_new(context);
		for (int theta = 0; theta <= 60; theta += 15) {
			double in[3];
			size_t count = 0;
			polar(theta, 0, in);
			for (int azimuth = 0; azimuth < 180; azimuth += 30)
				count = scan_line(material[n], in, azimuth, azimuth ? 20 : 1, 4, count, out, value);
			assert_int_equal(bsdfrbf_data_add(context, data, in, count, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
		}
		bsdfrbf_model *model = fixture_build_data(context, data, 0, 2);
		const double error = error_beyond(model, material[n], 0, 37);
		print_message("%s: %.4f\n", name[n], error);
		assert_true(error < .015);
		bsdfrbf_close(model);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* Falls off with tangential components. */
static void in_cosines(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1];
	xyz[0] = xyz[1] = xyz[2] = .01 + exp(-80 * (x*x + y*y));
}

/* One incidence, scanned along such lines: a fit that bridges the gaps is not dark there. */
static void gaps_are_bridged(void **state)
{
	(void)state;
	static double out[2000][3], value[2000];
	static float dsf[2000];
	const float lambertian[3] = {0};
	double in[3], xyz[3], error[2];
	rbf_incidence scan = {.outgoing = out[0], .dsf = dsf};
	int lines;
	polar(30, 0, in);
	memcpy(scan.direction, in, sizeof in);
	for (int azimuth = 0; azimuth < 180; azimuth += 30)
		scan.count = scan_line(broad, in, azimuth, azimuth ? 20 : 1, 4, scan.count, out, value);
	for (size_t i = 0; i < scan.count; i++)
		dsf[i] = (float)(value[i] * out[i][2]);
	assert_int_equal(rbf_scan_lines(&(rbf_measured){.count = 1, .incidence = &scan}, &lines), 0);
	assert_true(lines);
	for (int n = 0; n < 2; n++) {
		rbf_lobes l;
		double difference = 0, total = 0;
		scan.lines = n ? RBF_LINES_BRIDGED : RBF_LINES_LEFT;
		assert_int_equal(rbf_fit(&scan, 1, lambertian, 150, 0, &l, NULL), 0);
		for (int q = 0; q < 5000; q++) {
			const double r = sqrt((q + .5) / 5000), phi = 2 * RBF_PI * .6180339887 * q, o[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
			broad(in, o, xyz);
			difference += fabs((double)rbf_lobes_luminance(&l, (const float[3]){(float)o[0], (float)o[1], (float)o[2]}) / o[2] - xyz[0]);
			total += xyz[0];
		}
		error[n] = difference / total;
		rbf_lobes_free(&l);
	}
	print_message("gaps: left %.4f bridged %.4f\n", error[0], error[1]);
	assert_true(error[1] < .5 * error[0]);
}

/* And some light that goes back, by angles. */
static void to_and_fro(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] - in[0], y = out[1] - in[1], z = out[2] - in[2];
	in_cosines(in, out, xyz);
	xyz[0] = xyz[1] = xyz[2] = xyz[0] + .3 * exp(-80 * (x*x + y*y + z*z));
}

/* Mirrored by facets, by their slopes, over a ground. */
static void in_slopes(const double in[3], const double out[3], double xyz[3])
{
	const double x = in[0] + out[0], y = in[1] + out[1], z = in[2] + out[2];
	xyz[0] = xyz[1] = xyz[2] = .01 + .2 * exp(-20 * (x*x + y*y) / (z*z)) / fmax(in[2] * out[2], .02);
}

/* What was measured in the plane of incidence alone falls off beside it as along it, by angles, tangential components or slopes: which of them is found; also where
 * the highest sample is beside the peak. */
static void one_plane(void **state)
{
	(void)state;
	static double out[200][3], value[200];
	static bsdf *const material[] = {gloss, in_cosines, to_and_fro, in_slopes, in_slopes};
	static const char *const name[] = {"by angles", "by cosines", "two peaks", "by slopes", "by slopes, coarsely"};
	static const int apart[] = {1, 1, 1, 1, 4};
	for (int n = 0; n < 5; n++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = bsdfrbf_data_new(context);
		warned = 0;
		bsdfrbf_set_warning(context, count_warning, NULL);
		for (int theta = 0; theta <= 60; theta += 15) {
			double in[3];
			polar(theta, 0, in);
			const size_t count = scan_line(material[n], in, 0, apart[n], 1, 0, out, value);
			assert_int_equal(bsdfrbf_data_add(context, data, in, count, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
		}
		bsdfrbf_model *model = fixture_build_data(context, data, 0, 2);
		const double error = error_beyond(model, material[n], 0, 37);
		print_message("%s: %.4f\n", name[n], error);
		assert_true(error < .02);
		assert_int_equal(warned, 1);
		bsdfrbf_close(model);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* Directions along an arc that is aside of a plane through the normal, degrees, and off the arc by turns. */
static size_t arc_aside(double azimuth, double aside, double off, double from, size_t count, double out[][3])
{
	for (int at = -80; at <= 80; at += 2) {
		const double s = sin((aside + (at % 4 ? off : -off)) * DEGREE), c = sqrt(1 - s*s);
		const double x = c * sin(at * DEGREE), turn = azimuth * DEGREE;
		if (at < from)
			continue;
		out[count][0] = x * cos(turn) - s * sin(turn);
		out[count][1] = x * sin(turn) + s * cos(turn);
		out[count++][2] = c * cos(at * DEGREE);
	}
	return count;
}

/* Samples of one plane, though the device's or the sample's is out of line; others are not taken for one. */
static void planes_are_told(void **state)
{
	(void)state;
	static double out[400][3];
	static const struct { double azimuth, aside, off, from; int second, plane; } c[] = {
		{0, 0, 0, -90, 0, 1}, {4, 0, .5, -90, 0, 1}, {70, 4, 0, -90, 0, 1}, {0, -4, .7, -90, 0, 1}, {0, 4, .5, 20, 0, 1}, {0, 0, 2.5, -90, 0, 1},
		{0, 8, 0, -90, 0, 0}, {0, 4, 2, -90, 0, 0}, {0, 4, 0, -90, 1, 0}, {0, 0, 4, -90, 0, 0}, {0, 20, 4, 20, 1, 0}};
	for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
		double normal[3];
		size_t count = arc_aside(c[i].azimuth, c[i].aside, c[i].off, c[i].from, 0, out);
		if (c[i].second)
			count = arc_aside(c[i].azimuth, -c[i].aside, c[i].off, c[i].from, count, out);
		const rbf_incidence in = {.count = count, .outgoing = out[0]};
		if (rbf_scan_plane(&in, normal) != c[i].plane)
			fail_msg("case %zu is %sa plane", i, c[i].plane ? "" : "not ");
		if (c[i].plane && !(fabs(cos(c[i].azimuth * DEGREE) * normal[0] + sin(c[i].azimuth * DEGREE) * normal[1]) < .08 && fabs(normal[2]) < .12))
			fail_msg("case %zu: normal %g %g %g", i, normal[0], normal[1], normal[2]);
	}
	size_t count = 0;
	for (int side = -1; side <= 1; side += 2) /* two peaks, and nothing between them */
		for (int n = 0; n < 80; n++, count++) {
			const double r = 2.5 * DEGREE * sqrt((n + .5) / 80), theta = side * 25 * DEGREE + r * cos(2.4 * n);
			out[count][0] = sin(theta);
			out[count][1] = r * sin(2.4 * n);
			out[count][2] = sqrt(1 - out[count][0]*out[count][0] - out[count][1]*out[count][1]);
		}
	double normal[3];
	assert_false(rbf_scan_plane(&(const rbf_incidence){.count = count, .outgoing = out[0]}, normal));
}

/* Brushed, askew: mirroring facets, with axes at 20 degrees. */
static void brushed(const double in[3], const double out[3], double xyz[3])
{
	const double c = cos(20 * DEGREE), s = sin(20 * DEGREE), z = in[2] + out[2], x = (in[0] + out[0]) / z, y = (in[1] + out[1]) / z;
	const double along = c * x + s * y, across = c * y - s * x;
	xyz[0] = xyz[1] = xyz[2] = .02 + exp(-.5 * (along * along / (.2 * .2) + across * across / (.08 * .08))) / fmax(in[2] * out[2], .02);
}

/* A weave that blurs tangential components. */
static void woven(const double in[3], const double out[3], double xyz[3])
{
	const double x = in[0] + out[0], y = in[1] + out[1];
	xyz[0] = xyz[1] = xyz[2] = .01 + exp(-.5 * (x * x / (.05 * .05) + y * y / (.2 * .2))) + .5 * exp(-.5 * (x * x / (.2 * .2) + y * y / (.05 * .05)));
}

/* A beam through a fixed exit, which no plane but one shows. */
static void one_exit(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + .8, z = out[2] - .6;
	xyz[0] = xyz[1] = xyz[2] = .02 + (.5 + .5 * in[2]) * exp(-80 * (x*x + out[1]*out[1] + z*z));
}

/* Measured in planes of incidence alone, at several azimuths: planes at other azimuths tell what lies beside each, unless those at the same azimuth are not alike. */
static void cross_planes(void **state)
{
	(void)state;
	static double out[200][3], value[200];
	static bsdf *const material[] = {brushed, brushed, woven, one_exit};
	static const char *const name[] = {"brushed, each 30 degrees", "brushed, each 45", "woven", "one exit"};
	static const int step[] = {30, 45, 15, 60}, round[] = {360, 360, 91, 360};
	static const double most[] = {.01, .01, .05, .25};
	for (int n = 0; n < 4; n++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = bsdfrbf_data_new(context);
		warned = 0;
		bsdfrbf_set_warning(context, count_warning, NULL);
		for (int theta = 0; theta <= 60; theta += 15)
			for (int azimuth = 0; azimuth < (theta ? round[n] : 1); azimuth += step[n]) {
				double in[3];
				polar(theta, azimuth, in);
				const size_t count = scan_line(material[n], in, azimuth, 1, 1, 0, out, value);
				assert_int_equal(bsdfrbf_data_add(context, data, in, count, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
			}
		bsdfrbf_model *model = fixture_build_data(context, data, 0, 2);
		const double error = error_beyond(model, material[n], 0, 37);
		print_message("%s: %.4f\n", name[n], error);
		assert_true(error < most[n]);
		assert_int_equal(warned, n < 3 ? 1 : 2);
		bsdfrbf_close(model);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* Brushed along x: mirroring facets. */
static void along_x(const double in[3], const double out[3], double xyz[3])
{
	const double z = in[2] + out[2], x = (in[0] + out[0]) / z, y = (in[1] + out[1]) / z;
	xyz[0] = xyz[1] = xyz[2] = .02 + exp(-.5 * (x * x / (.35 * .35) + y * y / (.05 * .05))) / fmax(in[2] * out[2], .02);
}

enum part { ASIDE, AHEAD, QUARTER }; /* one side of the plane of incidence; ahead of the normal, seen along it; azimuths 0 to 90 */

static bsdfrbf_model *build_part(bsdf *f, enum part part, const plan *p)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	static double out[FIXTURE_SAMPLES][3], value[FIXTURE_SAMPLES];
	bsdfrbf_data *all = fixture_data(context, f, mirrored, 0, 1, p);
	for (size_t i = 0; i < bsdfrbf_data_incidences(all, BSDFRBF_RF); i++) {
		bsdfrbf_samples s;
		size_t count = 0;
		assert_int_equal(bsdfrbf_data_get(all, BSDFRBF_RF, i, &s), BSDFRBF_OK);
		const double r = hypot(s.direction[0], s.direction[1]), c = r > 1e-6 ? s.direction[0] / r : 1, n = r > 1e-6 ? s.direction[1] / r : 0;
		for (size_t k = 0; k < s.count; k++) {
			const double *o = s.outgoing + 3 * k;
			if ((part == ASIDE ? c * o[1] - n * o[0] : part == AHEAD ? -c * o[0] - n * o[1] : fmin(o[0], o[1])) < -.02)
				continue;
			memcpy(out[count], o, sizeof *out);
			value[count++] = (double)s.dsf[k];
		}
		assert_int_equal(bsdfrbf_data_add(context, data, s.direction, count, out[0], value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	}
	bsdfrbf_model *model = fixture_build_data(context, data, p->lobes, 2);
	bsdfrbf_data_free(all);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return model;
}

/* L1 between incidences. */
static double error_at(const bsdfrbf_model *m, bsdf *f, double theta, double azimuth)
{
	double difference = 0, total = 0, in[3], truth[3];
	polar(theta, azimuth, in);
	for (int q = 0; q < 5000; q++) {
		const double r = sqrt((q + .5) / 5000), phi = 2 * RBF_PI * .6180339887 * q, out[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
		float value[3];
		f(in, out, truth);
		bsdfrbf_eval(m, (const float[3]){(float)in[0], (float)in[1], (float)in[2]}, (const float[3]){(float)out[0], (float)out[1], (float)out[2]}, value);
		total += truth[0];
		difference += fabs((double)value[0] - truth[0]);
	}
	return difference / total;
}

/* Scans to one side of the plane of incidence. Bands along it hide the peak of each, and no frame tells; incidences in the mirror planes were seen on both sides, and half of
 * what they show is told by one. */
static void sides_are_told_by_those_that_show_both(void **state)
{
	(void)state;
	static const plan p = {"brushed", 5, 4, {0, 20, 40, 60, 75}, 0, 30, 120};
	bsdfrbf_model *m = build_part(along_x, ASIDE, &p);
	for (int n = 0; n < 3; n++) {
		const double error = error_at(m, along_x, 30, 20 + 25 * n);
		print_message("one side: %.4f at azimuth %d\n", error, 20 + 25 * n);
		assert_true(error < .06);
	}
	bsdfrbf_close(m);
}

/* A gloss over a ground that is darker for grazing light. */
static void over_ground(const double in[3], const double out[3], double xyz[3])
{
	gloss(in, out, xyz);
	xyz[0] = xyz[1] = xyz[2] = xyz[0] + .2 * in[2] * out[2];
}

/* Normal incidence shows all azimuths, but hardly any of what is hidden from it then is shown by those around: that says nothing against filling. */
static void what_is_hardly_shown_decides_nothing(void **state)
{
	(void)state;
	static const plan p = {"gloss", 8, 1, {0, 10, 20, 30, 40, 50, 60, 70}, 0, 0, 100};
	bsdfrbf_model *m = build_part(in_slopes, QUARTER, &p);
	const double error = error_at(m, in_slopes, 25, 0);
	print_message("a quarter: %.4f at 25\n", error);
	assert_true(error < .04);
	bsdfrbf_close(m);
}

/* What goes back was measured at no incidence but the normal one: what is said to be its error is what it is, within a factor 2. */
static void what_is_guessed_is_doubted(void **state)
{
	(void)state;
	static const plan p = {"gloss", 6, 1, {0, 15, 30, 45, 60, 75}, 0, 0, 100};
	bsdfrbf_component_info info;
	bsdfrbf_model *m = build_part(over_ground, AHEAD, &p);
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	double error = 0;
	for (int n = 0; n < 8; n++)
		error += error_at(m, over_ground, acos(1 - (n + .5) / 8 * (1 - cos(75 * DEGREE))) / DEGREE, 0) / 8;
	print_message("ahead alone: error %.4f, expected %.4f\n", error, (double)info.expected_error);
	assert_true((double)info.expected_error > .5 * error && (double)info.expected_error < 2 * error);
	bsdfrbf_close(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_hole_is_found),
		cmocka_unit_test(what_others_show_is_filled),
		cmocka_unit_test(what_symmetry_shows_is_filled),
		cmocka_unit_test(what_they_do_not_show_is_left),
		cmocka_unit_test(gaps_are_bridged),
		cmocka_unit_test(scan_lines),
		cmocka_unit_test(one_plane),
		cmocka_unit_test(planes_are_told),
		cmocka_unit_test(cross_planes),
		cmocka_unit_test(sides_are_told_by_those_that_show_both),
		cmocka_unit_test(what_is_hardly_shown_decides_nothing),
		cmocka_unit_test(what_is_guessed_is_doubted),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
