/* SPDX-License-Identifier: BSD-3-Clause */
/* Where two incidences may be compared: in directions that both were measured in. */
#ifndef RBF_BOTH_SEEN_H
#define RBF_BOTH_SEEN_H
#include "difference.h"
#include "seen.h"

typedef struct rbf_both_seen {
	const rbf_seen *a, *b;
	rbf_compared where;
	int some;            /* whether there is a hole on one side, so that `where` is to be asked */
	int few;             /* such directions are too few, and next to what was not measured */
} rbf_both_seen;

/* Of two incidences, and the rotation or mirror operation, rows, that takes directions of a to those of b. To be kept where it is. Returns what is to be
 * asked, or NULL: everything counts. */
const rbf_compared *rbf_both_seen_of(const rbf_seen *a, const rbf_seen *b, const float image[9], rbf_both_seen *both);
#endif
