/* SPDX-License-Identifier: BSD-3-Clause */
#include "extent.h"
#include "vector.h"

#include <stdlib.h>

static const float LEAST = 23; /* e to the minus this, 1e-10 of an amplitude, is nothing */

float *rbf_extent_make(const rbf_block *block, uint32_t blocks)
{
	const size_t row = rbf_extent_row(blocks);
	float *extent = calloc(4 * row, sizeof *extent);
	for (uint32_t b = 0; b < blocks && extent; b++) {
		const rbf_block *k = &block[b];
		float centre[3] = {0}, radius = 0;
		int lobes = 0;
		for (int i = 0; i < RBF_LANES; i++)
			if (k->k[i] > 0) { /* else unused */
				centre[0] += k->x[i];
				centre[1] += k->y[i];
				centre[2] += k->z[i];
				lobes++;
			}
		for (int n = 0; n < 3 && lobes; n++)
			centre[n] /= (float)lobes;
		for (int i = 0; i < RBF_LANES; i++)
			if (k->k[i] > 0)
				radius = fmaxf(radius, sqrtf(2 * LEAST / k->k[i])
					+ hypotf(hypotf(k->x[i] - centre[0], k->y[i] - centre[1]), k->z[i] - centre[2]));
		for (int n = 0; n < 3; n++)
			extent[(size_t)n * row + b] = centre[n];
		extent[3 * row + b] = radius * radius;
	}
	return extent;
}
