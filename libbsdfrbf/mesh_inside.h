/* SPDX-License-Identifier: BSD-3-Clause */
/* The quick part of rbf_mesh_locate(): most directions are in one of the first two elements of their cell. */
#ifndef RBF_MESH_INSIDE_H
#define RBF_MESH_INSIDE_H
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

/* As rbf_mesh_locate() without the corners, or RBF_MESH_NO_ELEMENT: look further. Which of the two elements it is cannot be foreseen,
 * so that nothing branches on it. */
static inline __attribute__((always_inline)) uint32_t rbf_mesh_inside(const rbf_mesh *mesh, const float d[3], float weight[3])
{
	float theta = 0, w0, w1, w2, scale, lowest;
	uint32_t first, last;
	rbf_bound_cell(mesh, rbf_mesh_cell(mesh, d, &theta), &first, &last);
	if (first == last)
		return RBF_MESH_NO_ELEMENT;
	const uint32_t one = mesh->cell_element[first], next = mesh->cell_element[first + 1 < last ? first + 1 : first];
	if (one >= mesh->elements)
		return RBF_MESH_NO_ELEMENT;
	const uint32_t two = next < mesh->elements ? next : one;
	const rbf_element *a = &mesh->element[one], *b = &mesh->element[two];
	int other;
	if (mesh->symmetry == RBF_ISOTROPIC) {
		const float ta = (theta - a->inverse[0][0]) * a->inverse[0][1], tb = (theta - b->inverse[0][0]) * b->inverse[0][1];
		const float lowest_a = rbf_min(ta, 1 - ta), lowest_b = rbf_min(tb, 1 - tb);
		other = lowest_b > lowest_a;
		w1 = other ? tb : ta;
		w0 = 1 - w1;
		w2 = 0;
		lowest = other ? lowest_b : lowest_a;
		scale = 1;
	} else {
		const float a0 = rbf_dot(a->inverse[0], d), a1 = rbf_dot(a->inverse[1], d), a2 = rbf_dot(a->inverse[2], d);
		const float b0 = rbf_dot(b->inverse[0], d), b1 = rbf_dot(b->inverse[1], d), b2 = rbf_dot(b->inverse[2], d);
		const float lowest_a = rbf_min(rbf_min(a0, a1), a2), lowest_b = rbf_min(rbf_min(b0, b1), b2);
		other = lowest_b > lowest_a;
		w0 = other ? b0 : a0;
		w1 = other ? b1 : a1;
		w2 = other ? b2 : a2;
		lowest = other ? lowest_b : lowest_a;
		scale = 1 / (w0 + w1 + w2);
	}
	weight[0] = w0 * scale;
	weight[1] = w1 * scale;
	weight[2] = w2 * scale;
	return (lowest >= 0) & (scale > 0) & (scale < INFINITY) ? other ? two : one : RBF_MESH_NO_ELEMENT;
}
#endif
