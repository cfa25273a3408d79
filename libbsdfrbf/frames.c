/* SPDX-License-Identifier: BSD-3-Clause */
#include "frames.h"
#include "choose.h"
#include "fit.h"
#include "grey.h"
#include "scale.h"
#include "unseen.h"

#include <stdlib.h>

enum { FILL_ROUNDS = 2 };

static bsdfrbf_status out_of_memory(bsdfrbf_context *context)
{
	return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
}

/* Of grey fits, as if all incidences had been measured at one scale. */
static bsdfrbf_status choose_scaled(bsdfrbf_context *context, double from, double to, float lambertian, int renew, rbf_job *j)
{
	rbf_fitted *m = &j->fitted;
	free(j->scale);
	j->scale = malloc(((size_t)m->bases + 1) * sizeof *j->scale);
	const int found = j->scale ? rbf_scale_find(m, lambertian, j->scale) : -1;
	if (found <= 0) {
		free(j->scale);
		j->scale = NULL;
	}
	if (found > 0)
		rbf_scale_lobes(m, j->scale, 0);
	if (found < 0 || ((renew || found) && rbf_label_renew(m, m->candidates)))
		return out_of_memory(context);
	RBF_TRY(rbf_choose(context, m, lambertian, j->held_out, from, to, &j->choice));
	if (!found)
		return BSDFRBF_OK;
	rbf_scale_lobes(m, j->scale, 1);
	for (uint32_t b = 0; b < m->bases; b++)
		if (j->choice.base_error[b] >= 0)
			j->choice.base_error[b] = fmaxf(j->choice.base_error[b], fabsf(1 / j->scale[b] - 1));
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_frames_choose(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	rbf_grey grey;
	if (rbf_grey_begin(&j->fitted, &grey))
		return out_of_memory(context);
	const bsdfrbf_status status = choose_scaled(context, from, to, rbf_grey_of(&grey, c->lambertian), grey.lobes != NULL, j);
	rbf_grey_end(&j->fitted, &grey);
	return status;
}

/* Fits anew what was filled. */
static int fit_filled(const rbf_unseen *unseen, const float lambertian[3], rbf_job *j)
{
	rbf_fitted *m = &j->fitted;
	int failed = 0;
	for (uint32_t b = 0; b < m->bases; b++)
		if (!rbf_team_mine(m->team, b))
			rbf_lobes_free(&m->lobes[b]);
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)m->bases; b++) {
		const rbf_incidence *in = rbf_unseen_incidence(unseen, (size_t)b);
		if (!rbf_team_mine(m->team, (uint64_t)b) || in->count == j->measured.incidence[b].count)
			continue;
		rbf_lobes_free(&m->lobes[b]);
		failed |= rbf_fit(in, (int)m->channels, lambertian, j->lobes[b], 0, &m->lobes[b], NULL) != 0;
	}
	return rbf_team_failed(m->team, failed) || rbf_lobes_share(m->team, m->bases, m->channels, m->lobes);
}

bsdfrbf_status rbf_frames_fill(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	rbf_fitted *m = &j->fitted;
	if (j->measured.ready)
		return BSDFRBF_OK;
	rbf_unseen *unseen = rbf_unseen_begin(&j->measured);
	const float most = unseen ? rbf_unseen_most(unseen) : 0;
	int failed = rbf_team_failed(m->team, !unseen), more = !failed && most > 0;
	for (int round = 0; round < FILL_ROUNDS && more && !failed; round++) {
		failed = rbf_unseen_fill(unseen, m, &j->choice, c->lambertian, j->lobes, &more);
		if (failed || !more)
			break;
		j->filled = (uint32_t)ceilf(1000 * most);
		failed = fit_filled(unseen, c->lambertian, j) || rbf_label_renew(m, round + 1 < FILL_ROUNDS ? m->candidates : RBF_MAPS_LISTED);
	}
	rbf_unseen_end(unseen);
	if (failed)
		return out_of_memory(context);
	if (!j->filled)
		return BSDFRBF_OK;
	rbf_choice_free(&j->choice);
	return rbf_frames_choose(context, from, to, j, c);
}
