/* SPDX-License-Identifier: BSD-3-Clause */
/* Processes that build one model together: which of them does an item of a loop, and how all come to hold what each made. */
#ifndef RBF_TEAM_H
#define RBF_TEAM_H
#include "bsdfrbf.h"

typedef bsdfrbf_team rbf_team; /* NULL: this process alone */

/* Items go round, as neighbours cost alike. */
static inline int rbf_team_mine(const rbf_team *t, uint64_t item)
{
	return !t || item % (unsigned)t->size == (unsigned)t->rank;
}

/* Processes that share a loop of `work`, whatever its unit, each with its part. */
static inline double rbf_team_part(const rbf_team *t, double work)
{
	return t ? work / t->size : work;
}

/* After a loop that may fail: non-zero if it failed in any process, or one gave up. */
int rbf_team_failed(const rbf_team *team, int failed);

/* The lowest of the processes' values. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_team_lowest(const rbf_team *team, float *value);

/* After a loop over `items` whose results lie in a row: item i, made where it is rbf_team_mine(), is byte first[i] to first[i + 1]
 * of data. All get all. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_team_share(const rbf_team *team, size_t items, const uint64_t *first, void *data);

/* The same for results of `each` bytes. */
int rbf_team_share_rows(const rbf_team *team, size_t items, size_t each, void *data);
#endif
