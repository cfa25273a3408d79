/* SPDX-License-Identifier: BSD-3-Clause */
#include "trials.h"

#include <stdlib.h>

typedef struct place { double z; uint32_t base; } place;

static int by_theta(const void *a, const void *b)
{
	const place *x = a, *y = b;
	return x->z != y->z ? (x->z > y->z ? -1 : 1) : x->base < y->base ? -1 : x->base > y->base;
}

int rbf_trials_make(rbf_trials *t, size_t bases, const double *direction)
{
	place *sorted = malloc((bases + 1) * sizeof *sorted);
	t->bases = (uint32_t)bases;
	t->order = malloc((bases + 1) * sizeof *t->order);
	if (!sorted || !t->order) {
		free(sorted);
		rbf_trials_free(t);
		return -1;
	}
	for (size_t b = 0; b < bases; b++)
		sorted[b] = (place){direction[3*b + 2], (uint32_t)b};
	qsort(sorted, bases, sizeof *sorted, by_theta);
	for (size_t b = 0; b < bases; b++)
		t->order[b] = sorted[b].base;
	free(sorted);
	const size_t third = (bases + 2) / 3;
	t->count = (uint32_t)(third < RBF_TRIALS_MOST ? third : RBF_TRIALS_MOST);
	for (uint32_t i = 0; i < t->count; i++)
		t->at[i] = (uint32_t)((2*i + 1) * bases / (2*t->count));
	return 0;
}

void rbf_trials_free(rbf_trials *t)
{
	free(t->order);
	t->order = NULL;
}

void rbf_trials_around(const rbf_trials *t, uint32_t place, uint32_t *before, uint32_t *after)
{
	uint32_t next = 0;
	while (next < t->count && t->at[next] < place)
		next++;
	*after = next < t->count ? next : t->count - 1;
	*before = next > 0 && t->at[*after] != place ? next - 1 : *after;
}
