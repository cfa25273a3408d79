/* SPDX-License-Identifier: BSD-3-Clause */
#include "scan_lines.h"
#include "model.h"
#include "neighbours.h"
#include "small_system.h"
#include "vector3.h"

#include <string.h>

enum { INCIDENCES = 8, SAMPLES = 100, FEW = 5 }; /* that are asked, at most; samples that may be on lines */
enum { DEGREES = 361, GAP = 5, GAP_MORE = 4 };   /* of a circle, and around 0; those between samples that are a gap, times what is usual */

static const double WIDE = .17;  /* sine: samples reach over 10 degrees of a plane */
static const double ASIDE = .09; /* sine: 5 degrees that an instrument's plane is beside the source's */
static const double THIN = .02;  /* and what samples are off it then: noise of the device's angles */

/* How many of some samples have all neighbours on one line; -1 when out of memory. */
static int on_lines(const rbf_incidence *in)
{
	rbf_tree tree;
	int found = 0;
	if (rbf_tree_of(&tree, in->count, in->outgoing))
		return -1;
	rbf_tree_own_order(&tree, NULL);
	for (size_t n = 0; n < SAMPLES && in->count; n++)
		found += !(rbf_tree_gap(&tree, tree.point[n * in->count / SAMPLES], 0) > 0);
	rbf_tree_free(&tree);
	return found;
}

/* Unit normal of the plane that holds the first sample and the one that is farthest from its line. Returns the sine between these. */
static double rough_normal(const rbf_incidence *in, double normal[3])
{
	const double *w = in->outgoing;
	double square = 0;
	normal[0] = normal[1] = normal[2] = 0;
	for (size_t i = 1; i < in->count; i++) {
		double c[3];
		rbf_cross3(w, w + 3*i, c);
		const double s = rbf_dot3(c, c);
		if (s > square) {
			square = s;
			memcpy(normal, c, sizeof c);
		}
	}
	return rbf_unit3(normal);
}

/* Turns a plane's normal to where the samples are nearest to the plane, or, with an offset, to one beside it: least squares of what they are off by
 * in what they are along two axes of the plane, and 1. Returns the offset. */
static double fit_plane(const rbf_incidence *in, int with_offset, double normal[3])
{
	double along[3] = {0}, across[3], row[3][3] = {{0}}, solution[3] = {0};
	along[fabs(normal[0]) < .7 ? 0 : 1] = 1;
	rbf_cross3(normal, along, across);
	rbf_unit3(across);
	rbf_cross3(across, normal, along);
	for (size_t i = 0; i < in->count; i++) {
		const double *w = in->outgoing + 3*i, a[3] = {rbf_dot3(along, w), rbf_dot3(across, w), with_offset};
		for (int n = 0; n < 3; n++) {
			for (int m = 0; m < 3; m++)
				row[n][m] += a[n] * a[m];
			solution[n] += a[n] * rbf_dot3(normal, w);
		}
	}
	row[2][2] += !with_offset;
	if (!rbf_small_system_solve(3, row[0], solution, 1e-9))
		return 0;
	for (int n = 0; n < 3; n++)
		normal[n] -= solution[0] * along[n] + solution[1] * across[n];
	return solution[2] / rbf_unit3(normal);
}

/* The most that samples are off a plane at an offset. */
static double farthest_off(const rbf_incidence *in, const double normal[3], double offset)
{
	double most = 0;
	for (size_t i = 0; i < in->count; i++)
		most = fmax(most, fabs(rbf_dot3(normal, in->outgoing + 3*i) - offset));
	return most;
}

/* Whether most of what samples reach over, along the plane, is without any: they are of some peaks, and no scan. */
static int is_gaps(const rbf_incidence *in, const double normal[3])
{
	unsigned char some[DEGREES] = {0};
	int gaps[DEGREES + 1] = {0}, first = -1, last = -1, steps = 0, usual = 0, empty = 0;
	double across[3];
	rbf_cross3(normal, in->outgoing, across);
	for (size_t i = 0; i < in->count; i++) {
		const double angle = atan2(rbf_dot3(across, in->outgoing + 3*i), rbf_dot3(in->outgoing, in->outgoing + 3*i));
		some[(int)((angle / (2 * RBF_PI) + .5) * (DEGREES - 1))] = 1;
	}
	for (int n = 0; n < DEGREES; n++) {
		if (!some[n])
			continue;
		steps += last >= 0;
		gaps[last >= 0 ? n - last : 0]++;
		first = first < 0 ? n : first;
		last = n;
	}
	for (int n = 1, so_far = 0; n <= DEGREES && !usual; n++) {
		so_far += gaps[n];
		usual = 2 * so_far >= steps ? n : 0;
	}
	for (int n = 1; n <= DEGREES; n++)
		empty += n > GAP && n > GAP_MORE * usual ? n * gaps[n] : 0;
	return 2 * empty > last - first;
}

int rbf_scan_plane(const rbf_incidence *in, double normal[3])
{
	double beside[3];
	if (!(rough_normal(in, normal) > WIDE) || is_gaps(in, normal))
		return 0;
	fit_plane(in, 0, normal);
	if (farthest_off(in, normal, 0) <= RBF_SCAN_FLAT)
		return 1;
	memcpy(beside, normal, sizeof beside);
	const double offset = fit_plane(in, 1, beside);
	return fabs(offset) < ASIDE && farthest_off(in, beside, offset) < THIN;
}

int rbf_scan_lines(const rbf_measured *measured, int *lines)
{
	*lines = 0;
	const size_t asked = measured->count < INCIDENCES ? measured->count : INCIDENCES;
	for (size_t n = 0; n < asked && !*lines; n++) {
		const int found = on_lines(&measured->incidence[n * measured->count / asked]);
		if (found < 0)
			return -1;
		*lines = found > FEW;
	}
	return 0;
}
