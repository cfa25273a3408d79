/* SPDX-License-Identifier: BSD-3-Clause */
/* What a build has to know of its sets before it integrates them (integrate.h). */
#ifndef RBF_BANDS_H
#define RBF_BANDS_H
#include "map.h"

/* Fills in set.sent and set.band of a component whose mesh, lobes and shifts are there. Returns 0, or -1 when out of memory. */
int rbf_bands_make(rbf_component *component);
#endif
