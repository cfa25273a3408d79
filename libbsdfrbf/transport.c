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
enum { MASS_BITS = 56, COST_BITS = 36 };
#define MASS_UNITS ((double)(1ll << MASS_BITS))
#define COST_UNITS ((double)(1ll << COST_BITS))

#define NONE UINT32_MAX
enum { MEAN_BITS = 20, BUCKET_BITS = 27 };
enum { BUCKETS = 3 << (COST_BITS - BUCKET_BITS) };

typedef struct edge {
	uint32_t from, to;
	int64_t cost;
} edge;

/* A node and the tree arc to its parent. Nodes are also in a ring in which the nodes of every subtree follow its top, from the hub on. */
typedef struct node {
	int64_t flow;      /* on the arc to the parent */
	uint32_t parent;
	uint32_t next, previous; /* in the ring */
	uint32_t last, nodes; /* of its subtree: the last one in the ring, and how many there are */
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

static void follow(node *nodes, uint32_t before, uint32_t after)
{
	nodes[before].next = after;
	nodes[after].previous = before;
}

/* Hangs a tree from the top of another one. */
static void plant_below(node *nodes, uint32_t parent, uint32_t child)
{
	node *p = &nodes[parent], *c = &nodes[child];
	const uint32_t after = p->next, last = c->last;
	c->parent = parent;
	follow(nodes, parent, child);
	follow(nodes, last, after);
	p->last = p->last == parent ? last : p->last;
	p->nodes += c->nodes;
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

/* Takes the subtree at `top` out of the ring, and its last node off those whose last one it was. */
static void cut(node *nodes, uint32_t top)
{
	const uint32_t last = nodes[top].last, before = nodes[top].previous;
	follow(nodes, before, nodes[last].next);
	for (uint32_t i = nodes[top].parent; i != NONE && nodes[i].last == last; i = nodes[i].parent)
		nodes[i].last = before;
}

/* The entering edge, as the tree arc of the one of its ends that becomes the top of what was cut off. */
typedef struct graft {
	uint32_t top, parent, arc;
	int up;
	int64_t flow;
} graft;

/* Turns the way from the old top of what was cut off to its new one round, and hangs it where it belongs now. In the ring, what a node of
 * the way had below it, but for the one before on the way, follows what that one has. */
static void turn_round(node *nodes, uint32_t old_top, graft g)
{
	const uint32_t top = g.top, hangs_from = g.parent, all = nodes[old_top].nodes;
	uint32_t i = top, before = nodes[top].previous, last = nodes[top].last, after = nodes[last].next, end = last, less = 0;
	while (1) {
		node *n = &nodes[i];
		const node old = *n;
		n->parent = g.parent;
		n->arc = g.arc;
		n->up = g.up;
		n->flow = g.flow;
		n->nodes = all - less;
		if (i == old_top)
			break;
		g = (graft){.parent = i, .arc = old.arc, .up = !old.up, .flow = old.flow};
		less = old.nodes;
		i = old.parent;
		const uint32_t its_before = nodes[i].previous, its_last = nodes[i].last, its_after = its_last == last ? after : nodes[its_last].next;
		follow(nodes, end, i);
		end = before;
		if (its_last != last) {
			follow(nodes, end, after);
			end = its_last;
		}
		before = its_before;
		last = its_last;
		after = its_after;
	}
	for (; i != hangs_from; i = nodes[i].parent)
		nodes[i].last = end;
	const uint32_t follows = nodes[hangs_from].next;
	follow(nodes, hangs_from, top);
	follow(nodes, end, follows);
	for (; i != NONE && nodes[i].last == hangs_from; i = nodes[i].parent)
		nodes[i].last = end;
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
	while (a != b) { /* the one with less below it has not met the join yet */
		if (nodes[a].nodes <= nodes[b].nodes) {
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
	const uint32_t meet = a, cut_off = nodes[leaving].nodes;
	for (a = e->from; a != meet; a = nodes[a].parent)
		nodes[a].flow += nodes[a].up ? -delta : delta;
	for (b = e->to; b != meet; b = nodes[b].parent)
		nodes[b].flow += nodes[b].up ? delta : -delta;

	/* The part cut off hangs from the entering edge now. */
	const int below = leaving_side == 1;
	const graft g = {.top = below ? e->from : e->to, .parent = below ? e->to : e->from, .arc = (uint32_t)entering, .up = below, .flow = delta};
	for (uint32_t i = nodes[leaving].parent; i != meet; i = nodes[i].parent)
		nodes[i].nodes -= cut_off;
	for (uint32_t i = g.parent; i != meet; i = nodes[i].parent)
		nodes[i].nodes += cut_off;
	cut(nodes, leaving);
	turn_round(nodes, leaving, g);
	const int64_t shift = below ? -reduced : reduced;
	for (uint32_t i = g.top, n = 0; n < cut_off; i = nodes[i].next, n++)
		w->potential[i] += shift;
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
 * out of the network: its tree has no nodes. first: index of the first one. */
static void set_masses(node *nodes, uint32_t first, size_t n, const double *mass, double total, int up)
{
	int64_t rest = (int64_t)MASS_UNITS;
	size_t largest = 0;
	for (size_t i = 0; i < n; i++) {
		nodes[i] = (node){.flow = llround(mass[i] / total * MASS_UNITS), .parent = NONE, .arc = NONE, .up = up};
		rest -= nodes[i].flow;
		if (mass[i] > mass[largest])
			largest = i;
	}
	nodes[largest].flow += rest;
	for (size_t i = 0; i < n; i++) {
		const uint32_t self = first + (uint32_t)i;
		nodes[i].next = nodes[i].previous = nodes[i].last = self;
		nodes[i].nodes = nodes[i].flow > 0;
	}
}

/* Tree of a greedy plan: edges one after the other, each with all that its ends still have. The end that is used up hangs from the
 * other, in a tie the demand, so that every edge without flow points at the root; the rest hangs from the hub. order: of the edges, the
 * ones that are likely in the optimum first. */
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
		plant_below(nodes, parent, child);
	}
	nodes[hub] = (node){.parent = NONE, .next = hub, .previous = hub, .last = hub, .nodes = 1, .arc = NONE};
	for (uint32_t i = 0; i < hub; i++)
		if (nodes[i].nodes && nodes[i].parent == NONE)
			plant_below(nodes, hub, i);
	w->potential[hub] = 0;
	for (uint32_t i = nodes[hub].next; i != hub; i = nodes[i].next) {
		const int64_t cost = nodes[i].arc != NONE ? w->edges[nodes[i].arc].cost : i < supplies ? 0 : cap;
		w->potential[i] = w->potential[nodes[i].parent] + (nodes[i].up ? -cost : cost);
	}
}

/* Bucket of an edge: by what it costs beyond what its ends cost on average. saved: how much less than the cap that is. */
static size_t bucket_of(const edge *e, const uint64_t *saved)
{
	return (size_t)(((uint64_t)e->cost + saved[e->from] + saved[e->to]) >> BUCKET_BITS);
}

/* Edges in the order of their buckets. Cheap edges first would leave costly ones to nodes that all else is far from; so a node's mean cost, over
 * all the mass of the other side, is taken off (Russell 1969 takes the highest). saved: room for both sides' nodes. */
static void sort_roughly(const network *w, size_t count, uint32_t hub, int64_t cap, uint64_t *saved, uint32_t *order)
{
	size_t first[BUCKETS + 1] = {0};
	memset(saved, 0, hub * sizeof *saved);
	for (size_t k = 0; k < count; k++) { /* whole numbers of MEAN_BITS: the order is the same on every machine */
		const edge *e = &w->edges[k];
		const uint64_t less = (uint64_t)(cap - e->cost) >> (COST_BITS - MEAN_BITS);
		saved[e->from] += less * ((uint64_t)w->nodes[e->to].flow >> (MASS_BITS - MEAN_BITS));
		saved[e->to] += less * ((uint64_t)w->nodes[e->from].flow >> (MASS_BITS - MEAN_BITS));
	}
	for (uint32_t i = 0; i < hub; i++) { /* more than the cap if there are parallel edges */
		saved[i] >>= 2 * MEAN_BITS - COST_BITS;
		saved[i] = saved[i] < (uint64_t)cap ? saved[i] : (uint64_t)cap;
	}
	for (size_t k = 0; k < count; k++)
		first[bucket_of(&w->edges[k], saved) + 1]++;
	for (int b = 1; b <= BUCKETS; b++)
		first[b] += first[b - 1];
	for (size_t k = 0; k < count; k++)
		order[first[bucket_of(&w->edges[k], saved)]++] = (uint32_t)k;
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
	int64_t *const dual = malloc((n + m) * sizeof *dual); /* before there are any, what nodes save */
	if (!w.nodes || !w.edges || !w.potential || !origin || !order || !other || !dual)
		goto done;
	const int64_t cap_units = (int64_t)(cap * units);
	set_masses(w.nodes, 0, n, supply, supply_total, 1);
	set_masses(w.nodes + n, (uint32_t)n, m, demand, demand_total, 0);

	/* Costs are rounded down, so that the duals are feasible for the true ones. */
	uint32_t pairs = 0;
	for (size_t k = 0; k < arcs; k++) {
		const uint32_t from = arc[k].source, to = (uint32_t)n + arc[k].target;
		if (arc[k].cost < cap && w.nodes[from].nodes && w.nodes[to].nodes) {
			w.edges[pairs] = (edge){from, to, (int64_t)(arc[k].cost * units)};
			origin[pairs++] = (uint32_t)k;
		}
	}
	w.edge_count = pairs;
	for (uint32_t i = 0; i < hub; i++)
		if (w.nodes[i].nodes)
			w.edges[w.edge_count++] = i < n ? (edge){i, hub, 0} : (edge){hub, i, cap_units};
	sort_roughly(&w, pairs, hub, cap_units, (uint64_t *)dual, order);
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
