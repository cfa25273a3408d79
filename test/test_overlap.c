/* SPDX-License-Identifier: BSD-3-Clause */
/* The same incidence measured twice, with other values: told. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "bsdfrbf.h"
#include "plans.h"

static char told[800];

static void keep(void *user, const char *text)
{
	(void)user;
	snprintf(told + strlen(told), sizeof told - strlen(told), "%s\n", text);
}

/* A peak of 2 degrees towards the mirror direction, over matt; times a factor, with noise. */
static void measure(bsdfrbf_context *context, bsdfrbf_data *data, const plan *p, double theta, double factor, double noise)
{
	static double value[MAX_PLAN];
	double in[3];
	uint64_t seed = 9;
	polar(theta, 30, in);
	for (size_t i = 0; i < p->count; i++) {
		const double *o = p->d[i], x = o[0] + in[0], y = o[1] + in[1], z = o[2] - in[2];
		seed = seed * 6364136223846793005u + 1442695040888963407u;
		value[i] = factor * (.1 + 20 * exp(-.5 * (x*x + y*y + z*z) / (.035 * .035))) * (1 + noise * ((double)(seed >> 33) / 1073741824. - 1));
	}
	assert_int_equal(bsdfrbf_data_add(context, data, in, p->count, p->d[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
}

/* Samples on a grid, or, if `fine`, on another one about the peak. */
static void twice(double theta, double factor, double noise, int fine)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	told[0] = 0;
	bsdfrbf_set_warning(context, keep, NULL);
	measure(context, data, rings(1, 2, 86, 2, 0, 356, 4), 40, 1, noise);
	measure(context, data, fine ? rings(0, 36.3, 43.7, .4, 205.2, 214.8, .6) : rings(1, 2, 86, 2, 0, 356, 4), theta, factor, noise / 2);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

static void other_values_are_told(void **state)
{
	(void)state;
	twice(40, 1.25, .06, 0);
	assert_non_null(strstr(told, "theta 40.0 phi 30.0 is measured twice"));
	assert_true(strstr(told, "1.25 times") || strstr(told, "1.24 times") || strstr(told, "1.26 times"));
	twice(40, .8, .06, 0);
	assert_non_null(strstr(told, "measured twice"));
}

static void others_are_not(void **state)
{
	(void)state;
	twice(40, 1, .06, 0);
	assert_string_equal(told, "");
	twice(40, 1.02, .01, 0);
	assert_string_equal(told, "");
	twice(41, 1.25, .06, 0);
	assert_string_equal(told, "");
	twice(40, 1, .06, 1);
	assert_string_equal(told, "");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(other_values_are_told), cmocka_unit_test(others_are_not)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
