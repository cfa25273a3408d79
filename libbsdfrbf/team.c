/* SPDX-License-Identifier: BSD-3-Clause */
#include "team.h"

#include <stdlib.h>
#include <string.h>

enum { ROUND = 1 << 24 }; /* bytes that are shared at once, if an item is not larger */

int rbf_team_lowest(const rbf_team *t, float *value)
{
	if (!t)
		return 0;
	float *all = calloc((size_t)t->size, sizeof *all);
	size_t *bytes = malloc((size_t)t->size * sizeof *bytes);
	int failed = !all || !bytes;
	if (!failed) {
		for (int r = 0; r < t->size; r++)
			bytes[r] = sizeof *all;
		all[t->rank] = *value;
		failed = t->gather(t->user, all, bytes) != 0;
		for (int r = 0; r < t->size; r++)
			*value = all[r] < *value ? all[r] : *value;
	}
	free(all);
	free(bytes);
	return failed ? -1 : 0;
}

int rbf_team_failed(const rbf_team *t, int failed)
{
	float value = failed ? -1 : 0;
	return rbf_team_lowest(t, &value) || value < 0;
}

typedef struct row { const uint64_t *first; size_t each; } row;

static uint64_t start(const row *r, size_t item)
{
	return r->first ? r->first[item] : (uint64_t)item * r->each;
}

/* The items of each process follow each other while they travel. */
static int share_round(const rbf_team *t, const row *r, size_t from, size_t to, char *data)
{
	const size_t size = (size_t)t->size, total = (size_t)(start(r, to) - start(r, from));
	size_t *bytes = calloc(2 * size, sizeof *bytes), *at = bytes ? bytes + size : NULL;
	char *block = malloc(total + 1);
	int failed = !bytes || !block;
	for (size_t i = from; i < to && !failed; i++)
		bytes[i % size] += (size_t)(start(r, i + 1) - start(r, i));
	for (size_t n = 1; n < size && !failed; n++)
		at[n] = at[n - 1] + bytes[n - 1];
	for (int back = 0; back < 2 && !failed; back++) {
		size_t place = 0;
		for (size_t n = 0; n < size; n++) {
			place = at[n];
			for (size_t i = from + (n + size - from % size) % size; i < to; i += size) {
				const size_t length = (size_t)(start(r, i + 1) - start(r, i));
				if (!back && n == (size_t)t->rank)
					memcpy(block + place, data + start(r, i), length);
				else if (back && n != (size_t)t->rank)
					memcpy(data + start(r, i), block + place, length);
				place += length;
			}
		}
		if (!back)
			failed = t->gather(t->user, block, bytes) != 0;
	}
	free(block);
	free(bytes);
	return failed ? -1 : 0;
}

static int share(const rbf_team *t, size_t items, const row *r, void *data)
{
	int failed = 0;
	for (size_t from = 0, to; from < items && t && !failed; from = to) {
		for (to = from + 1; to < items && start(r, to + 1) - start(r, from) <= ROUND; )
			to++;
		failed = share_round(t, r, from, to, data);
	}
	return failed;
}

int rbf_team_share(const rbf_team *t, size_t items, const uint64_t *first, void *data)
{
	return share(t, items, &(row){.first = first}, data);
}

int rbf_team_share_rows(const rbf_team *t, size_t items, size_t each, void *data)
{
	return share(t, items, &(row){.each = each}, data);
}
