/* SPDX-License-Identifier: BSD-3-Clause */
#include "scan_lines.h"
#include "neighbours.h"
#include "vector3.h"

enum { INCIDENCES = 8, SAMPLES = 100, FEW = 5 }; /* that are asked, at most; samples that may be on lines */

static const double WIDE = .17; /* sine: samples reach over 10 degrees of a plane */

/* How many of some samples have all neighbours on one line; -1 when out of memory. */
static int on_lines(const rbf_incidence *in)
{
	rbf_tree tree;
	int found = 0;
	if (rbf_tree_of(&tree, in->count, in->outgoing))
		return -1;
	for (size_t i = 0; i < in->count; i++)
		tree.index[i] = (uint32_t)i;
	for (size_t n = 0; n < SAMPLES && in->count; n++)
		found += !(rbf_tree_gap(&tree, tree.point[n * in->count / SAMPLES], 0) > 0);
	rbf_tree_free(&tree);
	return found;
}

int rbf_scan_plane(const rbf_incidence *in, double normal[3])
{
	const double *w = in->outgoing;
	double square = 0;
	normal[0] = normal[1] = normal[2] = 0;
	for (size_t i = 1; i < in->count; i++) { /* of the first sample and the one that is farthest from its line */
		double c[3];
		rbf_cross3(w, w + 3*i, c);
		const double s = rbf_dot3(c, c);
		if (s > square) {
			square = s;
			for (int n = 0; n < 3; n++)
				normal[n] = c[n];
		}
	}
	rbf_unit3(normal);
	for (size_t i = 0; i < in->count; i++)
		if (fabs(rbf_dot3(normal, w + 3*i)) > RBF_SCAN_FLAT)
			return 0;
	return square > WIDE * WIDE;
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
