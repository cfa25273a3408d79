/* SPDX-License-Identifier: BSD-3-Clause */
/* Values at the ends of what a detector, or the numbers it writes, can tell. */
#ifndef RBF_DETECTOR_LIMITS_H
#define RBF_DETECTOR_LIMITS_H
#include "measure.h"

typedef struct rbf_limits {
	size_t clipped, incidences, first; /* samples that share the highest DSF of all, as saturated ones do, at so many incidences, the first of which is this one */
	size_t lowest, samples;            /* samples that share the lowest DSF above zero of their incidence, of so many */
} rbf_limits;

/* What a few samples share by chance does not count. */
rbf_limits rbf_limits_of(const rbf_measured *measured, int channels);
#endif
