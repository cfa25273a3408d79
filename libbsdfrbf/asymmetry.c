/* SPDX-License-Identifier: BSD-3-Clause */
#include "asymmetry.h"
#include "difference.h"

static const float SELF = .0087f; /* half a degree: an incidence and its image are the same */

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
			const float l1 = rbf_difference(&m->lobes[b], &m->lobes[b], (unsigned)op[i], lambertian);
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
