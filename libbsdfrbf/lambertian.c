/* SPDX-License-Identifier: BSD-3-Clause */
#include "fit.h"
#include "spiral.h"
#include "neighbours.h"

#include <stdlib.h>

enum { NEIGHBOURS = 16, FLOOR_PLACES = 1500, DIRECTIONS = 200 };
static const float NEAR = .52f, REACHED = .3f; /* 30 degrees; share of the hemisphere that is as near to samples: else these are of a peak alone */

static int ascending(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;
	return x < y ? -1 : x > y;
}

/* Whether samples show what there is beside a peak. */
static int reaches(const rbf_tree *tree)
{
	int near = 0;
	for (int n = 0; n < DIRECTIONS; n++) {
		float q[3], distance;
		uint32_t index;
		rbf_spiral(n, DIRECTIONS, q);
		near += rbf_tree_nearest(tree, q, 1, &index, &distance) && distance < NEAR * NEAR;
	}
	return near > REACHED * DIRECTIONS;
}

/* Low quantile of f at one incidence, from local means, in which noise averages out; 0 if there are none, -1 when out of memory. */
static float incidence_floor(const rbf_incidence *in, int channels, int channel)
{
	const size_t step = in->count / FLOOR_PLACES + 1;
	float *mean = malloc((in->count / step + 1) * sizeof *mean), floor = 0;
	rbf_tree tree = {0};
	size_t used = 0;
	if (!mean || rbf_tree_of(&tree, in->count, in->outgoing))
		floor = -1;
	else if (reaches(&tree)) {
		for (size_t i = step / 2; i < in->count; i += step) {
			const double *at = in->outgoing + 3*i;
			const float w[3] = {(float)at[0], (float)at[1], (float)at[2]};
			uint32_t index[NEIGHBOURS];
			float distance[NEIGHBOURS];
			double sum = 0, cosine = 0;
			if (w[2] < .15f)
				continue;
			const int found = rbf_tree_nearest(&tree, w, NEIGHBOURS, index, distance);
			for (int j = 0; j < found; j++) {
				sum += (double)in->dsf[(size_t)index[j] * (size_t)channels + (size_t)channel];
				cosine += in->outgoing[3 * (size_t)index[j] + 2];
			}
			mean[used++] = (float)(sum / cosine);
		}
		if (used) {
			qsort(mean, used, sizeof *mean, ascending);
			floor = fmaxf(mean[used / 50], 0.f);
		}
	}
	rbf_tree_free(&tree);
	free(mean);
	return floor;
}

/* The Lambertian part is what every direction at every incidence shares: a little less than the lowest floor. */
int rbf_fit_lambertian(const rbf_team *team, const rbf_measured *measured, int channels, float lambertian[3])
{
	for (int c = 0; c < 3; c++)
		lambertian[c] = 0;
	for (int c = 0; c < channels; c++) {
		float floor = INFINITY;
		#pragma omp parallel for schedule(dynamic) reduction(min:floor)
		for (int64_t b = 0; b < (int64_t)measured->count; b++)
			if (rbf_team_mine(team, (uint64_t)b))
				floor = fminf(floor, incidence_floor(&measured->incidence[b], channels, c));
		if (rbf_team_lowest(team, &floor) || floor < 0)
			return -1;
		lambertian[c] = isfinite(floor) ? .95f * floor * (float)RBF_PI : 0;
	}
	return 0;
}
