/* SPDX-License-Identifier: BSD-3-Clause */
/* How many lobes the fits take. */
#ifndef RBF_LOBE_COUNT_H
#define RBF_LOBE_COUNT_H
#include "fit.h"
#include "trials.h"

/* Number of lobes for every incidence, whether it is paired or not, lobes[measured->count]: found at the trials; an incidence takes the larger number of
 * the two next to it, with RBF_FIT_NARROW or RBF_FIT_BETWEEN where that is better. error[trials->count]: relative L1 of the trials' fits against held-out
 * samples. Opens OpenMP regions. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_lobe_count(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	uint32_t *lobes, float *error);

/* The same errors with numbers of lobes that are known. */
int rbf_lobe_count_error(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	const uint32_t *lobes, float *error);
#endif
