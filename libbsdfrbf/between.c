/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The Voronoi cell of a point is its tangent plane, clipped by the bisectors towards the points around it, nearest first, until none that is farther
 * can reach it. Seen from the sphere's centre these are straight lines in that plane. Two points are next to each other if their cells share a side,
 * or no more than a corner, as diagonals of a grid do.
 */
#include "between.h"
#include "neighbours.h"
#include "vector.h"

#include <math.h>
#include <stdlib.h>

enum { NEAR = 20, CORNERS = RBF_NEAREST_MOST + 5 };
static const float FAR = .25f;     /* farther apart nothing is between */
static const float CORNER = .98f;  /* of the way to a bisector: one that touches a corner, or nearly does */
static const float SAME = 1e-10f;  /* square of a distance: no distance */

typedef struct cell {
	int corners;
	float at[CORNERS][2];
} cell;

/* A line: what is farther from the middle is cut off. */
typedef struct line {
	float normal[2], distance;
} line;

static float beyond(const line *l, const float at[2], float part)
{
	return l->normal[0] * at[0] + l->normal[1] * at[1] - part * l->distance;
}

static void clip(cell *c, const line *l)
{
	cell to = {.corners = 0};
	for (int i = 0; i < c->corners; i++) {
		const int next = i + 1 < c->corners ? i + 1 : 0;
		const float here = beyond(l, c->at[i], 1), there = beyond(l, c->at[next], 1);
		if (here <= 0) {
			to.at[to.corners][0] = c->at[i][0];
			to.at[to.corners++][1] = c->at[i][1];
		}
		if ((here <= 0) == (there <= 0))
			continue;
		const float part = here / (here - there);
		for (int a = 0; a < 2; a++)
			to.at[to.corners][a] = c->at[i][a] + part * (c->at[next][a] - c->at[i][a]);
		to.corners++;
	}
	*c = to;
}

static int touches(const cell *c, const line *l)
{
	int found = 0;
	for (int i = 0; i < c->corners; i++)
		found |= beyond(l, c->at[i], CORNER) > 0;
	return found;
}

/* Squared distance of the farthest point that may cut it: twice as far as its farthest corner. */
static float reach(const cell *c)
{
	float most = 0;
	for (int i = 0; i < c->corners; i++)
		most = fmaxf(most, c->at[i][0] * c->at[i][0] + c->at[i][1] * c->at[i][1]);
	return 4 * most;
}

/* next[j] = 1 for those of the points around that are next to a point, 0 for the others. Returns 0 if more of them may be. */
static int next_to(const rbf_tree *tree, size_t i, int around, const uint32_t *index, const float *distance, uint8_t *next)
{
	const float *p = tree->point[i];
	float t[3], u[3];
	cell c = {.corners = 4, .at = {{-FAR, -FAR}, {FAR, -FAR}, {FAR, FAR}, {-FAR, FAR}}};
	line bisector[RBF_NEAREST_MOST];
	int asked = 0;
	rbf_basis(p, t, u);
	for (; asked < around && !(distance[asked] > FAR * FAR) && !(distance[asked] > reach(&c)); asked++) {
		const float *q = tree->point[index[asked]];
		bisector[asked] = (line){{rbf_dot(q, t), rbf_dot(q, u)}, .5f * distance[asked]};
		if (distance[asked] > SAME)
			clip(&c, &bisector[asked]);
	}
	for (int j = 0; j < around; j++)
		next[j] = j < asked && distance[j] > SAME && touches(&c, &bisector[j]);
	return asked < around;
}

/* All pairs, each once; to be freed. Returns how many, or -1 when out of memory. */
static ptrdiff_t pairs_of(const rbf_tree *tree, uint32_t (**pair)[2])
{
	size_t room = 4 * tree->count + RBF_NEAREST_MOST, found = 0;
	uint32_t (*list)[2] = malloc(room * sizeof *list);
	float *seen = malloc((tree->count + 1) * sizeof *seen); /* squared distance: all that are nearer were asked */
	int failed = !list || !seen;
	for (size_t i = 0; i < tree->count && !failed; i++) {
		uint32_t index[RBF_NEAREST_MOST];
		float distance[RBF_NEAREST_MOST];
		uint8_t next[RBF_NEAREST_MOST];
		int around = rbf_tree_nearest(tree, tree->point[i], NEAR, index, distance);
		seen[i] = INFINITY;
		if (!next_to(tree, i, around, index, distance, next)) {
			around = rbf_tree_nearest(tree, tree->point[i], RBF_NEAREST_MOST, index, distance);
			if (!next_to(tree, i, around, index, distance, next) && around == RBF_NEAREST_MOST)
				seen[i] = distance[around - 1];
		}
		if (found + RBF_NEAREST_MOST > room) {
			uint32_t (*more)[2] = realloc(list, (room *= 2) * sizeof *list);
			failed = !more;
			list = more ? more : list;
		}
		for (int j = 0; j < around && !failed; j++) {
			if (!next[j] || (index[j] < i && distance[j] <= seen[index[j]]))
				continue;
			list[found][0] = (uint32_t)i;
			list[found++][1] = index[j];
		}
	}
	free(seen);
	if (failed) {
		free(list);
		return -1;
	}
	*pair = list;
	return (ptrdiff_t)found;
}

/* Room for as many more. */
static int reserve(size_t count, float (**w)[3], int channels, float *value[3])
{
	float (*more)[3] = realloc(*w, (count + 1) * sizeof *more);
	if (!more)
		return -1;
	*w = more;
	for (int c = 0; c < channels; c++) {
		float *values = realloc(value[c], (count + 1) * sizeof *values);
		if (!values)
			return -1;
		value[c] = values;
	}
	return 0;
}

int rbf_between_add(size_t *count, float (**w)[3], int channels, float *value[3])
{
	rbf_tree tree;
	uint32_t (*pair)[2] = NULL, *from = malloc((*count + 1) * sizeof *from);
	if (!from || rbf_tree_build(&tree, *count, (const float (*)[3])*w)) {
		free(from);
		return -1;
	}
	rbf_tree_own_order(&tree, from);
	const ptrdiff_t pairs = pairs_of(&tree, &pair);
	const int failed = pairs < 0 || reserve(*count + (size_t)pairs, w, channels, value);
	for (ptrdiff_t i = 0; i < pairs && !failed; i++, ++*count) {
		const uint32_t a = from[pair[i][0]], b = from[pair[i][1]];
		float *middle = (*w)[*count];
		for (int x = 0; x < 3; x++)
			middle[x] = (*w)[a][x] + (*w)[b][x];
		rbf_normalize(middle);
		for (int c = 0; c < channels; c++)
			value[c][*count] = .5f * (value[c][a] + value[c][b]);
	}
	rbf_tree_free(&tree);
	free(pair);
	free(from);
	return failed ? -1 : 0;
}
