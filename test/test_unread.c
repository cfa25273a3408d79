/* SPDX-License-Identifier: BSD-3-Clause */
/* Zeros that are no readings are left out, all others stay: those of shadows, of noise, and of coarse numbers. */
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
#include "unread.h"

enum { INCIDENCES = 24, ARCS = 40, STEPS = 40, LOST_ROW = 8 };

/* A lobe of 12 degrees over a Lambertian floor. */
static double soft(const double out[3], int incidence)
{
	const double s = sin(.2 * incidence), c = cos(.2 * incidence), x = out[0] + s, z = out[2] - c;
	return .1 + 2 * exp(-11 * (x*x + out[1]*out[1] + z*z));
}

static double profile(const double out[3])
{
	return fabs(atan2(out[1], out[2])) / DEGREE;
}

static double cut_off(const double out[3], int incidence)
{
	return profile(out) < 38 + incidence ? .1 : 0;
}

static double blinds(const double out[3], int incidence)
{
	return fmod(profile(out) + incidence, 16) < 9 ? .1 : 0;
}

static double dark_line(const double out[3], int incidence)
{
	return fabs(out[0] - .2 - .03 * incidence) > .02 ? .1 : 0;
}

static double disc(const double out[3], int incidence)
{
	return out[2] * cos(.1 * incidence) - out[0] * sin(.1 * incidence) > cos(14 * DEGREE) ? 3 : 0;
}

static double screen(const double out[3], int incidence)
{
	const double angle = acos(fmin(out[2] * cos(.1 * incidence) - out[0] * sin(.1 * incidence), 1)) / DEGREE;
	return angle < 6 ? 30 : angle < 20 ? 0 : .1;
}

static double flat(const double out[3], int incidence)
{
	(void)out;
	(void)incidence;
	return .1;
}

static double normal(uint64_t *seed)
{
	return sqrt(-2 * log(1 - random_unit(seed))) * cos(2 * RBF_PI * random_unit(seed));
}

/* How a measurement goes. */
typedef struct faults {
	double lost;      /* share of readings that get lost */
	int rows;         /* so often LOST_ROW in a row do */
	double noise;     /* standard deviation, clipped at zero */
	double step;      /* of the numbers written */
	int grid;         /* 1: rings of 10 degrees instead of arcs */
} faults;

