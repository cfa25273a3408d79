/* SPDX-License-Identifier: BSD-3-Clause */
/* Gains of scans, from what pairs of them differ by, and from DHR that is not smooth. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "bsdfrbf.h"
#include "gains.h"
#include "plans.h"
#include "unsteady.h"

#include <math.h>

enum { SCANS = 20 };
static rbf_pair pair[SCANS * SCANS];
static double told[SCANS];

static double uniform(uint64_t *seed)
{
	*seed = *seed * 6364136223846793005u + 1442695040888963407u;
	return (double)(*seed >> 33) / 2147483648. - .5;
}

/* All pairs, of scans of the same half only if `halves`. noise: of a pair, peak to peak. */
static int ask(const double gain[SCANS], double noise, int halves)
{
	float light[SCANS], least[SCANS];
	uint32_t pairs = 0;
	uint64_t seed = 5;
	for (uint32_t a = 0; a < SCANS; a++) {
		light[a] = 1 + (float)a / SCANS;
		least[a] = .03f;
		told[a] = 9;
		for (uint32_t b = a + 1; b < SCANS; b++)
			if (!halves || (a < SCANS / 2) == (b < SCANS / 2))
				pair[pairs++] = (rbf_pair){a, b, gain[a] - gain[b] + noise * uniform(&seed), 1};
	}
	return rbf_gains_solve(SCANS, light, least, pairs, pair, told);
}

static void near(const double expected[SCANS], double shift, double within)
{
	for (int k = 0; k < SCANS; k++)
		if (fabs(told[k] - (expected[k] - shift)) > within)
			fail_msg("scan %d: told %.4f, is %.4f", k, told[k], expected[k] - shift);
}

static void one_stands_out(void **state)
{
	(void)state;
	double gain[SCANS] = {0};
	gain[3] = .15;
	gain[11] = -.1;
	assert_int_equal(ask(gain, .02, 0), 2);
	near(gain, 0, .01);
}

/* Less than fits err by. */
static void small_ones_are_left(void **state)
{
	(void)state;
	double gain[SCANS] = {0};
	gain[3] = .025;
	assert_int_equal(ask(gain, .002, 0), 0);
}

/* Small ones count where many are large; all together keep their light. */
static void many_keep_their_mean(void **state)
{
	(void)state;
	double gain[SCANS], before = 0, after = 0;
	for (int k = 0; k < SCANS; k++)
		gain[k] = .3 + .08 * sin(k * 2.4);
	assert_in_range(ask(gain, .002, 0), SCANS - 3, SCANS);
	for (int k = 0; k < SCANS; k++) {
		before += 1 + k / (double)SCANS;
		after += (1 + k / (double)SCANS) * exp(-told[k]);
	}
	assert_true(fabs(after / before - 1) < .002);
	near(gain, gain[1] - told[1], .01);
	before = after = 0; /* two sessions: neither is right */
	for (int k = 0; k < SCANS; k++)
		gain[k] = k < 13 ? 0 : .15;
	assert_int_equal(ask(gain, .002, 0), SCANS);
	for (int k = 0; k < SCANS; k++) {
		before += 1 + k / (double)SCANS;
		after += (1 + k / (double)SCANS) * exp(-told[k]);
	}
	assert_true(fabs(after / before - 1) < .002);
}

/* No gains explain what pairs differ by. */
static void contradictions_tell_nothing(void **state)
{
	(void)state;
	double gain[SCANS] = {0};
	for (int k = 0; k < SCANS; k++)
		gain[k] = .05 * sin(k * 2.4);
	assert_int_equal(ask(gain, 1, 0), 0);
}

