/* SPDX-License-Identifier: BSD-3-Clause */
/* The quick part of rbf_mesh_locate(): most directions are in one of the first two elements of their cell. */
#ifndef RBF_MESH_INSIDE_H
#define RBF_MESH_INSIDE_H
#include "lanes.h"
#include "mesh_bounds.h"

static inline uint32_t rbf_mesh_column(float coordinate)
{
	const float t = (coordinate + 1) * (RBF_MESH_GRID / 2), low = rbf_max(t, 0); /* 0 also for what is not a number */
	return (uint32_t)(int32_t)rbf_min(low, RBF_MESH_GRID - .5f);
}

/* The locator's cell of a direction. */
static inline __attribute__((always_inline)) uint32_t rbf_mesh_cell(const rbf_mesh *mesh, const float d[3], float *theta)
{
	float disc[2];
	if (mesh->symmetry == RBF_ISOTROPIC) {
		*theta = rbf_polar_angle(d);
		const uint32_t column = rbf_mesh_column(*theta * (float)(2 / RBF_PI)), middle = RBF_MESH_GRID / 2;
		return column > middle ? column - middle : 0;
	}
	rbf_disc_from_direction(d, disc);
	return rbf_mesh_column(disc[1]) * RBF_MESH_GRID + rbf_mesh_column(disc[0]);
}

/* The one of two segments that holds an angle, with weights, or RBF_MESH_NO_ELEMENT. */
static inline __attribute__((always_inline)) uint32_t rbf_mesh_segment(const rbf_mesh *mesh, uint32_t one, uint32_t two, float theta,
	float weight[3])
{
	const rbf_element *a = &mesh->element[one], *b = &mesh->element[two];
	const float ta = (theta - a->inverse[0][0]) * a->inverse[0][1], tb = (theta - b->inverse[0][0]) * b->inverse[0][1];
	const float lowest_a = rbf_min(ta, 1 - ta), lowest_b = rbf_min(tb, 1 - tb);
	const int other = lowest_b > lowest_a;
	weight[1] = other ? tb : ta;
	weight[0] = 1 - weight[1];
	weight[2] = 0;
	return (other ? lowest_b : lowest_a) >= 0 ? other ? two : one : RBF_MESH_NO_ELEMENT;
}

/* The same of two triangles. Which it is cannot be foreseen: numbers of both are side by side in lanes, as compilers make branches of
 * choices between single ones. */
static inline __attribute__((always_inline)) uint32_t rbf_mesh_triangle(const rbf_mesh *mesh, uint32_t one, uint32_t two, const float d[3],
	float weight[3])
{
	const rbf_element *a = &mesh->element[one], *b = &mesh->element[two];
	const float a0 = rbf_dot(a->inverse[0], d), a1 = rbf_dot(a->inverse[1], d), a2 = rbf_dot(a->inverse[2], d);
	const float b0 = rbf_dot(b->inverse[0], d), b1 = rbf_dot(b->inverse[1], d), b2 = rbf_dot(b->inverse[2], d);
	const float lowest_a = rbf_min(rbf_min(a0, a1), a2), lowest_b = rbf_min(rbf_min(b0, b1), b2);
	const rbf_lane_mask other = rbf_lanes_all(lowest_b) > rbf_lanes_all(lowest_a);
	const rbf_lanes w = rbf_lanes_select(other, (rbf_lanes){b0, b1, b2, lowest_b}, (rbf_lanes){a0, a1, a2, lowest_a});
	const float scale = 1 / (w[0] + w[1] + w[2]);
	for (int k = 0; k < 3; k++)
		weight[k] = w[k] * scale;
	const uint32_t item = one ^ ((one ^ two) & (uint32_t)other[0]);
	return (w[3] >= 0) & (scale > 0) & (scale < INFINITY) ? item : RBF_MESH_NO_ELEMENT;
}

/* As rbf_mesh_locate() without the corners, or RBF_MESH_NO_ELEMENT: look further. */
static inline __attribute__((always_inline)) uint32_t rbf_mesh_inside(const rbf_mesh *mesh, const float d[3], float weight[3])
{
	float theta = 0;
	uint32_t first, last;
	rbf_bound_cell(mesh, rbf_mesh_cell(mesh, d, &theta), &first, &last);
	if (first == last)
		return RBF_MESH_NO_ELEMENT;
	const uint32_t one = mesh->cell_element[first], next = mesh->cell_element[first + (first + 1 < last)];
	if (one >= mesh->elements)
		return RBF_MESH_NO_ELEMENT;
	const uint32_t two = next < mesh->elements ? next : one;
	return mesh->symmetry == RBF_ISOTROPIC ? rbf_mesh_segment(mesh, one, two, theta, weight) : rbf_mesh_triangle(mesh, one, two, d, weight);
}
#endif
