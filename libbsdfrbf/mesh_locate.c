/* SPDX-License-Identifier: BSD-3-Clause */
/* Where an incident direction lies in the mesh. Renderers ask this for every new incidence. */
#include "clones.h"
#include "mesh_inside.h"

/* Directions this far beside an element are on its edge but for rounding, rad. */
static const float ROUNDING = 5e-7f;

typedef struct place {
	uint32_t item;    /* element, or border with RBF_MESH_BORDER */
	float quality;    /* element: smallest weight; border: minus the squared distance. The larger the better */
	float weight[3];
} place;

static inline __attribute__((always_inline)) int on_edge(const rbf_mesh *mesh, const place *p)
{
	if (!(p->quality > -INFINITY))
		return 0;
	const rbf_element *e = &mesh->element[p->item];
	int on = 1;
	for (int k = 0; k < 3; k++) {
		const float rise = mesh->symmetry == RBF_ISOTROPIC ? e->inverse[0][1] : sqrtf(rbf_dot(e->inverse[k], e->inverse[k]));
		on &= p->weight[k] >= -ROUNDING * rise; /* in thin triangles weights change quickly with the direction */
	}
	return on;
}

/* Weights in an element, normalised but not clipped. */
static inline __attribute__((always_inline)) void try_element(const rbf_mesh *mesh, uint32_t index, const float d[3], place *best)
{
	const rbf_element *e = &mesh->element[index];
	const float w0 = rbf_dot(e->inverse[0], d), w1 = rbf_dot(e->inverse[1], d), w2 = rbf_dot(e->inverse[2], d);
	const float sum = w0 + w1 + w2, lowest = rbf_min(rbf_min(w0, w1), w2);
	if (!(sum > 0) || !(lowest > best->quality * sum))
		return;
	const float scale = 1 / sum;
	*best = (place){ index, lowest * scale, { w0 * scale, w1 * scale, w2 * scale } };
}

static inline __attribute__((always_inline)) void try_segment(const rbf_mesh *mesh, uint32_t index, float theta, place *best)
{
	const rbf_element *e = &mesh->element[index];
	const float t = (theta - e->inverse[0][0]) * e->inverse[0][1];
	const float quality = rbf_min(t, 1 - t);
	if (quality > best->quality)
		*best = (place){ index, quality, { 1 - t, t, 0 } };
}

/* The nearest point of the arc from a to b: the direction's projection onto the arc's plane, p ~ u a + v b, or an end.
 * With e = b - a and q = |e|^2 / 2 = 1 - a.b the coefficients are u = q (d.b) - d.e and v = q (d.a) + d.e up to a common
 * factor. Written with differences of directions, which are exact, they stay accurate on short arcs: the lengths of rounded unit
 * vectors differ by more than a direction's way along an arc of .1 degrees. The same goes for the way across, (d - a).n with n = e x a.
 * Which border is nearest, and whether at an end, cannot be foreseen: nothing branches on it. */
static inline __attribute__((always_inline)) void try_border(const rbf_mesh *mesh, uint32_t index, const float d[3], place *best)
{
	const float *a = mesh->vertex[rbf_bound_vertex(mesh, mesh->border[index][0])].direction;
	const float *b = mesh->vertex[rbf_bound_vertex(mesh, mesh->border[index][1])].direction;
	const float e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
	const float from_a[3] = {d[0] - a[0], d[1] - a[1], d[2] - a[2]}, from_b[3] = {d[0] - b[0], d[1] - b[1], d[2] - b[2]};
	float n[3];
	rbf_cross(e, a, n);
	const float half_q = .25f * rbf_dot(e, e), da = rbf_dot(from_a, from_a), db = rbf_dot(from_b, from_b);
	const float u = -rbf_dot(from_b, e) - half_q * db, v = rbf_dot(from_a, e) - half_q * da;
	/* square of the chord, 2 (1 - cos) with sin = across / |n| */
	const float across = rbf_dot(from_a, n), square = across * across, n2 = rbf_dot(n, n);
	const float chord2 = 2 * square / (n2 + sqrtf(n2 * rbf_max(n2 - square, 0)));
	const int between = (u > 0) & (v > 0), at_a = da <= db;
	const float quality = between ? -chord2 : at_a ? -da : -db;
	const int nearer = quality > best->quality;
	best->item = nearer ? RBF_MESH_BORDER | index : best->item;
	best->quality = nearer ? quality : best->quality;
	best->weight[0] = nearer ? between ? u : (float)at_a : best->weight[0];
	best->weight[1] = nearer ? between ? v : (float)!at_a : best->weight[1];
}

