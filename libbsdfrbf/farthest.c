/* SPDX-License-Identifier: BSD-3-Clause */
/* Points stand in blocks with a sphere around each: a new point that is too far away to be nearer to any of a block is not compared
 * with its points, and soon that is nearly all blocks. */
#include "farthest.h"
#include "vector.h"

#include <stdlib.h>

enum { BLOCK = 32 };
static const float SAME = 1e-12f;  /* a squared distance, weighted */
static const float MARGIN = 1e-5f; /* more than rounding takes from a distance on the unit sphere */

typedef struct block {
	float middle[3], radius;
	float density;        /* least of its points */
	float far;            /* largest distance of its points, and the first that has it */
	uint32_t at;
} block;

static void enclose(const float (*point)[3], const float *density, uint32_t from, uint32_t to, block *b)
{
	*b = (block){.density = density[from], .far = INFINITY, .at = from};
	for (uint32_t i = from; i < to; i++) {
		for (int a = 0; a < 3; a++)
			b->middle[a] += point[i][a] / (float)(to - from);
		b->density = rbf_min(b->density, density[i]);
	}
	for (uint32_t i = from; i < to; i++) {
		const float d[3] = {point[i][0] - b->middle[0], point[i][1] - b->middle[1], point[i][2] - b->middle[2]};
		b->radius = rbf_max(b->radius, sqrtf(rbf_dot(d, d)));
	}
}

static int out_of_reach(const block *b, const float c[3])
{
	const float d[3] = {c[0] - b->middle[0], c[1] - b->middle[1], c[2] - b->middle[2]};
	const float least = rbf_max(sqrtf(rbf_dot(d, d)) - b->radius - MARGIN, 0) * b->density;
	return least * least > b->far;
}

static void approach(const float (*point)[3], const float *density, uint32_t from, uint32_t to, const float c[3], float *nearest, block *b)
{
	b->far = -1;
	for (uint32_t i = from; i < to; i++) {
		const float x = point[i][0] - c[0], y = point[i][1] - c[1], z = point[i][2] - c[2];
		nearest[i] = rbf_min((x*x + y*y + z*z) * density[i] * density[i], nearest[i]);
		if (nearest[i] > b->far) {
			b->far = nearest[i];
			b->at = i;
		}
	}
}

ptrdiff_t rbf_farthest(size_t count, const float (*point)[3], const float *density, size_t most, uint32_t *order)
{
	const uint32_t n = (uint32_t)count, blocks = (n + BLOCK - 1) / BLOCK;
	block *list = malloc((blocks + 1) * sizeof *list);
	float *nearest = malloc((count + 1) * sizeof *nearest);
	ptrdiff_t chosen = -1;
	if (list && nearest) {
		uint32_t next = 0;
		float far = INFINITY;
		for (uint32_t i = 0; i < n; i++) {
			nearest[i] = INFINITY;
			if (density[i] > density[next])
				next = i;
		}
		for (uint32_t b = 0; b < blocks; b++)
			enclose(point, density, b * BLOCK, b + 1 < blocks ? (b + 1) * BLOCK : n, &list[b]);
		for (chosen = 0; chosen < (ptrdiff_t)most && n && far > SAME; chosen++) {
			const float *c = point[order[chosen] = next];
			far = -1;
			for (uint32_t b = 0; b < blocks; b++) {
				if (!out_of_reach(&list[b], c))
					approach(point, density, b * BLOCK, b + 1 < blocks ? (b + 1) * BLOCK : n, c, nearest, &list[b]);
				if (list[b].far > far) {
					far = list[b].far;
					next = list[b].at;
				}
			}
		}
	}
	free(list);
	free(nearest);
	return chosen;
}
