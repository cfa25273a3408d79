/* SPDX-License-Identifier: BSD-3-Clause */
#include "lobes.h"

#include <stdlib.h>
#include <string.h>

int rbf_lobes_new(rbf_lobes *l, uint32_t count, uint32_t channels)
{
	l->count = count;
	l->channels = channels;
	l->blocks = (count + RBF_LANES - 1) / RBF_LANES;
	const size_t room = l->blocks ? l->blocks : 1;
	l->block = calloc(room, sizeof *l->block);
	l->amplitude = calloc(room * channels, sizeof *l->amplitude);
	l->mass = calloc(count ? count : 1, sizeof *l->mass);
	if (!l->block || !l->amplitude || !l->mass) {
		rbf_lobes_free(l);
		return -1;
	}
	for (uint32_t b = 0; b < l->blocks; b++)
		for (int i = 0; i < RBF_LANES; i++)
			l->block[b].z[i] = 1; /* unused lanes: a unit centre */
	return 0;
}

void rbf_lobes_free(rbf_lobes *l)
{
	free(l->block);
	free(l->amplitude);
	free(l->mass);
	memset(l, 0, sizeof *l);
}

void rbf_lobe_set(rbf_lobes *l, uint32_t i, const float centre[3], float kappa)
{
	rbf_block *b = &l->block[i / RBF_LANES];
	b->x[i % RBF_LANES] = centre[0];
	b->y[i % RBF_LANES] = centre[1];
	b->z[i % RBF_LANES] = centre[2];
	b->k[i % RBF_LANES] = kappa;
}

void rbf_lobes_sum(const rbf_lobes *l, const float direction[3], float value[3])
{
	rbf_kernel_job job = {.weight = 1, .blocks = l->blocks, .block = l->block, .amplitude = l->amplitude, .stride = l->blocks,
		.channels = l->channels, .mask = ~(uint64_t)0, .group = (l->blocks + 63) / 64,
		.direction = {direction[0], direction[1], direction[2]}};
	value[0] = value[1] = value[2] = 0;
	if (job.blocks)
		rbf_kernel_sum(&job, 1, value);
}
