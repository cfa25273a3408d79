/* SPDX-License-Identifier: BSD-3-Clause */
/* Light between incidences tuned to the DHR that the incidences around expect there. */
#ifndef RBF_TUNE_H
#define RBF_TUNE_H
#include "label.h"
#include "network.h"

/* DHR that is expected where a site has such corners: their knots, or NULL: by the levels of what arrives from them. */
double rbf_tune_expected(uint32_t corners, const rbf_level level[], const rbf_knot knot[], const rbf_vertex vertex[], const float weight[]);

/* What DHR should be over what it is, within what is believed. */
double rbf_tune_ratio(double expected, double is);

/* DHR without the Lambertian part, of such roots (levels.h): [bases], to be freed. NULL: out of memory. */
float *rbf_tune_arrived(uint32_t bases, const float root[]);

/* component->tune, of one that has its bands (bands.h), but no table of DHR. how: as choice->tune (left_out.h). Opens OpenMP regions. Returns 0, or -1
 * when out of memory. */
int rbf_tune_make(const rbf_fitted *fitted, int how, rbf_component *component);
#endif
