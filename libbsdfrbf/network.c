/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Nielson's minimum norm network (A method for interpolating scattered data based upon a minimum norm network, Math. Comp. 40, 1983). Where
 * the slopes at an edge's ends exceed that of its chord by p and q, the square of the cubic's second derivative integrates to
 * 4 (p^2 + p q + q^2) / length. The slopes that make the sum over all edges least are met by Jacobi iteration: own slopes count twice as much as
 * those at the other ends, so that what is missing halves in each round.
 * That lets nothing bend where the mesh ends, where light often bends most, towards grazing incidence. There edges that lead to the border are parabolas
 * instead: slopes at both ends exceed the chord's by as much, and fall short of it.
 */
#include "network.h"

#include <stdlib.h>

enum { ROUNDS = 30 };
static const double RIDGE = 1e-6; /* of the trace: nothing is known across a chain */
static const float OWN_IMAGE = 1e-6f; /* squared distance */

typedef struct edge {
	uint32_t base[2];
	float along[2][3]; /* its direction at both ends, in the bases' coordinates */
	float length;
	uint8_t last[2];   /* 1: that end lies on the border, and the other does not */
} edge;

/* A base's equations over the tangents t and s. */
typedef struct node {
	float t[3], s[3];
	int ops, op[4]; /* those that the base is its own image by: its slope is then, too */
	double tt, ts, ss, right[2];
} node;

/* From one vertex to another: the direction at both, in the bases' coordinates. Returns the angle. */
static float course(const rbf_vertex *from, const rbf_vertex *to, float along[2][3])
{
	const float cosine = rbf_dot(from->direction, to->direction);
	float first[3], second[3];
	for (int n = 0; n < 3; n++) {
		first[n] = to->direction[n] - cosine * from->direction[n];
		second[n] = cosine * to->direction[n] - from->direction[n];
	}
	rbf_normalize(first);
	rbf_normalize(second);
	rbf_mirror(from->op, first, along[0]);
	rbf_mirror(to->op, second, along[1]);
	return rbf_angle(from->direction, to->direction);
}

static edge *edges_of(const rbf_mesh *mesh, uint32_t *count)
{
	const int sides = mesh->symmetry == RBF_ISOTROPIC ? 1 : 3;
	edge *list = malloc(((size_t)mesh->elements * 3 + 1) * sizeof *list);
	uint8_t *on_border = calloc((size_t)mesh->vertices + 1, 1);
	*count = 0;
	for (uint32_t i = 0; i < mesh->borders && on_border; i++)
		on_border[mesh->border[i][0]] = on_border[mesh->border[i][1]] = 1;
	for (uint32_t i = 0; i < mesh->elements && list && on_border; i++)
		for (int k = 0; k < sides; k++) {
			const uint32_t v[2] = {mesh->element[i].v[k], mesh->element[i].v[(k + 1) % 3]};
			edge *e = &list[*count];
			for (int n = 0; n < 2; n++) {
				e->base[n] = mesh->vertex[v[n]].base;
				e->last[n] = on_border[v[n]] && !on_border[v[!n]] && mesh->vertices > 2;
			}
			e->length = course(&mesh->vertex[v[0]], &mesh->vertex[v[1]], e->along);
			*count += e->length > 0;
		}
	if (!on_border) {
		free(list);
		return NULL;
	}
	free(on_border);
	return list;
}

static void set_node(const rbf_mesh *mesh, const rbf_vertex *v, node *to)
{
	int op[4] = {RBF_OP_NONE, RBF_OP_X};
	const int ops = mesh->symmetry == RBF_ISOTROPIC ? 2 : rbf_symmetry_ops(mesh->symmetry, op);
	float own[3];
	rbf_mirror(v->op, v->direction, own);
	rbf_basis(own, to->t, to->s);
	to->ops = 0;
	for (int n = 0; n < ops; n++) {
		float d[3];
		rbf_mirror((unsigned)op[n], own, d);
		const float apart[3] = {d[0] - own[0], d[1] - own[1], d[2] - own[2]};
		if (rbf_dot(apart, apart) < OWN_IMAGE)
			to->op[to->ops++] = op[n];
	}
}

/* A direction and what it should rise by there, by its weight; and its images. */
static void add(node *to, const float along[3], double weight, double rise)
{
	for (int n = 0; n < to->ops; n++) {
		float image[3];
		rbf_mirror((unsigned)to->op[n], along, image);
		const double t = (double)rbf_dot(image, to->t), s = (double)rbf_dot(image, to->s);
		to->tt += weight * t * t;
		to->ts += weight * t * s;
		to->ss += weight * s * s;
		to->right[0] += weight * t * rise;
		to->right[1] += weight * s * rise;
	}
}

static void solve(node *of, float slope[3])
{
	const double ridge = RIDGE * (of->tt + of->ss), tt = of->tt + ridge, ss = of->ss + ridge, whole = tt * ss - of->ts * of->ts;
	const double t = of->right[0] * ss - of->right[1] * of->ts, s = of->right[1] * tt - of->right[0] * of->ts;
	for (int n = 0; n < 3 && whole > 0; n++)
		slope[n] = (float)((t * (double)of->t[n] + s * (double)of->s[n]) / whole);
	of->tt = of->ts = of->ss = of->right[0] = of->right[1] = 0;
}

rbf_knot *rbf_network_make(const rbf_mesh *mesh, const float value[])
{
	uint32_t edges;
	edge *list = edges_of(mesh, &edges);
	rbf_knot *knot = calloc((size_t)mesh->bases + 1, sizeof *knot);
	node *of = calloc((size_t)mesh->bases + 1, sizeof *of);
	const int ready = list && knot && of;
	for (uint32_t v = 0; v < mesh->vertices && ready; v++) {
		knot[mesh->vertex[v].base].value = value[mesh->vertex[v].base];
		set_node(mesh, &mesh->vertex[v], &of[mesh->vertex[v].base]);
	}
	for (int round = 0; round < ROUNDS && ready; round++) {
		for (uint32_t i = 0; i < edges; i++) {
			const edge *e = &list[i];
			const float chord = (value[e->base[1]] - value[e->base[0]]) / e->length;
			for (int k = 0; k < 2; k++) {
				const float other = rbf_dot(knot[e->base[!k]].slope, e->along[!k]);
				add(&of[e->base[k]], e->along[k], 1 / (double)e->length, (double)(e->last[k] ? 2 * chord - other : .5f * (3 * chord - other)));
			}
		}
		for (uint32_t b = 0; b < mesh->bases; b++)
			solve(&of[b], knot[b].slope);
	}
	free(list);
	free(of);
	if (!ready) {
		free(knot);
		return NULL;
	}
	return knot;
}

/* On an edge the cubic; on a triangle what its edges make of it, exact for what is of second degree. */
float rbf_network_between(uint32_t corners, const rbf_knot knot[], const rbf_vertex vertex[], const float weight[])
{
	float sum = 0;
	for (uint32_t k = 0; k < corners; k++) {
		sum += weight[k] * knot[k].value;
		for (uint32_t l = 0; l < k; l++) {
			float along[2][3];
			const float length = course(&vertex[l], &vertex[k], along), rise = knot[k].value - knot[l].value;
			const float p = length * rbf_dot(knot[l].slope, along[0]) - rise, q = length * rbf_dot(knot[k].slope, along[1]) - rise;
			sum += .5f * weight[k] * weight[l] * (p - q + (weight[l] - weight[k]) * (p + q));
		}
	}
	return sum;
}
