/* SPDX-License-Identifier: BSD-3-Clause */
/* Directions that were measured more than once count once, with their mean. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "faults.h"
#include "model_fixture.h"
#include "repeated.h"

enum { THETAS = 18, PHIS = 36, ALL = THETAS * PHIS };

static void sample_at(int i, double out[3])
{
	const double theta = 5 * DEGREE * (i / PHIS), phi = 10 * DEGREE * (i % PHIS);
	out[0] = sin(theta) * cos(phi);
	out[1] = sin(theta) * sin(phi);
	out[2] = cos(theta);
}

/* A table over all azimuths: the normal is in it 36 times, and one direction was asked for again, by the last digit of a file elsewhere. */
static void means_stand_for_all(void **state)
{
	(void)state;
	static double out[ALL + 1][3];
	static float dsf[2 * (ALL + 1)];
	for (int i = 0; i <= ALL; i++) {
		sample_at(i < ALL ? i : 200, out[i]);
		out[i][0] += i < ALL ? 0 : 2e-6;
		dsf[2*i] = (float)i;
		dsf[2*i + 1] = 1;
	}
	rbf_incidence incidence[2] = {{.count = ALL + 1, .outgoing = out[0], .dsf = dsf}, {.count = ALL - PHIS, .outgoing = out[PHIS], .dsf = dsf}};
	const rbf_measured all = {.count = 2, .incidence = incidence};
	rbf_measured joined;
	assert_int_equal(rbf_repeated_join(&all, 2, &joined), 0);
	const rbf_incidence *to = joined.incidence;
	assert_int_equal(to->count, ALL - PHIS + 1);
	assert_float_equal(to->dsf[0], .5f * (PHIS - 1), 1e-3f); /* in the place of the first */
	assert_float_equal(to->outgoing[2], 1, 1e-12);
	for (int i = PHIS; i < ALL; i++) {
		const int at = i - PHIS + 1;
		assert_memory_equal(to->outgoing + 3 * at, out[i], sizeof out[i]);
		assert_float_equal(to->dsf[2*at], i == 200 ? .5f * (200 + ALL) : (float)i, 1e-3f);
		assert_float_equal(to->dsf[2*at + 1], 1, 1e-6f);
	}
	assert_ptr_equal(joined.incidence[1].dsf, dsf); /* nothing repeated, nothing copied */
	rbf_faults_release(&all, &joined);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(means_stand_for_all)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
