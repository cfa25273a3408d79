/* SPDX-License-Identifier: BSD-3-Clause */
#include "asymmetry.h"
#include "both_seen.h"
#include "moved.h"
#include "neighbours.h"

#include <stdlib.h>

enum { TURNED = 4 }; /* incidences, itself among them, that one of an isotropic material is compared with at most */
static const float SAME = .0087f; /* half a degree: an incidence is the image of another */

/* The difference of an incidence's image from another, -1: that is not known. seen: or NULL. */
static float apart(const rbf_fitted *m, uint32_t base, const float d[3], unsigned op, uint32_t other, const float to[3], float lambertian, const rbf_seen *seen)
{
	const float image[9] = {op & RBF_OP_X ? -1 : 1, 0, 0, 0, op & RBF_OP_Y ? -1 : 1, 0, 0, 0, 1};
	rbf_both_seen both = {0};
	const rbf_compared *where = seen ? rbf_both_seen_of(&seen[base], &seen[other], image, &both) : NULL;
	return both.few ? -1 : rbf_moved_mirrored(&m->lobes[base], d, op, &m->lobes[other], to, lambertian, 0, where);
}

int rbf_asymmetry_of(const rbf_fitted *m, rbf_symmetry symmetry, float lambertian, const rbf_seen *seen, rbf_asymmetry *found)
{
	int op[4] = {RBF_OP_NONE, RBF_OP_Y, 0, 0}, ops = 2, count = 0;
	double sum = 0;
	rbf_tree tree;
	float (*d)[3] = malloc(((size_t)m->bases + 1) * sizeof *d);
	for (uint32_t b = 0; b < m->bases && d; b++)
		for (int n = 0; n < 3; n++)
			d[b][n] = (float)m->direction[3*b + (uint32_t)n];
	const int failed = !d || rbf_tree_build(&tree, m->bases, (const float (*)[3])d);
	if (symmetry != RBF_ISOTROPIC) /* an isotropic material is a mirror image of itself about the plane of incidence, whichever that is: all were turned */
		ops = rbf_symmetry_ops(symmetry, op);
	*found = (rbf_asymmetry){.mean = -1, .worst = -1};
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		for (int i = 1; i < ops; i++) { /* the first is none */
			float image[3], distance[TURNED];
			uint32_t other[TURNED];
			rbf_mirror((unsigned)op[i], d[b], image);
			const int near = rbf_tree_nearest(&tree, image, symmetry == RBF_ISOTROPIC ? TURNED : 1, other, distance);
			for (int n = 0; n < near; n++) {
				if (distance[n] > SAME * SAME || other[n] < b) /* a pair counts once */
					continue;
				const float l1 = apart(m, b, d[b], (unsigned)op[i], other[n], d[other[n]], lambertian, seen);
				if (l1 < 0)
					continue;
				sum += (double)l1;
				count++;
				if (l1 > found->worst) {
					found->worst = l1;
					found->base = b;
				}
			}
		}
	if (count)
		found->mean = (float)(sum / count);
	if (d && !failed)
		rbf_tree_free(&tree);
	free(d);
	return failed ? -1 : 0;
}
