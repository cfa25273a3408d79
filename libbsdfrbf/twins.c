/* SPDX-License-Identifier: BSD-3-Clause */
#include "twins.h"
#include "arrange.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float BESIDE = .25f; /* of a lobe's spread */

void rbf_twins_settle(float spread, float centre[3])
{
	if (!(centre[1] < BESIDE * spread))
		return;
	const float length = hypotf(centre[0], centre[2]);
	centre[0] /= length;
	centre[1] = 0;
	centre[2] /= length;
}

int rbf_twins_settle_all(uint32_t count, float (*centre)[3])
{
	rbf_tree tree;
	if (rbf_tree_build(&tree, count, (const float (*)[3])centre))
		return -1;
	for (uint32_t j = 0; j < count; j++) {
		uint32_t index[2];
		float distance[2];
		if (rbf_tree_nearest(&tree, centre[j], 2, index, distance) == 2)
			rbf_twins_settle(sqrtf(distance[1]), centre[j]);
	}
	rbf_tree_free(&tree);
	return 0;
}

int rbf_twins_tree(uint32_t count, const float (*centre)[3], rbf_tree *tree)
{
	float (*all)[3] = malloc((2 * (size_t)count + 1) * sizeof *all);
	size_t both = count;
	for (uint32_t j = 0; j < count && all; j++) {
		memcpy(all[j], centre[j], sizeof *all);
		if (rbf_twins_has(centre[j])) {
			memcpy(all[both], centre[j], sizeof *all);
			all[both++][1] *= -1;
		}
	}
	const int failed = !all || rbf_tree_build(tree, both, (const float (*)[3])all);
	free(all);
	return failed ? -1 : 0;
}

int rbf_twins_arrange(uint32_t lobes, const float (*centre)[3], const float *kappa, const double *amplitude, int channels, rbf_lobes *out)
{
	uint32_t all = lobes, twin = lobes;
	for (uint32_t j = 0; j < lobes; j++)
		all += (uint32_t)rbf_twins_has(centre[j]);
	float (*place)[3] = malloc((all + 1) * sizeof *place), *width = malloc((all + 1) * sizeof *width);
	double *light = malloc(((size_t)all * (size_t)channels + 1) * sizeof *light);
	for (uint32_t j = 0; j < lobes && place && width && light; j++)
		for (int side = 0; side <= rbf_twins_has(centre[j]); side++) {
			const uint32_t to = side ? twin++ : j;
			memcpy(place[to], centre[j], sizeof *place);
			place[to][1] = side ? -centre[j][1] : centre[j][1];
			width[to] = kappa[j];
			for (size_t c = 0; c < (size_t)channels; c++)
				light[c * all + to] = amplitude[c * lobes + j];
		}
	const int failed = !place || !width || !light || rbf_arrange(all, (const float (*)[3])place, width, light, channels, out);
	free(place);
	free(width);
	free(light);
	return failed ? -1 : 0;
}
