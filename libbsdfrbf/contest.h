/* SPDX-License-Identifier: BSD-3-Clause */
/* Choices of frames against each other: which predicts incidences that are left out with less error. */
#ifndef RBF_CONTEST_H
#define RBF_CONTEST_H
#include "left_out.h"

/* As another choice, but still to be labelled. */
static inline rbf_choice rbf_contest_again(const rbf_choice *of)
{
	rbf_choice next = *of;
	next.label = NULL;
	next.base_error = NULL;
	return next;
}

/* `next` in the place of `best`. */
void rbf_contest_replace(rbf_choice *best, rbf_choice *next);

/* `round` in the place of `best`, if its error is below that share of the other's; else it is freed. Returns whether it is. */
int rbf_contest_win(rbf_choice *best, rbf_choice *round, float share);

/* Measures `next`; the better of the two stays in `best`. against: what it has to beat in any case, or NULL. Opens OpenMP regions. Returns 0, or -1 when out
 * of memory or a process gave up. */
int rbf_contest(const rbf_left_out *left_out, rbf_choice *best, rbf_choice next, const rbf_choice *against);
#endif
