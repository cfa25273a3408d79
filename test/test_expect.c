/* SPDX-License-Identifier: BSD-3-Clause */
/* What is said of errors: of fits, of light that changes unevenly between incidences, and of peaks that are narrower than samples are apart. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "bsdfrbf.h"
#include "fit_error.h"
#include "noise.h"
#include "plans.h"
#include "uneven.h"

#include <math.h>
#include <stdio.h>

enum { INCIDENCES = 8, SAMPLES = 1500 };
static char warnings[4096];

static void keep_warning(void *user, const char *text)
{
	(void)user;
	snprintf(warnings + strlen(warnings), sizeof warnings - strlen(warnings), "%s\n", text);
}

static double uniform(uint64_t *seed)
{
	*seed = *seed * 6364136223846793005u + 1442695040888963407u;
	return (double)(*seed >> 33) / 2147483648. - .5;
}

/* Most of what light of the incidences in scratch leaves unknown, at all elements, and in *last: at the last. */
static float unknown_in(rbf_symmetry symmetry, const float light[], float *last)
{
	float unknown[64], most = 0;
	rbf_mesh mesh;
	assert_int_equal(rbf_mesh_build(NULL, symmetry, scratch.count, scratch.d[0], NULL, &mesh), BSDFRBF_OK);
	assert_true(mesh.elements && mesh.elements <= 64);
	rbf_uneven(&mesh, light, unknown);
	for (uint32_t e = 0; e < mesh.elements; e++)
		most = fmaxf(most, unknown[e]);
	*last = unknown[mesh.elements - 1];
	rbf_mesh_free(&mesh);
	return most;
}

static float unknown_of(int count, const double theta[], const float light[], float *last)
{
	scratch.count = 0;
	for (int i = 0; i < count; i++)
		add(&scratch, theta[i], 0);
	return unknown_in(RBF_ISOTROPIC, light, last);
}

static void uneven_light_is_unknown(void **state)
{
	(void)state;
	static const double theta[2][6] = {{0, 15, 30, 45, 60, 75}, {10, 25, 38, 50, 63, 76}}, few[5] = {0, 20, 40, 60, 75};
	static const float ends[5] = {.31f, .2485f, .166f, .05f, .0195f}; /* holes of a sheet that is as thick as they are wide */
	float last, smooth[6];
	for (int n = 0; n < 2; n++) {
		for (int i = 0; i < 6; i++)
			smooth[i] = (float)(.1 + .4 * cos(theta[n][i] * DEGREE));
		assert_true(unknown_of(6, theta[n], smooth, &last) < .004f);
		for (int i = 0; i < 6; i++) /* rises ever more steeply */
			smooth[i] = (float)(.04 + .96 * pow(1 - cos(theta[n][i] * DEGREE), 3));
		assert_true(unknown_of(6, theta[n], smooth, &last) < .2f);
		smooth[3] *= 1.3f;
		assert_true(unknown_of(6, theta[n], smooth, &last) > .1f);
	}
	const float most = unknown_of(5, few, ends, &last);
	assert_true(most > .1f && most < .2f && last > .1f && last < .2f);
	assert_true(unknown_of(3, few, ends, &last) <= 0);
	static const double twice[7] = {0, 20, 40, 40.4, 60, 75, 75.3}; /* with noise, which tells nothing */
	static const float noisy[7] = {.5f, .49f, .47f, .475f, .43f, .38f, .383f};
	assert_true(unknown_of(7, twice, noisy, &last) < .02f);
	static const float dark[5] = {0, 0, 0, 1, 0};
	assert_true(unknown_of(5, few, dark, &last) <= 1);
	float any[9];
	for (int i = 0; i < 9; i++)
		any[i] = i % 2 ? .1f : .4f;
	rings(1, 40, 40, 1, 0, 315, 45);
	assert_true(unknown_in(RBF_ANISOTROPIC, any, &last) <= 0);
}

/* Noise of 5 % of the light is told as that, and what a fit misses of every third of the brighter ones is none. */
static void noise_is_told(void **state)
{
	(void)state;
	static rbf_noisy list[1000];
	for (int missed = 0; missed < 2; missed++) {
		uint64_t seed = 5;
		double sum = 0, light = 0;
		for (int i = 0; i < 1000; i++) {
			double normal = 0;
			for (int k = 0; k < 12; k++)
				normal += uniform(&seed);
			const double l = pow(10, -3. * i / 1000), noise = .05 * fabs(normal) * l;
			list[i] = (rbf_noisy){l, l, 1, missed && i < 500 && i % 3 == 0 ? l : noise};
			sum += noise;
			light += l;
		}
		const double told = rbf_noise_of(1000, list);
		assert_true(told > .8 * sum / light && told < 1.25 * sum / light);
	}
}

