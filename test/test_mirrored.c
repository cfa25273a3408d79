/* SPDX-License-Identifier: BSD-3-Clause */
/* Incidences of which one side alone was measured: their mirror images tell the other. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "folded.h"
#include "mirrored.h"

enum { SPIRAL = 3000 };

typedef int sight(const double out[3]);

static int all_round(const double out[3])
{
	(void)out;
	return 1;
}

static int one_side(const double out[3])
{
	return out[1] > -.02;
}

static int a_quarter(const double out[3])
{
	return out[0] > -.02 && out[1] > -.02;
}

/* The other side as well, but only near the normal. */
static int one_side_or_steep(const double out[3])
{
	return out[1] > -.02 || out[2] > .8;
}

/* Behind the instrument's arm. */
static int not_behind(const double out[3])
{
	return fabs(atan2(out[1], out[0]) / DEGREE - 155) > 20;
}

/* An even spiral; what is measured tells on which side it was: 1 for y > 0, else 2. */
static void look(double theta, double phi, sight *seen, double (*outgoing)[3], float *dsf, rbf_incidence *in)
{
	*in = (rbf_incidence){.outgoing = outgoing[0], .dsf = dsf};
	polar(theta, phi, in->direction);
	for (int i = 0; i < SPIRAL; i++) {
		const double z = (i + .5) / SPIRAL, azimuth = 2 * RBF_PI * .6180339887 * i, s = sqrt(1 - z*z), d[3] = {s * cos(azimuth), s * sin(azimuth), z};
		if (!seen(d))
			continue;
		dsf[in->count] = d[1] > 0 ? 1 : 2;
		memcpy(outgoing[in->count++], d, sizeof d);
	}
}

static void only_what_was_not_measured_is_mirrored(void **state)
{
	(void)state;
	static const struct { rbf_symmetry symmetry; double theta, phi; sight *seen; float most; } given[] = {
		{RBF_BILATERAL_Y, 40, 0, one_side, .5f}, {RBF_BILATERAL_Y, 40, 180, one_side_or_steep, .36f}, {RBF_ISOTROPIC, 40, 0, one_side, .5f},
		{RBF_QUADRILATERAL, 0, 0, a_quarter, .75f}, {RBF_ISOTROPIC, 0, 0, a_quarter, .75f}, {RBF_UP, 0, 0, one_side, .5f},
		/* no image, or nothing that it tells */
		{RBF_BILATERAL_Y, 40, 10, one_side, 0}, {RBF_BILATERAL_X, 40, 0, one_side, 0}, {RBF_ANISOTROPIC, 40, 0, one_side, 0}, {RBF_UP, 40, 0, one_side, 0},
		{RBF_BILATERAL_Y, 40, 0, all_round, 0}};
	static double outgoing[SPIRAL][3];
	static float dsf[SPIRAL];
	for (size_t n = 0; n < sizeof given / sizeof *given; n++) {
		rbf_incidence in;
		rbf_measured measured = {.count = 1, .incidence = &in}, own = {0};
		float most;
		look(given[n].theta, given[n].phi, given[n].seen, outgoing, dsf, &in);
		const size_t had = in.count;
		assert_int_equal(rbf_mirrored_add(given[n].symmetry, 1, 0, &measured, &own, &most), 0);
		if (!(fabsf(most - given[n].most) < .06f))
			fail_msg("%zu: %.3f of the hemisphere was mirrored", n, (double)most);
		assert_int_equal(in.mirrored, in.count - had);
		assert_int_equal(own.count, given[n].most > 0);
		for (size_t i = 0; i < had; i++)
			assert_memory_equal(in.outgoing + 3*i, outgoing[i], sizeof *outgoing);
		for (size_t i = had; i < in.count; i++) {
			const double *o = in.outgoing + 3*i;
			if (given[n].seen(o) && o[1] < -.05 && (o[2] > .85 || given[n].seen != one_side_or_steep)) /* at the edge a sample may be halfway to the next */
				fail_msg("%zu: %g %g %g was measured", n, o[0], o[1], o[2]);
			if (given[n].seen == one_side && o[1] < -.02)
				assert_true(in.dsf[i] < 1.5f || o[1] > -.04);
		}
		if (given[n].most > .4f && given[n].seen != one_side_or_steep)
			assert_true(fabs((double)in.count - SPIRAL) < .05 * SPIRAL);
		rbf_mirrored_drop(&measured);
		assert_int_equal(in.count, had);
		rbf_folded_free(&own);
	}
}

