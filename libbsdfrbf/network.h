/* SPDX-License-Identifier: BSD-3-Clause */
/* What is known at the measured incidences, between them: a smooth surface over the mesh, on a chain the natural cubic spline. */
#ifndef RBF_NETWORK_H
#define RBF_NETWORK_H
#include "mesh.h"

/* What is known at a measured incidence. */
typedef struct rbf_knot {
	float value;
	float slope[3]; /* tangential, per radian, in the base's coordinates */
} rbf_knot;

/* Knots with the slopes that let the mesh's edges, as cubics of the angle, bend least: [bases], to be freed. value: [bases]. NULL: out of memory. */
rbf_knot *rbf_network_make(const rbf_mesh *mesh, const float value[]);

/* The value where a site has such corners: knots and directions of the vertices, weights that sum to 1. */
float rbf_network_between(uint32_t corners, const rbf_knot knot[], const rbf_vertex vertex[], const float weight[]);
#endif
