/* SPDX-License-Identifier: BSD-3-Clause */
/* Which cells of culling masks (cull.h) directions are in. */
#ifndef RBF_CELLS_H
#define RBF_CELLS_H
#include "lanes.h"
#include "model.h"

/* As by rbf_disc_from_direction(), whose result does not matter below the horizon). */
static inline __attribute__((always_inline)) rbf_lane_mask rbf_cells_at(const rbf_lanes d[3])
{
	const rbf_lanes scale = (RBF_CULL_GRID * .5f) / rbf_lanes_sqrt(1 + rbf_lanes_abs(d[2]));
	rbf_lanes t[2];
	for (int n = 0; n < 2; n++) /* may be not a number */
		t[n] = rbf_lanes_min(rbf_lanes_max(d[n] * scale + RBF_CULL_GRID * .5f, rbf_lanes_all(0)), rbf_lanes_all(RBF_CULL_GRID - .5f));
	return __builtin_convertvector(t[1], rbf_lane_mask) * RBF_CULL_GRID + __builtin_convertvector(t[0], rbf_lane_mask);
}
#endif
