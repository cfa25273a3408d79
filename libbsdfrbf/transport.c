/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Exact mass transport by the primal network simplex (Dantzig 1951; tree structure and strongly feasible trees after
 * Cunningham 1976, Ahuja, Magnanti and Orlin, "Network Flows", 1993, ch. 11).
 *
 * Two facts of our network make it short and fast: nothing has an upper bound, so an arc outside the tree carries
 * nothing and needs no state; and what is left of a greedy plan fades through the hub, which makes a feasible tree to start
 * from, so no artificial arcs are needed.
 */
#include "transport.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Masses sum to 2^56 units and cap is 2^36 units: potentials stay below 2^36 times the depth of the tree, far from
 * overflow, and rounding (1e-17 of the mass, 1e-11 of cap) stays below the precision promised. */
#define MASS_UNITS 72057594037927936.0
#define COST_UNITS 68719476736.0

#define NONE UINT32_MAX
enum { BUCKETS = 1024 };

typedef struct edge {
	uint32_t from, to;
	int64_t cost;
} edge;

/* A node and the tree arc to its parent. */
typedef struct node {
	int64_t flow;      /* on the arc to the parent */
	uint32_t parent, child, next, previous; /* tree, siblings in a list */
	uint32_t depth;
	uint32_t arc;      /* index of the edge to the parent */
	int up;            /* 1: that edge goes from here to the parent */
} node;

typedef struct network {
	node *nodes;
	int64_t *potential; /* cost of the tree's way from the hub to a node */
	edge *edges;
	size_t edge_count;
	size_t cursor;     /* where pricing goes on */
} network;

static void attach(node *nodes, uint32_t child, uint32_t parent)
{
	nodes[child].parent = parent;
	nodes[child].previous = NONE;
	nodes[child].next = nodes[parent].child;
	if (nodes[parent].child != NONE)
		nodes[nodes[parent].child].previous = child;
	nodes[parent].child = child;
}

static void detach(node *nodes, uint32_t child)
{
	const node *c = &nodes[child];
	if (c->previous == NONE)
		nodes[c->parent].child = c->next;
	else
		nodes[c->previous].next = c->next;
	if (c->next != NONE)
		nodes[c->next].previous = c->previous;
}

/* Edge with the most negative reduced cost of the next block that has one (Grigoriadis 1986: about the square root of the
 * number of edges makes a good block), or edge_count if there is none: optimal. */
static size_t price(network *w)
{
	const size_t count = w->edge_count, block = (size_t)sqrt((double)count) + 16;
	const int64_t *potential = w->potential;
	size_t best = count, i = w->cursor;
	int64_t lowest = 0;
	for (size_t seen = 0; seen < count && best == count; ) {
		size_t end = i + block < count ? i + block : count;
		seen += end - i;
		for (; i < end; i++) {
			const edge *e = &w->edges[i];
			const int64_t reduced = e->cost + potential[e->from] - potential[e->to];
			if (reduced < lowest) {
				lowest = reduced;
				best = i;
			}
		}
		if (i == count)
			i = 0;
	}
	w->cursor = i;
	return best;
}

/* Adds `shift` to the potentials of the subtree at `top` and renews the depths. */
static void renew(node *nodes, int64_t *potential, uint32_t top, int64_t shift)
{
	uint32_t i = top;
	for (;;) {
		potential[i] += shift;
		nodes[i].depth = nodes[nodes[i].parent].depth + 1;
		if (nodes[i].child != NONE) {
			i = nodes[i].child;
			continue;
		}
		while (i != top && nodes[i].next == NONE)
			i = nodes[i].parent;
		if (i == top)
			return;
		i = nodes[i].next;
	}
}

