/* SPDX-License-Identifier: BSD-3-Clause */
/* Materials between whose incidences no map of the list, or no sum of what was measured, tells the truth. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "levels.h"
#include "model_fixture.h"
#include "network.h"

/* L1 of a channel over incidences at each theta, and at azimuths half way between those that are phi_step apart. */
static double error_of(const bsdfrbf_model *m, bsdf *f, double phi_step, int thetas, const double theta[], int channel)
{
	double difference = 0, total = 0;
	for (int q = 0; q < 200 * 20; q++) {
		const double r = sqrt((q % 200 + .5) / 200), phi = 2 * RBF_PI * .6180339887 * q;
		double in[3], truth[3];
		float value[3];
		polar(theta[q / 200 % thetas], phi_step * (.5 + q / 600), in);
		const double out[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
		const float i[3] = {(float)in[0], (float)in[1], (float)in[2]}, o[3] = {(float)out[0], (float)out[1], (float)out[2]};
		f(in, out, truth);
		bsdfrbf_eval(m, i, o, value);
		difference += fabs((double)value[channel] - truth[channel]);
		total += truth[channel];
	}
	print_message("L1 %.4f\n", difference / total);
	return difference / total;
}

static double error_between(const bsdfrbf_model *m, bsdf *f, double phi_step, int thetas, const double theta[])
{
	return error_of(m, f, phi_step, thetas, theta, 0);
}

/* No map of the list follows grooves that are turned: one is learned. */
static void a_beam_is_learned(void **state)
{
	(void)state;
	static const plan p = {"grooves", 4, 12, {0, 20, 40, 60}, 0, 30, 100};
	bsdfrbf_model *m = fixture_build_of(&p, grooves, NULL, 0, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	int learned = -1;
	for (int f = 0; f < info.frames; f++)
		if (info.frame_learned[f])
			learned = f;
	if (learned < 0)
		fail_msg("nothing learned: %s and %d more frames", info.frame_name[0], info.frames - 1);
	for (int n = 0; n < 2; n++)
		for (int k = 0; k < 2; k++)
			assert_float_equal((double)info.frame_beam[learned][n][k], -ruled[n] * ruled[k], .05);
	if (!(error_between(m, grooves, 30, 3, (const double[3]){10, 30, 50}) < .05))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* Sends most of its light back whence it came, and some on as a mirror does. */
static void reflector(const double in[3], const double out[3], double xyz[3])
{
	double back[3];
	const double mirrored[3] = {-in[0], -in[1], in[2]};
	cats_eye(in, out, back);
	cats_eye(mirrored, out, xyz);
	xyz[0] = xyz[1] = xyz[2] = .02 + back[1] + .2 * xyz[1];
}

static int reflector_beams(const double in[3], double beam[][3])
{
	cats_eye_beams(in, beam);
	beam[1][0] = -in[0];
	beam[1][1] = -in[1];
	beam[1][2] = in[2];
	return 2;
}

/* Normal incidence, which all frames predict alike from others around, and one ring or a single incidence more. */
static void few_tell_frames(void **state)
{
	(void)state;
	static const plan plans[] = {{"", 2, 1, {0, 45}, 0, 0, 60}, {"", 2, 4, {0, 45}, 0, 90, 60}};
	for (int n = 0; n < 2; n++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = fixture_data(context, reflector, reflector_beams, 0, 1, &plans[n]);
		bsdfrbf_build_options options;
		bsdfrbf_model *m;
		bsdfrbf_build_defaults(&options);
		options.lobes = plans[n].lobes;
		options.symmetry = "IA"[n];
		assert_int_equal(bsdfrbf_build(context, data, &options, &m), BSDFRBF_OK);
		const double error = error_between(m, reflector, 45, 2, (const double[2]){15, 30});
		int transmit;
		print_message("%c: %s, L1 %.3f\n", options.symmetry, fixture_maps(fixture_component(m, &transmit)), error);
		assert_true(error < .2);
		bsdfrbf_close(m);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* Cuts at 45 degrees either way besides what is mirrored: images of each other, but neither of itself. */
static void crossed(const double in[3], const double out[3], double xyz[3])
{
	static const double e[3][2][2] = {{{-1, 0}, {0, -1}}, {{0, 1}, {1, 0}}, {{0, -1}, {-1, 0}}};
	xyz[0] = xyz[1] = xyz[2] = .01;
	for (int b = 0; b < 3; b++) {
		const double x = out[0] - e[b][0][0]*in[0] - e[b][0][1]*in[1], y = out[1] - e[b][1][0]*in[0] - e[b][1][1]*in[1], z = out[2] - in[2];
		xyz[1] += exp(-40 * (x*x + y*y + z*z));
	}
	xyz[0] = xyz[2] = xyz[1];
}

/* Each of the three is worth little without the others; and motion of all there is, which tells the next ring as well, is wrong at other azimuths. */
static void beams_are_learned_together(void **state)
{
	(void)state;
	static const plan p = {"crossed", 6, 4, {12, 24, 36, 48, 60, 72}, 0, 30, 0};
	bsdfrbf_model *m = fixture_build_of(&p, crossed, NULL, 0, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_int_equal(info.symmetry, 'Q');
	if (!(error_between(m, crossed, 30, 3, (const double[3]){18, 30, 54}) < .08))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* Back to the source and mirrored, the one weaker for light from along y. */
static void two_beams(const double in[3], const double out[3], double xyz[3])
{
	xyz[1] = .02;
	for (int mirrored = 0; mirrored < 2; mirrored++) {
		const double sign = mirrored ? -1 : 1, x = out[0] - sign * in[0], y = out[1] - sign * in[1], z = out[2] - in[2];
		xyz[1] += (mirrored ? .3 : 1 - .8 * in[1]) * exp(-60 * (x*x + y*y + z*z));
	}
	xyz[0] = xyz[2] = xyz[1];
}

/* Wherever the half that was measured lies, its beams are told apart: the mesh has its incidences mirrored where they are not asked for. */
static void halves_are_alike(void **state)
{
	(void)state;
	static const plan half[2] = {{"right", 6, 7, {0, 15, 30, 45, 60, 75}, -90, 30, 60}, {"left", 6, 7, {0, 15, 30, 45, 60, 75}, 90, 30, 60}};
	for (int n = 0; n < 2; n++) {
		bsdfrbf_model *m = fixture_build_of(&half[n], two_beams, NULL, 0, 1);
		bsdfrbf_component_info info;
		assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
		assert_true(info.mirror_x && !info.mirror_y);
		if (!(error_between(m, two_beams, 30, 4, (const double[4]){22, 37, 52, 67}) < .02))
			fail_msg("half %d: wrong between the measured incidences", n);
		bsdfrbf_close(m);
	}
}

/* Mirrored, but for blue, which goes back to the source. */
static void split_by_colour(const double in[3], const double out[3], double xyz[3])
{
	const double z = out[2] - in[2], x = out[0] + in[0], y = out[1] + in[1], back_x = out[0] - in[0], back_y = out[1] - in[1];
	xyz[0] = xyz[1] = .02 + exp(-60 * (x*x + y*y + z*z));
	xyz[2] = .02 + exp(-60 * (back_x*back_x + back_y*back_y + z*z));
}

/* Where luminance has no beam, another channel's is followed none the less. */
static void colours_have_frames(void **state)
{
	(void)state;
	static const plan p = {"split", 6, 4, {0, 15, 30, 45, 60, 75}, 0, 30, 60};
	bsdfrbf_model *m = fixture_build_of(&p, split_by_colour, NULL, 0, 3);
	for (int n = 0; n < 3; n++)
		if (!(error_of(m, split_by_colour, 30, 4, (const double[4]){22, 37, 52, 67}, n) < .02))
			fail_msg("channel %d: wrong between the measured incidences", n);
	bsdfrbf_close(m);
}

/* A gloss that rises as Fresnel's reflectance does. */
static void rising(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1], z = out[2] - in[2];
	xyz[0] = xyz[1] = xyz[2] = (.004 + 3 * (.04 + .96 * pow(1 - in[2], 5)) * exp(-30 * (x*x + y*y + z*z)));
}

/* Levels of such a frame are evened: the sum of what was measured, each by its weight, would be too much. */
static void levels_are_evened(void **state)
{
	(void)state;
	static const plan p = {"rising", 5, 1, {0, 20, 40, 60, 80}, 0, 0, 100};
	bsdfrbf_model *m = fixture_build_of(&p, rising, NULL, 0, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_true(info.even > 0);
	if (!(error_between(m, rising, 0, 4, (const double[4]){10, 30, 50, 70}) < .045))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* A beam that a grating bends: it sets where the incidence is low enough. */
static void bent(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0] - .5, y = out[1] + in[1];
	xyz[0] = xyz[1] = xyz[2] = .01 + exp(-60 * (x*x + y*y));
}

static void bent_along_y(const double in[3], const double out[3], double xyz[3])
{
	bent((double[3]){in[1], in[0], in[2]}, (double[3]){out[1], out[0], out[2]}, xyz);
}

/* Measured all round, and asked for as bilateral: the data tell about which plane. */
static void the_other_plane(void **state)
{
	(void)state;
	static const plan p = {"bent", 4, 8, {0, 20, 40, 60}, 0, 45, 60};
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_build_options options;
	bsdfrbf_component_info info;
	bsdfrbf_build_defaults(&options);
	options.lobes = p.lobes;
	options.symmetry = 'B';
	for (int turned = 0; turned < 2; turned++) {
		bsdfrbf_model *m;
		bsdfrbf_data *data = fixture_data(context, turned ? bent_along_y : bent, NULL, 0, 1, &p);
		assert_int_equal(bsdfrbf_build(context, data, &options, &m), BSDFRBF_OK);
		assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
		assert_int_equal(info.mirror_x, turned);
		assert_int_equal(info.mirror_y, !turned);
		bsdfrbf_close(m);
		bsdfrbf_data_free(data);
	}
	bsdfrbf_context_free(context);
}

/* What is still above the horizon tells alone how strong it is there: it counts for those that tell nothing. */
static void shares_are_limited(void **state)
{
	(void)state;
	static const plan p = {"bent", 6, 9, {0, 15, 30, 45, 60, 75}, 0, 22.5, 100};
	bsdfrbf_model *m = fixture_build_of(&p, bent, NULL, 0, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_int_equal(info.frames, 1);
	assert_true(info.frame_limit[0] > 2);
	if (!(error_between(m, bent, 22.5, 4, (const double[4]){10, 37, 50, 67}) < .0027))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* Where incidences are few, what maps and shares of corners make of facets' light is too much: it is tuned. */
static void light_is_tuned(void **state)
{
	(void)state;
	static const plan p = {"brushed", 3, 2, {0, 40, 70}, 0, 90, 100};
	bsdfrbf_model *m = fixture_build(&p);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_int_equal(info.tuned, 1);
	if (!(error_between(m, material_find(p.material)->f, 90, 2, (const double[2]){20, 55}) < .086))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* A film between whose fringes few incidences were measured. */
static void fringed(const double in[3], const double out[3], double xyz[3])
{
	const double x = out[0] + in[0], y = out[1] + in[1], z = out[2] - in[2], swing = sin(3 * acos(fmin(in[2], 1)) - .3);
	xyz[0] = xyz[1] = xyz[2] = .01 + (.2 + .8 * swing * swing) * exp(-25 * (x*x + y*y + z*z));
}

/* Light is tuned to a spline through what was measured. */
static void fringes_are_followed(void **state)
{
	(void)state;
	static const plan p = {"fringed", 9, 1, {0, 10, 20, 30, 40, 50, 60, 70, 80}, 0, 0, 100};
	bsdfrbf_model *m = fixture_build_of(&p, fringed, NULL, 0, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_int_equal(info.tuned, 1);
	if (!(error_between(m, fringed, 0, 8, (const double[8]){5, 15, 25, 35, 45, 55, 65, 75}) < .025))
		fail_msg("wrong between the measured incidences");
	bsdfrbf_close(m);
}

/* Second derivative by the angle at the first or second end of an interval of a chain whose azimuth is 0. */
static double bend_at(const rbf_knot *a, const rbf_knot *b, double a_theta, double b_theta, int end)
{
	const double h = b_theta - a_theta, chord = (double)(b->value - a->value) / h;
	const double p = (double)a->slope[0] / cos(a_theta), q = (double)b->slope[0] / cos(b_theta);
	return (end ? 2*p + 4*q - 6*chord : 6*chord - 4*p - 2*q) / h;
}

/* On a chain the network is the cubic spline that is even about the normal and ends as a parabola, whatever the spacing. */
static void a_chain_is_splined(void **state)
{
	(void)state;
	static const double theta[6] = {0, 8, 25, 35, 60, 70};
	static const float value[6] = {.2f, .5f, .1f, .12f, .6f, .3f};
	bsdfrbf_context *context = bsdfrbf_context_new();
	double direction[6 * 3];
	rbf_mesh mesh;
	for (int i = 0; i < 6; i++)
		polar(theta[i], 0, direction + 3*i);
	assert_int_equal(rbf_mesh_build(context, RBF_ISOTROPIC, 6, direction, NULL, &mesh), BSDFRBF_OK);
	rbf_knot *knot = rbf_network_make(&mesh, value);
	assert_non_null(knot);
	assert_float_equal((double)knot[0].slope[0], 0, 1e-4);
	for (int i = 1; i < 6; i++) {
		const double before = bend_at(&knot[i - 1], &knot[i], theta[i - 1] * DEGREE, theta[i] * DEGREE, 1);
		const double after = i < 5 ? bend_at(&knot[i], &knot[i + 1], theta[i] * DEGREE, theta[i + 1] * DEGREE, 0)
			: bend_at(&knot[i - 1], &knot[i], theta[i - 1] * DEGREE, theta[i] * DEGREE, 0);
		assert_float_equal((double)knot[i].value, (double)value[i], 0);
		assert_float_equal(before, after, 2e-3);
	}
	free(knot);
	rbf_mesh_free(&mesh);
	bsdfrbf_context_free(context);
}

/* Between the vertices of triangles the network is closer to what is smooth than the plane through their values, whichever part of the circle
 * was measured. */
static void triangles_are_smoothed(void **state)
{
	(void)state;
	static const struct { rbf_symmetry symmetry; int phis; double step; } plans[] = {
		{RBF_ANISOTROPIC, 12, 30}, {RBF_QUADRILATERAL, 4, 30}, {RBF_BILATERAL_Y, 7, 30}, {RBF_UP, 6, 30}};
	bsdfrbf_context *context = bsdfrbf_context_new();
	for (size_t p = 0; p < sizeof plans / sizeof *plans; p++) {
		double direction[60 * 3], plain[2] = {0, 0}, error[2] = {0, 0}; /* inside, and at the edge, where less is known */
		float value[60];
		uint32_t count = 0;
		rbf_mesh mesh;
		for (int t = 0; t < 5; t++)
			for (int a = 0; a < (t ? plans[p].phis : 1); a++)
				polar(15 * t, plans[p].step * a, direction + 3 * count++);
		for (uint32_t b = 0; b < count; b++)
			value[b] = (float)(1 + .4*direction[3*b]*direction[3*b] + .5 * direction[3*b + 2] * direction[3*b + 2] * direction[3*b + 2]);
		assert_int_equal(rbf_mesh_build(context, plans[p].symmetry, count, direction, NULL, &mesh), BSDFRBF_OK);
		rbf_knot *knot = rbf_network_make(&mesh, value);
		assert_non_null(knot);
		for (uint32_t e = 0; e < mesh.elements; e++) {
			static const float third[3] = {1 / 3.f, 1 / 3.f, 1 / 3.f};
			rbf_vertex vertex[3];
			rbf_knot of[3];
			float middle[3] = {0, 0, 0}, mean = 0;
			for (int k = 0; k < 3; k++) {
				vertex[k] = mesh.vertex[mesh.element[e].v[k]];
				of[k] = knot[vertex[k].base];
				mean += of[k].value / 3;
				for (int n = 0; n < 3; n++)
					middle[n] += vertex[k].direction[n];
			}
			rbf_normalize(middle);
			const float truth = 1 + .4f*middle[0]*middle[0] + .5f*middle[2]*middle[2]*middle[2];
			const int edge = middle[2] < .6f;
			plain[edge] += (double)fabsf(mean - truth);
			error[edge] += (double)fabsf(rbf_network_between(3, of, vertex, third) - truth);
		}
		print_message("%c: %.4f of %.4f, at the edge %.4f of %.4f\n", plans[p].symmetry, error[0], plain[0], error[1], plain[1]);
		assert_true(error[0] < .2 * plain[0] && error[1] < .25 * plain[1]);
		free(knot);
		rbf_mesh_free(&mesh);
	}
	bsdfrbf_context_free(context);
}

/* Levels of second degree over the tangential components: their slopes are known, whichever part of the circle was measured. */
static void slopes_are_met(void **state)
{
	(void)state;
	static const struct { rbf_symmetry symmetry; int phis; double step; } plans[] = {
		{RBF_ANISOTROPIC, 12, 30}, {RBF_QUADRILATERAL, 4, 30}, {RBF_BILATERAL_Y, 7, 30}, {RBF_ISOTROPIC, 1, 0}};
	for (size_t p = 0; p < sizeof plans / sizeof *plans; p++) {
		double direction[60 * 3], mass[60];
		rbf_lobes lobes[60] = {{0}};
		rbf_fitted m = {.symmetry = plans[p].symmetry, .direction = direction, .lobes = lobes};
		for (int t = 0; t < 5; t++)
			for (int a = 0; a < (t ? plans[p].phis : 1); a++)
				polar(15 * t, plans[p].step * a, direction + 3 * m.bases++);
		const double u = p ? 0 : .1, v = p ? 0 : .05, w = p ? 0 : .15; /* what mirror images do not have */
		for (uint32_t b = 0; b < m.bases; b++) {
			const double x = direction[3*b], y = direction[3*b + 1];
			lobes[b].count = 1;
			lobes[b].mass = &mass[b];
			mass[b] = pow(1 + u*x + v*y + .4*x*x + w*x*y - .2*y*y, 4);
		}
		float *root = rbf_levels_sent(&m);
		assert_non_null(root);
		for (uint32_t b = 0; b < m.bases; b++) {
			const double *d = direction + 3*b, x = d[0], y = d[1], gradient[3] = {u + .8*x + w*y, v + w*x - .4*y, 0};
			const double across = gradient[0]*x + gradient[1]*y; /* what is not tangential */
			rbf_level level;
			rbf_level_of(&m, root, NULL, b, &level);
			assert_float_equal((double)level.root, pow(mass[b], .25), 1e-6);
			if (d[2] > .6) /* at the edge of the data less is known */
				for (int n = 0; n < 3; n++)
					assert_float_equal((double)level.slope[n], gradient[n] - across * d[n], .05);
		}
		free(root);
	}
}

/* Slats that run up and down instead of across. */
static void upright(const double in[3], const double out[3], double xyz[3])
{
	const double i[3] = {in[1], in[0], in[2]}, o[3] = {out[1], out[0], out[2]};
	material_find("slats")->f(i, o, xyz);
}

static int upright_beams(const double in[3], double beam[][3])
{
	const double i[3] = {in[1], in[0], in[2]};
	const int count = material_find("slats")->beams(i, beam);
	for (int b = 0; b < count; b++) {
		const double x = beam[b][0];
		beam[b][0] = beam[b][1];
		beam[b][1] = x;
	}
	return count;
}

/* What is cut off along a line of incidences is not blended across it, however the sample was mounted: the mesh follows the data, not the axes. */
static void the_mesh_follows_the_data(void **state)
{
	(void)state;
	static const plan across = {"slats", 7, 10, {0, 12, 24, 36, 48, 60, 72}, -90, 20, 64}, up = {"slats", 7, 10, {0, 12, 24, 36, 48, 60, 72}, 0, 20, 64};
	const struct material *slats = material_find("slats");
	bsdfrbf_model *one = fixture_build_of(&across, slats->f, slats->beams, 1, 1), *other = fixture_build_of(&up, upright, upright_beams, 1, 1);
	uint64_t seed = 3;
	double error[2] = {0, 0}, total = 0;
	for (int q = 0; q < 60; q++) {
		const double theta = acos(1 - random_unit(&seed) * (1 - cos(70 * DEGREE))) / DEGREE, phi = 360 * random_unit(&seed);
		double in[3], truth[3];
		polar(theta, phi, in);
		for (int k = 0; k < 2000; k++) {
			const double r = sqrt((k + .5) / 2000), turn = 2 * RBF_PI * .6180339887 * k;
			const double out[3] = {r * cos(turn), r * sin(turn), -sqrt(1 - r*r)};
			const float i[3] = {(float)in[0], (float)in[1], (float)in[2]}, o[3] = {(float)out[0], (float)out[1], (float)out[2]};
			const float i2[3] = {i[1], i[0], i[2]}, o2[3] = {o[1], o[0], o[2]};
			float value[3];
			slats->f(in, out, truth);
			bsdfrbf_eval(one, i, o, value);
			error[0] += fabs((double)value[0] - truth[0]);
			bsdfrbf_eval(other, i2, o2, value);
			error[1] += fabs((double)value[0] - truth[0]);
			total += truth[0];
		}
	}
	print_message("L1 of slats across %.4f, upright %.4f\n", error[0] / total, error[1] / total);
	assert_true(fmax(error[0], error[1]) < 1.12 * fmin(error[0], error[1]));
	bsdfrbf_close(one);
	bsdfrbf_close(other);
}

/* A weave: threads askew, which the light of the other threads shadows, sheen along them. */
static void weave(const double in[3], const double out[3], double xyz[3])
{
	const double axis[2][3] = {{cos(.47) * cos(.24), sin(.47) * cos(.24), sin(.24)}, {-sin(.47), cos(.47), 0}}, width[2] = {.1, .2}, much[2] = {.2, .08};
	const double z = fmax(out[2], 1e-3), lit = 4 * in[2] * z / pow(in[2] + z, 2);
	double f = .1 / RBF_PI;
	for (int n = 0; n < 2; n++) {
		double along = 0;
		for (int k = 0; k < 3; k++)
			along += axis[n][k] * (in[k] + out[k]);
		f += lit * much[n] * exp(-.5 * pow(along / width[n], 2)) / (RBF_PI * width[n] * sqrt(2 * RBF_PI));
	}
	xyz[0] = xyz[1] = xyz[2] = f;
}

/* A frame may be learned that stands for levels that change: one of the list, with levels evened, tells more. */
static void levels_are_not_learned(void **state)
{
	(void)state;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	for (int n = -1; n < 70; n++) {
		double in[3];
		polar(n < 0 ? 0 : acos(1 - .724 * (n + .5) / 70) / DEGREE, fmod(n * 137.50776, 360), in);
		fixture_measure(context, data, weave, NULL, 0, 1, in);
	}
	bsdfrbf_model *m = fixture_build_data(context, data, 120, 0);
	bsdfrbf_data_free(data);
	if (!(error_between(m, weave, 30, 4, (const double[4]){10, 30, 50, 65}) < .023))
		fail_msg("wrong between the measured incidences: %s", fixture_maps(m->component));
	bsdfrbf_close(m);
	bsdfrbf_context_free(context);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(levels_are_not_learned),
		cmocka_unit_test(a_beam_is_learned),
		cmocka_unit_test(few_tell_frames),
		cmocka_unit_test(beams_are_learned_together),
		cmocka_unit_test(halves_are_alike),
		cmocka_unit_test(colours_have_frames),
		cmocka_unit_test(levels_are_evened),
		cmocka_unit_test(the_other_plane),
		cmocka_unit_test(shares_are_limited),
		cmocka_unit_test(light_is_tuned),
		cmocka_unit_test(slopes_are_met),
		cmocka_unit_test(fringes_are_followed),
		cmocka_unit_test(a_chain_is_splined),
		cmocka_unit_test(triangles_are_smoothed),
		cmocka_unit_test(the_mesh_follows_the_data),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
