/* SPDX-License-Identifier: BSD-3-Clause */
/* Thin rings and sharp edges in coarse tables, and where samples are far apart. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "between.h"
#include "held_out.h"
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

/* With 2 % of noise, in a table or by chance. */
static void measure(truth *f, int by_chance)
{
	uint64_t seed = 5;
	for (int i = 0; i < SAMPLES; i++) {
		double noise = 0;
		if (by_chance)
			polar(acos(1 - .995 * random_unit(&seed)) / DEGREE, 360 * random_unit(&seed), outgoing + 3*i);
		else
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

static void sharp_where_needed(void **state)
{
	(void)state;
	static const struct { const char *name; truth *f; int by_chance, sharp; double most; } list[] = {
		{"ring", ring, 0, 1, .25}, {"disc by chance", disc, 1, 1, .12}, {"smooth", smooth, 0, 0, .02}, {"smooth by chance", smooth, 1, 0, .02}};
	for (size_t n = 0; n < sizeof list / sizeof *list; n++) {
		float held_out;
		double energy;
		measure(list[n].f, list[n].by_chance);
		const uint32_t places = places_found(&held_out);
		const double error = error_of(list[n].f, places, &energy);
		print_message("%s: %u places%s%s, L1 %.4f, of samples held out %.4f, energy %.3f\n", list[n].name, places & RBF_FIT_PLACES,
			places & RBF_FIT_NARROW ? ", narrow" : "", places & RBF_FIT_BETWEEN ? ", between" : "", error, (double)held_out, energy);
		assert_int_equal(places > RBF_FIT_PLACES, list[n].sharp);
		assert_true(error < list[n].most);
		assert_true(fabs(energy - 1) < list[n].most / 2);
	}
}

/* Narrow lobes make an edge sharper, and so does what lies between samples. */
static void sharper(void **state)
{
	(void)state;
	for (int by_chance = 0; by_chance < 2; by_chance++) {
		double energy[3];
		measure(disc, by_chance);
		const double wide = error_of(disc, 300, &energy[0]), narrow = error_of(disc, 300 | RBF_FIT_NARROW, &energy[1]),
			between = error_of(disc, 300 | RBF_FIT_BETWEEN, &energy[2]);
		print_message("disc%s: L1 %.4f, with narrow ones %.4f, between samples %.4f; energy %.3f, %.3f, %.3f\n", by_chance ? " by chance" : "", wide,
			narrow, between, energy[0], energy[1], energy[2]);
		assert_true(by_chance || narrow < .75 * wide);
		assert_true(between < (by_chance ? .6 : .75) * wide);
		assert_true(fabs(energy[2] - 1) < .025 && fabs(energy[2] - 1) < fabs(energy[0] - 1) + .01);
	}
}

/* A middle for each side and diagonal of a grid; on the sphere, each sample has one with its nearest, none is far off, and they hold the means. */
static void between_samples(void **state)
{
	(void)state;
	enum { SIDE = 9, COUNT = 500 };
	size_t count = SIDE * SIDE;
	float (*w)[3] = malloc(count * sizeof *w), *value[3] = {malloc(count * sizeof(float)), NULL, NULL};
	assert_non_null(w);
	assert_non_null(value[0]);
	for (size_t i = 0; i < count; i++) {
		double d[3];
		polar(40 + (double)(i / SIDE), 1.5 * (double)(i % SIDE), d);
		for (int a = 0; a < 3; a++)
			w[i][a] = (float)d[a];
		value[0][i] = w[i][0];
	}
	assert_int_equal(rbf_between_add(&count, &w, 1, value), 0);
	print_message("%d samples of a grid, %zu between\n", SIDE * SIDE, count - SIDE * SIDE);
	assert_in_range(count - SIDE * SIDE, 4 * (SIDE - 1) * (SIDE - 1), 4 * SIDE * (SIDE - 1));
	for (size_t i = SIDE * SIDE; i < count; i++)
		assert_true(fabsf(value[0][i] - w[i][0]) < 2e-4f && fabsf(rbf_dot(w[i], w[i]) - 1) < 1e-6f);

	uint64_t seed = 3;
	count = COUNT;
	w = realloc(w, count * sizeof *w);
	value[0] = realloc(value[0], count * sizeof(float));
	assert_non_null(w);
	assert_non_null(value[0]);
	for (size_t i = 0; i < count; i++) {
		double d[3];
		polar(acos(random_unit(&seed)) / DEGREE, 360 * random_unit(&seed), d);
		for (int a = 0; a < 3; a++)
			w[i][a] = (float)d[a];
		value[0][i] = 1;
	}
	assert_int_equal(rbf_between_add(&count, &w, 1, value), 0);
	print_message("%d samples by chance, %zu between\n", COUNT, count - COUNT);
	assert_in_range(count - COUNT, 2 * COUNT, 3 * COUNT);
	for (size_t i = 0; i < COUNT; i++) {
		float nearest = INFINITY, middle = INFINITY;
		for (size_t j = 0; j < count; j++) {
			const float d[3] = {w[j][0] - w[i][0], w[j][1] - w[i][1], w[j][2] - w[i][2]}, distance = sqrtf(rbf_dot(d, d));
			if (j < COUNT && j != i)
				nearest = fminf(nearest, distance);
			else if (j >= COUNT)
				middle = fminf(middle, distance);
		}
		assert_true(middle < .505f * nearest);
	}
	free(w);
	free(value[0]);
}

/* Samples are held out of all rows and columns of a table alike. */
static void held_out_everywhere(void **state)
{
	(void)state;
	static const size_t columns[] = {8, 12, 16, 24, 36, 37, 72, 73, 90, 144, 181, 360};
	for (uint32_t hold = 2; hold <= 8; hold += 6)
		for (size_t c = 0; c < sizeof columns / sizeof *columns; c++) {
			const size_t rows = 64;
			size_t all = 0, every = 0;
			for (size_t x = 0; x < columns[c]; x++) {
				size_t held = 0;
				for (size_t y = 0; y < rows; y++) {
					held += (size_t)rbf_held_out(RBF_HOLD_BY_CHANCE(hold, c % 4), y * columns[c] + x);
					every += (size_t)rbf_held_out(hold, y * columns[c] + x);
				}
				assert_in_range(held, 1, 3 * rows / hold);
				all += held;
			}
			assert_int_equal(all, rows * columns[c] / hold);
			assert_int_equal(every, rows * columns[c] / hold);
		}
	assert_false(rbf_held_out(0, 0) || rbf_held_out(1, 0));
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(sharp_where_needed), cmocka_unit_test(sharper), cmocka_unit_test(between_samples),
		cmocka_unit_test(held_out_everywhere)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
