/* SPDX-License-Identifier: BSD-3-Clause */
#include "lobes.h"
#include "extent.h"

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
	l->extent = NULL;
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
	free(l->extent);
	memset(l, 0, sizeof *l);
}

int rbf_lobes_copy(const rbf_lobes *l, rbf_lobes *copy)
{
	if (rbf_lobes_new(copy, l->count, l->channels))
		return -1;
	memcpy(copy->block, l->block, l->blocks * sizeof *l->block);
	memcpy(copy->amplitude, l->amplitude, (size_t)l->blocks * l->channels * sizeof *l->amplitude);
	memcpy(copy->mass, l->mass, l->count * sizeof *l->mass);
	return rbf_lobes_finish(copy);
}

int rbf_lobes_finish(rbf_lobes *l)
{
	free(l->extent);
	l->extent = rbf_extent_make(l->block, l->blocks);
	return l->extent ? 0 : -1;
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
	const rbf_kernel_lobes all = {l->block, l->amplitude, l->blocks, l->channels, 1};
	value[0] = value[1] = value[2] = 0;
	for (uint32_t first = 0; first < l->blocks; first += RBF_CULL_BITS) {
		rbf_kernel_job job = {.weight = 1, .first = first, .blocks = rbf_lobes_rest(l, first), .direction = {direction[0], direction[1], direction[2]}};
		float part[3];
		job.mask = rbf_extent_mask(l->extent, l->blocks, first, job.blocks, direction);
		rbf_kernel_sum(&job, 1, &all, part);
		for (uint32_t c = 0; c < l->channels; c++)
			value[c] += part[c];
	}
}

float rbf_lobes_luminance(const rbf_lobes *l, const float direction[3])
{
	float v[3];
	rbf_lobes_sum(l, direction, v);
	return v[rbf_luminance(l->channels)];
}

/* Copies a fit into a row of bytes, or out of it. Returns how many bytes it takes. */
static size_t pack(const rbf_lobes *l, char *to, const char *from)
{
	const struct { void *array; size_t bytes; } part[] = {{l->block, l->blocks * sizeof *l->block},
		{l->amplitude, (size_t)l->channels * l->blocks * sizeof *l->amplitude}, {l->mass, l->count * sizeof *l->mass}};
	size_t at = 0;
	for (size_t n = 0; n < sizeof part / sizeof *part; at += part[n++].bytes) {
		if (to)
			memcpy(to + at, part[n].array, part[n].bytes);
		if (from)
			memcpy(part[n].array, from + at, part[n].bytes);
	}
	return at;
}

int rbf_lobes_share(const rbf_team *team, uint32_t count, uint32_t channels, rbf_lobes *lobes)
{
	if (!team)
		return 0;
	uint32_t *number = calloc((size_t)count + 1, sizeof *number);
	uint64_t *first = calloc((size_t)count + 1, sizeof *first);
	char *row = NULL;
	int failed = !number || !first;
	for (uint32_t i = 0; i < count && !failed; i++)
		number[i] = lobes[i].count;
	failed = failed || rbf_team_share_rows(team, count, sizeof *number, number);
	for (uint32_t i = 0; i < count && !failed; i++) {
		failed = !rbf_team_mine(team, i) && rbf_lobes_new(&lobes[i], number[i], channels);
		first[i + 1] = first[i] + pack(&lobes[i], NULL, NULL);
	}
	failed = failed || !(row = malloc(first[count] + 1));
	for (uint32_t i = 0; i < count && !failed; i++)
		if (rbf_team_mine(team, i))
			pack(&lobes[i], row + first[i], NULL);
	failed = failed || rbf_team_share(team, count, first, row);
	for (uint32_t i = 0; i < count && !failed; i++)
		pack(&lobes[i], NULL, row + first[i]);
	for (uint32_t i = 0; i < count && !failed; i++)
		failed = !rbf_team_mine(team, i) && rbf_lobes_finish(&lobes[i]);
	free(number);
	free(first);
	free(row);
	return failed ? -1 : 0;
}
