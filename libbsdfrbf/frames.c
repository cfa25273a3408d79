/* SPDX-License-Identifier: BSD-3-Clause */
#include "frames.h"
#include "choose.h"
#include "fit.h"
#include "grey.h"
#include "scale.h"
#include "unseen.h"

#include <stdlib.h>

enum { FILL_LEAST = 2, FILL_MOST = 12 }; /* rounds: each comes one incidence farther */
static const float FILL_MORE = .97f;      /* another one, if the last left that much or less of what was unknown where devices reach */

/* Part of the choice, as if all incidences had been measured at one scale. */
static bsdfrbf_status choose_scaled(bsdfrbf_context *context, double from, double to, float lambertian, int first, int renew, rbf_job *j)
{
	rbf_fitted *m = &j->fitted;
	if (j->scale)
		rbf_scale_lobes(m, j->scale, 0);
	bsdfrbf_status status = (renew || j->scale) && rbf_label_renew(m, m->candidates) ? rbf_out_of_memory(context) : BSDFRBF_OK;
	if (status == BSDFRBF_OK && first)
		status = rbf_left_out_make(context, m, lambertian, 0, &j->left_out);
	if (status == BSDFRBF_OK)
		status = first ? rbf_choose_first(context, &j->left_out, from, to, &j->choice)
			: rbf_choose(context, &j->left_out, lambertian, j->held_out, from, to, &j->choice);
	if (!j->scale || status != BSDFRBF_OK)
		return status;
	rbf_scale_lobes(m, j->scale, 1);
	for (uint32_t b = 0; b < m->bases && !first; b++)
		if (j->choice.base_error[b] >= 0)
			j->choice.base_error[b] = fmaxf(j->choice.base_error[b], fabsf(1 / j->scale[b] - 1));
	return BSDFRBF_OK;
}

/* Of grey fits. */
static bsdfrbf_status choose_grey(bsdfrbf_context *context, double from, double to, int first, rbf_job *j, const rbf_component *c)
{
	rbf_grey grey;
	if (rbf_grey_begin(&j->fitted, &grey))
		return rbf_out_of_memory(context);
	const bsdfrbf_status status = choose_scaled(context, from, to, rbf_grey_of(&grey, c->lambertian), first, grey.lobes != NULL, j);
	rbf_grey_end(&j->fitted, &grey);
	return status;
}

bsdfrbf_status rbf_frames_first(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	rbf_fitted *m = &j->fitted;
	rbf_left_out_free(&j->left_out);
	free(j->scale);
	j->scale = malloc(((size_t)m->bases + 1) * sizeof *j->scale);
	const int found = j->scale ? rbf_scale_find(m, c->lambertian[rbf_luminance(m->channels)], j->scale) : -1;
	if (found <= 0) {
		free(j->scale);
		j->scale = NULL;
	}
	return found < 0 ? rbf_out_of_memory(context) : choose_grey(context, from, to, 1, j, c);
}

bsdfrbf_status rbf_frames_rest(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	const bsdfrbf_status status = choose_grey(context, from, to, 0, j, c);
	rbf_left_out_free(&j->left_out);
	return status;
}

bsdfrbf_status rbf_frames_choose(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	RBF_TRY(rbf_frames_first(context, from, to, j, c));
	return rbf_frames_rest(context, from, to, j, c);
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

static void tell_wide(bsdfrbf_context *context, const rbf_unseen *unseen, const rbf_job *j)
{
	size_t first = 0;
	double theta, phi;
	const size_t wide = rbf_unseen_wide(unseen, &first);
	if (!wide)
		return;
	rbf_job_angles(j->direction + 3*first, &theta, &phi);
	rbf_warn(context, "%s: more than a quarter of what leaves within 60 degrees of the normal was not measured at %zu of %zu incidences, first at theta %.1f phi %.1f: "
		"%s; measure it", j->name, wide, j->measured.count, theta, phi, j->filled ? "what the incidences around tell is a guess" : "only a smooth continuation is there");
}

/* The error that what was not measured is likely to have. Returns 0, or -1 when out of memory. */
static int doubt(const rbf_unseen *unseen, const float lambertian[3], rbf_job *j)
{
	free(j->doubt);
	j->doubt = malloc((j->fitted.bases + 1) * sizeof *j->doubt);
	return j->doubt ? rbf_unseen_doubt(unseen, &j->fitted, lambertian, j->doubt) : -1;
}

bsdfrbf_status rbf_frames_fill(bsdfrbf_context *context, int tell, double from, double to, rbf_job *j, const rbf_component *c)
{
	rbf_fitted *m = &j->fitted;
	if (j->measured.ready)
		return BSDFRBF_OK;
	rbf_unseen *unseen = rbf_unseen_begin(&j->measured);
	const float most = unseen ? rbf_unseen_most(unseen) : 0;
	int failed = rbf_team_failed(m->team, !unseen), more = !failed && most > 0;
	float left = 1;
	for (int round = 0; round < FILL_MOST && more && !failed; round++) {
		const float former = left;
		failed = rbf_unseen_fill(unseen, m, &j->choice, c->lambertian, j->lobes, &more);
		if (failed || !more)
			break;
		j->filled = (uint32_t)ceilf(1000 * most);
		left = rbf_unseen_left(unseen);
		more = round + 1 < FILL_LEAST || (round + 1 < FILL_MOST && left < FILL_MORE * former);
		failed = fit_filled(unseen, c->lambertian, j) || rbf_label_renew(m, more ? m->candidates : RBF_MAPS_LISTED);
	}
	if (!failed && most > 0)
		failed = rbf_team_failed(m->team, doubt(unseen, c->lambertian, j));
	if (!failed && tell)
		tell_wide(context, unseen, j);
	rbf_unseen_end(unseen);
	if (failed)
		return rbf_out_of_memory(context);
	if (!j->filled)
		return BSDFRBF_OK;
	rbf_choice_free(&j->choice);
	return rbf_frames_choose(context, from, to, j, c);
}
