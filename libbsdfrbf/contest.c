/* SPDX-License-Identifier: BSD-3-Clause */
#include "contest.h"

#include <string.h>

static const float TIE = .99f; /* of the error of one before it, which is simpler, for the next to be better, where trials tell little */

void rbf_contest_replace(rbf_choice *best, rbf_choice *next)
{
	rbf_choice_free(best);
	*best = *next;
	memset(next, 0, sizeof *next);
}

int rbf_contest_win(rbf_choice *best, rbf_choice *round, float share)
{
	const int better = round->frames && round->error < share * best->error;
	if (better)
		rbf_contest_replace(best, round);
	else
		rbf_choice_free(round);
	return better;
}

int rbf_contest(const rbf_left_out *b, rbf_choice *best, rbf_choice next, const rbf_choice *against)
{
	if (rbf_left_out_error(b, &next, against)) {
		rbf_choice_free(&next);
		return -1;
	}
	if (!best->frames || next.error < (b->outside ? TIE : 1) * best->error)
		rbf_contest_replace(best, &next);
	else
		rbf_choice_free(&next);
	return 0;
}
