/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a corner takes over from another one, whose mapped direction is lower and not valid (map.h): its share is above 1 there. */
#ifndef RBF_TAKEOVER_H
#define RBF_TAKEOVER_H
#include "map.h"
#include "mesh.h"

/* Two vertices that are corners of the same sites. */
typedef struct rbf_neighbour {
	float k[3], l[3];  /* of the one that may take over, and of the other */
	uint32_t op;       /* operation that takes the first one's measured direction to k */
	float twist;       /* at most: angle by which the way k, site, l turns more than the way k, l */
} rbf_neighbour;

/* A lower bound of the angle, rad, from a direction at k (`centre`, in the base's coordinates) to the nearest one where k takes over from l;
 * INFINITY: nowhere. No site need be known: what is seen from k and l differs by what moves from k to l. */
float rbf_takeover_angle(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float centre[3]);

/* All that a base's vertices have in the mesh, corners of the same element or ends of the same border, each once: those of base b are of[first[b]] to
 * of[first[b + 1] - 1]. */
typedef struct rbf_neighbours {
	uint32_t *first;
	rbf_neighbour *of;
} rbf_neighbours;

/* Returns 0, or -1 when out of memory; to be freed in either case. */
int rbf_neighbours_find(const rbf_mesh *mesh, rbf_neighbours *neighbours);
void rbf_neighbours_free(rbf_neighbours *neighbours);
#endif
