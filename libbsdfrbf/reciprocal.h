/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A transmission side that was not measured: f(a, b) = f(b, a). Evaluation just swaps the vectors; to integrate and to sample
 * over the measured component's incident directions, with its exitant direction fixed, a table is made for the direction asked.
 */
#ifndef RBF_RECIPROCAL_H
#define RBF_RECIPROCAL_H
#include "evaluate.h"

#define RBF_RECIPROCAL_CELLS 1536

/* Adaptive partition of the unit square that maps to the hemisphere at constant projected solid angle. */
typedef struct rbf_reciprocal {
	uint32_t cells;
	struct { float x, y, size, value[3], energy; } cell[RBF_RECIPROCAL_CELLS]; /* lower corner and side in [0, 1]; f; running sum of energy */
	double dhr[3];         /* per channel */
} rbf_reciprocal;

/* exitant: direction in the measured component's half space, unit, z > 0. A millisecond or two. */
void rbf_reciprocal_make(const rbf_component *component, const float exitant[3], rbf_reciprocal *table);

/* Direction in the half space of the measured component's incident side; 0 if there is nothing to draw. */
int rbf_reciprocal_sample(const rbf_reciprocal *table, double u, float incident[3]);
#endif
