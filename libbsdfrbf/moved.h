/* SPDX-License-Identifier: BSD-3-Clause */
/* How far two incidences are apart, where a beam moves with the incident direction. */
#ifndef RBF_MOVED_H
#define RBF_MOVED_H
#include "difference.h"

enum { RBF_MOVED = 3 }; /* ways in which it may: as the surface has it, or with the mirrored or the incident direction */

/* rbf_difference_where() of a and b in each of these ways. image: rows of a rotation about the normal or a mirror operation that
 * comes first; from, to: what it makes of a's incident direction, and b's. lambertian, more, where: as there. */
void rbf_moved_difference(const rbf_lobes *a, const rbf_lobes *b, const float image[9], const float from[3], const float to[3], float lambertian,
	float more, const rbf_compared *where, float difference[RBF_MOVED]);

/* The same of an image by a mirror operation (mesh.h) of a, at incident direction d, in the way that makes the least of it. */
float rbf_moved_mirrored(const rbf_lobes *a, const float d[3], unsigned op, const rbf_lobes *b, const float to[3], float lambertian,
	float more, const rbf_compared *where);
#endif
