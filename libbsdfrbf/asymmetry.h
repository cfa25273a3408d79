/* SPDX-License-Identifier: BSD-3-Clause */
/* Does the material have the symmetry that its scan plan claims? */
#ifndef RBF_ASYMMETRY_H
#define RBF_ASYMMETRY_H
#include "label.h"

/* Relative L1 between exitant distributions and their images, at incidences that the symmetry maps onto themselves: those
 * on a mirror axis, and the normal. *mean: over these incidences and operations, < 0: there are none. *worst, *base: the
 * largest, and where. lambertian: luminance of the Lambertian part (it counts in the denominator). */
void rbf_asymmetry(const rbf_fitted *fitted, float lambertian, float *mean, float *worst, uint32_t *base);
#endif
