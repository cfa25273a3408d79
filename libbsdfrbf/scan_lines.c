/* SPDX-License-Identifier: BSD-3-Clause */
#include "scan_lines.h"
#include "neighbours.h"

#include <stdlib.h>

enum { INCIDENCES = 8, SAMPLES = 100, FEW = 5 }; /* that are asked, at most; samples that may be on lines */

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
