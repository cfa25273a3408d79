/* SPDX-License-Identifier: BSD-3-Clause */
#include "seen.h"
#include "spiral.h"

#include <stdlib.h>
#include <string.h>

enum { COARSE = 400, FINE = 2000 }; /* directions that are asked for */
static const float REACH_LEAST = .0436f; /* 2.5 degrees */
static const float INSIDE = .6f; /* of the gap between samples: nothing is farther from them among them */
static const float BAND = .2f; /* rad */

/* The place in the tree of the point that stands for direction q; -1: there is none. bridged: as rbf_tree_gap() takes it. */
static ptrdiff_t place_of(const rbf_tree *tree, const float q[3], int bridged)
{
	uint32_t place;
	float distance, reach = REACH_LEAST;
	if (!rbf_tree_nearest(tree, q, 1, &place, &distance))
		return -1;
	if (distance > reach * reach)
		reach = rbf_tree_gap(tree, tree->point[place], bridged);
	return distance <= reach * reach ? (ptrdiff_t)place : -1;
}

int rbf_seen_is(const rbf_seen *seen, const float direction[3])
{
	return place_of(&seen->measured, direction, seen->bridged) >= 0;
}

rbf_seen_shares rbf_seen_compare(const rbf_seen *first, const rbf_seen *second, const float image[9])
{
	int count[4] = {0};
	for (int n = 0; n < FINE; n++) {
		float q[3], there[3];
		rbf_spiral(n, FINE, q);
		for (int k = 0; k < 3; k++)
			there[k] = image[3*k]*q[0] + image[3*k + 1]*q[1] + image[3*k + 2]*q[2];
		count[rbf_seen_is(first, q) + 2 * rbf_seen_is(second, there)]++;
	}
	return (rbf_seen_shares){(float)count[3] / FINE, (float)count[1] / FINE, (float)count[2] / FINE};
}

/* Has a tree, as it was made, answer in its own order. Returns which of the caller's points each was, NULL: out of memory, or it was not made. */
static uint32_t *own_order(rbf_tree *tree, int failed)
{
	uint32_t *from = failed ? NULL : malloc((tree->count + 1) * sizeof *from);
	if (from)
		rbf_tree_own_order(tree, from);
	return from;
}

int rbf_seen_make(const rbf_incidence *in, rbf_seen *seen)
{
	float q[3];
	int unseen = 0, upper = 0;
	memset(seen, 0, sizeof *seen);
	seen->bridged = in->lines == RBF_LINES_BRIDGED;
	seen->sample = own_order(&seen->measured, rbf_tree_of(&seen->measured, in->count, in->outgoing));
	const int failed = !seen->sample;
	for (int n = 0; n < COARSE && !failed; n++) {
		rbf_spiral(n, COARSE, q);
		const int is = place_of(&seen->measured, q, seen->bridged) < 0;
		unseen += is;
		upper += is && q[2] > .5f;
	}
	seen->share = (float)unseen / COARSE;
	seen->upper = upper / (.5f * COARSE);
	return failed ? -1 : 0;
}

int rbf_seen_refine(rbf_seen *seen)
{
	float (*unseen)[3] = malloc(FINE * sizeof *unseen), q[3];
	uint32_t count = 0;
	for (int n = 0; n < FINE && unseen; n++) {
		rbf_spiral(n, FINE, q);
		if (place_of(&seen->measured, q, seen->bridged) < 0)
			memcpy(unseen[count++], q, sizeof q);
	}
	seen->share = (float)count / FINE;
	const int failed = !unseen || rbf_tree_build(&seen->hole, count, (const float (*)[3])unseen);
	free(unseen);
	return failed ? -1 : 0;
}

int rbf_seen_band(rbf_seen *seen)
{
	seen->band = calloc(seen->measured.count + 1, 1);
	seen->gap = malloc((seen->measured.count + 1) * sizeof *seen->gap);
	const int failed = !seen->band || !seen->gap;
	for (size_t i = 0; i < seen->measured.count && !failed; i++) {
		uint32_t nearest;
		float far = INFINITY;
		rbf_tree_nearest(&seen->hole, seen->measured.point[i], 1, &nearest, &far);
		seen->band[i] = far < BAND * BAND;
		seen->gap[i] = seen->band[i] ? rbf_tree_gap(&seen->measured, seen->measured.point[i], seen->bridged) : -1;
	}
	rbf_tree_free(&seen->hole);
	return failed ? -1 : 0;
}

void rbf_seen_free(rbf_seen *seen)
{
	rbf_tree_free(&seen->measured);
	rbf_tree_free(&seen->filled);
	rbf_tree_free(&seen->hole);
	free(seen->sample);
	free(seen->band);
	free(seen->gap);
	free(seen->certainty);
	memset(seen, 0, sizeof *seen);
}

int rbf_seen_fill(rbf_seen *seen, uint32_t count, const float (*direction)[3], const float *certainty)
{
	rbf_tree_free(&seen->filled);
	free(seen->certainty);
	seen->certainty = malloc((count + 1) * sizeof *seen->certainty);
	uint32_t *from = own_order(&seen->filled, rbf_tree_build(&seen->filled, count, direction));
	for (uint32_t i = 0; i < count && from && seen->certainty; i++)
		seen->certainty[i] = certainty[from[i]];
	free(from);
	return from && seen->certainty ? 0 : -1;
}

float rbf_seen_unknown(const rbf_seen *seen)
{
	int unknown = 0;
	for (int n = 0; n < COARSE; n++) {
		float q[3];
		rbf_spiral(n, COARSE, q);
		unknown += q[2] > .5f && !rbf_seen_is(seen, q) && place_of(&seen->filled, q, 0) < 0;
	}
	return unknown / (.5f * COARSE);
}

/* The sample that tells of a direction, -1: none. Next to what is unseen it does so only as far as among others. */
static ptrdiff_t sample_at(const rbf_seen *seen, const float direction[3])
{
	uint32_t place;
	float distance;
	if (!rbf_tree_nearest(&seen->measured, direction, 1, &place, &distance))
		return -1;
	const float reach = seen->band[place] ? INSIDE * seen->gap[place] : INFINITY;
	return distance <= reach * reach ? (ptrdiff_t)place : -1;
}

int rbf_seen_lacks(const rbf_seen *seen, const float direction[3])
{
	return sample_at(seen, direction) < 0;
}

float rbf_seen_filled(const rbf_seen *seen, const float direction[3])
{
	const ptrdiff_t filled = place_of(&seen->filled, direction, 0);
	return filled >= 0 ? seen->certainty[filled] : 0;
}

float rbf_seen_certainty(const rbf_seen *seen, const float direction[3], int inner)
{
	const ptrdiff_t own = sample_at(seen, direction);
	if (own >= 0)
		return !inner || !seen->band[own];
	return inner ? 0 : rbf_seen_filled(seen, direction);
}
