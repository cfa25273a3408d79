/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef RBF_SPIRAL_H
#define RBF_SPIRAL_H
#include "vector.h"

/* Direction n of as many, each for the same solid angle of the hemisphere, a golden angle apart. */
static inline void rbf_spiral(int n, int of, float q[3])
{
	const double z = 1 - (n + .5) / of, r = sqrt(1 - z*z), phi = 2 * RBF_PI * fmod(n * .6180339887498949, 1);
	q[0] = (float)(r * cos(phi));
	q[1] = (float)(r * sin(phi));
	q[2] = (float)z;
}
#endif
