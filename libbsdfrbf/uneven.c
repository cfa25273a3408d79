/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * DHR of a chain's incidences has a second divided difference at each of them. Where the material is smooth for how far they are apart, those at both ends
 * of a segment are alike, or change as before, and the two parabolas meet in its middle. Where light falls steeply and then no more, they do not, and nothing
 * tells which one is right, or how far from both the truth is. Beyond the last but one there is no other: the segment before tells.
 */
#include "uneven.h"

enum { LEAST = 4, BELOW = 3, ABOVE = 2 }; /* vertices: else there are too few images; how many are asked on either side of a segment */
static const float GUESS = .5f;  /* of what the segment before tells */
static const float NEAR = .25f;  /* of a segment's width: those that are nearer to each other tell of noise */

/* A segment's ends, at `first` and after it, and what lies on both sides of them. */
typedef struct around {
	int count, first;
	float angle[BELOW + 2 + ABOVE], value[BELOW + 2 + ABOVE];
} around;

/* Of a chain's vertex; those before the first are mirror images, and so may that be. */
static float angle_of(const rbf_mesh *mesh, int64_t v, const float light[], float *value)
{
	const rbf_vertex *at = &mesh->vertex[v >= 0 ? v : (mesh->vertex[0].direction[0] < 0) - v];
	*value = light[at->base];
	return (v < 0 ? -1.f : 1.f) * atan2f(at->direction[0], at->direction[2]);
}

static void look_around(const rbf_mesh *mesh, int64_t v, const float light[], around *a)
{
	const int64_t lowest = (mesh->vertex[0].direction[0] < 0) + 1 - (int64_t)mesh->vertices;
	float value[2], back[BELOW][2];
	const float ends[2] = {angle_of(mesh, v, light, &value[0]), angle_of(mesh, v + 1, light, &value[1])}, least = NEAR * (ends[1] - ends[0]);
	float last = ends[0], here;
	int below = 0;
	for (int64_t k = v - 1; k >= lowest && below < BELOW; k--) {
		const float angle = angle_of(mesh, k, light, &here);
		if (!(last - angle > least))
			continue;
		back[below][0] = last = angle;
		back[below++][1] = here;
	}
	a->count = 0;
	for (int n = below; n-- > 0; a->count++) {
		a->angle[a->count] = back[n][0];
		a->value[a->count] = back[n][1];
	}
	a->first = below;
	for (int n = 0; n < 2; n++, a->count++) {
		a->angle[a->count] = ends[n];
		a->value[a->count] = value[n];
	}
	last = ends[1];
	for (int64_t k = v + 2; k < mesh->vertices && a->count < below + 2 + ABOVE; k++) {
		const float angle = angle_of(mesh, k, light, &here);
		if (!(angle - last > least))
			continue;
		a->angle[a->count] = last = angle;
		a->value[a->count++] = here;
	}
}

/* Second derivative, as those next to it tell. */
static float bend_at(const around *a, int i)
{
	const float *x = a->angle + i - 1, *y = a->value + i - 1;
	return 2 * ((y[2] - y[1]) / (x[2] - x[1]) - (y[1] - y[0]) / (x[1] - x[0])) / (x[2] - x[0]);
}

/* By how much second derivatives at both ends of a segment differ, or that of one from what the two before it lead to, if that is less. */
static float bends_apart(const around *a, int i)
{
	if (i < 1 || i + 2 >= a->count)
		return 0;
	const float here = bend_at(a, i), there = bend_at(a, i + 1);
	float apart = fabsf(there - here);
	if (i > 1)
		apart = fminf(apart, fabsf(there - 2 * here + bend_at(a, i - 1)));
	if (i + 3 < a->count)
		apart = fminf(apart, fabsf(here - 2 * there + bend_at(a, i + 2)));
	return apart;
}

void rbf_uneven(const rbf_mesh *mesh, const float light[], float unknown[])
{
	for (uint32_t e = 0; e < mesh->elements; e++) {
		around a;
		unknown[e] = 0;
		if (mesh->symmetry != RBF_ISOTROPIC || mesh->vertices < LEAST)
			continue;
		look_around(mesh, mesh->element[e].v[0], light, &a);
		const int last = a.first + 2 == a.count;
		const float width = a.angle[a.first + 1] - a.angle[a.first], mean = .5f * (a.value[a.first] + a.value[a.first + 1]);
		const float apart = (last ? GUESS : 1) * bends_apart(&a, a.first - last) * width * width / 8;
		unknown[e] = mean > apart ? apart / mean : 1;
	}
}
