/* SPDX-License-Identifier: BSD-3-Clause */
#include "repeated.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const double SAME = 1e-5; /* rad: what is left of a direction in a text file */

/* A sample, and its place along a line that no scan lies across. */
typedef struct place { double along; size_t sample; } place;

static int by_place(const void *a, const void *b)
{
	const place *p = a, *q = b;
	return p->along < q->along ? -1 : p->along > q->along ? 1 : (p->sample > q->sample) - (p->sample < q->sample);
}

static int same(const double *a, const double *b)
{
	return fabs(a[0] - b[0]) < SAME && fabs(a[1] - b[1]) < SAME && fabs(a[2] - b[2]) < SAME;
}

/* Sets first[i] to the first sample in the direction of sample i. Returns how many are not the first. */
static size_t find(const rbf_incidence *in, place *p, size_t *first)
{
	size_t repeated = 0;
	for (size_t i = 0; i < in->count; i++) {
		const double *w = in->outgoing + 3*i;
		p[i] = (place){.61 * w[0] + .53 * w[1] + .59 * w[2], i};
		first[i] = i;
	}
	qsort(p, in->count, sizeof *p, by_place);
	for (size_t n = 0; n < in->count; n++) {
		const size_t i = p[n].sample;
		if (first[i] != i)
			continue;
		for (size_t m = n + 1; m < in->count && p[m].along - p[n].along < 2 * SAME; m++) {
			const size_t k = p[m].sample;
			if (first[k] == k && same(in->outgoing + 3*i, in->outgoing + 3*k)) {
				first[k] = i;
				repeated++;
			}
		}
	}
	return repeated;
}

/* The means, without changing the order. left: so many. */
static int join(const rbf_incidence *in, size_t channels, const size_t *first, size_t left, rbf_incidence *to)
{
	size_t *times = calloc(in->count + 1, sizeof *times), *at = malloc((in->count + 1) * sizeof *at);
	*to = *in;
	to->outgoing = NULL;
	to->dsf = NULL;
	to->count = 0;
	const int failed = !times || !at || rbf_incidence_reserve(to, channels, left);
	for (size_t i = 0; i < in->count && !failed; i++)
		times[first[i]]++;
	for (size_t i = 0; i < in->count && !failed; i++)
		if (times[i]) {
			at[i] = to->count;
			memcpy(to->outgoing + 3 * to->count, in->outgoing + 3*i, 3 * sizeof *to->outgoing);
			for (size_t c = 0; c < channels; c++)
				to->dsf[channels * to->count + c] = 0;
			to->count++;
		}
	for (size_t i = 0; i < in->count && !failed; i++)
		for (size_t c = 0; c < channels; c++)
			to->dsf[channels * at[first[i]] + c] += in->dsf[channels * i + c] / (float)times[first[i]];
	free(times);
	free(at);
	return failed ? -1 : 0;
}

int rbf_repeated_join(const rbf_measured *all, int channels, rbf_measured *joined)
{
	int failed = 0;
	*joined = *all;
	joined->incidence = malloc((all->count + 1) * sizeof *joined->incidence);
	if (!joined->incidence)
		return -1;
	if (all->count)
		memcpy(joined->incidence, all->incidence, all->count * sizeof *all->incidence);
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)all->count; b++) {
		const rbf_incidence *in = &all->incidence[b];
		place *p = malloc((in->count + 1) * sizeof *p);
		size_t *first = malloc((in->count + 1) * sizeof *first);
		failed |= !p || !first;
		const size_t repeated = p && first ? find(in, p, first) : 0;
		if (repeated)
			failed |= join(in, (size_t)channels, first, in->count - repeated, &joined->incidence[b]) != 0;
		free(p);
		free(first);
	}
	return failed ? -1 : 0;
}
