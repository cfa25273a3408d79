/* SPDX-License-Identifier: BSD-3-Clause */
/* Farthest-point order: each point is the one farthest from all before it (Gonzalez 1985). */
#ifndef RBF_FARTHEST_H
#define RBF_FARTHEST_H
#include <stddef.h>
#include <stdint.h>

/* The squared distance of point i from a chosen one counts times density[i]^2. Starts at the largest density; of equals, the first.
 * Quick where points that follow each other are near each other. order: room for `most`. Returns how many: fewer than `most` where
 * only duplicates are left; -1 when out of memory. */
ptrdiff_t rbf_farthest(size_t count, const float (*point)[3], const float *density, size_t most, uint32_t *order);
#endif
