/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * How DHR goes on beyond the last measured incidences. Nothing is known there but what was measured last: the change of ln DHR across
 * the last two spacings of the mesh goes on, ever slower up to the horizon, and stops short of more light than arrives.
 */
#ifndef RBF_TREND_H
#define RBF_TREND_H
#include "evaluate.h"

/* Makes the trend along every line beyond a border (dhr.h), for all components once they are built, as reflection and transmission
 * share the light. Returns 0, or -1 when out of memory. */
int rbf_trend_set(bsdfrbf_model *model);
#endif
