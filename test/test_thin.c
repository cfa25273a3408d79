/* SPDX-License-Identifier: BSD-3-Clause */
/* Thin rings and sharp edges in coarse tables. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "lobe_count.h"
#include "model_fixture.h"

enum { THETAS = 34, PHIS = 72, SAMPLES = 1 + THETAS * PHIS, INCIDENCES = 3 }; /* 2.5 degrees by 5 */
static double outgoing[3 * SAMPLES];
static float dsf[SAMPLES];
static rbf_incidence incidence[INCIDENCES];
static const float none[3] = {0, 0, 0};
typedef double truth(const double o[3]);

static double from_middle(const double o[3]) { return hypot(o[0] - .26, o[1] - .05); }
static double ring(const double o[3]) { const double d = (from_middle(o) - .34) / .02; return exp(-.5 * d*d) + .003 * o[2]; }
static double disc(const double o[3]) { return .5 * erfc((from_middle(o) - .34) / .017) + .01 * o[2]; }
static double smooth(const double o[3]) { const double d = from_middle(o) / .2; return exp(-.5 * d*d) + .1 * o[2]; }

/* With 2 % of noise. */
static void measure(truth *f)
{
	uint64_t seed = 5;
	for (int i = 0; i < SAMPLES; i++) {
		double noise = 0;
		polar(i ? 2.5 * (1 + (i - 1) / PHIS) : 0, i ? 5. * ((i - 1) % PHIS) : 0, outgoing + 3*i);
		for (int k = 0; k < 12; k++)
			noise += random_unit(&seed) - .5;
		dsf[i] = (float)(f(outgoing + 3*i) * (1 + .02 * noise));
	}
	for (int b = 0; b < INCIDENCES; b++) {
		incidence[b] = (rbf_incidence){.count = SAMPLES, .outgoing = outgoing, .dsf = dsf};
		polar(20 * b, 0, incidence[b].direction);
	}
}

/* Against the truth; *energy: over the true one. */
static double error_of(truth *f, uint32_t places, double *energy)
{
	double difference = 0, total = 0, sum = 0;
	rbf_lobes fitted;
	assert_int_equal(rbf_fit(&incidence[0], 1, none, places, 0, &fitted, NULL), 0);
	for (int i = 0; i < 40000; i++) {
		double o[3];
		polar(acos(1 - .9 * (i + .25) / 40000) / DEGREE, 271.9557 * i, o);
		const float w[3] = {(float)o[0], (float)o[1], (float)o[2]};
		float value[3];
		rbf_lobes_sum(&fitted, w, value);
		difference += fabs((double)value[0] - f(o));
		sum += (double)value[0];
		total += f(o);
	}
	rbf_lobes_free(&fitted);
	*energy = sum / total;
	return difference / total;
}

static uint32_t places_found(float *held_out)
{
	const rbf_measured measured = {.count = INCIDENCES, .incidence = incidence};
	double direction[3 * INCIDENCES];
	uint32_t places[INCIDENCES];
	float error[RBF_TRIALS_MOST];
	rbf_trials trials;
	for (int b = 0; b < INCIDENCES; b++)
		memcpy(direction + 3*b, incidence[b].direction, sizeof incidence[b].direction);
	assert_int_equal(rbf_trials_make(&trials, INCIDENCES, direction), 0);
	assert_int_equal(rbf_lobe_count(NULL, &measured, &trials, 1, none, places, error), 0);
	rbf_trials_free(&trials);
	*held_out = error[0];
	return places[0];
}

static void narrow_where_needed(void **state)
{
	(void)state;
	static const struct { const char *name; truth *f; int narrow; double most; } list[] = {{"ring", ring, 1, .25}, {"smooth", smooth, 0, .02}};
	for (size_t n = 0; n < sizeof list / sizeof *list; n++) {
		float held_out;
		double energy;
		measure(list[n].f);
		const uint32_t places = places_found(&held_out);
		const double error = error_of(list[n].f, places, &energy);
		print_message("%s: %u places%s, L1 %.4f, of samples held out %.4f, energy %.3f\n", list[n].name, places & ~RBF_FIT_NARROW,
			places & RBF_FIT_NARROW ? ", narrow" : "", error, (double)held_out, energy);
		assert_int_equal((places & RBF_FIT_NARROW) != 0, list[n].narrow);
		assert_true(error < list[n].most);
		assert_true(fabs(energy - 1) < list[n].most / 2);
	}
}

/* Narrow lobes make an edge sharper. */
static void sharper(void **state)
{
	(void)state;
	double energy[2];
	measure(disc);
	const double wide = error_of(disc, 300, &energy[0]), narrow = error_of(disc, 300 | RBF_FIT_NARROW, &energy[1]);
	print_message("disc: L1 %.4f, with narrow ones %.4f; energy %.3f, %.3f\n", wide, narrow, energy[0], energy[1]);
	assert_true(narrow < .75 * wide);
	assert_true(fabs(energy[1] - 1) < .02);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(narrow_where_needed), cmocka_unit_test(sharper)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