/* L1 at an incidence. */
static double error_at(const bsdfrbf_model *m, bsdf *f, double theta, double phi)
{
	double difference = 0, total = 0, in[3], truth[3];
	polar(theta, phi, in);
	for (int q = 0; q < 10000; q++) {
		const double r = sqrt((q + .5) / 10000), azimuth = 2 * RBF_PI * .6180339887 * q, out[3] = {r * cos(azimuth), r * sin(azimuth), sqrt(1 - r*r)};
		const float i[3] = {(float)in[0], (float)in[1], (float)in[2]}, o[3] = {(float)out[0], (float)out[1], (float)out[2]};
		float value[3];
		f(in, out, truth);
		bsdfrbf_eval(m, i, o, value);
		total += truth[0];
		difference += fabs((double)value[0] - truth[0]);
	}
	return difference / total;
}

static int specular(const double in[3], double beam[][3])
{
	beam[0][0] = -in[0];
	beam[0][1] = -in[1];
	beam[0][2] = in[2];
	return 1;
}

static void gloss(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1], z = out[2] - in[2];
	xyz[0] = xyz[1] = xyz[2] = .05 + exp(-80 * (x*x + y*y + z*z)) / out[2];
}

/* Mirroring facets, tilted to one side. */
static void tilted(const double in[3], const double out[3], double xyz[3])
{
	const double shifted[3] = {out[0], out[1] - .12, out[2]};
	gloss(in, shifted, xyz);
}

/* Brushed along x. */
static void brushed(const double in[3], const double out[3], double xyz[3])
{
	const double z = in[2] + out[2], x = (in[0] + out[0]) / z, y = (in[1] + out[1]) / z;
	xyz[0] = xyz[1] = xyz[2] = .05 + exp(-.5 * (x * x / (.12 * .12) + y * y / (.2 * .2))) / fmax(in[2] * out[2], .02);
}

static char last_warning[600];
static void keep_warning(void *user, const char *text)
{
	(void)user;
	warned++;
	snprintf(last_warning, sizeof last_warning, "%s", text);
}

