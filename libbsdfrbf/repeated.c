/* SPDX-License-Identifier: BSD-3-Clause */
#include "repeated.h"
#include "faults.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static const double SAME = 1e-5, CELL = 2e-4; /* rad: what is left of a direction in a text file; cells that are looked up */

/* First samples by the cell they are in; chains of those in one slot. */
typedef struct table {
	size_t mask, *head, *next; /* 0: none, else a sample's number plus 1 */
} table;

static int table_make(size_t count, table *t)
{
	size_t slots = 64;
	while (slots < 2 * count)
		slots *= 2;
	*t = (table){slots - 1, calloc(slots, sizeof *t->head), malloc((count + 1) * sizeof *t->next)};
	return t->head && t->next ? 0 : -1;
}

static size_t *slot_of(const table *t, const int64_t cell[3])
{
	const uint64_t hash = (uint64_t)cell[0] * 0x9e3779b97f4a7c15u ^ (uint64_t)cell[1] * 0xc2b2ae3d27d4eb4fu ^ (uint64_t)cell[2] * 0x165667b19e3779f9u;
	return &t->head[(hash ^ hash >> 32) & t->mask];
}

static int same(const double *a, const double *b)
{
	return fabs(a[0] - b[0]) < SAME && fabs(a[1] - b[1]) < SAME && fabs(a[2] - b[2]) < SAME;
}

/* The first sample in the direction of sample i, i itself if none is before it. What is next to a cell's side is looked for on both. */
static size_t first_like(const rbf_incidence *in, const table *t, size_t i)
{
	const double *w = in->outgoing + 3*i;
	int64_t low[3], high[3], cell[3];
	for (int n = 0; n < 3; n++) {
		low[n] = (int64_t)floor((w[n] - SAME) / CELL);
		high[n] = (int64_t)floor((w[n] + SAME) / CELL);
	}
	for (cell[0] = low[0]; cell[0] <= high[0]; cell[0]++)
		for (cell[1] = low[1]; cell[1] <= high[1]; cell[1]++)
			for (cell[2] = low[2]; cell[2] <= high[2]; cell[2]++)
				for (size_t k = *slot_of(t, cell); k; k = t->next[k - 1])
					if (same(w, in->outgoing + 3 * (k - 1)))
						return k - 1;
	return i;
}

/* Sets first[i] to the first sample in the direction of sample i. Returns how many are not the first. */
static size_t find(const rbf_incidence *in, const table *t, size_t *first)
{
	size_t repeated = 0;
	for (size_t i = 0; i < in->count; i++) {
		first[i] = first_like(in, t, i);
		if (first[i] < i) {
			repeated++;
			continue;
		}
		int64_t cell[3];
		for (int n = 0; n < 3; n++)
			cell[n] = (int64_t)floor(in->outgoing[3*i + (size_t)n] / CELL);
		size_t *slot = slot_of(t, cell);
		t->next[i] = *slot;
		*slot = i + 1;
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
	if (rbf_faults_borrow(all, joined))
		return -1;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)all->count; b++) {
		const rbf_incidence *in = &all->incidence[b];
		table t;
		size_t *first = malloc((in->count + 1) * sizeof *first);
		const int without = table_make(in->count, &t) || !first;
		const size_t repeated = without ? 0 : find(in, &t, first);
		failed |= without;
		if (repeated)
			failed |= join(in, (size_t)channels, first, in->count - repeated, &joined->incidence[b]) != 0;
		free(t.head);
		free(t.next);
		free(first);
	}
	return failed ? -1 : 0;
}