/* Brings the edge into the tree and takes another out. */
static void pivot(network *w, size_t entering)
{
	node *nodes = w->nodes;
	const edge *e = &w->edges[entering];
	const int64_t reduced = e->cost + w->potential[e->from] - w->potential[e->to];

	/* Round the cycle flow goes join -> from -> to -> join. It falls on edges that point up on the `from` side and down on
	 * the `to` side. The last of the limiting ones, seen from the join, leaves: this keeps every edge without flow
	 * pointing at the root, so that degenerate pivots cannot cycle. */
	int64_t delta = INT64_MAX;
	uint32_t leaving = NONE, a = e->from, b = e->to;
	int leaving_side = 0;
	while (a != b) {
		if (nodes[a].depth >= nodes[b].depth) {
			if (nodes[a].up && nodes[a].flow < delta) {
				delta = nodes[a].flow;
				leaving = a;
				leaving_side = 1;
			}
			a = nodes[a].parent;
		} else {
			if (!nodes[b].up && nodes[b].flow <= delta) {
				delta = nodes[b].flow;
				leaving = b;
				leaving_side = 2;
			}
			b = nodes[b].parent;
		}
	}
	const uint32_t join = a;
	for (a = e->from; a != join; a = nodes[a].parent)
		nodes[a].flow += nodes[a].up ? -delta : delta;
	for (b = e->to; b != join; b = nodes[b].parent)
		nodes[b].flow += nodes[b].up ? delta : -delta;

	/* The part cut off hangs from the entering edge now: turn the way from its new top to its old one round. */
	const uint32_t top = leaving_side == 1 ? e->from : e->to;
	uint32_t i = top, parent = leaving_side == 1 ? e->to : e->from;
	uint32_t arc = (uint32_t)entering;
	int up = leaving_side == 1;
	int64_t flow = delta;
	for (;;) {
		const node old = nodes[i];
		detach(nodes, i);
		attach(nodes, i, parent);
		nodes[i].arc = arc;
		nodes[i].up = up;
		nodes[i].flow = flow;
		if (i == leaving)
			break;
		parent = i;
		arc = old.arc;
		up = !old.up;
		flow = old.flow;
		i = old.parent;
	}
	renew(nodes, w->potential, top, leaving_side == 1 ? -reduced : reduced);
}

/* The total, or 0 if an entry cannot be a mass. */
static double total_mass(size_t n, const double *mass)
{
	double sum = 0;
	for (size_t i = 0; i < n; i++) {
		if (!(mass[i] >= 0))
			return 0;
		sum += mass[i];
	}
	return isfinite(sum) ? sum : 0;
}

/* Masses in integer units as `flow`. The largest takes the rounding residue so that both sides match; what rounds to nothing stays
 * out of the network: its depth is 0. */
static void set_masses(node *nodes, size_t n, const double *mass, double total, int up)
{
	int64_t rest = (int64_t)MASS_UNITS;
	size_t largest = 0;
	for (size_t i = 0; i < n; i++) {
		nodes[i] = (node){.flow = llround(mass[i] / total * MASS_UNITS), .parent = NONE, .child = NONE, .next = NONE, .previous = NONE,
			.arc = NONE, .up = up};
		rest -= nodes[i].flow;
		if (mass[i] > mass[largest])
			largest = i;
	}
	nodes[largest].flow += rest;
	for (size_t i = 0; i < n; i++)
		nodes[i].depth = nodes[i].flow > 0;
}

/* Tree of a greedy plan: the cheapest edges first, each with all that its ends still have. The end that is used up hangs from the
 * other, in a tie the demand, so that every edge without flow points at the root; the rest hangs from the hub. order: the edges by
 * cost, roughly is enough. */
static void plant(network *w, uint32_t hub, size_t pairs, const uint32_t *order, uint32_t supplies, int64_t cap)
{
	node *nodes = w->nodes;
	for (size_t k = 0; k < pairs; k++) {
		const uint32_t from = w->edges[order[k]].from, to = w->edges[order[k]].to;
		if (nodes[from].parent != NONE || nodes[to].parent != NONE || !nodes[from].flow)
			continue;
		const uint32_t child = nodes[from].flow < nodes[to].flow ? from : to, parent = child == from ? to : from;
		nodes[parent].flow -= nodes[child].flow;
		nodes[child].arc = order[k];
		attach(nodes, child, parent);
	}
	nodes[hub] = (node){.parent = NONE, .child = NONE, .next = NONE, .previous = NONE, .arc = NONE};
	for (uint32_t i = 0; i < hub; i++)
		if (nodes[i].depth && nodes[i].parent == NONE)
			attach(nodes, i, hub);
	w->potential[hub] = 0;
	for (uint32_t i = nodes[hub].child; i != NONE && i != hub; ) {
		const uint32_t parent = nodes[i].parent;
		const int64_t cost = nodes[i].arc != NONE ? w->edges[nodes[i].arc].cost : i < supplies ? 0 : cap;
		nodes[i].depth = nodes[parent].depth + 1;
		w->potential[i] = w->potential[parent] + (nodes[i].up ? -cost : cost);
		if (nodes[i].child != NONE) {
			i = nodes[i].child;
			continue;
		}
		while (i != hub && nodes[i].next == NONE)
			i = nodes[i].parent;
		if (i != hub)
			i = nodes[i].next;
	}
}

