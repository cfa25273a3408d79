/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A transmission side that was not measured: f(a, b) = f(b, a). Evaluation just swaps the vectors. To integrate and to sample over
 * the measured component's incident directions, with its exitant direction fixed, tables are made for small cells of exitant
 * directions, each when the first direction in it is asked for; the model keeps them (rbf_reciprocal in model.h).
 */
#ifndef RBF_RECIPROCAL_H
#define RBF_RECIPROCAL_H
#include "evaluate.h"

/* model: the one that `component` is part of. exitant: direction in the measured component's half space, unit, z > 0. A new cell takes
 * a few milliseconds, otherwise it is well below a microsecond. */
void rbf_reciprocal_dhr(const bsdfrbf_model *model, const rbf_component *component, const float exitant[3], float value[3]);

/* Draws a direction in the half space of the measured component's incident side; 0 if there is nothing to draw. */
int rbf_reciprocal_sample(const bsdfrbf_model *model, const rbf_component *component, const float exitant[3], double u, float incident[3]);
#endif
