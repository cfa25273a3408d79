/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Table of the DHR of the scattered part, times max(cos, RBF_DHR_Z), made so that its nodes follow the mesh: DHR has kinks along
 * the mesh's edges and nowhere else, and quadratic pieces that end there keep to it.
 *
 * An element (triangle, or segment of a chain) holds a lattice in its barycentric coordinates, `steps` intervals a side.
 * A border holds what lies beyond it, without the limit that evaluation sets there: the nearest point of the arc and the
 * direction from it run once around the arc (outwards along it from end a to end b, around b, back inwards, around a),
 * 4 `steps` intervals, and the distance over that of the horizon makes `steps` more.
 * Values: [item][node][channel], elements first, then borders.
 */
#ifndef RBF_DHR_H
#define RBF_DHR_H
#include "model.h"

#define RBF_DHR_Z 0.01f  /* what facets reflect grows as 1/cos beyond the last incidence: times the cosine it is even */
#define RBF_DHR_STEPS_MAX 32

/* Nodes of one element and of one border. */
static inline uint32_t rbf_dhr_element_nodes(const rbf_component *c)
{
	return c->mesh.symmetry == RBF_ISOTROPIC ? c->dhr_steps + 1 : (c->dhr_steps + 1) * (c->dhr_steps + 2) / 2;
}

static inline uint32_t rbf_dhr_border_nodes(const rbf_component *c)
{
	return 4 * c->dhr_steps * (c->dhr_steps + 1);
}

/* The node of a triangle's lattice whose weights are (steps - p - q, p, q) / steps. */
static inline uint32_t rbf_dhr_lattice(uint32_t steps, uint32_t p, uint32_t q)
{
	return q * (steps + 1) - (q * q - q) / 2 + p;
}

/* Weights of nodes 0, 1 and 2 of a quadratic piece, t in [0, 2]. */
static inline void rbf_quadratic(float t, float weight[3])
{
	weight[0] = .5f * (t - 1) * (t - 2);
	weight[1] = t * (2 - t);
	weight[2] = .5f * t * (t - 1);
}

/* A point beyond a border: `around` in [0, 4), `out` in [0, 1] (0: the arc, 1: the horizon). */
typedef struct rbf_dhr_polar { float around, out; } rbf_dhr_polar;

/* The direction of a point, and the weights of the border's ends at the nearest point of its arc. */
void rbf_dhr_beyond_direction(const rbf_mesh *mesh, uint32_t border, rbf_dhr_polar point, float weight[2], float direction[3]);

/* The line of points with the same `around`: weights of the arc's ends where it starts, and its unit direction there (along
 * the arc's outward normal if `around` < 1). Returns its length, up to the horizon. */
float rbf_dhr_line(const rbf_mesh *mesh, uint32_t border, float around, float weight[2], float direction[3]);

/* Values of the table, times max(cos, RBF_DHR_Z), inside an element. */
void rbf_dhr_inside(const rbf_component *component, uint32_t element, const float weight[3], float value[3]);

/* DHR at an incident direction (unit, z > 0, not folded) that is found inside the mesh at once; 0: look further. */
int rbf_dhr_quick(const rbf_component *component, const float incident[3], float value[3]);

/* What the table holds for a direction beyond a border. */
typedef struct rbf_dhr_edge {
	float value[3]; /* times max(cos, RBF_DHR_Z) */
	float edge[3];  /* the same at the nearest point of the border */
	float z;        /* of that point */
	float trend;    /* by how much ln DHR should have changed since there, as far as the incidences within tell (trend.h) */
} rbf_dhr_edge;

/* weight: of the border's ends at the nearest point of its arc (rbf_mesh_locate()). */
void rbf_dhr_outside(const rbf_component *component, uint32_t border, const float weight[2], const float direction[3], rbf_dhr_edge *at);
#endif
