/* SPDX-License-Identifier: BSD-3-Clause */
#include "neighbours.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF = 12 };

/* The median of a range is its node, split along the axis of largest extent. */
static int widest(const rbf_tree *t, size_t from, size_t to)
{
	float low[3], high[3];
	memcpy(low, t->point[from], sizeof low);
	memcpy(high, low, sizeof high);
	for (size_t i = from + 1; i < to; i++)
		for (int a = 0; a < 3; a++) {
			if (t->point[i][a] < low[a]) low[a] = t->point[i][a];
			if (t->point[i][a] > high[a]) high[a] = t->point[i][a];
		}
	int axis = 0;
	for (int a = 1; a < 3; a++)
		if (high[a] - low[a] > high[axis] - low[axis])
			axis = a;
	return axis;
}

static void exchange(rbf_tree *t, size_t a, size_t b)
{
	float p[3];
	memcpy(p, t->point[a], sizeof p);
	memcpy(t->point[a], t->point[b], sizeof p);
	memcpy(t->point[b], p, sizeof p);
	const uint32_t i = t->index[a];
	t->index[a] = t->index[b];
	t->index[b] = i;
}

/* Ties are broken by the caller's index, so that the order is the same everywhere. */
static int before(const rbf_tree *t, size_t i, int axis, float value, uint32_t index)
{
	return t->point[i][axis] < value || (t->point[i][axis] == value && t->index[i] < index);
}

static void quickselect(rbf_tree *t, size_t from, size_t to, size_t nth, int axis)
{
	while (to - from > 1) {
		const size_t middle = from + (to - from) / 2;
		exchange(t, middle, to - 1);
		const float value = t->point[to - 1][axis];
		const uint32_t index = t->index[to - 1];
		size_t store = from;
		for (size_t i = from; i < to - 1; i++)
			if (before(t, i, axis, value, index))
				exchange(t, i, store++);
		exchange(t, store, to - 1);
		if (store == nth)
			return;
		if (store < nth)
			from = store + 1;
		else
			to = store;
	}
}

static void build(rbf_tree *t, size_t from, size_t to)
{
	while (to - from > LEAF) {
		const size_t middle = from + (to - from) / 2;
		const int axis = widest(t, from, to);
		quickselect(t, from, to, middle, axis);
		t->axis[middle] = (uint8_t)axis;
		build(t, from, middle);
		from = middle + 1;
	}
}

int rbf_tree_build(rbf_tree *tree, size_t count, const float (*points)[3])
{
	tree->count = count;
	tree->point = malloc((count ? count : 1) * sizeof *tree->point);
	tree->index = malloc((count ? count : 1) * sizeof *tree->index);
	tree->axis = malloc(count ? count : 1);
	if (!tree->point || !tree->index || !tree->axis) {
		rbf_tree_free(tree);
		return -1;
	}
	memcpy(tree->point, points, count * sizeof *points);
	for (size_t i = 0; i < count; i++)
		tree->index[i] = (uint32_t)i;
	build(tree, 0, count);
	return 0;
}

void rbf_tree_free(rbf_tree *tree)
{
	free(tree->point);
	free(tree->index);
	free(tree->axis);
	memset(tree, 0, sizeof *tree);
}

typedef struct search {
	const rbf_tree *tree;
	const float *p;
	int k, found;
	uint32_t *index;
	float *distance;
} search;

static void offer(search *s, size_t i)
{
	const float *q = s->tree->point[i];
	const float x = q[0] - s->p[0], y = q[1] - s->p[1], z = q[2] - s->p[2], d = x*x + y*y + z*z;
	const uint32_t index = s->tree->index[i];
	if (s->found == s->k && !(d < s->distance[s->k - 1] || (d == s->distance[s->k - 1] && index < s->index[s->k - 1])))
		return;
	int at = s->found < s->k ? s->found++ : s->k - 1;
	while (at > 0 && (s->distance[at - 1] > d || (s->distance[at - 1] == d && s->index[at - 1] > index))) {
		s->distance[at] = s->distance[at - 1];
		s->index[at] = s->index[at - 1];
		at--;
	}
	s->distance[at] = d;
	s->index[at] = index;
}

static void visit(search *s, size_t from, size_t to)
{
	while (to - from > LEAF) {
		const size_t middle = from + (to - from) / 2;
		const int axis = s->tree->axis[middle];
		const float side = s->p[axis] - s->tree->point[middle][axis];
		offer(s, middle);
		if (side < 0)
			visit(s, from, middle);
		else
			visit(s, middle + 1, to);
		if (s->found == s->k && side * side > s->distance[s->k - 1])
			return;
		if (side < 0)
			from = middle + 1;
		else
			to = middle;
	}
	for (size_t i = from; i < to; i++)
		offer(s, i);
}

int rbf_tree_nearest(const rbf_tree *tree, const float p[3], int k, uint32_t *index, float *distance)
{
	search s = {tree, p, k, 0, index, distance};
	if (k > 0)
		visit(&s, 0, tree->count);
	return s.found;
}
