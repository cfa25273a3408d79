/* SPDX-License-Identifier: BSD-3-Clause */
#include "others.h"
#include "cross_planes.h"
#include "difference.h"
#include "frames.h"
#include "one_plane.h"
#include "scan_lines.h"

#include <stdlib.h>
#include <string.h>

static const float OTHER_GAIN = .95f; /* of the leave-one-out error */
/* likewise, for what is guessed alike at all incidences; and for angles where facets may mirror, as they are rare there */
static const float GUESS_GAIN = .8f, ANGLES_GAIN = .9f;
static const float GUESS = .15f; /* of the difference between two guesses */
static const double CROSS_MOST = .5; /* of all light, that planes of incidence are from what others at their azimuth tell: as much is dark else */

/* Fits and choice of another job, which takes the place of the first if it predicts incidences that are left out with less than `gain` times its
 * error. */
static bsdfrbf_status try_other(bsdfrbf_context *context, double from, double to, float gain, rbf_job *j, rbf_job *other,
	rbf_component *c)
{
	float lambertian[3];
	memcpy(lambertian, c->lambertian, sizeof lambertian); /* fits set it */
	RBF_TRY(rbf_job_fit(context, from, other, c));
	if (rbf_label_prepare(&other->fitted))
		return rbf_out_of_memory(context);
	RBF_TRY(rbf_frames_choose(context, from, to, other, c));
	RBF_TRY(rbf_frames_fill(context, 0, from, to, other, c));
	if (other->choice.error < gain * j->choice.error) {
		const rbf_job former = *j;
		const int handed = !other->turned; /* samples are the former's, if anybody's */
		*j = *other;
		*other = former;
		if (handed) {
			j->turned = former.turned;
			j->own = former.own;
			j->guess = former.guess;
			other->own = (rbf_measured){0};
			other->turned = 0;
			other->guess = NULL;
		}
	} else
		memcpy(c->lambertian, lambertian, sizeof lambertian);
	return BSDFRBF_OK;
}

/* Of what is guessed, two guesses that differ tell how far it may be wrong. Returns 0, or -1 when out of memory. */
static int doubt_guess(rbf_job *j, const rbf_job *other, const rbf_component *c)
{
	const rbf_fitted *m = &j->fitted;
	free(j->guess);
	j->guess = malloc((m->bases + 1) * sizeof *j->guess);
	for (uint32_t b = 0; b < m->bases && j->guess; b++)
		j->guess[b] = GUESS * rbf_difference(&m->lobes[b], &other->fitted.lobes[b], NULL, c->lambertian[rbf_luminance(m->channels)], 0);
	return j->guess ? 0 : -1;
}

static int has_guesses(const rbf_job *j)
{
	int some = 0;
	for (size_t b = 0; b < j->measured.count; b++)
		some |= j->measured.incidence[b].guessed > 0;
	return some;
}

/* The same with light guessed beside the plane of incidence in one way. */
static bsdfrbf_status try_guess(bsdfrbf_context *context, double from, double to,
	enum rbf_falloff by, rbf_job *j, rbf_component *c)
{
	const float gain = by == RBF_FALLOFF_ANGLES && !j->transmits ? ANGLES_GAIN : has_guesses(j) ? OTHER_GAIN : GUESS_GAIN;
	rbf_job other;
	int failed = rbf_job_copy(j, 1, &other);
	for (size_t b = 0; b < j->measured.count && !failed; b++)
		failed = rbf_one_plane_complete(&other.measured.incidence[b], j->channels, by, by == RBF_FALLOFF_SLOPES ? c->lambertian : NULL, 1);
	bsdfrbf_status status = failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
	if (status == BSDFRBF_OK && has_guesses(&other)) {
		status = try_other(context, from, to, gain, j, &other, c);
		if (status == BSDFRBF_OK && has_guesses(j) && doubt_guess(j, &other, c))
			status = rbf_out_of_memory(context);
	}
	rbf_job_free(&other);
	return status;
}

/* In all ways; what guesses there are so far are by tangential components. Facets do not mirror what is transmitted. */
static bsdfrbf_status try_guesses(bsdfrbf_context *context, double from, double to, rbf_job *j, rbf_component *c)
{
	static const enum rbf_falloff by[] = {RBF_FALLOFF_COSINES, RBF_FALLOFF_SLOPES, RBF_FALLOFF_ANGLES};
	for (size_t n = has_guesses(j) ? 1 : 0; n < sizeof by / sizeof *by; n++)
		if (by[n] != RBF_FALLOFF_SLOPES || !j->transmits)
			RBF_TRY(try_guess(context, from, to, by[n], j, c));
	return BSDFRBF_OK;
}

