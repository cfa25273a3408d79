/* SPDX-License-Identifier: BSD-3-Clause */
#include "edges.h"
#include "advect.h"
#include "assemble.h"
#include "moves.h"

#include <stdlib.h>

/* A directed edge between a base and a vertex, mirrored so that the base is the measured one. */
typedef struct edge {
	uint32_t from, to, op;
	uint32_t at;           /* first entry in the shift array */
	rbf_vertex vertex;
	uint32_t slot;         /* where it is used: index into shift_of */
} edge;

static int by_key(const void *a, const void *b)
{
	const edge *x = a, *y = b;
	if (x->from != y->from) return x->from < y->from ? -1 : 1;
	if (x->to != y->to) return x->to < y->to ? -1 : 1;
	if (x->op != y->op) return x->op < y->op ? -1 : 1;
	return x->slot < y->slot ? -1 : x->slot > y->slot;
}

/* Every edge once, by key, with its place in the shift array, of which all its slots are told. */
static uint64_t place_edges(rbf_component *c, uint32_t *shift_of, edge *list)
{
	size_t count = 0;
	uint64_t total = 0;
	for (uint32_t e = 0; e < c->mesh.elements; e++)
		for (uint32_t own = 0; own < 3; own++)
			for (uint32_t n = 0; n < 2; n++) {
				const uint32_t *v = c->mesh.element[e].v, slot = e * 6 + own * 2 + n;
				const rbf_vertex *a = &c->mesh.vertex[v[own]], *b = &c->mesh.vertex[v[(own + 1 + n) % 3]];
				shift_of[slot] = RBF_NO_SHIFT;
				/* a segment repeats its second corner: only the first of its two slots counts */
				if (v[1] == v[2] && (own == 2 || (own == 0 && n == 1) || (own == 1 && n == 0)))
					continue;
				edge *x = &list[count++];
				*x = (edge){.from = a->base, .to = b->base, .op = a->op ^ b->op, .slot = slot};
				x->vertex = (rbf_vertex){.base = b->base, .op = a->op ^ b->op};
				rbf_mirror(a->op, b->direction, x->vertex.direction);
			}
	qsort(list, count, sizeof *list, by_key);
	c->edges = 0;
	for (size_t i = 0; i < count; i++) {
		const edge *last = c->edges ? &list[c->edges - 1] : NULL;
		if (!last || list[i].from != last->from || list[i].to != last->to || list[i].op != last->op) {
			list[c->edges] = list[i];
			list[c->edges++].at = (uint32_t)total;
			total += rbf_assemble_blocks(c, list[i].from);
		}
		shift_of[list[i].slot] = list[c->edges - 1].at;
	}
	return total;
}

/* first[edges + 1]: where the edges' rows start, bytes; length[edges]: of their motion, radians. */
static int move(const rbf_fitted *m, const rbf_choice *choice, const rbf_component *c, const edge *list, uint64_t *first,
	float *length, rbf_shift *shift)
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t i = 0; i < (int64_t)c->edges; i++) {
		const edge *x = &list[i];
		first[i] = x->at * sizeof *shift;
		if (failed || !rbf_team_mine(m->team, (uint64_t)i))
			continue;
		float (*motion)[3] = malloc((m->lobes[x->from].count + 1) * sizeof *motion);
		if (!motion || rbf_advect(m, choice->frames, choice->frame, choice->label, x->from, &x->vertex, choice->cap, motion, &length[i]))
			failed = 1;
		else
			rbf_assemble_shift(m, c, choice->label, x->from, (const float (*)[3])motion, shift + x->at);
		free(motion);
	}
	first[c->edges] = c->shifts * sizeof *shift;
	return rbf_team_failed(m->team, failed) || rbf_team_share(m->team, c->edges, first, shift)
		|| rbf_team_share_rows(m->team, c->edges, sizeof *length, length);
}

bsdfrbf_status rbf_edges_move(bsdfrbf_context *context, const rbf_fitted *m, const rbf_choice *choice, rbf_component *c)
{
	const size_t slots = (size_t)c->mesh.elements * 6;
	uint32_t *shift_of = malloc((slots + 1) * sizeof *shift_of);
	edge *list = malloc((slots + 1) * sizeof *list);
	uint64_t *first = malloc((slots + 1) * sizeof *first);
	float *length = calloc(slots + 1, sizeof *length);
	c->shift_of = shift_of;
	int failed = !shift_of || !list || !first || !length;
	const uint64_t total = failed ? 0 : place_edges(c, shift_of, list);
	if (!failed && total < RBF_NO_SHIFT) {
		rbf_shift *shift = calloc(total + 1, sizeof *shift);
		c->shifts = (uint32_t)total;
		c->shift = shift;
		failed = !shift || move(m, choice, c, list, first, length, shift) || rbf_moves_round(c);
	}
	double sum = 0;
	for (uint32_t i = 0; i < c->edges && !failed; i++)
		sum += (double)length[i];
	c->facts.residual_deg = (float)(c->edges ? sum / c->edges * 180 / RBF_PI : 0);
	free(list);
	free(first);
	free(length);
	if (failed)
		return rbf_out_of_memory(context);
	if (total >= RBF_NO_SHIFT)
		return rbf_fail(context, BSDFRBF_ERR_UNSUPPORTED, "residual transport needs too many entries; use fewer lobes (-l)");
	return BSDFRBF_OK;
}
