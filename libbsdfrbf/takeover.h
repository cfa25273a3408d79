/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a corner takes over from another one, whose mapped direction is lower and not valid (map.h): its share is above 1 there. */
#ifndef RBF_TAKEOVER_H
#define RBF_TAKEOVER_H
#include "map.h"

/* Two corners of the same sites. */
typedef struct rbf_neighbour {
	float k[3], l[3];  /* of the one that may take over, and of the other */
	float twist;       /* at most: angle by which the way k, site, l turns more than the way k, l */
} rbf_neighbour;

/* A lower bound of the angle, rad, from a direction at k to the nearest one where k takes over from l; INFINITY: nowhere. No site need be
 * known: what is seen from k and l differs by what moves from k to l. enough: beyond that, any. */
float rbf_takeover_angle(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float at[3], float enough);
#endif