/* By what planes of incidence at the same azimuth have in common: the best of all ways, and the next. Sets *error to that of the best. Returns 0, or -1 when out of
 * memory. */
static int rank_cross(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by[2], double *error)
{
	double of[RBF_FALLOFFS];
	by[0] = by[1] = RBF_FALLOFFS;
	for (enum rbf_falloff way = 0; way < RBF_FALLOFFS; way++) {
		if (rbf_cross_planes_error(measured, plan, way, &of[way]))
			return -1;
		for (int n = 0; n < 2; n++)
			if (by[n] == RBF_FALLOFFS || of[way] < of[by[n]]) {
				by[1] = n ? way : by[0];
				by[0] = n ? by[0] : way;
				break;
			}
	}
	*error = of[by[0]];
	return 0;
}

/* Of a material that is not isotropic, what lies beside the plane of incidence is guessed from planes at other azimuths. The second best guess tells how far it may
 * be wrong. Leaving out incidences is no judge of either: guesses are alike at all, and what is dark is told well by what is as dark. */
static bsdfrbf_status try_cross(bsdfrbf_context *context, double from, double to, rbf_job *j, rbf_component *c)
{
	float measured[3], kept[3];
	double error;
	enum rbf_falloff by[2];
	bsdfrbf_status status = BSDFRBF_OK;
	const rbf_cross_plan plan = {j->channels, j->transmits, j->symmetry.symmetry, measured};
	memcpy(measured, c->lambertian, sizeof measured);
	if (rank_cross(&j->measured, &plan, by, &error))
		return rbf_out_of_memory(context);
	for (int n = 0; n < 2 && (n ? has_guesses(j) : error < CROSS_MOST) && status == BSDFRBF_OK; n++) {
		rbf_job other;
		memcpy(kept, c->lambertian, sizeof kept);
		if (rbf_job_copy(j, 1, &other) || rbf_cross_planes_complete(&other.measured, &plan, by[n]))
			status = rbf_out_of_memory(context);
		else if (has_guesses(&other))
			status = n ? rbf_job_fit(context, from, &other, c) : try_other(context, from, to, INFINITY, j, &other, c);
		if (n)
			memcpy(c->lambertian, kept, sizeof kept);
		if (status == BSDFRBF_OK && n && has_guesses(&other) && doubt_guess(j, &other, c))
			status = rbf_out_of_memory(context);
		rbf_job_free(&other);
	}
	if (status == BSDFRBF_OK && !has_guesses(j))
		rbf_warn(context, "%s: planes of incidence do not tell what planes at other azimuths are like: what lies beside them stays dark", j->name);
	return status;
}

bsdfrbf_status rbf_others_try(bsdfrbf_context *context, double from, double to, rbf_job *j, rbf_component *c)
{
	int lines;
	if (j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	if (rbf_scan_lines(&j->measured, &lines))
		return rbf_out_of_memory(context);
	if (has_guesses(j))
		RBF_TRY(try_guesses(context, from, to, j, c));
	const int guess = lines && j->turned && !has_guesses(j);
	if (!j->turned && rbf_cross_planes_only(&j->measured)) {
		RBF_TRY(try_cross(context, from, to, j, c));
		if (has_guesses(j))
			return BSDFRBF_OK;
	}
	for (rbf_lines way = RBF_LINES_BRIDGED; way <= RBF_LINES_FILLED && lines; way++) {
		rbf_job other;
		bsdfrbf_status status = rbf_job_copy(j, 0, &other) ? rbf_out_of_memory(context) : BSDFRBF_OK;
		for (size_t b = 0; b < j->measured.count && status == BSDFRBF_OK; b++)
			other.measured.incidence[b].lines = way;
		if (status == BSDFRBF_OK)
			status = try_other(context, from, to, OTHER_GAIN, j, &other, c);
		rbf_job_free(&other);
		RBF_TRY(status);
	}
	return guess ? try_guesses(context, from, to, j, c) : BSDFRBF_OK;
}
