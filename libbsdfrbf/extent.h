/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * How far blocks of lobes extend: a ball about each, outside which nothing is left of its lobes. Culling masks (cull.h) tell more, but take
 * long to make; this serves fits and choices that are asked for but a few directions.
 */
#ifndef RBF_EXTENT_H
#define RBF_EXTENT_H
#include "cull.h"
#include "lanes.h"

/* The balls of `blocks` blocks: x, y, z and squared radius, a row of each, to be freed. NULL: out of memory. */
float *rbf_extent_make(const rbf_block *block, uint32_t blocks);

/* From one row to the next: the last four blocks are read as any four. */
static inline size_t rbf_extent_row(uint32_t blocks)
{
	return (size_t)blocks + 3;
}

/* As rbf_kernel_job.mask: which blocks of `of`, at most RBF_CULL_BITS from `first` on, extend to a direction. */
static inline __attribute__((always_inline)) uint64_t rbf_extent_mask(const float *extent, uint32_t of, uint32_t first, uint32_t blocks,
	const float direction[3])
{
	const float *x = extent + first;
	const size_t row = rbf_extent_row(of);
	const rbf_lanes p[3] = {rbf_lanes_all(direction[0]), rbf_lanes_all(direction[1]), rbf_lanes_all(direction[2])};
	uint64_t mask = 0;
	for (uint32_t b = 0; b < blocks; b += 4) {
		const rbf_lanes dx = rbf_lanes_load(x + b) - p[0], dy = rbf_lanes_load(x + row + b) - p[1], dz = rbf_lanes_load(x + 2*row + b) - p[2];
		mask |= (uint64_t)rbf_lanes_bits(dx*dx + dy*dy + dz*dz < rbf_lanes_load(x + 3*row + b)) << b;
	}
	return mask & rbf_cull_all(blocks);
}
#endif
