/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples are dense where there is much light: each counts for the solid angle it stands for. */
#include "held_out.h"
#include "noise.h"

#include <math.h>
#include <stdlib.h>

enum { AROUND = 32 };

/* The next sample that is held out, from *i on, and its direction. Returns 0 when there is none. */
static int find_next(const rbf_incidence *in, uint32_t hold, size_t *i, float w[3])
{
	while (*i < in->count && !rbf_held_out(hold, *i))
		++*i;
	for (size_t a = 0; a < 3 && *i < in->count; a++)
		w[a] = (float)in->outgoing[3 * *i + a];
	return *i < in->count;
}

float *rbf_held_out_areas(const rbf_incidence *in, uint32_t hold, int folded, const rbf_tree *used)
{
	float *area = malloc((in->count + 1) * sizeof *area);
	size_t held = 0;
	float w[3];
	for (size_t i = 0; area && find_next(in, hold, &i, w); i++) {
		w[1] = folded ? fabsf(w[1]) : w[1];
		area[held++] = rbf_tree_cap(used, w, AROUND);
	}
	return area;
}

float rbf_held_out_error(const rbf_incidence *in, int channels, uint32_t hold, const float lambertian[3], const float mix[3],
	const float *area, const rbf_lobes *lobes)
{
	double difference = 0, total = 0;
	size_t held = 0;
	float w[3], v[3];
	for (size_t i = 0; find_next(in, hold, &i, w); i++, held++) {
		rbf_lobes_sum(lobes, w, v);
		for (int c = 0; c < channels; c++) {
			const double t = (double)in->dsf[i * (size_t)channels + (size_t)c], part = (double)area[held] * (double)mix[c];
			difference += part * fabs(v[c] + lambertian[c] * w[2] / RBF_PI - t);
			total += part * fabs(t);
		}
	}
	return total > 0 ? (float)(difference / total) : -1;
}

float rbf_held_out_noise(const rbf_incidence *in, int channels, uint32_t hold, const float lambertian[3], const float *area, const rbf_lobes *lobes)
{
	const size_t y = rbf_luminance((uint32_t)channels);
	rbf_noisy *list = malloc((in->count + 1) * sizeof *list);
	int held = 0;
	float w[3];
	for (size_t i = 0; list && find_next(in, hold, &i, w); i++, held++) {
		const double truth = (double)in->dsf[i * (size_t)channels + y];
		const double light = (double)(rbf_lobes_luminance(lobes, w) + lambertian[y] * w[2] / (float)RBF_PI);
		list[held] = (rbf_noisy){light, truth, (double)area[held], fabs(light - truth)};
	}
	const float noise = list ? (float)rbf_noise_of(held, list) : -1;
	free(list);
	return noise;
}
