/* SPDX-License-Identifier: BSD-3-Clause */
#include "folded.h"
#include "vector3.h"

#include <stdlib.h>
#include <string.h>

static const double SAME = .25 * RBF_PI / 180; /* as far as devices repeat a direction */

static void mirror(unsigned op, const double d[3], double image[3])
{
	image[0] = op & RBF_OP_X ? -d[0] : d[0];
	image[1] = op & RBF_OP_Y ? -d[1] : d[1];
	image[2] = d[2];
}

void rbf_folded_free(rbf_measured *own)
{
	for (size_t b = 0; b < own->count; b++) {
		free(own->incidence[b].outgoing);
		free(own->incidence[b].dsf);
	}
	free(own->incidence);
	*own = (rbf_measured){0};
}

int rbf_folded_merge(rbf_measured *own, rbf_measured *more)
{
	rbf_incidence *all = realloc(own->incidence, (own->count + more->count + 1) * sizeof *all);
	if (!all)
		return -1;
	if (more->count)
		memcpy(all + own->count, more->incidence, more->count * sizeof *all);
	free(more->incidence);
	*own = (rbf_measured){.count = own->count + more->count, .incidence = all};
	*more = (rbf_measured){0};
	return 0;
}

/* Appends mirrored samples of another to those that an incidence has of its own. */
static int append(rbf_incidence *to, const rbf_incidence *other, unsigned op, size_t channels)
{
	const size_t had = to->count;
	if (rbf_incidence_append(to, other, channels))
		return -1;
	for (size_t i = had; i < to->count; i++)
		mirror(op, to->outgoing + 3*i, to->outgoing + 3*i);
	return 0;
}

/* Where an incidence has its image among those before it, if it has. */
static int find(rbf_symmetry symmetry, size_t kept, const double *direction, const double d[3], rbf_fold *fold)
{
	int op[4];
	const int ops = rbf_symmetry_ops(symmetry, op);
	for (size_t a = 0; a < kept; a++)
		for (int k = 1; k < ops; k++) {
			double image[3];
			mirror((unsigned)op[k], d, image);
			for (int n = 0; n < 3; n++)
				image[n] -= direction[3*a + (size_t)n];
			if (rbf_dot3(image, image) < SAME * SAME) {
				*fold = (rbf_fold){(uint32_t)a, (uint32_t)op[k]};
				return 1;
			}
		}
	return 0;
}

int rbf_folded_join(rbf_symmetry symmetry, int channels, rbf_measured *measured, double *direction, rbf_fold *fold, rbf_measured *own)
{
	const size_t count = measured->count;
	size_t kept = 0;
	rbf_incidence **mine = calloc(count + 1, sizeof *mine); /* of those kept, those that are in `own` */
	*own = (rbf_measured){.incidence = malloc((count + 1) * sizeof *own->incidence)};
	int failed = !mine || !own->incidence;
	for (size_t b = 0; b < count && !failed; b++) {
		const rbf_incidence in = measured->incidence[b];
		if (!find(symmetry, kept, direction, in.direction, &fold[b])) {
			fold[b] = (rbf_fold){(uint32_t)kept, RBF_OP_NONE};
			measured->incidence[kept] = in;
			memcpy(direction + 3 * kept++, in.direction, sizeof in.direction);
			continue;
		}
		rbf_incidence *to = mine[fold[b].place];
		if (!to) {
			const rbf_incidence *first = &measured->incidence[fold[b].place];
			to = mine[fold[b].place] = &own->incidence[own->count++];
			*to = *first;
			to->outgoing = NULL;
			to->dsf = NULL;
			to->count = 0;
			failed = append(to, first, RBF_OP_NONE, (size_t)channels);
		}
		failed = failed || append(to, &in, fold[b].op, (size_t)channels);
	}
	for (size_t a = 0; a < kept && !failed; a++)
		if (mine[a])
			measured->incidence[a] = *mine[a];
	measured->count = failed ? 0 : kept;
	free(mine);
	return failed ? -1 : 0;
}
