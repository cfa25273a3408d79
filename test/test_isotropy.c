/* SPDX-License-Identifier: BSD-3-Clause */
/* What noise allows of incidences at other azimuths, turned; and what repeats in a turn without being round. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "isotropy.h"

enum { MOST = 64 };
static const float SCATTER = .02f, NO = 0;

/* A material: a beam about the mirror direction, some degrees aside, that grows with the polar angle and changes with the azimuth by a share, so
 * many times in a turn; and as many beams at normal incidence, where a share is given. */
typedef struct sheet { double aside, share; int folds; } sheet;

static void fit(const sheet *s, double theta, double phi, rbf_lobes *l)
{
	double d[3];
	float centre[3];
	polar(theta, phi + 180 + s->aside, d);
	for (int n = 0; n < 3; n++)
		centre[n] = (float)d[n];
	assert_int_equal(rbf_lobes_new(l, 1 + (uint32_t)s->folds, 1), 0);
	const double times = (1 + theta / 45) * (1 + s->share * cos(s->folds * phi * DEGREE));
	rbf_lobe_set(l, 0, centre, 60);
	l->amplitude[0].a[0] = (float)times;
	l->mass[0] = 2 * RBF_PI / 60 * times;
	for (int k = 0; k < s->folds; k++) {
		polar(20, 360. * k / s->folds, d);
		for (int n = 0; n < 3; n++)
			centre[n] = (float)d[n];
		rbf_lobe_set(l, 1 + (uint32_t)k, centre, 60);
		l->amplitude[(1 + k) / RBF_LANES].a[(1 + k) % RBF_LANES] = (float)(theta > 0 ? 0 : s->share);
		l->mass[1 + k] = theta > 0 ? 0 : 2 * RBF_PI / 60 * s->share;
	}
	assert_int_equal(rbf_lobes_finish(l), 0);
}

/* spiral: so many incidences, or 0: rings at azimuths `step` apart, from normal incidence on if that is asked for. */
static rbf_isotropy ask(const sheet *s, int spiral, double step, int normal, float scatter, float enough)
{
	static double direction[3 * MOST];
	static rbf_lobes lobes[MOST];
	float error[MOST];
	rbf_fitted m = {.symmetry = RBF_ANISOTROPIC, .channels = 1, .direction = direction, .lobes = lobes};
	rbf_isotropy found;
	for (int n = 0; n < spiral; n++, m.bases++) {
		const double theta = acos(1 - .8 * (n + .5) / spiral) / DEGREE, phi = fmod(n * 137.50776, 360);
		polar(theta, phi, direction + 3*m.bases);
		fit(s, theta, phi, &lobes[m.bases]);
	}
	for (double theta = normal ? 0 : 20; theta < 75 && !spiral; theta += 20)
		for (double phi = 0; phi < (theta > 0 ? 359 : 1); phi += step, m.bases++) {
			polar(theta, phi, direction + 3*m.bases);
			fit(s, theta, phi, &lobes[m.bases]);
		}
	for (uint32_t b = 0; b < m.bases; b++)
		error[b] = scatter;
	assert_int_equal(rbf_isotropy_of(&m, .1f, error, NULL, enough, &found), 0);
	for (uint32_t b = 0; b < m.bases; b++)
		rbf_lobes_free(&lobes[b]);
	return found;
}

/* By as much as fits err, azimuths may differ, and no more; or by what is said to be enough. */
static void noise_is_allowed(void **state)
{
	(void)state;
	const sheet even = {0}, uneven = {.share = .2, .folds = 1}, little = {.share = .01, .folds = 1};
	assert_true(ask(&even, 0, 100, 0, SCATTER, NO).isotropic);
	assert_true(ask(&little, 0, 100, 0, SCATTER, NO).isotropic);
	assert_false(ask(&little, 0, 100, 0, SCATTER / 100, NO).isotropic);
	assert_true(ask(&little, 0, 100, 0, SCATTER / 100, SCATTER).isotropic);
	assert_false(ask(&uneven, 0, 100, 0, SCATTER, NO).isotropic);
}

/* Where no two polar angles are one, what changes with them does not count. */
static void polar_angles_may_differ(void **state)
{
	(void)state;
	const sheet even = {.aside = 5}, uneven = {.share = .2, .folds = 1};
	const rbf_isotropy found = ask(&even, 48, 0, 0, SCATTER, NO);
	if (!(found.isotropic && found.error < .5f * SCATTER && found.folds == 0))
		fail_msg("%d, differs by %g, %u folds", found.isotropic, (double)found.error, found.folds);
	assert_false(ask(&uneven, 48, 0, 0, SCATTER, NO).isotropic);
}

/* Measured at the azimuths where it is the same, a material that repeats is told by normal incidence, or where that was not measured, if it is not its own
 * mirror image. */
static void what_repeats_is_not_round(void **state)
{
	(void)state;
	const sheet three = {.share = .3, .folds = 3}, askew = {.aside = 10}, even = {0};
	assert_int_equal(ask(&three, 0, 120, 1, SCATTER, NO).folds, 3);
	assert_false(ask(&three, 0, 120, 1, SCATTER, NO).isotropic);
	assert_true(ask(&three, 0, 120, 0, SCATTER, NO).isotropic); /* nothing tells */
	assert_false(ask(&askew, 0, 120, 0, SCATTER, NO).isotropic);
	assert_true(ask(&askew, 0, 120, 1, SCATTER, NO).isotropic);
	assert_true(ask(&even, 0, 120, 1, SCATTER, NO).isotropic);
	assert_int_equal(ask(&even, 0, 100, 1, SCATTER, NO).folds, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(noise_is_allowed), cmocka_unit_test(polar_angles_may_differ),
		cmocka_unit_test(what_repeats_is_not_round)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
