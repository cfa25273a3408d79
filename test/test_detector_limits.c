/* SPDX-License-Identifier: BSD-3-Clause */
/* Saturated samples and a detector's floor are told; round and flat tops, noise and coarse numbers are none. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>

#include "detector_limits.h"
#include "model_fixture.h"

enum { INCIDENCES = 4, SAMPLES = 3000 };

/* Where DSF ends, in shares of its maximum; the step of its numbers, likewise; the width of a peak; relative noise; 1: Lambertian. */
typedef struct ends { double top, floor, step, kappa, noise; int flat; } ends;

static rbf_limits measured(ends p)
{
	static double out[SAMPLES][3], value[SAMPLES];
	bsdfrbf_data *data = bsdfrbf_data_new(NULL);
	uint64_t seed = 9;
	for (int b = 0; b < INCIDENCES; b++) {
		double in[3], beam[3];
		polar(15 * b, 0, in);
		polar(15 * b, 180, beam);
		for (int i = 0; i < SAMPLES; i++) {
			polar(acos(1 - .98 * random_unit(&seed)) / DEGREE, 360 * random_unit(&seed), out[i]);
			const double x = out[i][0] - beam[0], y = out[i][1] - beam[1], z = out[i][2] - beam[2];
			double v = (p.flat ? out[i][2] : .001 + exp(-.5 * p.kappa * (x*x + y*y + z*z))) * (1 + p.noise * (2 * random_unit(&seed) - 1));
			v = p.step > 0 ? p.step * round(v / p.step) : v;
			v = fmax(fmin(v, p.top), p.floor);
			value[i] = 1e-6 * round(1e6 * v / out[i][2]); /* f, written with few digits */
		}
		assert_int_equal(bsdfrbf_data_add(NULL, data, in, SAMPLES, out[0], value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	}
	const rbf_limits found = rbf_limits_of(&data->component[BSDFRBF_RF], 1);
	bsdfrbf_data_free(data);
	return found;
}

static void saturated(void **state)
{
	(void)state;
	const rbf_limits half = measured((ends){.top = .5, .kappa = 100, .noise = .02});
	assert_int_equal(half.incidences, INCIDENCES);
	assert_int_equal(half.first, 0);
	assert_true(half.clipped > 50 && !half.lowest);
	assert_true(measured((ends){.top = .1, .kappa = 500, .noise = .1}).clipped > 20);
}

static void floors(void **state)
{
	(void)state;
	const rbf_limits found = measured((ends){.top = 9, .floor = .01, .kappa = 20, .noise = .02});
	assert_true(found.lowest > SAMPLES && found.lowest < found.samples && !found.clipped);
	assert_int_equal(found.samples, INCIDENCES * SAMPLES);
}

static void neither(void **state)
{
	(void)state;
	static const ends plans[] = {{.kappa = 100, .noise = .02}, {.kappa = 3, .noise = .01}, {.kappa = 3}, {.kappa = .1}, {.flat = 1}, {.flat = 1, .noise = .02},
		{.kappa = 10, .step = 1e-3, .noise = .02}, {.flat = 1, .step = .004, .noise = .01}};
	for (size_t n = 0; n < sizeof plans / sizeof *plans; n++) {
		ends p = plans[n];
		p.top = 9;
		const rbf_limits found = measured(p);
		if (found.clipped || (!(p.step > 0) && (double)found.lowest > .02 * (double)found.samples))
			fail_msg("case %zu: %zu highest, %zu lowest", n, found.clipped, found.lowest);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(saturated), cmocka_unit_test(floors), cmocka_unit_test(neither)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
