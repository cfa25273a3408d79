/* SPDX-License-Identifier: BSD-3-Clause */
#include "arrange.h"
#include "vector.h"

#include <stdlib.h>

/* Position along a Hilbert curve over the square map, 27 bits: neighbours in order are neighbours in direction, which keeps
 * blocks compact and stratified sampling stratified. */
static uint32_t hilbert(const float direction[3])
{
	float square[2];
	uint32_t x[2], order = 0;
	rbf_square_from_direction(direction, square);
	for (int a = 0; a < 2; a++)
		x[a] = (uint32_t)fminf(fmaxf((square[a] + 1) * 32768, 0.f), 65535.f);
	for (uint32_t s = 32768; s; s >>= 1) {
		const uint32_t rx = (x[0] & s) != 0, ry = (x[1] & s) != 0;
		order += s * s * ((3 * rx) ^ ry);
		if (!ry) {
			if (rx) {
				x[0] = 65535 - x[0];
				x[1] = 65535 - x[1];
			}
			const uint32_t t = x[0];
			x[0] = x[1];
			x[1] = t;
		}
	}
	return order >> 5;
}

/* Lobes of like width, within a factor of 2, follow each other: a broad one would keep a block of narrow ones in sight everywhere. */
static uint32_t rank_of(const float centre[3], double kappa)
{
	return ((uint32_t)fmin(fmax(.5 * log2(kappa), 0), 31) << 27) + hilbert(centre);
}

typedef struct ranked { uint32_t order, lobe; } ranked;

static int by_order(const void *a, const void *b)
{
	const ranked *x = a, *y = b;
	return x->order != y->order ? (x->order < y->order ? -1 : 1) : x->lobe < y->lobe ? -1 : x->lobe > y->lobe;
}

int rbf_arrange(uint32_t lobes, const float (*centre)[3], const float *kappa, const double *amplitude, int channels, rbf_lobes *out)
{
	const double *value[3];
	for (int c = 0; c < channels; c++)
		value[c] = amplitude + (size_t)c * lobes;
	const uint32_t y = rbf_luminance((uint32_t)channels);
	uint32_t count = 0;
	double total = 0;
	ranked *rank = malloc(((size_t)lobes + 1) * sizeof *rank);
	if (!rank)
		return -1;
	for (uint32_t j = 0; j < lobes; j++)
		total += value[y][j] * rbf_lobe_integral(kappa[j]);
	for (uint32_t j = 0; j < lobes; j++) {
		double energy = 0;
		for (int c = 0; c < channels; c++)
			energy = fmax(energy, value[c][j] * rbf_lobe_integral(kappa[j]));
		if (energy > 1e-8 * total)
			rank[count++] = (ranked){rank_of(centre[j], kappa[j]), j};
	}
	qsort(rank, count, sizeof *rank, by_order);
	if (rbf_lobes_new(out, count, (uint32_t)channels)) {
		free(rank);
		return -1;
	}
	for (uint32_t at = 0; at < count; at++) {
		const uint32_t j = rank[at].lobe;
		rbf_lobe_set(out, at, centre[j], kappa[j]);
		for (uint32_t c = 0; c < (uint32_t)channels; c++)
			out->amplitude[c * out->blocks + at / RBF_LANES].a[at % RBF_LANES] = (float)value[c][j];
		out->mass[at] = value[y][j] * rbf_lobe_integral(kappa[j]);
	}
	free(rank);
	if (rbf_lobes_finish(out)) {
		rbf_lobes_free(out);
		return -1;
	}
	return 0;
}

int rbf_arrange_ready(const rbf_incidence *in, int channels, rbf_lobes *out)
{
	float (*centre)[3] = malloc((in->lobes + 1) * sizeof *centre), *kappa = malloc((in->lobes + 1) * sizeof *kappa);
	double *amplitude = malloc((in->lobes + 1) * (size_t)channels * sizeof *amplitude);
	int failed = !centre || !kappa || !amplitude;
	for (size_t i = 0; i < in->lobes && !failed; i++) {
		for (int a = 0; a < 3; a++)
			centre[i][a] = (float)in->lobe[i].centre[a];
		kappa[i] = (float)in->lobe[i].kappa;
		for (int c = 0; c < channels; c++)
			amplitude[(size_t)c * in->lobes + i] = (double)in->lobe[i].dsf[c];
	}
	failed = failed || rbf_arrange((uint32_t)in->lobes, (const float (*)[3])centre, kappa, amplitude, channels, out);
	free(centre);
	free(kappa);
	free(amplitude);
	return failed ? -1 : 0;
}
