/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Maps ("frames"): how an exitant direction at one incidence corresponds to one at another.
 * A new map joins here: an id, a name, and a case in the functions below. All vectors are in the component's
 * half space, z >= 0 for incident and exitant ones alike.
 */
#ifndef RBF_MAP_H
#define RBF_MAP_H
#include "vector.h"

enum rbf_map {
	RBF_MAP_FIXED = 0,  /* o' = o: diffuse part, fixed exits */
	RBF_MAP_MIRROR = 1, /* smallest rotation from D i to D k, D = diag(-,-,+): specular, straight through */
	RBF_MAP_XFLIP = 2,  /* D = diag(+,-,+) */
	RBF_MAP_YFLIP = 3,  /* D = diag(-,+,+) */
	RBF_MAP_RETRO = 4,  /* D = identity: retro-reflection */
	RBF_MAP_HALF = 5,   /* same half vector: facets; density factor cos k / cos i */
	RBF_MAP_SHIFT = 6,  /* tangential components shift with the source; f is carried unchanged */
	RBF_MAPS = 7
};

static const char *const rbf_map_name[RBF_MAPS] = {"fixed", "mirror", "x-flip", "y-flip", "retro", "half", "shift"};
