/* SPDX-License-Identifier: BSD-3-Clause */
#include "coarse_peak.h"
#include "neighbours.h"
#include "vector3.h"

static const float FAR_LOWER = .5f;                  /* of the highest */
static const float AROUND_FROM = .5f, AROUND_TO = 2; /* times the gap: nearer ones along a scan line tell nothing of the peak across it */
static const float LOBE = 1.5707963f; /* solid angle of a Gaussian whose sigma is half the gap, 2 pi / 4, over its square */
static const double DEGREES = 57.29577951308232;

static const rbf_incidence *nearest(const rbf_measured *measured, const float direction[3], int all_azimuths)
{
	const double d[3] = {(double)direction[0], (double)direction[1], (double)direction[2]};
	const rbf_incidence *found = NULL;
	double least = INFINITY;
	for (size_t i = 0; i < measured->count; i++) {
		const double *w = measured->incidence[i].direction;
		const double far = all_azimuths ? fabs(rbf_theta3(w) - rbf_theta3(d)) : 1 - rbf_dot3(w, d);
		if (far < least && measured->incidence[i].count) {
			least = far;
			found = &measured->incidence[i];
		}
	}
	return found;
}

float rbf_coarse_peak(const rbf_measured *measured, int channels, const float direction[3], int all_azimuths, float *apart)
{
	const rbf_incidence *in = nearest(measured, direction, all_azimuths);
	const size_t step = (size_t)channels, y = channels == 3;
	size_t top = 0;
	rbf_tree tree;
	*apart = 0;
	if (!in)
		return 0;
	for (size_t i = 1; i < in->count; i++)
		top = in->dsf[step * i + y] > in->dsf[step * top + y] ? i : top;
	const double *peak = in->outgoing + 3*top;
	const float at[3] = {(float)peak[0], (float)peak[1], (float)peak[2]}, most = in->dsf[step * top + y];
	if (rbf_tree_of(&tree, in->count, in->outgoing))
		return -1;
	rbf_tree_own_order(&tree, NULL);
	const float gap = rbf_tree_gap(&tree, at, 1);
	rbf_tree_free(&tree);
	*apart = gap * (float)DEGREES;
	for (size_t i = 0; i < in->count; i++) {
		const double *w = in->outgoing + 3*i;
		const double d[3] = {w[0] - peak[0], w[1] - peak[1], w[2] - peak[2]}, far = sqrt(rbf_dot3(d, d));
		if (far > (double)(AROUND_FROM * gap) && far < (double)(AROUND_TO * gap) && in->dsf[step * i + y] > FAR_LOWER * most)
			return 0;
	}
	return most * LOBE * gap * gap;
}
