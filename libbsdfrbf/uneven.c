/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * DHR of a chain's incidences has a second divided difference at each of them. Where the material is smooth for how far they are apart, those at both ends
 * of a segment are alike, or change as before, and the two parabolas meet in its middle. Where light falls steeply and then no more, they do not, and nothing
 * tells which one is right, or how far from both the truth is. Beyond the last but one there is no other: the segment before tells.
 */
#include "uneven.h"

enum { LEAST = 4 }; /* vertices: else there are too few images */
static const float GUESS = .5f; /* of what the segment before tells */

/* Of a chain's vertex; those before the first are mirror images, and so may that be. */
static float angle_of(const rbf_mesh *mesh, int64_t v, const float light[], float *value)
{
	const rbf_vertex *at = &mesh->vertex[v >= 0 ? v : (mesh->vertex[0].direction[0] < 0) - v];
	*value = light[at->base];
	return (v < 0 ? -1.f : 1.f) * atan2f(at->direction[0], at->direction[2]);
}

/* Second derivative at a vertex, as those next to it tell. */
static float bend_at(const rbf_mesh *mesh, int64_t v, const float light[])
{
	float value[3], angle[3];
	for (int n = 0; n < 3; n++)
		angle[n] = angle_of(mesh, v + n - 1, light, &value[n]);
	return 2 * ((value[2] - value[1]) / (angle[2] - angle[1]) - (value[1] - value[0]) / (angle[1] - angle[0])) / (angle[2] - angle[0]);
}

/* By how much second derivatives at both ends of a segment differ, or that of one from what the two before it lead to, if that is less. */
static float bends_apart(const rbf_mesh *mesh, int64_t first, const float light[])
{
	const float here = bend_at(mesh, first, light), there = bend_at(mesh, first + 1, light);
	float apart = fminf(fabsf(there - here), fabsf(there - 2 * here + bend_at(mesh, first - 1, light)));
	if (first + 3 < mesh->vertices)
		apart = fminf(apart, fabsf(here - 2 * there + bend_at(mesh, first + 2, light)));
	return apart;
}

void rbf_uneven(const rbf_mesh *mesh, const float light[], float unknown[])
{
	for (uint32_t e = 0; e < mesh->elements; e++) {
		unknown[e] = 0;
		if (mesh->symmetry != RBF_ISOTROPIC || mesh->vertices < LEAST)
			continue;
		const int64_t first = mesh->element[e].v[0], inner = first + 2 < mesh->vertices ? first : first - 1;
		float value[2];
		const float from = angle_of(mesh, first, light, &value[0]), width = angle_of(mesh, first + 1, light, &value[1]) - from;
		const float apart = (inner < first ? GUESS : 1) * bends_apart(mesh, inner, light) * width * width / 8, mean = .5f * (value[0] + value[1]);
		unknown[e] = mean > apart ? apart / mean : 1;
	}
}