/* What no pair joins is not compared. */
static void parts_are_apart(void **state)
{
	(void)state;
	double gain[SCANS] = {0};
	for (int k = SCANS / 2; k < SCANS; k++)
		gain[k] = .4;
	gain[3] += .15;
	gain[15] += .15;
	assert_int_equal(ask(gain, .002, 1), 2);
	for (int k = 0; k < SCANS; k++)
		assert_true(fabs(told[k] - (k == 3 || k == 15 ? .15 : 0)) < .01);
	for (int k = 0; k < SCANS; k++) /* many in the second */
		gain[k] = k < SCANS / 2 ? .025 * (k == 3) : .1 * sin(k * 2.4);
	assert_in_range(ask(gain, .002, 1), SCANS / 2 - 3, SCANS / 2);
	for (int k = 0; k < SCANS / 2; k++)
		assert_true(fabs(told[k]) <= 0);
	assert_int_equal(rbf_gains_solve(0, NULL, NULL, 0, NULL, told), 0);
}

static double smooth(const double d[3])
{
	return .2 + .1 * d[2] * d[2] + .05 * d[0] * d[0] * d[1];
}

/* sigma: of the gains. */
static double found(rbf_symmetry symmetry, const plan *p, double sigma)
{
	float dhr[200];
	uint64_t seed = 3;
	assert_true(p->count <= 200);
	for (size_t k = 0; k < p->count; k++)
		dhr[k] = (float)(smooth(p->d[k]) * exp(sigma * sqrt(12.) * uniform(&seed)));
	return rbf_unsteady(symmetry, (uint32_t)p->count, p->d[0], dhr);
}

static void dhr_tells_how_unsteady(void **state)
{
	(void)state;
	static const double sigma[] = {.03, .1};
	plan *p = rings(1, 10, 70, 10, 0, 345, 15);
	assert_true(found(RBF_ANISOTROPIC, p, 0) < .002);
	for (int n = 0; n < 2; n++) {
		const double is = found(RBF_ANISOTROPIC, p, sigma[n]);
		assert_true(is > .75 * sigma[n] && is < 1.3 * sigma[n]);
	}
	p = rings(1, 15, 75, 15, 0, 90, 15);
	assert_true(found(RBF_QUADRILATERAL, p, .05) > .03 && found(RBF_QUADRILATERAL, p, .05) < .08);
	p = rings(1, 5, 75, 5, 0, 0, 15);
	assert_true(found(RBF_ISOTROPIC, p, 0) < .004);
	assert_true(found(RBF_ISOTROPIC, p, .1) > .05 && found(RBF_ISOTROPIC, p, .1) < .2);
	p = rings(1, 20, 60, 20, 0, 0, 15); /* too few */
	assert_true(found(RBF_ISOTROPIC, p, .1) <= 0);
}

static void scans_are_scaled(void **state)
{
	(void)state;
	static const double in[3] = {0, 0, 1}, out[6] = {.6, 0, .8, 0, .6, .8}, value[2] = {2, 4};
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_samples s;
	float gain;
	assert_int_equal(bsdfrbf_data_add(context, data, in, 2, out, value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_data_scale(context, data, BSDFRBF_RF, 0, .25), BSDFRBF_OK);
	bsdfrbf_data_get(data, BSDFRBF_RF, 0, &s);
	assert_true(fabsf(s.dsf[0] - .5f) < 1e-6f && fabsf(s.dsf[1] - 1) < 1e-6f);
	assert_int_equal(bsdfrbf_data_scale(context, data, BSDFRBF_RF, 1, 1), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_scale(context, data, BSDFRBF_RF, 0, 0), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_scale(context, data, BSDFRBF_RF, 0, (double)NAN), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_scale(context, NULL, BSDFRBF_RF, 0, 1), BSDFRBF_ERR_ARGUMENT);
	assert_true(bsdfrbf_data_gains(data, NULL, BSDFRBF_RF, &gain) < 0);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_stands_out), cmocka_unit_test(small_ones_are_left), cmocka_unit_test(many_keep_their_mean),
		cmocka_unit_test(contradictions_tell_nothing), cmocka_unit_test(parts_are_apart),
		cmocka_unit_test(dhr_tells_how_unsteady), cmocka_unit_test(scans_are_scaled),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
