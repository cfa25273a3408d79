/* SPDX-License-Identifier: BSD-3-Clause */
/* Incidences that were measured at another scale: told, and no harm to others. Mirror images that are not quite at each other's place. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "asymmetry.h"

/* A layer of gloss over a matt base, or a beam that only normal incidence goes through, or the same light that ends towards grazing
 * incidence: what was measured at one polar angle, times a factor. */
static enum { GLOSS, COLLIMATOR, ENDING } kind;
static double odd_theta, factor;

static void sheet(const double in[3], const double out[3], double xyz[3])
{
	const double theta = acos(fmin(in[2], 1)) / DEGREE, x = in[0] + out[0], y = in[1] + out[1], d2 = x*x + y*y;
	double f = .1;
	if (kind == COLLIMATOR)
		f = .01 + 40 * (theta < 1 ? exp(-.5 * d2 / (.05 * .05)) : 0);
	else if (kind == ENDING)
		f = .3 * (theta < 65 ? 1 : .01) + .3 * exp(-.5 * d2 / (.3 * .3)) * (theta < 65 ? 1 : .01);
	else {
		const double h[3] = {x, y, in[2] + fabs(out[2])}, c = h[2] / sqrt(h[0]*h[0] + h[1]*h[1] + h[2]*h[2]);
		f += exp((c*c - 1) / (c*c * .15 * .15)) / (4 * in[2] * fmax(fabs(out[2]), .02));
	}
	xyz[0] = xyz[1] = xyz[2] = f * (fabs(theta - odd_theta) < .5 ? factor : 1);
}

static char told[800];
static void keep_scale_warning(void *user, const char *text)
{
	(void)user;
	if (strstr(text, "times the light"))
		snprintf(told + strlen(told), sizeof told - strlen(told), "%s\n", text);
}

static bsdfrbf_model *build(const plan *p)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = fixture_data(context, sheet, NULL, 0, 1, p);
	bsdfrbf_build_options options;
	bsdfrbf_model *made = NULL;
	bsdfrbf_build_defaults(&options);
	options.lobes = p->lobes;
	told[0] = 0;
	bsdfrbf_set_warning(context, keep_scale_warning, NULL);
	assert_int_equal(bsdfrbf_build(context, data, &options, &made), BSDFRBF_OK);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return made;
}