/* Directions all over the hemisphere, and the mirror direction; what a beam towards that, of such a width in rad, sends into each. */
static void scan(const double mirror[3], double sigma, double out[SAMPLES + 1][3], double beam[SAMPLES + 1])
{
	for (int i = 0; i <= SAMPLES; i++) {
		if (i < SAMPLES)
			polar(acos(1 - (i + .5) / SAMPLES) / DEGREE, 137.508 * i, out[i]);
		else
			memcpy(out[i], mirror, sizeof out[i]);
		const double x = out[i][0] - mirror[0], y = out[i][1] - mirror[1], z = out[i][2] - mirror[2];
		beam[i] = exp(-.5 * (x*x + y*y + z*z) / (sigma * sigma)) / (2 * RBF_PI * sigma * sigma);
	}
}

/* A beam of such a width, degrees, besides haze, with noise; what a fit to it misses. */
static void fit_errors(double width, double noise, float *by_noise, float *missed)
{
	static double out[SAMPLES + 1][3], beam[SAMPLES + 1];
	static float dsf[SAMPLES + 1];
	const float none[3] = {0, 0, 0};
	const double direction[3] = {0, 0, 1};
	uint64_t seed = 7;
	double mirror[3];
	polar(20, 180, mirror);
	scan(mirror, width * DEGREE, out, beam);
	for (int i = 0; i <= SAMPLES; i++)
		dsf[i] = (float)((.1 * out[i][2] / RBF_PI + .5 * beam[i]) * (1 + noise * sqrt(12) * uniform(&seed)));
	rbf_incidence in = {.direction = {0, 0, 1}, .count = SAMPLES + 1, .outgoing = out[0], .dsf = dsf};
	const rbf_measured measured = {.count = 1, .incidence = &in};
	rbf_lobes all, held;
	rbf_fitted fitted = {.bases = 1, .channels = 1, .direction = direction, .lobes = &all};
	rbf_trials trials;
	const uint32_t count = 150;
	float error;
	assert_int_equal(rbf_trials_make(&trials, 1, direction), 0);
	assert_int_equal(rbf_fit(&in, 1, none, count, 0, &all, NULL), 0);
	assert_int_equal(rbf_fit(&in, 1, none, count, 8, &held, &error), 0);
	assert_int_equal(rbf_fit_error(&measured, &trials, &fitted, none, &count, &error, by_noise, missed), 0);
	rbf_lobes_free(&all);
	rbf_lobes_free(&held);
	rbf_trials_free(&trials);
}

static void what_fits_miss(void **state)
{
	(void)state;
	float by_noise, missed;
	for (int n = 0; n < 3; n++) { /* noise is no miss */
		static const double noise[3] = {.01, .05, .2};
		fit_errors(12, noise[n], &by_noise, &missed);
		assert_true((double)by_noise > .1 * noise[n] && (double)by_noise < noise[n]);
		assert_true((double)missed < noise[n]);
	}
	fit_errors(.6, .02, &by_noise, &missed); /* samples are four degrees apart */
	assert_true(missed > .2f && missed <= 1);
}

/* Incidences 10 degrees apart: a share of the light, by polar angle, is a mirror's beam of such a width, the rest diffuse. Returns the expected error. */
static float build(const float *light, double share, double width)
{
	static double out[SAMPLES + 1][3], beam[SAMPLES + 1], value[SAMPLES + 1];
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_model *made = NULL;
	bsdfrbf_component_info info;
	uint64_t seed = 3;
	for (int t = 0; t < INCIDENCES; t++) {
		double in[3], mirror[3];
		polar(10 * t, 0, in);
		polar(10 * t, 180, mirror);
		scan(mirror, width * DEGREE, out, beam);
		for (int i = 0; i <= SAMPLES; i++)
			value[i] = (double)light[t] * ((1 - share) * out[i][2] / RBF_PI + share * beam[i]) * (1 + .03 * uniform(&seed));
		assert_int_equal(bsdfrbf_data_add(context, data, in, SAMPLES + 1, out[0], value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	}
	warnings[0] = 0;
	bsdfrbf_set_warning(context, keep_warning, NULL);
	assert_int_equal(bsdfrbf_build(context, data, NULL, &made), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_get_component_info(made, BSDFRBF_RF, &info), BSDFRBF_OK);
	bsdfrbf_close(made);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return info.expected_error;
}

static void what_is_told(void **state)
{
	(void)state;
	static const float even[INCIDENCES] = {.5f, .5f, .5f, .5f, .5f, .5f, .5f, .5f}, uneven[INCIDENCES] = {.6f, .6f, .6f, .6f, .6f, .3f, .3f, .3f};
	assert_true(build(even, .5, 12) < .03f);
	if (*warnings)
		fail_msg("%s", warnings);
	assert_true(build(uneven, .5, 12) > .05f);
	if (!strstr(warnings, "light changes unevenly: DHR is 0.6") || !strstr(warnings, "at theta 40.0") || strstr(warnings, "single sample"))
		fail_msg("%s", warnings);
	assert_true(build(even, .8, .5) > .5f);
	if (!strstr(warnings, "most light stands on a single sample") || strstr(warnings, "check its scale"))
		fail_msg("%s", warnings);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(uneven_light_is_unknown),
		cmocka_unit_test(noise_is_told),
		cmocka_unit_test(what_fits_miss),
		cmocka_unit_test(what_is_told),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
