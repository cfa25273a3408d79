/* SPDX-License-Identifier: BSD-3-Clause */
/* How far two exitant distributions are apart. */
#ifndef RBF_DIFFERENCE_H
#define RBF_DIFFERENCE_H
#include "lobes.h"

/* Integral of |a - b'| over the hemisphere, over half that of a + b'; luminance. b' is b as seen by the rotation or mirror operation `turn`, rows,
 * that takes directions of a to those of b; NULL: none. lambertian: luminance of the Lambertian part that both share (it counts in the
 * denominator); more: of what b has beyond that, or, if negative, a; it does not turn. 0 if both are empty. */
float rbf_difference(const rbf_lobes *a, const rbf_lobes *b, const float turn[9], float lambertian, float more);

/* Where the two may be compared: at directions of a, and what they are of b. */
typedef struct rbf_compared {
	int (*both)(const void *user, const float of_a[3], const float of_b[3]);
	const void *user;
	float share; /* of the hemisphere */
} rbf_compared;

/* The same of these directions alone; NULL: all. */
float rbf_difference_where(const rbf_lobes *a, const rbf_lobes *b, const float turn[9], float lambertian, float more, const rbf_compared *where);
#endif
