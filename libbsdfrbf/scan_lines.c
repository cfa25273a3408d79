/* SPDX-License-Identifier: BSD-3-Clause */
#include "scan_lines.h"
#include "neighbours.h"
#include "vector.h"

#include <stdlib.h>

enum { INCIDENCES = 8, SAMPLES = 100, FEW = 5 }; /* that are asked, at most; samples that may be on lines */

static const double WIDE = .17; /* sine: samples reach over 10 degrees of a plane */

/* How many of some samples have all neighbours on one line; -1 when out of memory. */
static int on_lines(const rbf_incidence *in)
{
	float (*w)[3] = malloc((in->count + 1) * sizeof *w);
	rbf_tree tree;
	int found = 0;
	for (size_t i = 0; i < in->count && w; i++)
		for (int a = 0; a < 3; a++)
			w[i][a] = (float)in->outgoing[3*i + (size_t)a];
	if (!w || rbf_tree_build(&tree, in->count, (const float (*)[3])w)) {
		free(w);
		return -1;
	}
	for (size_t i = 0; i < in->count; i++)
		tree.index[i] = (uint32_t)i;
	for (size_t n = 0; n < SAMPLES && in->count; n++)
		found += !(rbf_tree_gap(&tree, tree.point[n * in->count / SAMPLES], 0) > 0);
	rbf_tree_free(&tree);
	free(w);
	return found;
}

static void cross(const double a[3], const double b[3], double out[3])
{
	for (int n = 0; n < 3; n++)
		out[n] = a[(n + 1) % 3] * b[(n + 2) % 3] - a[(n + 2) % 3] * b[(n + 1) % 3];
}

int rbf_scan_plane(const rbf_incidence *in, double normal[3])
{
	const double *w = in->outgoing;
	double square = 0;
	normal[0] = normal[1] = normal[2] = 0;
	for (size_t i = 1; i < in->count; i++) { /* of the first sample and the one that is farthest from its line */
		double c[3];
		cross(w, w + 3*i, c);
		const double s = c[0]*c[0] + c[1]*c[1] + c[2]*c[2];
		if (s > square) {
			square = s;
			for (int n = 0; n < 3; n++)
				normal[n] = c[n];
		}
	}
	for (int n = 0; n < 3 && square > 0; n++)
		normal[n] /= sqrt(square);
	for (size_t i = 0; i < in->count; i++) {
		const double across = normal[0]*w[3*i] + normal[1]*w[3*i + 1] + normal[2]*w[3*i + 2];
		if (fabs(across) > RBF_SCAN_FLAT)
			return 0;
	}
	return square > WIDE * WIDE;
}

int rbf_scan_lines(const rbf_measured *measured, int *lines)
{
	*lines = 0;
	for (size_t n = 0; n < INCIDENCES && measured->count; n++) {
		const int found = on_lines(&measured->incidence[n * measured->count / INCIDENCES]);
		if (found < 0)
			return -1;
		*lines |= found > FEW;
	}
	return 0;
}
