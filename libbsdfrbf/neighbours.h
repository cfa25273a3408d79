/* SPDX-License-Identifier: BSD-3-Clause */
/* Nearest neighbours among points in space (k-d tree). */
#ifndef RBF_NEIGHBOURS_H
#define RBF_NEIGHBOURS_H
#include <stddef.h>
#include <stdint.h>

typedef struct rbf_tree {
	size_t count;
	float (*point)[3];   /* in tree order */
	uint32_t *index;     /* tree order -> caller's order */
	uint8_t *axis;       /* split axis of each node */
} rbf_tree;

/* points: count x 3. Returns 0, or -1 when out of memory. */
int rbf_tree_build(rbf_tree *tree, size_t count, const float (*points)[3]);
/* The same of count x 3 doubles. */
int rbf_tree_of(rbf_tree *tree, size_t count, const double *points);
/* From now on the tree answers in its own order; from, or NULL: takes which of the caller's points each was. */
void rbf_tree_own_order(rbf_tree *tree, uint32_t *from);
void rbf_tree_free(rbf_tree *tree);

enum { RBF_NEAREST_MOST = 64 };
enum { RBF_NEAR = 9 }; /* nearest points that fits keep of each, itself included and nearest first; where there are fewer, itself repeats */

/* Whether a value is the highest among those of its neighbours; of equals, the first. */
static inline int rbf_near_highest(const uint32_t (*near)[RBF_NEAR], const float *value, size_t i)
{
	for (int j = 0; j < RBF_NEAR; j++) {
		const uint32_t n = near[i][j];
		if (value[n] > value[i] || (n < i && value[n] == value[i]))
			return 0;
	}
	return 1;
}

/* The `k` (at most RBF_NEAREST_MOST) points nearest to p, nearest first, into index[k] and squared distance[k]. Returns how many. */
int rbf_tree_nearest(const rbf_tree *tree, const float p[3], int k, uint32_t *index, float *distance);

/* Squared radius of the cap about p that holds so many points: its area, up to a factor. More than 0. */
float rbf_tree_cap(const rbf_tree *tree, const float p[3], int points);

/* How far directions are apart about one of them, along the axis where they are farthest: samples of a scan by arcs may be ten times as
 * far from each other across the arcs as along them, and lobes as narrow as along would leave the dark between. Either side of an axis will
 * do, as at the horizon or a hole there is but one. all: those far off are asked too, if the nearest do not tell as they lie on one line; 0 if
 * none tells. The tree's index must be its own order. */
float rbf_tree_gap(const rbf_tree *tree, const float direction[3], int all);
#endif
