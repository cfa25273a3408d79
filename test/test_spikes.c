/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples far above all around them are left out, unless other incidences show the same. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "spoilt.h"
#include "measure.h"
#include "model_fixture.h"
#include "spikes.h"

enum { INCIDENCES = 16, SAMPLES = 1600 };

/* Where the beam of an incidence goes: mirrored, or turned aside from there. */
static double beam(const double out[3], int incidence, double aside, double kappa)
{
	double to[3];
	polar(5 * incidence + aside, 180, to);
	return exp(kappa * (out[0]*to[0] + out[1]*to[1] + out[2]*to[2] - 1));
}

static double soft(const double out[3], int incidence)
{
	return .1 + 2 * beam(out, incidence, 0, 40);
}

static double narrow(const double out[3], int incidence)
{
	return .1 + 300 * beam(out, incidence, 0, 2000);
}

/* A deflected beam, as of a prism, that rarely meets a sample. */
static double deflected(const double out[3], int incidence)
{
	return .1 + 60 * beam(out, incidence, 8, 900);
}

static double line(const double out[3], int incidence)
{
	return fabs(out[1] - .3 - .02 * incidence) < .012 ? 4 : .1;
}

static double normal(uint64_t *seed)
{
	return sqrt(-2 * log(1 - random_unit(seed))) * cos(2 * RBF_PI * random_unit(seed));
}

/* How a measurement goes: the share of spikes, by what they are multiplied; samples on rings 5 degrees apart instead of anywhere; counts per unit of light. */
typedef struct faults { double spikes, times; int rings; double counts; } faults;

static bsdfrbf_data *measure(double (*f)(const double out[3], int incidence), faults how, uint8_t spike[INCIDENCES][SAMPLES])
{
	static double out[SAMPLES][3], value[SAMPLES];
	bsdfrbf_data *data = bsdfrbf_data_new(NULL);
	uint64_t seed = 4;
	assert_non_null(data);
	for (int b = 0; b < INCIDENCES; b++) {
		const int count = how.rings ? 17 * 72 : SAMPLES;
		double in[3];
		for (int i = 0; i < count; i++) {
			polar(how.rings ? 5 * (i / 72) : acos(1 - .98 * random_unit(&seed)) / DEGREE, how.rings ? 5 * (i % 72) : 360 * random_unit(&seed), out[i]);
			value[i] = f(out[i], b) * (1 + .02 * normal(&seed));
			if (how.counts > 0) {
				int n = 0; /* Poisson's, of this mean */
				for (double left = value[i] * how.counts + log(1 - random_unit(&seed)); left > 0; left += log(1 - random_unit(&seed)))
					n++;
				value[i] = n / how.counts;
			}
			spike[b][i] = random_unit(&seed) < how.spikes;
			value[i] *= spike[b][i] ? how.times : 1;
		}
		polar(5 * b, 0, in);
		assert_int_equal(bsdfrbf_data_add(NULL, data, in, (size_t)count, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	}
	return data;
}

/* How many spikes there are; of them and of others, how many are left out. */
static void leave_out(double (*f)(const double out[3], int incidence), faults how, int *spikes, int *left_out, int *wrong)
{
	static uint8_t is_spike[INCIDENCES][SAMPLES];
	rbf_measured rest;
	rbf_faults found;
	bsdfrbf_data *data = measure(f, how, is_spike);
	const rbf_measured *all = &data->component[BSDFRBF_RF];
	*spikes = *left_out = *wrong = 0;
	assert_int_equal(rbf_spikes_leave_out(all, 1, &rest, &found), 0);
	for (size_t b = 0; b < INCIDENCES; b++) {
		const rbf_incidence *had = &all->incidence[b], *has = &rest.incidence[b];
		size_t at = 0;
		for (size_t i = 0; i < had->count; i++) {
			const int kept = at < has->count && !memcmp(had->outgoing + 3*i, has->outgoing + 3*at, 3 * sizeof *had->outgoing)
				&& !memcmp(had->dsf + i, has->dsf + at, sizeof *had->dsf);
			*spikes += is_spike[b][i];
			*left_out += !kept && is_spike[b][i];
			*wrong += !kept && !is_spike[b][i];
			at += (size_t)kept;
		}
		assert_int_equal(at, has->count);
	}
	assert_int_equal(found.samples, *left_out + *wrong);
	rbf_faults_release(all, &rest);
	assert_null(rest.incidence);
	bsdfrbf_data_free(data);
}

static void spikes_go(void **state)
{
	(void)state;
	static const faults how[] = {{.spikes = .001, .times = 20}, {.spikes = .01, .times = 12}, {.spikes = .03, .times = 20}, {.spikes = .05, .times = 100},
		{.spikes = .02, .times = 10, .rings = 1}, {.spikes = .01, .times = 20, .counts = 3000}};
	for (size_t n = 0; n < sizeof how / sizeof *how; n++) {
		int spikes, left_out, wrong;
		leave_out(soft, how[n], &spikes, &left_out, &wrong);
		if (!(left_out > .9 * spikes) || wrong)
			fail_msg("case %zu: %d of %d left out, and %d others", n, left_out, spikes, wrong);
	}
}

/* A peak that a sample or two of each incidence see, a line, and single photons are none. */
static void peaks_stay(void **state)
{
	(void)state;
	static double (*const f[])(const double *, int) = {soft, narrow, deflected, line};
	static const faults how[] = {{0}, {.rings = 1}, {.counts = .5}, {.counts = 5}, {.counts = 100, .rings = 1}};
	for (size_t k = 0; k < sizeof f / sizeof *f; k++)
		for (size_t n = 0; n < sizeof how / sizeof *how; n++) {
			int spikes, left_out, wrong;
			leave_out(f[k], how[n], &spikes, &left_out, &wrong);
			if (wrong > 2)
				fail_msg("material %zu, case %zu: %d left out", k, n, wrong);
		}
}

/* Both: narrow peaks stay among spikes. */
static void peaks_among_spikes(void **state)
{
	(void)state;
	int spikes, left_out, wrong;
	leave_out(narrow, (faults){.spikes = .02, .times = 20, .rings = 1}, &spikes, &left_out, &wrong);
	if (!(left_out > .93 * spikes) || wrong > 1)
		fail_msg("%d of %d left out, and %d others", left_out, spikes, wrong);
}

/* What more than a tenth of all samples are, is no fault. */
static void too_many(void **state)
{
	(void)state;
	int spikes, left_out, wrong;
	leave_out(soft, (faults){.spikes = .16, .times = 50}, &spikes, &left_out, &wrong);
	assert_int_equal(left_out + wrong, 0);
}

/* A build goes without them, and says so. */
static void model_without(void **state)
{
	(void)state;
	static uint8_t spike[INCIDENCES][SAMPLES];
	float dhr[2];
	for (int n = 0; n < 2; n++)
		dhr[n] = dhr_without(measure(soft, (faults){.spikes = n ? .03 : 0, .times = 30}, spike), "they count as spikes, and are left out", "spikes", n);
	if (!(fabsf(dhr[1] - dhr[0]) < .01f * dhr[0]))
		fail_msg("DHR %g, without spikes %g", (double)dhr[1], (double)dhr[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(spikes_go),
		cmocka_unit_test(peaks_stay),
		cmocka_unit_test(peaks_among_spikes),
		cmocka_unit_test(too_many),
		cmocka_unit_test(model_without),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
