/* SPDX-License-Identifier: BSD-3-Clause */
#include "diagonals.h"
#include "assemble.h"
#include "extent.h"
#include "levels.h"
#include "sample.h"

#include <stdlib.h>

enum { DRAWS = 64 }; /* of what is told, and of what is */

/* What judges trials: the lobes by their frames. */
typedef struct judge {
	const rbf_fitted *fitted;
	const rbf_choice *choice;
} judge;

/* Sums of |one - other| over what both say together, by directions drawn from `one`, which has these corners. */
static double apart(const rbf_site *one, const rbf_site *other, const rbf_vertex vertex[3], const float weight[3], int *drawn)
{
	const uint32_t y = rbf_luminance(one->component->channels);
	rbf_sampler sampler;
	double sum = 0;
	rbf_draws *draws = rbf_draws_of_corners(one->component, vertex, weight);
	rbf_sampler_set(one, draws, NULL, &sampler);
	for (int i = 0; i < DRAWS; i++) {
		float o[3], folded[3], a[3], b[3];
		if (!rbf_site_sample(one, &sampler, (i + .5) / DRAWS, o))
			continue;
		rbf_site_fold(one, o, folded);
		rbf_site_dsf(one, folded, a);
		rbf_site_dsf(other, folded, b);
		if (!(a[y] + b[y] > 0))
			continue;
		sum += fabs((double)a[y] - (double)b[y]) / (double)(a[y] + b[y]);
		++*drawn;
	}
	free(draws);
	return sum;
}

/* L1 of what is told against the incidence's own lobes. */
static float trial_error(const rbf_component *c, const rbf_mesh_trial *trial)
{
	static const float whole[3] = {1, 0, 0};
	const rbf_vertex own[3] = {trial->vertex, trial->vertex, trial->vertex};
	rbf_site told, is;
	int drawn = 0;
	rbf_site_corners(c, trial->vertex.direction, trial->from, trial->weight, &told);
	rbf_site_corners(c, trial->vertex.direction, own, whole, &is);
	const double sum = apart(&told, &is, trial->from, trial->weight, &drawn) + apart(&is, &told, own, whole, &drawn);
	return drawn ? (float)(2 * sum / drawn) : 0;
}

static int try_all(void *data, size_t count, const rbf_mesh_trial *trial, float *error)
{
	const judge *j = data;
	const rbf_fitted *m = j->fitted;
	const rbf_choice *choice = j->choice;
	rbf_component c = {0};
	int failed = rbf_assemble_sets(m, choice->frames, choice->frame, choice->label, choice->limit, &c) != 0;
	c.extent = failed ? NULL : rbf_extent_make(c.block, c.blocks);
	failed = !c.extent || rbf_levels_make(m, choice->even, choice->slopes, &c);
	#pragma omp parallel for schedule(dynamic)
	for (int64_t i = 0; i < (int64_t)count; i++)
		if (!failed && rbf_team_mine(m->team, (uint64_t)i))
			error[i] = trial_error(&c, &trial[i]);
	rbf_assemble_release(&c);
	free((void *)c.extent);
	free((void *)c.level);
	return rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, count, sizeof *error, error) ? -1 : 0;
}

bsdfrbf_status rbf_diagonals_choose(bsdfrbf_context *context, const rbf_choice *choice, rbf_fitted *m, rbf_component *component)
{
	judge j = {m, choice};
	rbf_mesh mesh;
	if (m->symmetry == RBF_ISOTROPIC)
		return BSDFRBF_OK;
	RBF_TRY(rbf_mesh_build_judged(context, m->symmetry, m->bases, m->direction, try_all, &j, &mesh));
	rbf_mesh_free(&component->mesh);
	component->mesh = m->mesh = mesh;
	return BSDFRBF_OK;
}
