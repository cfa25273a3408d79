/* SPDX-License-Identifier: BSD-3-Clause */
#include "difference.h"
#include "sample.h"

enum { POINTS = 256 };

static double total_mass(const rbf_lobes *l)
{
	double total = 0;
	for (uint32_t i = 0; i < l->count; i++)
		total += l->mass[i];
	return total;
}

/* Mean of |f - g'| / (f + g') over directions drawn from f. back: g' is g as seen by the inverse of turn. */
static double drawn(const rbf_lobes *f, const rbf_lobes *g, const float turn[9], int back, double total)
{
	const uint32_t y = rbf_luminance(f->channels);
	double sum = 0, running = f->count ? f->mass[0] : 0;
	uint32_t lobe = 0;
	for (int p = 0; p < POINTS && total > 0; p++) {
		float centre[3], o[3], image[3], a[3], b[3];
		while (lobe + 1 < f->count && running < (p + .5) / POINTS * total)
			running += f->mass[++lobe];
		rbf_lobe_centre(f, lobe, centre);
		rbf_lobe_draw(centre, rbf_lobe_kappa(f, lobe), fmod(p * .7548776662 + .5, 1), fmod(p * .5698402910, 1), o);
		if (!(o[2] > 0))
			continue;
		for (int n = 0; n < 3; n++)
			image[n] = !turn ? o[n] : back ? turn[n]*o[0] + turn[3 + n]*o[1] + turn[6 + n]*o[2]
			         : turn[3*n]*o[0] + turn[3*n + 1]*o[1] + turn[3*n + 2]*o[2];
		rbf_lobes_sum(f, o, a);
		rbf_lobes_sum(g, image, b);
		sum += fabs((double)a[y] - (double)b[y]) / fmax((double)a[y] + (double)b[y], 1e-30) / POINTS;
	}
	return sum;
}

/* Directions are drawn from both, so that what only one of them has counts as well, and no quotient is large. */
float rbf_difference(const rbf_lobes *a, const rbf_lobes *b, const float turn[9], float lambertian)
{
	const double mass[2] = {total_mass(a), total_mass(b)}, mean = .5 * (mass[0] + mass[1]) + (double)lambertian;
	if (!(mean > 0))
		return 0;
	return (float)((mass[0] * drawn(a, b, turn, 0, mass[0]) + mass[1] * drawn(b, a, turn, 1, mass[1])) / mean);
}