/* Edges in the order of their cost's bucket. */
static void sort_roughly(const edge *edges, size_t count, int64_t cap, uint32_t *order)
{
	size_t first[BUCKETS + 1] = {0};
	const int64_t width = cap / BUCKETS + 1;
	for (size_t k = 0; k < count; k++)
		first[edges[k].cost / width + 1]++;
	for (int b = 1; b <= BUCKETS; b++)
		first[b] += first[b - 1];
	for (size_t k = 0; k < count; k++)
		order[first[edges[k].cost / width]++] = (uint32_t)k;
}

/* Sorts moves by source, then target: by counting targets first, then sources. other: as much room; start: room for max(n, m) + 1. */
static void sort_moves(size_t count, rbf_move *moves, rbf_move *other, size_t n, size_t m, uint32_t *start)
{
	for (int by_source = 0; by_source < 2; by_source++) {
		const rbf_move *in = by_source ? other : moves;
		rbf_move *out = by_source ? moves : other;
		const size_t keys = by_source ? n : m;
		memset(start, 0, (keys + 1) * sizeof *start);
		for (size_t k = 0; k < count; k++)
			start[1 + (by_source ? in[k].source : in[k].target)]++;
		for (size_t k = 0; k < keys; k++)
			start[k + 1] += start[k];
		for (size_t k = 0; k < count; k++)
			out[start[by_source ? in[k].source : in[k].target]++] = in[k];
	}
}

/* Duals, with u . supply + v . demand as the answer. The tree bounds those of its own nodes; making first every v and then every u
 * as large as the others allow serves the entries without mass too and keeps all pairs feasible. */
static double duals(const network *w, size_t n, const double *supply, double supply_total, size_t m, const double *demand,
	double demand_total, size_t arcs, const rbf_arc *arc, double cap, double units, int64_t *u, int64_t *v,
	double *dual_u, double *dual_v)
{
	const int64_t cap_units = (int64_t)(cap * units);
	const double unit = 1 / units;
	int64_t highest = INT64_MIN;
	for (size_t i = 0; i < n; i++) {
		u[i] = w->nodes[i].parent == NONE ? INT64_MIN : -w->potential[i];
		if (u[i] > highest)
			highest = u[i];
	}
	for (size_t j = 0; j < m; j++)
		v[j] = cap_units - highest;
	for (size_t k = 0; k < arcs; k++)
		if (arc[k].cost < cap && u[arc[k].source] != INT64_MIN) {
			const int64_t most = (int64_t)(arc[k].cost * units) - u[arc[k].source];
			if (most < v[arc[k].target])
				v[arc[k].target] = most;
		}
	highest = INT64_MIN;
	for (size_t j = 0; j < m; j++)
		if (v[j] > highest)
			highest = v[j];
	for (size_t i = 0; i < n; i++)
		u[i] = cap_units - highest;
	for (size_t k = 0; k < arcs; k++)
		if (arc[k].cost < cap) {
			const int64_t most = (int64_t)(arc[k].cost * units) - v[arc[k].target];
			if (most < u[arc[k].source])
				u[arc[k].source] = most;
		}
	double sum = 0;
	for (size_t i = 0; i < n; i++) {
		const double x = (double)u[i] * unit;
		sum += x * (supply[i] / supply_total);
		if (dual_u)
			dual_u[i] = x;
	}
	for (size_t j = 0; j < m; j++) {
		const double x = (double)v[j] * unit;
		sum += x * (demand[j] / demand_total);
		if (dual_v)
			dual_v[j] = x;
	}
	return sum;
}