static inline __attribute__((always_inline)) uint32_t finish(const rbf_mesh *mesh, const place *best, uint32_t corner[3], float weight[3])
{
	float sum = 0;
	rbf_bound_corners(mesh, best->item, corner);
	for (int k = 0; k < 3; k++) {
		weight[k] = best->weight[k] > 0 ? best->weight[k] : 0;
		sum += weight[k];
	}
	const float scale = 1 / sum;
	for (int k = 0; k < 3; k++)
		weight[k] *= scale;
	return best->item;
}

/* Without the locator: for directions that are not in the fundamental domain, whose cells are empty. */
static inline __attribute__((always_inline)) void search_all(const rbf_mesh *mesh, const float d[3], float theta, place *element, place *border)
{
	for (uint32_t i = 0; i < mesh->elements; i++)
		if (mesh->symmetry == RBF_ISOTROPIC)
			try_segment(mesh, i, theta, element);
		else
			try_element(mesh, i, d, element);
	for (uint32_t i = 0; i < mesh->borders; i++)
		try_border(mesh, i, d, border);
}

/* Any direction, by all that its cell lists. */
static inline __attribute__((always_inline)) uint32_t search_cell(const rbf_mesh *mesh, const float d[3], float theta, uint32_t k, uint32_t last,
	uint32_t corner[3], float weight[3])
{
	const int isotropic = mesh->symmetry == RBF_ISOTROPIC;
	place element = { 0, -INFINITY, { 1, 0, 0 } }, border = { RBF_MESH_BORDER, -INFINITY, { 1, 0, 0 } };
	if (k == last)
		search_all(mesh, d, theta, &element, &border);
	for (; k < last; k++) {
		const uint32_t item = rbf_bound_entry(mesh, mesh->cell_element[k]);
		if (item & RBF_MESH_BORDER)
			break;
		if (isotropic)
			try_segment(mesh, item, theta, &element);
		else
			try_element(mesh, item, d, &element);
		if (element.quality >= 0)
			return finish(mesh, &element, corner, weight);
	}
	if (on_edge(mesh, &element))
		return finish(mesh, &element, corner, weight);
	for (; k < last; k++)
		try_border(mesh, rbf_bound_entry(mesh, mesh->cell_element[k] | RBF_MESH_BORDER) & ~RBF_MESH_BORDER, d, &border);
	if (border.quality > -INFINITY || !(element.quality > -INFINITY))
		return finish(mesh, &border, corner, weight);
	return finish(mesh, &element, corner, weight);
}

/* A direction that rbf_mesh_inside() does not find. */
RBF_CLONES static uint32_t search(const rbf_mesh *mesh, const float d[3], uint32_t corner[3], float weight[3])
{
	uint32_t first, last;
	float theta = 0;
	rbf_bound_cell(mesh, rbf_mesh_cell(mesh, d, &theta), &first, &last);
	return search_cell(mesh, d, theta, first, last, corner, weight);
}

uint32_t rbf_mesh_search(const rbf_mesh *mesh, const float d[3], uint32_t corner[3], float weight[3])
{
	return search(mesh, d, corner, weight);
}

RBF_CLONES static uint32_t inside(const rbf_mesh *mesh, const float d[3], float weight[3])
{
	return rbf_mesh_inside(mesh, d, weight);
}

uint32_t rbf_mesh_locate(const rbf_mesh *mesh, const float d[3], uint32_t corner[3], float weight[3])
{
	const uint32_t item = inside(mesh, d, weight);
	if (item == RBF_MESH_NO_ELEMENT)
		return search(mesh, d, corner, weight);
	rbf_bound_corners(mesh, item, corner);
	return item;
}
