/* SPDX-License-Identifier: BSD-3-Clause */
#include "grey.h"

#include <stdlib.h>
#include <string.h>

enum { CHANNELS = 3 };

static void find_mix(const rbf_fitted *m, float mix[CHANNELS])
{
	const uint32_t y = rbf_luminance(CHANNELS);
	double sum[CHANNELS] = {0};
	uint32_t some = 0;
	for (uint32_t b = 0; b < m->bases; b++)
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			for (uint32_t n = 0; n < CHANNELS; n++)
				sum[n] += (double)rbf_lobe_amplitude(&m->lobes[b], n, i) * rbf_lobe_integral(rbf_lobe_kappa(&m->lobes[b], i));
	for (uint32_t n = 0; n < CHANNELS; n++)
		some += sum[n] > 0;
	for (uint32_t n = 0; n < CHANNELS; n++)
		mix[n] = sum[n] > 0 ? (float)((sum[y] > 0 ? sum[y] : 1) / sum[n] / some) : 0;
}

float rbf_grey_of(const rbf_grey *g, const float value[CHANNELS])
{
	return g->lobes ? g->mix[0] * value[0] + g->mix[1] * value[1] + g->mix[2] * value[2] : value[rbf_luminance(g->channels)];
}

/* Blocks and what is known of them are shared with `from`. */
static int mix_lobes(const rbf_grey *g, const rbf_lobes *from, rbf_lobes *to)
{
	*to = *from;
	to->channels = 1;
	to->amplitude = calloc((size_t)from->blocks + 1, sizeof *to->amplitude);
	to->mass = calloc((size_t)from->count + 1, sizeof *to->mass);
	for (uint32_t i = 0; i < from->count && to->amplitude && to->mass; i++) {
		const float value[CHANNELS] = {rbf_lobe_amplitude(from, 0, i), rbf_lobe_amplitude(from, 1, i), rbf_lobe_amplitude(from, 2, i)};
		const float mixed = rbf_grey_of(g, value);
		to->amplitude[i / RBF_LANES].a[i % RBF_LANES] = mixed;
		to->mass[i] = (double)mixed * rbf_lobe_integral(rbf_lobe_kappa(from, i));
	}
	return to->amplitude && to->mass ? 0 : -1;
}

int rbf_grey_begin(rbf_fitted *m, rbf_grey *g)
{
	int failed = 0;
	*g = (rbf_grey){.channels = m->channels};
	if (m->channels != CHANNELS)
		return 0;
	g->lobes = malloc(((size_t)m->bases + 1) * sizeof *g->lobes);
	if (!g->lobes)
		return -1;
	memcpy(g->lobes, m->lobes, m->bases * sizeof *g->lobes);
	find_mix(m, g->mix);
	for (uint32_t b = 0; b < m->bases; b++)
		failed |= mix_lobes(g, &g->lobes[b], &m->lobes[b]);
	m->channels = 1;
	if (failed)
		rbf_grey_end(m, g);
	return failed;
}

void rbf_grey_end(rbf_fitted *m, rbf_grey *g)
{
	for (uint32_t b = 0; b < m->bases && g->lobes; b++) {
		free(m->lobes[b].amplitude);
		free(m->lobes[b].mass);
		m->lobes[b] = g->lobes[b];
	}
	m->channels = g->channels;
	free(g->lobes);
	g->lobes = NULL;
}
