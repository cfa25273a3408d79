/* SPDX-License-Identifier: BSD-3-Clause */
/* A narrow peak holds few samples, and none sits on its top: local maxima are candidates, the most prominent ones if there are
 * many. What counts is how far one stands out of its surroundings, not how high it is: errors are relative. A peak that is seen
 * down to its foot is also tried without what lies under it. */
#include "peaks.h"
#include "small_system.h"
#include "vector.h"

#include <math.h>

enum { PEAKS = RBF_PEAKS_MOST / 6, PEAK_AROUND = 48 };
static const float PEAK_PART = .05f; /* of a peak's own height */
static const double PEAK_SEEN = 2;   /* a sample lies within so many sigmas of a peak's top */

/* A Gaussian by regression, log(y - base) = a + b.t - kappa/2 t^2 over the nearest samples of sample i, t in the tangent plane,
 * if the samples tell it. Returns how many: 1 or 0. */
static int add_peak(const rbf_peaks_samples *k, const double sigma[2], size_t i, int nearest, float base, float centre[3], float *kappa_found)
{
	uint32_t index[PEAK_AROUND];
	float distance[PEAK_AROUND];
	const int count = rbf_tree_nearest(k->tree, k->tree->point[i], nearest, index, distance);
	const float *w = k->tree->point[i];
	float t[3], u[3];
	rbf_basis(w, t, u);
	const double unit = sqrt((double)distance[count - 1]);
	double m[4][4] = {{0}}, a[4] = {0}; /* log y - base = a.(1, x, y, x^2 + y^2) */
	float peak = 0;
	int used = 0;
	if (count < nearest || !(unit > 0))
		return 0;
	for (int j = 0; j < count; j++)
		peak = fmaxf(peak, k->level[index[j]] - base);
	for (int j = 0; j < count; j++) {
		const float *p = k->tree->point[index[j]], level = k->level[index[j]] - base;
		const double x = (double)rbf_dot(p, t) / unit, y = (double)rbf_dot(p, u) / unit;
		const double row[4] = {1, x, y, x*x + y*y}, log_level = (double)logf(fmaxf(level, 1e-30f));
		if (level < PEAK_PART * peak)
			continue;
		used++;
		for (int r = 0; r < 4; r++) {
			for (int q = 0; q < 4; q++)
				m[r][q] += row[r] * row[q];
			a[r] += row[r] * log_level;
		}
	}
	if (used < 6 || !rbf_small_system_solve(4, m[0], a, 1e-12))
		return 0;
	const double curvature = -2 * a[3], kappa = curvature / (unit * unit), x = a[1] / curvature * unit, y = a[2] / curvature * unit;
	if (!(kappa > 1 / (sigma[1] * sigma[1])) || !(kappa < 1 / (sigma[0] * sigma[0])) || !(hypot(x, y) < unit))
		return 0;
	for (int q = 0; q < 3; q++)
		centre[q] = w[q] + (float)x * t[q] + (float)y * u[q];
	rbf_normalize(centre);
	/* samples that all lie on a circle tell neither; an amplitude that no sample sees would be anything */
	rbf_tree_nearest(k->tree, centre, 1, index, distance);
	if (kappa * (double)distance[0] > PEAK_SEEN * PEAK_SEEN)
		return 0;
	*kappa_found = (float)kappa;
	return 1;
}

uint32_t rbf_peaks_find(const rbf_peaks_samples *k, const double sigma[2], float (*centre)[3], float *kappa)
{
	static const int nearest[] = {PEAK_AROUND / 4, PEAK_AROUND / 2, PEAK_AROUND};
	struct { size_t sample; float prominence, base; } most[PEAKS + 1];
	int found = 0;
	uint32_t lobes = 0;
	for (size_t i = 0; i < k->tree->count; i++) {
		uint32_t index[PEAK_AROUND];
		float distance[PEAK_AROUND], around = 0, base = k->smooth[i];
		if (!(k->smooth[i] > 0) || k->smooth[i] < k->floor || !rbf_near_highest(k->near, k->smooth, i))
			continue;
		const int count = rbf_tree_nearest(k->tree, k->tree->point[i], PEAK_AROUND, index, distance);
		for (int j = 0; j < count; j++) {
			around += k->smooth[index[j]] / k->smooth[i] / (float)count;
			base = fminf(base, k->smooth[index[j]]);
		}
		int place = found < PEAKS ? found++ : PEAKS;
		for (; place > 0 && 1 - around > most[place - 1].prominence; place--)
			most[place] = most[place - 1];
		most[place].sample = i;
		most[place].prominence = 1 - around;
		most[place].base = base < .5f * k->smooth[i] ? base : 0;
	}
	for (int p = 0; p < found; p++)
		for (size_t n = 0; n < sizeof nearest / sizeof *nearest; n++)
			for (int foot = 0; foot < (most[p].base > 0 ? 2 : 1); foot++)
				lobes += (uint32_t)add_peak(k, sigma, most[p].sample, nearest[n], foot ? most[p].base : 0, centre[lobes], &kappa[lobes]);
	return lobes;
}
