/* SPDX-License-Identifier: BSD-3-Clause */
/* Scans that are off by a factor as a whole, found by reciprocity in fits of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "bsdfrbf.h"
#include "plans.h"

enum { SCANS = 7 };
static const double thetas[SCANS] = {0, 10, 20, 30, 40, 50, 60};

/* A blurred beam that goes on as it came, or a blurred mirror image: reciprocal. back: incident from the back. Exitance to `edge` degrees. */
static void measure(bsdfrbf_data *data, int transmits, int back, double theta, double phi, double edge, double factor)
{
	static double value[MAX_PLAN];
	double in[3];
	plan *p = rings(1, 4, edge, 4, 0, 352, 8);
	polar(theta, phi, in);
	for (size_t i = 0; i < p->count; i++) {
		const double x = p->d[i][0] + in[0], y = p->d[i][1] + in[1];
		value[i] = factor * (.1 + .5 * exp(-.5 * (x*x + y*y) / (.25 * .25)));
		p->d[i][2] *= transmits == back ? 1 : -1;
	}
	in[2] *= back ? -1 : 1;
	assert_int_equal(bsdfrbf_data_add(NULL, data, in, p->count, p->d[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
}

/* Isotropic, one scan off. Gains of a component; returns how many. */
static int gains(int transmits, int sides, int off_side, int off, double factor, double edge, bsdfrbf_component asked, float gain[SCANS])
{
	bsdfrbf_data *data = bsdfrbf_data_new(NULL);
	bsdfrbf_model *model;
	for (int back = 0; back < sides; back++)
		for (int k = 0; k < SCANS; k++)
			measure(data, transmits, back, thetas[k], 0, edge, k == off && back == off_side ? factor : 1);
	assert_int_equal(bsdfrbf_build(NULL, data, NULL, &model), BSDFRBF_OK);
	const int found = bsdfrbf_data_gains(data, model, asked, gain);
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	return found;
}

static void expect(const float gain[SCANS], int off, double factor)
{
	for (int k = 0; k < SCANS; k++)
		if (fabs((double)gain[k] - (k == off ? factor : 1)) > .03)
			fail_msg("scan %d: %.3f", k, (double)gain[k]);
}

static void reflection(void **state)
{
	(void)state;
	float gain[SCANS];
	assert_int_equal(gains(0, 1, 0, 3, 1.2, 84, BSDFRBF_RF, gain), 1);
	expect(gain, 3, 1.2);
	assert_int_equal(gains(0, 1, 0, 3, 1, 84, BSDFRBF_RF, gain), 0);
	expect(gain, 3, 1);
	assert_int_equal(gains(0, 1, 0, 3, 1.2, 84, BSDFRBF_TF, gain), 0); /* not there */
}

/* Both sides tell of each other. */
static void transmission(void **state)
{
	(void)state;
	float gain[SCANS];
	assert_int_equal(gains(1, 2, 1, 2, .8, 84, BSDFRBF_TB, gain), 1);
	expect(gain, 2, .8);
	assert_int_equal(gains(1, 2, 1, 2, .8, 84, BSDFRBF_TF, gain), 0);
	expect(gain, 2, 1);
	assert_int_equal(gains(1, 1, 0, 2, .8, 84, BSDFRBF_TF, gain), 0); /* nothing to compare with */
	expect(gain, 2, 1);
}

/* Mirror images tell as well; incidences that no other saw do not. */
static void all_round(void **state)
{
	(void)state;
	float gain[64];
	bsdfrbf_data *data = bsdfrbf_data_new(NULL);
	bsdfrbf_model *model;
	measure(data, 0, 0, 0, 0, 84, 1);
	for (int n = 0; n < 21; n++)
		measure(data, 0, 0, 20. + 20 * (n / 7), 15 * (n % 7), 84, n == 9 ? .85 : 1);
	bsdfrbf_build_options options;
	bsdfrbf_build_defaults(&options);
	options.symmetry = 'Q';
	assert_int_equal(bsdfrbf_build(NULL, data, &options, &model), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_data_gains(data, model, BSDFRBF_RF, gain), 1);
	assert_true(fabs((double)gain[10] - .85) < .03);
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
}

/* Exitant directions without samples are guesses: they tell nothing. */
static void what_was_not_measured(void **state)
{
	(void)state;
	float gain[SCANS];
	assert_int_equal(gains(0, 1, 0, 6, 1.2, 36, BSDFRBF_RF, gain), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(reflection), cmocka_unit_test(transmission), cmocka_unit_test(all_round), cmocka_unit_test(what_was_not_measured),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
