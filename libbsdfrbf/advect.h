/* SPDX-License-Identifier: BSD-3-Clause */
/* Residual motion: what mass transport says of the lobes after the frames have aligned two incidences. */
#ifndef RBF_ADVECT_H
#define RBF_ADVECT_H
#include "label.h"

/* Motion of base `from`'s lobes towards vertex `to`, in the base's coordinates: motion[count of its lobes][3], a
 * chord that, added to the centre whole, carries the lobe to its partners' mean. frame and label as from rbf_label().
 * cap: largest motion as a share of the angle between the two incidences (and at least 6 degrees). *mean: energy-weighted
 * mean length, radians. Returns 0, or -1 when out of memory. Thread-safe. */
int rbf_advect(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], const float *label, uint32_t from,
	const rbf_vertex *to, float cap, float (*motion)[3], float *mean);
#endif