/* Samples, arc by arc. lost: 1 where a reading got lost. */
static bsdfrbf_data *measure(double (*f)(const double out[3], int incidence), faults how, uint8_t lost[INCIDENCES][ARCS * STEPS])
{
	static double out[ARCS * STEPS][3], value[ARCS * STEPS];
	bsdfrbf_data *data = bsdfrbf_data_new(NULL);
	uint64_t seed = 4;
	assert_non_null(data);
	for (int b = 0; b < INCIDENCES; b++) {
		const int count = how.grid ? 9 * 36 : ARCS * STEPS;
		double in[3];
		for (int i = 0; i < count; i++) {
			const double theta = how.grid ? 10 * (i / 36) + .1 : 86. * (i % STEPS) / (STEPS - 1) + .4 * (random_unit(&seed) - .5);
			polar(fabs(theta), how.grid ? 10 * (i % 36) : 360. * (i / STEPS) / ARCS + .5 * (random_unit(&seed) - .5), out[i]);
			value[i] = f(out[i], b % 6) * (1 + .02 * normal(&seed)) + how.noise * normal(&seed);
			value[i] = fmax(how.step > 0 ? how.step * round(value[i] / how.step) : value[i], 0);
			lost[b][i] = random_unit(&seed) < how.lost;
		}
		for (int r = 0; r < how.rows; r++)
			memset(lost[b] + (int)(random_unit(&seed) * (count - LOST_ROW)), 1, LOST_ROW);
		for (int i = 0; i < count; i++)
			value[i] *= !lost[b][i];
		polar(3 * b, 0, in);
		assert_int_equal(bsdfrbf_data_add(NULL, data, in, (size_t)count, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	}
	return data;
}

/* How many lost readings there are; of them and of other samples, how many are left out. What is kept is as it was. */
static void leave_out(double (*f)(const double out[3], int incidence), faults how, int *lost, int *left_out, int *wrong)
{
	static uint8_t is_lost[INCIDENCES][ARCS * STEPS];
	rbf_measured read;
	rbf_faults found;
	bsdfrbf_data *data = measure(f, how, is_lost);
	const rbf_measured *all = &data->component[BSDFRBF_RF];
	size_t incidences = 0;
	*lost = *left_out = *wrong = 0;
	assert_int_equal(rbf_unread_leave_out(all, 1, &read, &found), 0);
	for (size_t b = 0; b < INCIDENCES; b++) {
		const rbf_incidence *had = &all->incidence[b], *has = &read.incidence[b];
		size_t at = 0;
		for (size_t i = 0; i < had->count; i++) {
			const int kept = at < has->count && !memcmp(had->outgoing + 3*i, has->outgoing + 3*at, 3 * sizeof *had->outgoing)
				&& !memcmp(had->dsf + i, has->dsf + at, sizeof *had->dsf);
			*lost += is_lost[b][i];
			*left_out += !kept && is_lost[b][i];
			*wrong += !kept && !is_lost[b][i];
			at += (size_t)kept;
		}
		assert_int_equal(at, has->count);
		assert_true((has->dsf == had->dsf) == (has->count == had->count));
		incidences += has->count != had->count;
	}
	assert_int_equal(found.samples, *left_out + *wrong);
	assert_int_equal(found.incidences, incidences);
	rbf_faults_release(all, &read);
	assert_null(read.incidence);
	bsdfrbf_data_free(data);
}

static void lost_readings(void **state)
{
	(void)state;
	static const faults how[] = {{.lost = .03}, {.lost = .15}, {.rows = 5}, {.rows = 8}, {.lost = .02, .rows = 3},
		{.lost = .03, .noise = .01}, {.lost = .003}, {.lost = .05, .grid = 1}};
	for (size_t n = 0; n < sizeof how / sizeof *how; n++) {
		int lost, left_out, wrong;
		leave_out(soft, how[n], &lost, &left_out, &wrong);
		if (!(left_out > .93 * lost) || wrong)
			fail_msg("case %zu: %d of %d left out, and %d others", n, left_out, lost, wrong);
	}
}

/* Nothing is lost: whatever is zero is true, or noise. */
static void true_zeros(void **state)
{
	(void)state;
	static double (*const f[])(const double *, int) = {soft, cut_off, blinds, dark_line, disc, screen, flat};
	static const faults how[] = {{0}, {.noise = .004}, {.noise = .05}, {.step = .16}, {.step = .194}, {.grid = 1}, {.grid = 1, .noise = .004}};
	for (size_t k = 0; k < sizeof f / sizeof *f; k++)
		for (size_t n = 0; n < sizeof how / sizeof *how; n++) {
			int lost, left_out, wrong;
			leave_out(f[k], how[n], &lost, &left_out, &wrong);
			if (wrong > 2)
				fail_msg("material %zu, case %zu: %d left out", k, n, wrong);
		}
}

/* What more than a fifth of all samples are, is no fault. */
static void too_many(void **state)
{
	(void)state;
	int lost, left_out, wrong;
	leave_out(soft, (faults){.lost = .22}, &lost, &left_out, &wrong);
	assert_int_equal(left_out + wrong, 0);
}

/* Both: the shadow stays, and most of what was lost is found. */
static void lost_beside_shadows(void **state)
{
	(void)state;
	static const faults how[] = {{.lost = .03}, {.rows = 4}};
	for (int n = 0; n < 2; n++) {
		int lost, left_out, wrong;
		leave_out(cut_off, how[n], &lost, &left_out, &wrong); /* half of them are lost in the dark */
		if (!(left_out > .3 * lost) || wrong > 6)
			fail_msg("case %d: %d of %d left out, and %d others", n, left_out, lost, wrong);
	}
}

/* A build goes without them, and says so. */
static void model_without(void **state)
{
	(void)state;
	static uint8_t lost[INCIDENCES][ARCS * STEPS];
	float dhr[2];
	for (int n = 0; n < 2; n++)
		dhr[n] = dhr_without(measure(soft, (faults){.lost = n ? .1 : 0}, lost), "they count as not read, and are left out", "unread", n);
	if (!(fabsf(dhr[1] - dhr[0]) < .01f * dhr[0]))
		fail_msg("DHR %g, without losses %g", (double)dhr[1], (double)dhr[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lost_readings),
		cmocka_unit_test(true_zeros),
		cmocka_unit_test(too_many),
		cmocka_unit_test(lost_beside_shadows),
		cmocka_unit_test(model_without),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
