/* SPDX-License-Identifier: BSD-3-Clause */
/* What noise allows of incidences at other azimuths, turned; and what repeats in a turn without being round. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "isotropy.h"

enum { MOST = 64 };
static const float SCATTER = .02f, NO = 0;

/* A material: a beam about the mirror direction, some degrees aside, that grows with the polar angle and changes with the azimuth by a share, so
 * many times in a turn; and as many beams at normal incidence, where a share is given. */
typedef struct sheet { double aside, share; int folds; } sheet;

static void fit(const sheet *s, double theta, double phi, rbf_lobes *l)
{
	double d[3];
	float centre[3];
	polar(theta, phi + 180 + s->aside, d);
	for (int n = 0; n < 3; n++)
		centre[n] = (float)d[n];
	assert_int_equal(rbf_lobes_new(l, 1 + (uint32_t)s->folds, 1), 0);
	const double times = (1 + theta / 45) * (1 + s->share * cos(s->folds * phi * DEGREE));
	rbf_lobe_set(l, 0, centre, 60);
	l->amplitude[0].a[0] = (float)times;
	l->mass[0] = 2 * RBF_PI / 60 * times;
	for (int k = 0; k < s->folds; k++) {
		polar(20, 360. * k / s->folds, d);
		for (int n = 0; n < 3; n++)
			centre[n] = (float)d[n];
		rbf_lobe_set(l, 1 + (uint32_t)k, centre, 60);
		l->amplitude[(1 + k) / RBF_LANES].a[(1 + k) % RBF_LANES] = (float)(theta > 0 ? 0 : s->share);
		l->mass[1 + k] = theta > 0 ? 0 : 2 * RBF_PI / 60 * s->share;
	}
	assert_int_equal(rbf_lobes_finish(l), 0);
}

/* spiral: so many incidences, or 0: rings at azimuths `step` apart, from normal incidence on if that is asked for. */
static rbf_isotropy ask(const sheet *s, int spiral, double step, int normal, float scatter, float enough)
{
	static double direction[3 * MOST];
	static rbf_lobes lobes[MOST];
	float error[MOST];
	rbf_fitted m = {.symmetry = RBF_ANISOTROPIC, .channels = 1, .direction = direction, .lobes = lobes};
	rbf_isotropy found;
	for (int n = 0; n < spiral; n++, m.bases++) {
		const double theta = acos(1 - .8 * (n + .5) / spiral) / DEGREE, phi = fmod(n * 137.50776, 360);
		polar(theta, phi, direction + 3*m.bases);
		fit(s, theta, phi, &lobes[m.bases]);
	}
	for (double theta = normal ? 0 : 20; theta < 75 && !spiral; theta += 20)
		for (double phi = 0; phi < (theta > 0 ? 359 : 1); phi += step, m.bases++) {
			polar(theta, phi, direction + 3*m.bases);
			fit(s, theta, phi, &lobes[m.bases]);
		}
	for (uint32_t b = 0; b < m.bases; b++)
		error[b] = scatter;
	assert_int_equal(rbf_isotropy_of(&m, .1f, error, NULL, enough, &found), 0);
	for (uint32_t b = 0; b < m.bases; b++)
		rbf_lobes_free(&lobes[b]);
	return found;
}

/* By as much as fits err, azimuths may differ, and no more; or by what is said to be enough. */
static void noise_is_allowed(void **state)
{
	(void)state;
	const sheet even = {0}, uneven = {.share = .2, .folds = 1}, little = {.share = .01, .folds = 1};
	assert_true(ask(&even, 0, 100, 0, SCATTER, NO).isotropic);
	assert_true(ask(&little, 0, 100, 0, SCATTER, NO).isotropic);
	assert_false(ask(&little, 0, 100, 0, SCATTER / 100, NO).isotropic);
	assert_true(ask(&little, 0, 100, 0, SCATTER / 100, SCATTER).isotropic);
	assert_false(ask(&uneven, 0, 100, 0, SCATTER, NO).isotropic);
}

/* Where no two polar angles are one, what changes with them does not count. */
static void polar_angles_may_differ(void **state)
{
	(void)state;
	const sheet even = {.aside = 5}, uneven = {.share = .2, .folds = 1};
	const rbf_isotropy found = ask(&even, 48, 0, 0, SCATTER, NO);
	if (!(found.isotropic && found.error < .5f * SCATTER && found.folds == 0))
		fail_msg("%d, differs by %g, %u folds", found.isotropic, (double)found.error, found.folds);
	assert_false(ask(&uneven, 48, 0, 0, SCATTER, NO).isotropic);
}

/* Measured at the azimuths where it is the same, a material that repeats is told by normal incidence, or where that was not measured, if it is not its own
 * mirror image. */
