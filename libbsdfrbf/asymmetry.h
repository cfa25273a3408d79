/* SPDX-License-Identifier: BSD-3-Clause */
/* Does the material have the symmetry that its scan plan claims? */
#ifndef RBF_ASYMMETRY_H
#define RBF_ASYMMETRY_H
#include "label.h"
#include "seen.h"

typedef struct rbf_asymmetry {
	float mean;      /* over all such incidences and operations, < 0: there are none */
	float worst;
	uint32_t base;   /* where */
} rbf_asymmetry;

/* Relative L1 between exitant distributions and the images of others, at incidences that a symmetry maps onto each other, as on the
 * two sides of a mirror axis, or onto themselves, as on that axis and at the normal. lambertian: luminance of the Lambertian part (it
 * counts in the denominator). seen: [bases], or NULL: all was measured; else what counts is where both were, if that is much. Returns 0, or -1 when
 * out of memory. */
int rbf_asymmetry_of(const rbf_fitted *fitted, rbf_symmetry symmetry, float lambertian, const rbf_seen *seen, rbf_asymmetry *found);
#endif
