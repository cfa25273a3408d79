/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Lobes cost: bytes, and time of everything that follows. Their number is doubled as long as that takes a tenth off the error against
 * held-out samples, noise included, and halved where that adds next to nothing. Where samples held out are missed by more than noise is,
 * there may be edges or thin lines, and narrower lobes are tried as well.
 */
#include "lobe_count.h"

enum { HOLD = 8, START = 150, MOST = 600 };
static const float GAIN = .9f, SAME = 1.005f;
static const float NOISE = 2.5f; /* times the spread: three times what noise alone would be */

/* Error against held-out samples with a number of lobes. */
static int try_lobes(rbf_fitting *fitting, uint32_t lobes, float *error)
{
	rbf_lobes fitted;
	const int failed = rbf_fit_lobes(fitting, lobes, &fitted, error);
	rbf_lobes_free(&fitted);
	return failed;
}

/* From the number found on; twice as many where these gain half of what they should. */
static int try_narrow(rbf_fitting *fitting, uint32_t *lobes, float *error)
{
	for (uint32_t n = *lobes; n <= MOST; n *= 2) {
		float next;
		if (try_lobes(fitting, n | RBF_FIT_NARROW, &next))
			return -1;
		if (next < GAIN * *error) {
			*lobes = n | RBF_FIT_NARROW;
			*error = next;
		} else if (!(next < .5f * (1 + GAIN) * *error) || *lobes & RBF_FIT_NARROW)
			break;
	}
	return 0;
}

static int from_samples(const rbf_incidence *in, int channels, const float lambertian[3], uint32_t *lobes, float *error)
{
	rbf_incidence one = *in;
	one.paired = 0; /* twice the samples would ask for more */
	rbf_fitting *fitting = rbf_fit_begin(&one, channels, lambertian, HOLD);
	int failed = !fitting || try_lobes(fitting, START, error);
	float next;
	float spread = failed ? 0 : rbf_fit_spread(fitting);
	*lobes = START;
	while (!failed && 2 * *lobes <= MOST) {
		failed = try_lobes(fitting, 2 * *lobes, &next);
		if (failed || !(next < GAIN * *error))
			break;
		*lobes *= 2;
		*error = next;
		spread = rbf_fit_spread(fitting);
	}
	if (!failed && *lobes == START) {
		failed = try_lobes(fitting, START / 2, &next);
		if (!failed && next < SAME * *error) {
			*lobes = START / 2;
			*error = next;
		}
	}
	if (!failed && *error > NOISE * spread)
		failed = try_narrow(fitting, lobes, error);
	rbf_fit_end(fitting);
	return failed ? -1 : 0;
}

int rbf_lobe_count(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	uint32_t *lobes, float *error)
{
	uint32_t found[RBF_TRIALS_MOST];
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < trials->count; t++)
		if (rbf_team_mine(team, t))
			failed |= from_samples(&measured->incidence[rbf_trial_base(trials, t)], channels, lambertian, &found[t], &error[t]) != 0;
	if (rbf_team_failed(team, failed) || rbf_team_share_rows(team, trials->count, sizeof *found, found)
		|| rbf_team_share_rows(team, trials->count, sizeof *error, error))
		return -1;
	for (uint32_t i = 0; i < trials->bases; i++) {
		uint32_t before, after;
		rbf_trials_around(trials, i, &before, &after);
		lobes[trials->order[i]] = found[before] > found[after] ? found[before] : found[after];
	}
	return 0;
}

int rbf_lobe_count_error(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	const uint32_t *lobes, float *error)
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < trials->count; t++) {
		const uint32_t b = rbf_trial_base(trials, t);
		rbf_lobes fitted;
		if (!rbf_team_mine(team, t))
			continue;
		failed |= rbf_fit(&measured->incidence[b], channels, lambertian, lobes[b], HOLD, &fitted, &error[t]) != 0;
		rbf_lobes_free(&fitted);
	}
	return rbf_team_failed(team, failed) || rbf_team_share_rows(team, trials->count, sizeof *error, error) ? -1 : 0;
}