static void what_repeats_is_not_round(void **state)
{
	(void)state;
	const sheet three = {.share = .3, .folds = 3}, askew = {.aside = 10}, even = {0};
	assert_int_equal(ask(&three, 0, 120, 1, SCATTER, NO).folds, 3);
	assert_false(ask(&three, 0, 120, 1, SCATTER, NO).isotropic);
	assert_true(ask(&three, 0, 120, 0, SCATTER, NO).isotropic); /* nothing tells */
	assert_false(ask(&askew, 0, 120, 0, SCATTER, NO).isotropic);
	assert_true(ask(&askew, 0, 120, 1, SCATTER, NO).isotropic);
	assert_true(ask(&even, 0, 120, 1, SCATTER, NO).isotropic);
	assert_int_equal(ask(&even, 0, 100, 1, SCATTER, NO).folds, 0);
}

/* By what azimuths differ beyond noise; where azimuths repeat, by what normal incidence does. */
static void beyond_noise(void **state)
{
	(void)state;
	const sheet even = {0}, uneven = {.share = .2, .folds = 1}, three = {.share = .3, .folds = 3};
	const rbf_isotropy quiet = ask(&uneven, 0, 100, 0, 0, NO), noisy = ask(&uneven, 0, 100, 0, SCATTER, NO);
	assert_true(ask(&even, 0, 100, 0, SCATTER, NO).beyond <= 0);
	assert_true(quiet.error > 3 * SCATTER && fabsf(quiet.beyond - quiet.error) < 1e-6f * quiet.error);
	assert_true(fabsf(noisy.beyond * noisy.beyond - (quiet.error * quiet.error - 2 * SCATTER * SCATTER)) < 1e-5f);
	assert_true(ask(&three, 0, 120, 0, SCATTER, NO).beyond <= 0);
	assert_true(ask(&three, 0, 120, 1, SCATTER, NO).beyond > .1f);
}

static char warning[600];
static void keep_warning(void *user, const char *text)
{
	(void)user;
	if (strstr(text, "taken as isotropic"))
		snprintf(warning, sizeof warning, "%s", text);
}

/* Gloss of a width whose height changes with the azimuth by a share, at so many azimuths of 90 degrees: the symmetry that it is taken for. */
static const char *taken_as(double kappa, double share, int azimuths, char symmetry)
{
	enum { SAMPLES = 700 };
	static double out[SAMPLES][3], value[SAMPLES];
	static char letter[2];
	uint64_t seed = 3;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_build_options options;
	bsdfrbf_model *model;
	bsdfrbf_component_info info;
	*warning = 0;
	bsdfrbf_set_warning(context, keep_warning, NULL);
	for (int b = 0; b <= 5 * azimuths; b++) {
		const double theta = 14 * ((b + azimuths - 1) / azimuths), phi = b ? 90. * ((b - 1) % azimuths) / (azimuths - 1) : 0;
		double in[3], beam[3];
		polar(theta, phi, in);
		polar(theta, phi + 180, beam);
		for (int i = 0; i < SAMPLES; i++) {
			polar(acos(1 - .98 * random_unit(&seed)) / DEGREE, 360 * random_unit(&seed), out[i]);
			const double x = out[i][0] - beam[0], y = out[i][1] - beam[1], z = out[i][2] - beam[2];
			value[i] = (.1 + (1 + share * cos(2 * phi * DEGREE)) * exp(-.5 * kappa * (x*x + y*y + z*z))) * (.99 + .02 * random_unit(&seed));
		}
		assert_int_equal(bsdfrbf_data_add(context, data, in, SAMPLES, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	}
	bsdfrbf_build_defaults(&options);
	options.symmetry = symmetry;
	assert_int_equal(bsdfrbf_build(context, data, &options, &model), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_get_component_info(model, BSDFRBF_RF, &info), BSDFRBF_OK);
	letter[0] = info.symmetry;
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return letter;
}

/* What changes by less than interpolation between three azimuths errs is taken as isotropic, with a word on how to keep it; not what changes more, is
 * measured at more azimuths, or asked for. */
static void weakly_anisotropic(void **state)
{
	(void)state;
	assert_string_equal(taken_as(800, .1, 3, 0), "I");
	assert_non_null(strstr(warning, "-s Q keeps that"));
	assert_string_equal(taken_as(800, .8, 3, 0), "Q");
	assert_string_equal(taken_as(800, .1, 3, 'Q'), "Q");
	assert_string_equal(taken_as(40, .1, 5, 0), "Q");
	assert_string_equal(warning, "");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(noise_is_allowed), cmocka_unit_test(polar_angles_may_differ),
		cmocka_unit_test(what_repeats_is_not_round), cmocka_unit_test(beyond_noise), cmocka_unit_test(weakly_anisotropic)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
