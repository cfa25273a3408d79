/* SPDX-License-Identifier: BSD-3-Clause */
/* Which incidences are one place: what one tells of another there is no prediction. */
#include "mesh_build.h"

static const double APART = .25; /* of an even spacing */

/* Mean width of the gaps between polar angles, each as often as it is wide. */
static double mean_gap(size_t count, const double *directions)
{
	enum { STEPS = 360 };
	const double step = RBF_PI / 2 / STEPS;
	unsigned char there[STEPS + 1] = {0};
	double squares = 0, all = 0;
	int last = -1;
	for (size_t i = 0; i < count; i++)
		there[(int)(rbf_theta3(directions + 3 * i) / step)] = 1;
	for (int n = 0; n <= STEPS; n++) {
		if (!there[n])
			continue;
		if (last >= 0) {
			squares += pow((n - last) * step, 2);
			all += (n - last) * step;
		}
		last = n;
	}
	return all > 0 ? squares / all : 0;
}

/* Distance between unit vectors (isotropic: of angles to the normal) below which two incidences are taken as one place: a quarter of how far
 * apart so many would be if they were spread evenly. */
static double apart_of(rbf_symmetry symmetry, size_t count, const double *directions)
{
	double lowest = 1;
	int op[4];
	if (symmetry == RBF_ISOTROPIC)
		return fmax(APART * mean_gap(count, directions), RBF_MESH_SAME);
	for (size_t i = 0; i < count; i++)
		lowest = fmin(lowest, fmax(directions[3*i + 2], 0));
	return fmax(APART * sqrt(2 * RBF_PI * (1 - lowest) / (double)(count * (size_t)rbf_symmetry_ops(symmetry, op))), RBF_MESH_SAME);
}

/* Whether a or one of its images is that near to b. */
static int together(rbf_symmetry symmetry, const double a[3], const double b[3], double apart)
{
	int op[4];
	if (symmetry == RBF_ISOTROPIC)
		return fabs(rbf_theta3(a) - rbf_theta3(b)) < apart;
	const int ops = rbf_symmetry_ops(symmetry, op);
	for (int k = 0; k < ops; k++) {
		const double x = (op[k] & RBF_OP_X ? -a[0] : a[0]) - b[0], y = (op[k] & RBF_OP_Y ? -a[1] : a[1]) - b[1], z = a[2] - b[2];
		if (x*x + y*y + z*z < apart * apart)
			return 1;
	}
	return 0;
}

void rbf_mesh_leave_out(rbf_symmetry symmetry, size_t count, const double *directions, size_t which, unsigned char *out)
{
	const double apart = apart_of(symmetry, count, directions);
	for (size_t i = 0; i < count; i++)
		out[i] |= (unsigned char)together(symmetry, directions + 3 * i, directions + 3 * which, apart);
}
