/* SPDX-License-Identifier: BSD-3-Clause */
#include "asymmetry.h"
#include "sample.h"

enum { POINTS = 256 };
static const float SELF = .0087f; /* half a degree: an incidence and its image are the same */

/* Integral of |f - f'| over that of f, f' the image of f. As both have the same integral, it is twice the mean of
 * |f - f'| / (f + f') over directions drawn from f. */
static float difference(const rbf_lobes *l, unsigned op, float lambertian)
{
	const uint32_t y = rbf_luminance(l->channels);
	double total = 0, sum = 0, running = 0;
	uint32_t lobe = 0;
	for (uint32_t i = 0; i < l->count; i++)
		total += l->mass[i];
	if (!(total > 0))
		return 0;
	running = l->mass[0];
	for (int p = 0; p < POINTS; p++) {
		float centre[3], o[3], image[3], f[3], g[3];
		while (lobe + 1 < l->count && running < (p + .5) / POINTS * total)
			running += l->mass[++lobe];
		rbf_lobe_centre(l, lobe, centre);
		rbf_lobe_draw(centre, rbf_lobe_kappa(l, lobe), fmod(p * .7548776662 + .5, 1), fmod(p * .5698402910, 1), o);
		if (!(o[2] > 0))
			continue;
		rbf_mirror(op, o, image);
		rbf_lobes_sum(l, o, f);
		rbf_lobes_sum(l, image, g);
		sum += 2 * fabs((double)f[y] - (double)g[y]) / fmax((double)f[y] + (double)g[y], 1e-30) / POINTS;
	}
	return (float)(sum * total / (total + (double)lambertian));
}

void rbf_asymmetry(const rbf_fitted *m, float lambertian, float *mean, float *worst, uint32_t *base)
{
	int op[4] = {RBF_OP_NONE, RBF_OP_Y, 0, 0}, ops = 2, count = 0;
	double sum = 0;
	if (m->symmetry != RBF_ISOTROPIC) /* an isotropic material is a mirror image of itself about the plane of incidence */
		ops = rbf_symmetry_ops(m->symmetry, op);
	*worst = -1;
	*base = 0;
	for (uint32_t b = 0; b < m->bases; b++) {
		const float d[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]};
		for (int i = 0; i < ops; i++) {
			float image[3];
			rbf_mirror((unsigned)op[i], d, image);
			if (op[i] == RBF_OP_NONE || hypotf(image[0] - d[0], image[1] - d[1]) > SELF)
				continue;
			const float l1 = difference(&m->lobes[b], (unsigned)op[i], lambertian);
			sum += (double)l1;
			count++;
			if (l1 > *worst) {
				*worst = l1;
				*base = b;
			}
		}
	}
	*mean = count ? (float)(sum / count) : -1;
}
