/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Matching pursuit (Mallat and Zhang 1993) with Gaussians of several widths at the local maxima of what a fit lacks.
 */
#include "missed.h"

#include <math.h>
#include <stdlib.h>

enum { WIDE = 48 };
static const int WIDTHS[] = {5, 8, 11, 16, 23, 32, 47}; /* 1.5 sigma is the distance of this neighbour */
static const double GAIN = 81; /* nine standard errors: lobes cost, and are as many as there are samples to choose from */

/* Mean over the neighbours that count: 0 where half of them do not. */
static float mean_miss(const rbf_misses *m, size_t i)
{
	float sum = 0;
	int count = 0;
	for (int j = 0; j < RBF_NEAR; j++) {
		const uint32_t n = m->near[i][j];
		sum += m->outlier[n] ? 0 : m->miss[n];
		count += !m->outlier[n];
	}
	return 2 * count > RBF_NEAR ? sum / (float)count : 0;
}

/* The best width at sample i. */
static rbf_missed best_at(const rbf_misses *m, size_t i, const double sigma[2])
{
	rbf_missed best = {.sample = (uint32_t)i};
	uint32_t index[WIDE];
	float distance[WIDE];
	const int near = rbf_tree_nearest(m->tree, m->tree->point[i], WIDE, index, distance);
	for (size_t n = 0; n < sizeof WIDTHS / sizeof *WIDTHS && WIDTHS[n] < near; n++) {
		const double s = fmin(fmax(sqrt((double)distance[WIDTHS[n]]) / 1.5, sigma[0]), sigma[1]), kappa = 1 / (s * s);
		double product = 0, square = 0;
		for (int j = 0; j < near; j++) {
			const uint32_t q = index[j];
			const double g = m->outlier[q] ? 0 : exp(-.5 * kappa * (double)distance[j]) / (double)m->total[q];
			product += g * (double)m->miss[q];
			square += g * g;
		}
		const double gain = product > 0 && square > 0 ? product * product / square / ((double)m->spread * (double)m->spread) : 0;
		if (gain > (double)best.gain) {
			best.gain = (float)fmin(gain, 1e30);
			best.kappa = (float)kappa;
		}
	}
	return best;
}

int rbf_missed_find(const rbf_misses *m, const double sigma[2], int most, rbf_missed *found)
{
	float *mean = malloc((m->tree->count + 1) * sizeof *mean);
	int count = 0;
	if (!mean)
		return -1;
	for (size_t i = 0; i < m->tree->count; i++)
		mean[i] = mean_miss(m, i);
	for (size_t i = 0; i < m->tree->count; i++) {
		if (!(mean[i] > m->spread) || !rbf_near_highest(m->near, mean, i)) /* three standard errors */
			continue;
		const rbf_missed one = best_at(m, i, sigma);
		if (!((double)one.gain > GAIN))
			continue;
		int place = count < most ? count++ : most;
		for (; place > 0 && one.gain > found[place - 1].gain; place--)
			if (place < most)
				found[place] = found[place - 1];
		if (place < most)
			found[place] = one;
	}
	free(mean);
	return count;
}