/* From those samples that are in sight; copies the facts. */
static bsdfrbf_model *build_seen(const plan *p, bsdf *f, sight *seen, bsdfrbf_component_info *info)
{
	static double out[FIXTURE_SAMPLES][3], value[FIXTURE_SAMPLES];
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *all = fixture_data(context, f, specular, 0, 1, p), *data = bsdfrbf_data_new(context);
	bsdfrbf_build_options options;
	bsdfrbf_model *model;
	for (size_t i = 0; i < bsdfrbf_data_incidences(all, BSDFRBF_RF); i++) {
		bsdfrbf_samples s;
		size_t count = 0;
		assert_int_equal(bsdfrbf_data_get(all, BSDFRBF_RF, i, &s), BSDFRBF_OK);
		for (size_t k = 0; k < s.count; k++)
			if (seen(s.outgoing + 3 * k)) {
				memcpy(out[count], s.outgoing + 3 * k, sizeof *out);
				value[count++] = (double)s.dsf[k];
			}
		assert_int_equal(bsdfrbf_data_add(context, data, s.direction, count, out[0], value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	}
	if (seen == one_side)
		assert_true(fabs(bsdfrbf_data_unmeasured(data, BSDFRBF_RF, 0) - .46) < .04);
	else if (seen == all_round)
		assert_true(bsdfrbf_data_unmeasured(data, BSDFRBF_RF, 0) < .01);
	bsdfrbf_build_defaults(&options);
	options.lobes = p->lobes;
	options.threads = 2;
	warned = 0;
	last_warning[0] = 0;
	bsdfrbf_set_warning(context, keep_warning, NULL);
	assert_int_equal(bsdfrbf_build(context, data, &options, &model), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_get_component_info(model, BSDFRBF_RF, info), BSDFRBF_OK);
	bsdfrbf_data_free(all);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return model;
}

/* Of an isotropic material half of the hemisphere is enough, and nothing is said of a symmetry that cannot be seen. */
static void half_is_enough(void **state)
{
	(void)state;
	static const plan p = {"gloss", 6, 1, {0, 15, 30, 45, 60, 75}, 0, 0, 100};
	double error[2];
	for (int half = 0; half < 2; half++) {
		bsdfrbf_component_info info;
		bsdfrbf_model *m = build_seen(&p, gloss, half ? one_side : all_round, &info);
		error[half] = .5 * (error_at(m, gloss, 30, 0) + error_at(m, gloss, 53, 20));
		assert_true(half ? info.mirrored > .4f && info.mirrored < .5f : info.mirrored <= 0);
		assert_true(half ? info.asymmetry < 0 : info.asymmetry >= 0);
		if (warned)
			fail_msg("%s", last_warning);
		bsdfrbf_close(m);
	}
	print_message("L1 %.4f, of one side %.4f\n", error[0], error[1]);
	assert_true(error[1] < 1.25 * error[0]);
}

/* Where one side has a hole, the rest is compared: a symmetric material stays so, and one that is not is noticed. */
static void the_rest_is_compared(void **state)
{
	(void)state;
	static const plan p = {"gloss", 5, 1, {0, 15, 30, 45, 60}, 0, 0, 100};
	bsdfrbf_component_info info;
	bsdfrbf_model *m = build_seen(&p, gloss, not_behind, &info);
	assert_true(info.mirrored > .03f && info.asymmetry >= 0 && info.asymmetry < .03f);
	assert_int_equal(warned, 0);
	bsdfrbf_close(m);
	m = build_seen(&p, tilted, not_behind, &info);
	assert_true(info.asymmetry > .1f);
	assert_non_null(strstr(last_warning, "differ from their images by"));
	bsdfrbf_close(m);
}

/* The largest difference between both sides of the plane of incidence, over the mean. */
static double sides_differ(const bsdfrbf_model *m)
{
	const float in[3] = {.5f, 0, .8660254f};
	double most = 0, sum = 0;
	for (int q = 0; q < 1000; q++) {
		const double r = sqrt((q + .5) / 1000), azimuth = 2 * RBF_PI * .6180339887 * q;
		float out[3] = {(float)(r * cos(azimuth)), (float)(r * sin(azimuth)), (float)sqrt(1 - r*r)}, value[2][3];
		bsdfrbf_eval(m, in, out, value[0]);
		out[1] *= -1;
		bsdfrbf_eval(m, in, out, value[1]);
		most = fmax(most, fabs((double)value[0][0] - (double)value[1][0]));
		sum += (double)value[0][0] / 1000;
	}
	return most / sum;
}

/* Sides that differ by noise alone are told from both; what differs is kept. */
static void sides_are_joined_if_alike(void **state)
{
	(void)state;
	static const plan p = {"gloss", 5, 1, {0, 15, 30, 45, 60}, 0, 0, 100};
	bsdfrbf_component_info info;
	bsdfrbf_model *m = build_seen(&p, gloss, all_round, &info);
	const double joined = sides_differ(m);
	bsdfrbf_close(m);
	m = build_seen(&p, tilted, all_round, &info);
	const double kept = sides_differ(m);
	bsdfrbf_close(m);
	print_message("sides differ by %.5f, of a tilted one by %.3f of the mean\n", joined, kept);
	assert_true(joined < 2e-3 && kept > .5);
}

/* Measured all round with one side of the sample hidden: turned, incidences are compared where both were measured, and together they are complete. */
static void isotropy_is_found_from_halves(void **state)
{
	(void)state;
	static const plan p = {"gloss", 4, 4, {0, 20, 40, 60}, 0, 90, 80};
	bsdfrbf_component_info info;
	bsdfrbf_model *m = build_seen(&p, gloss, one_side, &info);
	const double error = error_at(m, gloss, 30, 0);
	print_message("%s: L1 %.4f\n", info.symmetry_text, error);
	assert_int_equal(info.incidences, 4);
	assert_true(error < .02);
	bsdfrbf_close(m);
}

/* Off the mirror planes nothing but the incidences around tells, and these only once they are told themselves: the beam of those in the plane is carried from
 * one to the next. */
static void beams_are_carried_on(void **state)
{
	(void)state;
	static const plan p = {"brushed", 6, 4, {0, 13, 26, 39, 52, 65}, 0, 30, 80};
	bsdfrbf_component_info info;
	bsdfrbf_model *m = build_seen(&p, brushed, one_side, &info);
	const double near = error_at(m, brushed, 26, 30), far = error_at(m, brushed, 65, 60);
	print_message("L1 %.4f near what was measured, %.4f far off; %s\n", near, far, last_warning);
	assert_true(info.mirrored > .4f && info.filled > .4f);
	assert_true(near < .03 && far < .05);
	assert_non_null(strstr(last_warning, "more than a quarter of what leaves within 60 degrees of the normal was not measured at 15 of 21 incidences"));
	bsdfrbf_close(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(only_what_was_not_measured_is_mirrored),
		cmocka_unit_test(half_is_enough),
		cmocka_unit_test(sides_are_joined_if_alike),
		cmocka_unit_test(the_rest_is_compared),
		cmocka_unit_test(isotropy_is_found_from_halves),
		cmocka_unit_test(beams_are_carried_on),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
