/* SPDX-License-Identifier: BSD-3-Clause */
/* Where an incident direction lies in the mesh. Renderers ask this for every new incidence. */
#include "clones.h"
#include "lanes.h"
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

static inline __attribute__((always_inline)) rbf_lanes dot(const rbf_lanes a[3], const rbf_lanes b[3])
{
	return a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
}

/* The first lane that is as large as any. */
static inline __attribute__((always_inline)) uint32_t first_largest(rbf_lanes v)
{
	const rbf_lanes pairs = rbf_lanes_max(v, (rbf_lanes){v[1], v[0], v[3], v[2]});
	const rbf_lane_mask large = v >= rbf_lanes_max(pairs, (rbf_lanes){pairs[2], pairs[3], pairs[0], pairs[1]});
	return large[0] ? 0 : large[1] ? 1 : large[2] ? 2 : 3;
}

/* One component of four borders' ends as rows of lanes: x, y, z. */
static inline __attribute__((always_inline)) void ends_of(const rbf_mesh *mesh, const uint32_t border[4], int end, rbf_lanes out[4])
{
	for (int i = 0; i < 4; i++) /* with what follows the direction: a vertex is longer than four numbers */
		out[i] = rbf_lanes_load(mesh->vertex[rbf_bound_vertex(mesh, mesh->border[border[i]][end])].direction);
	rbf_lanes_transpose(out);
}

/* The nearest points of the arcs from a to b: the direction's projection onto the arc's plane, p ~ u a + v b, or an end.
 * With e = b - a and q = |e|^2 / 2 = 1 - a.b the coefficients are u = q (d.b) - d.e and v = q (d.a) + d.e up to a common
 * factor. Written with differences of directions, which are exact, they stay accurate on short arcs: the lengths of rounded unit
 * vectors differ by more than a direction's way along an arc of .1 degrees. The same goes for the way across, (d - a).n with n = e x a.
 * Which border is nearest, and whether at an end, cannot be foreseen: four at once, and nothing branches on it. */
static inline __attribute__((always_inline)) void try_borders(const rbf_mesh *mesh, const uint32_t border[4], const float d[3], place *best)
{
	rbf_lanes a[4], b[4], e[3], from_a[3], from_b[3], n[3];
	ends_of(mesh, border, 0, a);
	ends_of(mesh, border, 1, b);
	for (int i = 0; i < 3; i++) {
		e[i] = b[i] - a[i];
		from_a[i] = d[i] - a[i];
		from_b[i] = d[i] - b[i];
	}
	for (int i = 0; i < 3; i++)
		n[i] = e[(i + 1) % 3] * a[(i + 2) % 3] - e[(i + 2) % 3] * a[(i + 1) % 3];
	const rbf_lanes zero = rbf_lanes_all(0), one = rbf_lanes_all(1);
	const rbf_lanes half_q = .25f * dot(e, e), da = dot(from_a, from_a), db = dot(from_b, from_b);
	const rbf_lanes u = -dot(from_b, e) - half_q * db, v = dot(from_a, e) - half_q * da;
	/* square of the chord, 2 (1 - cos) with sin = across / |n| */
	const rbf_lanes across = dot(from_a, n), square = across * across, n2 = dot(n, n);
	const rbf_lanes chord2 = 2 * square / (n2 + rbf_lanes_sqrt(n2 * rbf_lanes_max(n2 - square, zero)));
	const rbf_lane_mask between = (u > zero) & (v > zero), at_a = da <= db;
	const rbf_lanes quality = -rbf_lanes_select(between, chord2, rbf_lanes_min(da, db));
	float far[4], weight[2][4];
	rbf_lanes_store(far, quality);
	rbf_lanes_store(weight[0], rbf_lanes_select(between, u, rbf_lanes_select(at_a, one, zero)));
	rbf_lanes_store(weight[1], rbf_lanes_select(between, v, rbf_lanes_select(at_a, zero, one)));
	const uint32_t which = first_largest(quality);
	if (far[which] > best->quality)
		*best = (place){RBF_MESH_BORDER | border[which], far[which], {weight[0][which], weight[1][which], 0}};
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
	for (uint32_t i = 0; i < mesh->borders; i += 4) {
		uint32_t four[4];
		for (uint32_t k = 0; k < 4; k++)
			four[k] = i + k < mesh->borders ? i + k : mesh->borders - 1;
		try_borders(mesh, four, d, border);
	}
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
	for (; k < last; k += 4) {
		uint32_t four[4];
		for (uint32_t n = 0; n < 4; n++)
			four[n] = rbf_bound(mesh->cell_element[k + n < last ? k + n : last - 1] & ~RBF_MESH_BORDER, mesh->borders);
		try_borders(mesh, four, d, &border);
	}
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
