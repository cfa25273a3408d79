/* SPDX-License-Identifier: BSD-3-Clause */
#include "faults.h"

#include <stdlib.h>
#include <string.h>

/* A copy of an incidence's samples without those; `left` remain. */
static int leave_out(const rbf_incidence *in, size_t channels, const uint8_t *state, uint8_t fault, size_t left, rbf_incidence *to)
{
	to->outgoing = NULL;
	to->dsf = NULL;
	to->count = 0;
	if (rbf_incidence_reserve(to, channels, left))
		return -1;
	for (size_t i = 0; i < in->count; i++) {
		if (state[i] == fault)
			continue;
		memcpy(to->outgoing + 3 * to->count, in->outgoing + 3*i, 3 * sizeof *to->outgoing);
		memcpy(to->dsf + channels * to->count++, in->dsf + channels * i, channels * sizeof *to->dsf);
	}
	return 0;
}

int rbf_faults_borrow(const rbf_measured *all, rbf_measured *rest)
{
	*rest = *all;
	rest->incidence = malloc((all->count + 1) * sizeof *rest->incidence);
	if (rest->incidence && all->count)
		memcpy(rest->incidence, all->incidence, all->count * sizeof *all->incidence);
	return rest->incidence ? 0 : -1;
}

int rbf_faults_leave_out(const rbf_measured *all, int channels, uint8_t *const *state, uint8_t fault, rbf_measured *rest, rbf_faults *found)
{
	int failed = 0;
	*found = (rbf_faults){0};
	if (rbf_faults_borrow(all, rest))
		return -1;
	for (size_t b = 0; b < all->count && state && !failed; b++) {
		size_t some = 0;
		for (size_t i = 0; i < all->incidence[b].count; i++)
			some += state[b][i] == fault;
		if (!some)
			continue;
		failed = leave_out(&all->incidence[b], (size_t)channels, state[b], fault, all->incidence[b].count - some, &rest->incidence[b]);
		found->first = found->incidences++ ? found->first : b;
		found->samples += some;
	}
	return failed ? -1 : 0;
}

void rbf_faults_release(const rbf_measured *all, rbf_measured *rest)
{
	for (size_t b = 0; b < all->count && rest->incidence; b++)
		if (rest->incidence[b].dsf != all->incidence[b].dsf) {
			free(rest->incidence[b].outgoing);
			free(rest->incidence[b].dsf);
		}
	free(rest->incidence);
	*rest = (rbf_measured){0};
}

float rbf_faults_step(const float *value, const float (*over)[3], size_t count)
{
	float least = 0, next = 0;
	for (int pass = 0; pass < 2; pass++)
		for (size_t i = 0; i < count; i++) {
			const float v = over ? value[i] / over[i][2] : value[i];
			float *to = pass ? &next : &least;
			if (v > 1.001f * least * (float)pass && !(*to > 0 && *to <= v))
				*to = v;
		}
	return next > 0 && next < 1.5f * least ? 0 : least;
}
