/* SPDX-License-Identifier: BSD-3-Clause */
#include "neighbours.h"
#include "lanes.h"
#include "vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 12, BRANCHLESS = 24, GAP_AROUND = 48 };
static const float AXIS = .41421356f; /* tan 22.5 degrees */
static const float SAME = 1e-12f;     /* square of a distance: no distance */

/* A point and the caller's index of it, whose bits are the last lane. */
typedef rbf_lanes item;

static inline item item_of(const float point[3], uint32_t index)
{
	item i = {point[0], point[1], point[2], 0};
	rbf_lane_mask bits = (rbf_lane_mask)i;
	bits[3] = (int32_t)index;
	return (item)bits;
}

static inline uint32_t index_of(item i)
{
	const rbf_lane_mask bits = (rbf_lane_mask)i;
	return (uint32_t)bits[3];
}

/* The median of a range is its node, split along the axis of largest extent. */
static int widest(const item *list, size_t from, size_t to)
{
	item low = list[from], high = low;
	for (size_t i = from + 1; i < to; i++) {
		low = rbf_lanes_min(list[i], low);
		high = rbf_lanes_max(list[i], high);
	}
	const item extent = high - low;
	int axis = 0;
	for (int a = 1; a < 3; a++)
		if (extent[a] > extent[axis])
			axis = a;
	return axis;
}

static inline void exchange(item *list, size_t a, size_t b)
{
	const item i = list[a];
	list[a] = list[b];
	list[b] = i;
}

/* Ties are broken by the caller's index, so that the order is the same everywhere. Which side a point belongs to cannot be foreseen: nothing branches
 * on that. axis: constant. place: room. */
static inline __attribute__((always_inline)) void quickselect(item *list, size_t from, size_t to, size_t nth, int axis, uint32_t *place)
{
	while (to - from > 1) {
		const size_t middle = from + (to - from) / 2;
		exchange(list, middle, to - 1);
		const float value = list[to - 1][axis];
		const uint32_t index = index_of(list[to - 1]);
		size_t before = 0;
		for (size_t i = from; i < to - 1; i++) {
			place[before] = (uint32_t)i;
			before += (list[i][axis] < value) | ((list[i][axis] == value) & (index_of(list[i]) < index));
		}
		for (size_t i = 0; i < before; i++)
			exchange(list, place[i], from + i);
		const size_t store = from + before;
		exchange(list, store, to - 1);
		if (store == nth)
			return;
		if (store < nth)
			from = store + 1;
		else
			to = store;
	}
}

/* The tree's indices are room until they are known. */
static void build(rbf_tree *t, item *list, size_t from, size_t to)
{
	while (to - from > LEAF) {
		const size_t middle = from + (to - from) / 2;
		const int axis = widest(list, from, to);
		switch (axis) {
		case 0: quickselect(list, from, to, middle, 0, t->index); break;
		case 1: quickselect(list, from, to, middle, 1, t->index); break;
		default: quickselect(list, from, to, middle, 2, t->index);
		}
		t->axis[middle] = (uint8_t)axis;
		build(t, list, from, middle);
		from = middle + 1;
	}
}

int rbf_tree_build(rbf_tree *tree, size_t count, const float (*points)[3])
{
	const size_t room = count ? count : 1;
	item *list = malloc(room * sizeof *list);
	tree->count = count;
	tree->point = malloc(room * sizeof *tree->point);
	tree->index = malloc(room * sizeof *tree->index);
	tree->axis = malloc(room);
	const int failed = !list || !tree->point || !tree->index || !tree->axis;
	for (size_t i = 0; i < count && !failed; i++)
		list[i] = item_of(points[i], (uint32_t)i);
	if (!failed)
		build(tree, list, 0, count);
	for (size_t i = 0; i < count && !failed; i++) {
		for (int a = 0; a < 3; a++)
			tree->point[i][a] = list[i][a];
		tree->index[i] = index_of(list[i]);
	}
	free(list);
	if (failed)
		rbf_tree_free(tree);
	return failed ? -1 : 0;
}

int rbf_tree_of(rbf_tree *tree, size_t count, const double *points)
{
	float (*rounded)[3] = malloc((count + 1) * sizeof *rounded);
	for (size_t i = 0; i < count && rounded; i++)
		for (size_t a = 0; a < 3; a++)
			rounded[i][a] = (float)points[3*i + a];
	const int failed = !rounded || rbf_tree_build(tree, count, (const float (*)[3])rounded);
	free(rounded);
	return failed ? -1 : 0;
}

void rbf_tree_own_order(rbf_tree *tree, uint32_t *from)
{
	for (size_t i = 0; i < tree->count; i++) {
		if (from)
			from[i] = tree->index[i];
		tree->index[i] = (uint32_t)i;
	}
}

