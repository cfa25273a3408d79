/* SPDX-License-Identifier: BSD-3-Clause */
/* Light between incidences tuned to the DHR that the incidences around expect there. */
#ifndef RBF_TUNE_H
#define RBF_TUNE_H
#include "label.h"

/* What DHR should be over what it is, within what is believed. */
double rbf_tune_ratio(double expected, double is);

/* component->tune, of one that has its tables of draws, but none of DHR. slopes: as for levels (levels.h). Opens OpenMP regions. Returns 0, or -1
 * when out of memory. */
int rbf_tune_make(const rbf_fitted *fitted, int slopes, rbf_component *component);
#endif