/* L1 at one incidence. */
static double error_at(const bsdfrbf_model *m, double theta)
{
	double difference = 0, total = 0, in[3], truth[3];
	polar(theta, 0, in);
	for (int q = 0; q < 4000; q++) {
		const double r = sqrt((q + .5) / 4000), phi = 2 * RBF_PI * .6180339887 * q, out[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
		const float i[3] = {(float)in[0], (float)in[1], (float)in[2]}, o[3] = {(float)out[0], (float)out[1], (float)out[2]};
		float value[3];
		sheet(in, out, truth);
		bsdfrbf_eval(m, i, o, value);
		total += truth[0];
		difference += fabs((double)value[0] - truth[0]);
	}
	return difference / total;
}

static const plan around = {"sheet", 8, 1, {0, 10, 20, 30, 40, 50, 60, 70}, 0, 0, 100};

static void one_of_wrong_scale(void **state)
{
	(void)state;
	static const struct { double theta, factor, far; const char *text; } wrong[] = {
		{-1, 1, 45, NULL}, {0, 50, 45, "theta 0.0 phi 0.0 sends 5"}, {30, 10, 55, "theta 30.0 phi 0.0 sends 10 times the light"},
		{20, RBF_PI, 55, "theta 20.0 phi 0.0 sends 3."}, {40, .02, 15, "theta 40.0 phi 0.0 sends 0.02"}};
	double clean[2] = {0, 0};
	kind = GLOSS;
	for (size_t n = 0; n < sizeof wrong / sizeof *wrong; n++) {
		odd_theta = wrong[n].theta;
		factor = wrong[n].factor;
		bsdfrbf_model *m = build(&around);
		if (!n) {
			clean[0] = error_at(m, 15);
			clean[1] = fmax(error_at(m, 45), error_at(m, 55));
		}
		if (wrong[n].text ? !strstr(told, wrong[n].text) || strchr(told, '\n') != told + strlen(told) - 1 : *told)
			fail_msg("theta %g times %g: '%s'", odd_theta, factor, told);
		if (!(error_at(m, wrong[n].far) < 1.5 * clean[wrong[n].far > 30] + .01))
			fail_msg("theta %g times %g: %.3f at %g degrees", odd_theta, factor, error_at(m, wrong[n].far), wrong[n].far);
		bsdfrbf_close(m);
	}
}

/* What a material may do: light that only normal incidence lets through, though its shape differs then, that ends towards grazing incidence, or
 * whatever there is at the border of what was measured. */
static void no_false_alarm(void **state)
{
	(void)state;
	for (int n = 0; n < 3; n++) {
		kind = n == 0 ? COLLIMATOR : n == 1 ? ENDING : GLOSS;
		odd_theta = 70;
		factor = n == 2 ? .1 : 1;
		bsdfrbf_model *m = build(&around);
		if (*told)
			fail_msg("%d: '%s'", n, told);
		bsdfrbf_close(m);
	}
}

/* At the border it is not known what is wrong: but no incidence counts more than a beam that is missed. */
static void no_error_counts_more_than_a_beam(void **state)
{
	(void)state;
	bsdfrbf_component_info info;
	kind = GLOSS;
	odd_theta = 70;
	factor = 1000;
	bsdfrbf_model *m = build(&around);
	assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
	if (!(info.loo_error < 2. / 6 + .1)) /* one of the six between others is next to it */
		fail_msg("%.3f", (double)info.loo_error);
	bsdfrbf_close(m);
}

/* One lobe of 1.3 degrees, its mirror image seen from half a degree beside the image of its incidence: by itself, moved with the incidence, or
 * three degrees off. */
static void images_move(void **state)
{
	(void)state;
	for (int n = 0; n < 4; n++) {
		rbf_lobes lobes[2];
		double in[2][3], out[2][3];
		rbf_asymmetry found;
		polar(12, 80, in[0]);
		polar(12.4, -80, in[1]);
		polar(n == 1 ? 12 : 40, n == 1 ? 260 : 30, out[0]);
		polar(n == 1 ? 12.4 : n == 2 ? 43 : 40, n == 1 ? 100 : -30, out[1]);
		if (n == 3)
			memcpy(out, in, sizeof out);
		for (int b = 0; b < 2; b++) {
			const float centre[3] = {(float)out[b][0], (float)out[b][1], (float)out[b][2]};
			assert_int_equal(rbf_lobes_new(&lobes[b], 1, 1), 0);
			rbf_lobe_set(&lobes[b], 0, centre, 1900);
			lobes[b].amplitude[0].a[0] = 300;
			lobes[b].mass[0] = 300 * 2 * RBF_PI / 1900;
			assert_int_equal(rbf_lobes_finish(&lobes[b]), 0);
		}
		const rbf_fitted m = {.channels = 1, .bases = 2, .direction = in[0], .lobes = lobes};
		assert_int_equal(rbf_asymmetry_of(&m, RBF_BILATERAL_Y, 0, NULL, &found), 0);
		if (n == 2 ? !(found.mean > .8f) : !(found.mean >= 0 && found.mean < .03f))
			fail_msg("%d: %.3f", n, (double)found.mean);
		rbf_lobes_free(&lobes[0]);
		rbf_lobes_free(&lobes[1]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = { cmocka_unit_test(one_of_wrong_scale), cmocka_unit_test(no_false_alarm),
		cmocka_unit_test(no_error_counts_more_than_a_beam), cmocka_unit_test(images_move) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
