/* SPDX-License-Identifier: BSD-3-Clause */
/* Between the files that build a mesh. */
#ifndef RBF_MESH_BUILD_H
#define RBF_MESH_BUILD_H
#include "mesh.h"
#include "vector3.h"

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

/* Flips diagonals that directions leave open (mesh_diagonals.c) where the judge says so. Errors: MEMORY. */
bsdfrbf_status rbf_mesh_diagonals(bsdfrbf_context *context, const rbf_mesh *mesh, const double (*direction)[3], size_t triangles,
	rbf_triangle *triangle, rbf_mesh_judge *judge, void *data);

/* Fills the locator from vertex, element and border. used[i] is set if some cell lists border i. */
bsdfrbf_status rbf_mesh_grid(bsdfrbf_context *context, rbf_mesh *mesh, unsigned char *used);
#endif
