/* SPDX-License-Identifier: BSD-3-Clause */
/* Between the files that build a mesh. */
#ifndef RBF_MESH_BUILD_H
#define RBF_MESH_BUILD_H
#include "mesh.h"

/* Directions closer than this are one (radians): finer than a goniophotometer positions its sample. */
#define RBF_MESH_SAME 1e-4

/* A triangle of the whole hull, counter-clockwise from outside. */
typedef struct rbf_triangle {
	uint32_t v[3];
	int32_t neighbour[3]; /* across the side opposite to v[k]; -1: the rim */
} rbf_triangle;

/* Triangles of the convex hull of `count` unit vectors (z >= 0) as seen from the origin, with neighbours, less
 * what cannot carry barycentric weights. *triangles is malloc'ed, NULL if there are none. */
bsdfrbf_status rbf_hull(bsdfrbf_context *context, size_t count, const double (*direction)[3],
	size_t *triangles, rbf_triangle **triangle);

/* Fills the locator from vertex, element and border. used[i] is set if some cell lists border i. */
bsdfrbf_status rbf_mesh_grid(bsdfrbf_context *context, rbf_mesh *mesh, unsigned char *used);

static inline double rbf_dot3(const double a[3], const double b[3])
{
	return a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
}

static inline void rbf_cross3(const double a[3], const double b[3], double out[3])
{
	const double x = a[1]*b[2] - a[2]*b[1], y = a[2]*b[0] - a[0]*b[2], z = a[0]*b[1] - a[1]*b[0];
	out[0] = x;
	out[1] = y;
	out[2] = z;
}

/* Angle to the normal. */
static inline double rbf_theta3(const double a[3])
{
	return atan2(hypot(a[0], a[1]), fmax(a[2], 0));
}

/* Normalises; returns the former length. */
static inline double rbf_unit3(double a[3])
{
	const double length = sqrt(rbf_dot3(a, a));
	if (length > 0)
		for (int i = 0; i < 3; i++)
			a[i] /= length;
	return length;
}
#endif