void rbf_tree_free(rbf_tree *tree)
{
	free(tree->point);
	free(tree->index);
	free(tree->axis);
	memset(tree, 0, sizeof *tree);
}

/* The nearest so far, as keys that sort by distance and then by index: the bits of a float that is not negative sort as it does. */
typedef struct search {
	const rbf_tree *tree;
	float p[3];
	int k;
	float worst; /* squared distance of the last */
	uint64_t key[RBF_NEAREST_MOST];
} search;

static inline float distance_of(uint64_t key)
{
	const uint32_t bits = (uint32_t)(key >> 32);
	float distance;
	memcpy(&distance, &bits, sizeof distance);
	return distance;
}

static inline uint64_t key_of(float distance, uint32_t index)
{
	uint32_t bits;
	memcpy(&bits, &distance, sizeof bits);
	return (uint64_t)bits << 32 | index;
}

static inline void insert(search *s, float d, uint32_t index)
{
	const uint64_t key = key_of(d, index);
	if (s->k > BRANCHLESS) {
		int at = s->k - 1;
		for (; at > 0 && s->key[at - 1] > key; at--)
			s->key[at] = s->key[at - 1];
		if (key < s->key[at])
			s->key[at] = key;
	} else { /* every key moves to its place without a branch, since where that is cannot be foreseen */
		for (int at = s->k - 1; at > 0; at--) {
			const uint64_t own = s->key[at], lower = s->key[at - 1], least = key < own ? key : own;
			s->key[at] = lower > least ? lower : least;
		}
		s->key[0] = key < s->key[0] ? key : s->key[0];
	}
	s->worst = distance_of(s->key[s->k - 1]);
}

static inline float distance2(const float p[3], const float q[3])
{
	const float x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2];
	return x*x + y*y + z*z;
}

static inline void offer(search *s, size_t i)
{
	const float d = distance2(s->p, s->tree->point[i]);
	if (d <= s->worst)
		insert(s, d, s->tree->index[i]);
}

static void visit(search *s, size_t from, size_t to)
{
	while (to - from > LEAF) {
		const size_t middle = from + (to - from) / 2;
		const int axis = s->tree->axis[middle];
		const float side = s->p[axis] - s->tree->point[middle][axis];
		if (side < 0)
			visit(s, from, middle);
		else
			visit(s, middle + 1, to);
		if (side * side > s->worst)
			return;
		offer(s, middle);
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
	search s = {.tree = tree, .p = {p[0], p[1], p[2]}, .k = k, .worst = INFINITY};
	const uint64_t none = key_of(INFINITY, UINT32_MAX);
	int found = 0;
	for (int i = 0; i < k; i++)
		s.key[i] = none;
	if (k > 0)
		visit(&s, 0, tree->count);
	for (; found < k && s.key[found] != none; found++) {
		index[found] = (uint32_t)s.key[found];
		distance[found] = distance_of(s.key[found]);
	}
	return found;
}

float rbf_tree_cap(const rbf_tree *tree, const float p[3], int points)
{
	uint32_t index[RBF_NEAREST_MOST];
	float distance[RBF_NEAREST_MOST];
	const int found = rbf_tree_nearest(tree, p, points, index, distance);
	return found ? distance[found - 1] + SAME : 1;
}

/* What is seen from p, in its tangent plane: the squared distance of the nearest along each of four axes. */
typedef struct around {
	const float *p;
	float t[3], u[3], nearest[4];
} around;

static void look_at(around *a, const float q[3], float distance)
{
	const float x = rbf_dot(q, a->t), y = rbf_dot(q, a->u);
	const int axis = fabsf(y) < AXIS * fabsf(x) ? 0 : fabsf(x) < AXIS * fabsf(y) ? 1 : x * y > 0 ? 2 : 3;
	if (distance > 1e-10f)
		a->nearest[axis] = fminf(a->nearest[axis], distance);
}

static float farthest_axis(const around *a)
{
	return fmaxf(fmaxf(a->nearest[0], a->nearest[1]), fmaxf(a->nearest[2], a->nearest[3]));
}

float rbf_tree_gap(const rbf_tree *tree, const float p[3], int all)
{
	uint32_t index[GAP_AROUND];
	float distance[GAP_AROUND];
	around a = {.p = p, .nearest = {INFINITY, INFINITY, INFINITY, INFINITY}};
	const int found = rbf_tree_nearest(tree, p, GAP_AROUND, index, distance);
	rbf_basis(p, a.t, a.u);
	for (int n = 0; n < found; n++)
		look_at(&a, tree->point[index[n]], distance[n]);
	if (farthest_axis(&a) < INFINITY)
		all = 0;
	for (size_t i = 0; i < tree->count && all; i++)
		look_at(&a, tree->point[i], distance2(p, tree->point[i]));
	return farthest_axis(&a) < INFINITY ? sqrtf(farthest_axis(&a)) : 0;
}