int rbf_transport_solve(size_t n, const double *supply, size_t m, const double *demand, size_t arcs, const rbf_arc *arc,
	double cap, rbf_move *moves, size_t *count, double *cost, double *dual_u, double *dual_v, double *gap)
{
	const double supply_total = total_mass(n, supply), demand_total = total_mass(m, demand);
	if (!(supply_total > 0) || !(demand_total > 0) || !(cap >= 0) || !isfinite(cap))
		return -2;
	for (size_t k = 0; k < arcs; k++)
		if (arc[k].source >= n || arc[k].target >= m || !(arc[k].cost >= 0) || !isfinite(arc[k].cost))
			return -2;
	if (n >= NONE / 4 || m >= NONE / 4 || arcs >= NONE)
		return -1;

	const double units = cap > 0 ? COST_UNITS / cap : 1; /* of cost */
	const uint32_t hub = (uint32_t)(n + m);
	int result = -1;
	network w = {.nodes = malloc((n + m + 1) * sizeof *w.nodes), .edges = malloc((n + m + arcs) * sizeof *w.edges),
		.potential = malloc((n + m + 1) * sizeof *w.potential)};
	uint32_t *const origin = malloc((arcs + 1) * sizeof *origin), *const order = malloc((arcs + n + m + 1) * sizeof *order);
	rbf_move *const other = malloc((n + m + 1) * sizeof *other); /* no more moves than the tree has arcs */
	int64_t *const dual = malloc((n + m) * sizeof *dual);
	if (!w.nodes || !w.edges || !w.potential || !origin || !order || !other || !dual)
		goto done;
	const int64_t cap_units = (int64_t)(cap * units);
	set_masses(w.nodes, n, supply, supply_total, 1);
	set_masses(w.nodes + n, m, demand, demand_total, 0);

	/* Costs are rounded down, so that the duals are feasible for the true ones. */
	uint32_t pairs = 0;
	for (size_t k = 0; k < arcs; k++) {
		const uint32_t from = arc[k].source, to = (uint32_t)n + arc[k].target;
		if (arc[k].cost < cap && w.nodes[from].depth && w.nodes[to].depth) {
			w.edges[pairs] = (edge){from, to, (int64_t)(arc[k].cost * units)};
			origin[pairs++] = (uint32_t)k;
		}
	}
	w.edge_count = pairs;
	for (uint32_t i = 0; i < hub; i++)
		if (w.nodes[i].depth)
			w.edges[w.edge_count++] = i < n ? (edge){i, hub, 0} : (edge){hub, i, cap_units};
	sort_roughly(w.edges, pairs, cap_units, order);
	plant(&w, hub, pairs, order, (uint32_t)n, cap_units);
	for (size_t entering; (entering = price(&w)) != w.edge_count; )
		pivot(&w, entering);

	size_t moved = 0;
	double sum = 0;
	for (uint32_t i = 0; i < hub; i++) {
		if (w.nodes[i].parent == NONE || w.nodes[i].flow <= 0)
			continue;
		const double mass = (double)w.nodes[i].flow / MASS_UNITS;
		if (w.nodes[i].arc < pairs) {
			const rbf_arc *a = &arc[origin[w.nodes[i].arc]];
			moves[moved++] = (rbf_move){a->source, a->target, mass};
			sum += mass * a->cost;
		} else if (!w.nodes[i].up) {
			sum += mass * cap;
		}
	}
	sort_moves(moved, moves, other, n, m, order);
	*count = moved;
	*cost = sum;
	if (dual_u || dual_v || gap) {
		const double lower = duals(&w, n, supply, supply_total, m, demand, demand_total, arcs, arc, cap, units,
			dual, dual + n, dual_u, dual_v);
		if (gap)
			*gap = sum - lower;
	}
	result = 0;
done:
	free(w.nodes);
	free(w.edges);
	free(w.potential);
	free(origin);
	free(order);
	free(other);
	free(dual);
	return result;
}
