/* SPDX-License-Identifier: BSD-3-Clause */
/* From measurements to a model: the stages in their order. */
#include "assemble.h"
#include "asymmetry.h"
#include "choose.h"
#include "cross_planes.h"
#include "difference.h"
#include "edges.h"
#include "energy.h"
#include "expect.h"
#include "fit.h"
#include "folded.h"
#include "grey.h"
#include "images.h"
#include "isotropy.h"
#include "job.h"
#include "levels.h"
#include "one_plane.h"
#include "scale.h"
#include "scan_lines.h"
#include "trend.h"
#include "tune.h"
#include "turned.h"
#include "unseen.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

static const float ASYMMETRY_NOISE = 3, ASYMMETRY_MIN = .06f; /* times the fit's error; at least */
static const float ASYMMETRY_LESS = .3f; /* of what a mirror image is off by: half a turn is meant */
static const float ISOTROPIC = .5f, OTHER_GAIN = .95f; /* of the leave-one-out error */
/* likewise, for what is guessed alike at all incidences; and for angles where facets may mirror, as what is seen too coarsely looks alike, too */
static const float GUESS_GAIN = .8f, ANGLES_GAIN = .7f;
static const float GUESS = .15f; /* of the difference between two guesses */
static const double CROSS_MOST = .5; /* of all light, that planes of incidence are from what others at their azimuth tell: as much is dark else */
static const float READY_ERROR = .14f; /* typical error of the fits in a .sir file against exact truth, which the file does not tell */

enum { FILL_ROUNDS = 2 };

void bsdfrbf_build_defaults(bsdfrbf_build_options *options)
{
	memset(options, 0, sizeof *options);
	options->size = sizeof *options;
}

static bsdfrbf_status out_of_memory(bsdfrbf_context *context)
{
	return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
}

/* What the azimuths say of the symmetry, the data may contradict: then the other one that these allow is taken, if the data agree with that;
 * else the user is told. */
static bsdfrbf_status settle_symmetry(bsdfrbf_context *context, const char *name, rbf_job *j, rbf_component *c)
{
	rbf_fitted *m = &j->fitted;
	const float lambertian = c->lambertian[rbf_luminance(m->channels)];
	const float noise = fmaxf(ASYMMETRY_NOISE * (j->measured.ready ? READY_ERROR : fmaxf(j->held_out, 0)), ASYMMETRY_MIN);
	rbf_asymmetry found, other;
	if (rbf_asymmetry_of(m, m->symmetry, lambertian, &found))
		return out_of_memory(context);
	c->facts.asymmetry = found.mean;
	if (!(found.mean > noise))
		return BSDFRBF_OK;
	if (j->symmetry.other != m->symmetry) {
		if (rbf_asymmetry_of(m, j->symmetry.other, lambertian, &other))
			return out_of_memory(context);
		if (other.mean >= 0 && other.mean < fmaxf(noise, ASYMMETRY_LESS * found.mean)) {
			char had[sizeof j->symmetry.text];
			const int asked = j->symmetry.other != RBF_UP;
			memcpy(had, j->symmetry.text, sizeof had);
			rbf_symmetry_found(j->symmetry.other, &j->symmetry);
			rbf_warn(context, "%s: as %s, the data differ from their images by %.0f %% on average, but by %.1f %% as %s: taken so%s", name, had,
				100 * (double)found.mean, 100 * (double)other.mean, j->symmetry.text, asked ? "" : "; -s decides otherwise");
			m->symmetry = j->symmetry.symmetry;
			c->facts.asymmetry = other.mean;
			if (!(other.mean > noise))
				return BSDFRBF_OK;
			found = other;
		}
	}
	double theta, phi;
	rbf_job_angles(j->direction + 3*found.base, &theta, &phi);
	rbf_warn(context, "%s: taken as %s, but the data differ from their images by %.0f %% on average and %.0f %% at theta %.1f phi %.1f; "
		"check the sample's orientation, or measure the other azimuths", name, j->symmetry.text,
		100 * (double)found.mean, 100 * (double)found.worst, theta, phi);
	return BSDFRBF_OK;
}

/* Samples beside the plane, by tangential components, if all incidences were measured in one alone; else those that were not tell more. Returns
 * 0, or -1 when out of memory. */
static int guess_beside(rbf_measured *measured, int channels)
{
	double normal[3];
	int failed = 0, only = !measured->ready;
	for (size_t b = 0; b < measured->count && only; b++)
		only = rbf_one_plane_only(&measured->incidence[b], normal);
	for (size_t b = 0; b < measured->count && only && !failed; b++)
		failed = rbf_one_plane_complete(&measured->incidence[b], channels, RBF_PLANE_COSINES, 0);
	return failed;
}

/* Incidences of an isotropic material that were measured at several azimuths, and compared, are fitted as one. */
static bsdfrbf_status join_turned(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double progress, rbf_job *j,
	rbf_component *c)
{
	const int gone = rbf_turned_join(&j->measured, channels, j->direction);
	if (gone < 0 || (gone && guess_beside(&j->measured, channels)))
		return out_of_memory(context);
	return gone ? rbf_job_fit(context, name, channels, lobes, progress, j, c) : BSDFRBF_OK;
}

/* Sets *found if other azimuths, turned about the normal, tell far more of an incidence than its neighbours do: then the material is isotropic,
 * whatever the azimuths say. Where both tell as much, azimuths are of use: frames are learned from them. */
static bsdfrbf_status find_isotropy(bsdfrbf_context *context, const char *name, const rbf_job *j, const rbf_component *c, int *found)
{
	const rbf_fitted *m = &j->fitted;
	const float left_out = j->choice.error;
	float error;
	if (j->turned || j->measured.ready || !(left_out > 0))
		return BSDFRBF_OK;
	if (rbf_isotropy_of(m, c->lambertian[rbf_luminance(m->channels)], ISOTROPIC * left_out, &error))
		return out_of_memory(context);
	if (error < 0 || error > ISOTROPIC * left_out)
		return BSDFRBF_OK;
	rbf_warn(context, "%s: turned about the normal, incidences at other azimuths differ by no more than %.1f %% on average: taken as isotropic, "
		"not as %s; -s decides otherwise", name, 100 * (double)error, j->symmetry.text);
	*found = 1;
	return BSDFRBF_OK;
}

static void tell_scale(bsdfrbf_context *context, const char *name, const rbf_job *j)
{
	for (uint32_t b = 0; b < j->fitted.bases && j->scale; b++) {
		const double times = (double)j->scale[b];
		double theta, phi;
		if (!(times < 1 || times > 1))
			continue;
		rbf_job_angles(j->direction + 3*b, &theta, &phi);
		rbf_warn(context, "%s: incidence theta %.1f phi %.1f sends %.*f times the light that those around it tell; it is kept as measured: check "
			"its scale, measure it again, or leave it out", name, theta, phi, times < .095 ? 3 : times < 9.5 ? 1 + (times < .95) : 0, times);
	}
}

static float longest(const rbf_component *c)
{
	float top = 0;
	for (uint32_t i = 0; i < c->shifts; i++)
		for (int n = 0; n < RBF_LANES; n++) {
			const rbf_shift *s = &c->shift[i];
			top = fmaxf(top, s->x[n]*s->x[n] + s->y[n]*s->y[n] + s->z[n]*s->z[n]);
		}
	return sqrtf(top);
}

static bsdfrbf_status set_facts(bsdfrbf_context *context, const rbf_job *j, rbf_component *c)
{
	const rbf_fitted *m = &j->fitted;
	rbf_base_info *info = calloc((size_t)m->bases + 1, sizeof *info);
	c->base_info = info;
	if (!info)
		return out_of_memory(context);
	const uint32_t y = rbf_luminance(m->channels);
	float *expected = calloc((size_t)m->bases + 1, sizeof *expected);
	if (!expected)
		return out_of_memory(context);
	const bsdfrbf_status status = j->measured.ready ? BSDFRBF_OK : rbf_expect(context, m, c, j->choice.base_error, j->scatter, expected);
	for (uint32_t b = 0; b < m->bases; b++) {
		float value[3];
		for (int n = 0; n < 3; n++)
			info[b].direction[n] = (float)m->direction[3*b + (uint32_t)n];
		info[b].lobes = m->lobes[b].count;
		rbf_component_dhr(c, info[b].direction, value);
		info[b].dhr = value[y] + c->lambertian[y];
		info[b].fit_error = j->fit_error[b];
		info[b].loo_error = j->choice.base_error[b];
		info[b].expected = j->guess ? hypotf(expected[b], j->guess[b]) : expected[b];
	}
	free(expected);
	c->facts.fit_error = j->held_out;
	c->facts.loo_error = j->choice.error;
	memcpy(c->facts.frame_share, j->choice.share, sizeof c->facts.frame_share);
	memcpy(c->facts.symmetry_text, j->symmetry.text, sizeof c->facts.symmetry_text);
	return status;
}

/* Chooses frames of grey fits, as if all incidences had been measured at one scale. */
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

static bsdfrbf_status choose_frames(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
{
	rbf_grey grey;
	if (rbf_grey_begin(&j->fitted, &grey))
		return out_of_memory(context);
	const bsdfrbf_status status = choose_scaled(context, from, to, rbf_grey_of(&grey, c->lambertian), grey.lobes != NULL, j);
	rbf_grey_end(&j->fitted, &grey);
	return status;
}

/* The same incidences, and their images, under a symmetry. Takes the job's place if it predicts what is left out better. */
static bsdfrbf_status try_images(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, rbf_symmetry symmetry,
	float difference, rbf_fold *fold, rbf_job *j, rbf_job *other, rbf_component *c)
{
	const char *const had = j->symmetry.text;
	const float former[3] = {c->lambertian[0], c->lambertian[1], c->lambertian[2]};
	double error[2];
	memset(&other->fitted.mesh, 0, sizeof other->fitted.mesh);
	if (rbf_folded_join(symmetry, channels, &other->measured, other->direction, fold, &other->folded))
		return out_of_memory(context);
	rbf_symmetry_found(symmetry, &other->symmetry);
	RBF_TRY(rbf_job_fit(context, name, channels, lobes, from, other, c));
	RBF_TRY(rbf_mesh_build(context, symmetry, other->measured.count, other->direction, NULL, &other->fitted.mesh));
	bsdfrbf_status status = rbf_label_prepare(&other->fitted) ? out_of_memory(context) : choose_frames(context, from, to, other, c);
	const int better = status == BSDFRBF_OK && rbf_job_compare(j, other, fold, c->lambertian[rbf_luminance((uint32_t)channels)], error)
		&& error[1] < error[0];
	if (better) {
		rbf_warn(context, "%s: images of incidences differ from what was measured around them by %.1f %% on average, as interpolation and noise do: "
			"taken as %s, not as %s; -s A keeps all apart", name, 100 * (double)difference, other->symmetry.text, had);
		const rbf_job kept = *other;
		*other = *j;
		*j = kept;
		c->mesh = j->fitted.mesh;
		c->facts.asymmetry = difference;
	} else
		memcpy(c->lambertian, former, sizeof former);
	rbf_mesh_free(&other->fitted.mesh);
	return status;
}

/* What the azimuths say of the symmetry may be less than the data show: measured all round, or over half a circle. */
static bsdfrbf_status find_images(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, rbf_job *j,
	rbf_component *c)
{
	rbf_symmetry symmetry;
	float difference = 0;
	if (j->turned || j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	RBF_TRY(rbf_images_find(context, &j->fitted, c->lambertian[rbf_luminance((uint32_t)channels)], &j->choice, j->scatter, &symmetry, &difference));
	if (symmetry == j->symmetry.symmetry)
		return BSDFRBF_OK;
	rbf_job other;
	rbf_fold *fold = malloc((j->measured.count + 1) * sizeof *fold);
	const int failed = rbf_job_copy(j, channels, 0, &other) || !fold;
	const bsdfrbf_status status = failed ? out_of_memory(context)
		: try_images(context, name, channels, lobes, from, to, symmetry, difference, fold, j, &other, c);
	free(fold);
	rbf_job_free(&other);
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

/* Fills what was not measured (unseen.h) and fits again, which tells what is still farther; in the end frames are chosen anew. */
static bsdfrbf_status fill_unseen(bsdfrbf_context *context, double from, double to, rbf_job *j, const rbf_component *c)
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
	return choose_frames(context, from, to, j, c);
}

/* Fits and choice of another job, which takes the place of the first if it predicts incidences that are left out with less than `gain` times its
 * error. */
static bsdfrbf_status try_other(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, float gain,
	rbf_job *j, rbf_job *other, rbf_component *c)
{
	float lambertian[3];
	memcpy(lambertian, c->lambertian, sizeof lambertian); /* fits set it */
	RBF_TRY(rbf_job_fit(context, name, channels, lobes, from, other, c));
	if (rbf_label_prepare(&other->fitted))
		return out_of_memory(context);
	RBF_TRY(choose_frames(context, from, to, other, c));
	RBF_TRY(fill_unseen(context, from, to, other, c));
	if (other->choice.error < gain * j->choice.error) {
		const rbf_job former = *j;
		const int handed = !other->turned; /* samples are the former's, if anybody's */
		*j = *other;
		*other = former;
		if (handed) {
			j->turned = former.turned;
			j->folded = former.folded;
			j->guess = former.guess;
			other->folded = (rbf_measured){0};
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

/* The same with light guessed beside the plane of incidence, by tangential components or by angles. */
static bsdfrbf_status try_guess(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to,
	enum rbf_one_plane by, rbf_job *j, rbf_component *c)
{
	const float gain = by == RBF_PLANE_ANGLES && !j->transmits ? ANGLES_GAIN : has_guesses(j) ? OTHER_GAIN : GUESS_GAIN;
	rbf_job other;
	int failed = rbf_job_copy(j, channels, 1, &other);
	for (size_t b = 0; b < j->measured.count && !failed; b++)
		failed = rbf_one_plane_complete(&other.measured.incidence[b], channels, by, 1);
	bsdfrbf_status status = failed ? out_of_memory(context) : BSDFRBF_OK;
	if (status == BSDFRBF_OK && has_guesses(&other)) {
		status = try_other(context, name, channels, lobes, from, to, gain, j, &other, c);
		if (status == BSDFRBF_OK && has_guesses(j) && doubt_guess(j, &other, c))
			status = out_of_memory(context);
	}
	rbf_job_free(&other);
	return status;
}

/* By what planes of incidence at the same azimuth have in common: the best of all ways, and the next. Sets *error to that of the best. Returns 0, or -1 when out of
 * memory. */
static int rank_cross(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_cross by[2], double *error)
{
	double of[RBF_CROSSES];
	by[0] = by[1] = RBF_CROSSES;
	for (enum rbf_cross way = 0; way < RBF_CROSSES; way++) {
		if (rbf_cross_planes_error(measured, plan, way, &of[way]))
			return -1;
		for (int n = 0; n < 2; n++)
			if (by[n] == RBF_CROSSES || of[way] < of[by[n]]) {
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
static bsdfrbf_status try_cross(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, rbf_job *j,
	rbf_component *c)
{
	float measured[3], kept[3];
	double error;
	enum rbf_cross by[2];
	bsdfrbf_status status = BSDFRBF_OK;
	const rbf_cross_plan plan = {channels, j->transmits, j->symmetry.symmetry, measured};
	memcpy(measured, c->lambertian, sizeof measured);
	if (rank_cross(&j->measured, &plan, by, &error))
		return out_of_memory(context);
	for (int n = 0; n < 2 && (n ? has_guesses(j) : error < CROSS_MOST) && status == BSDFRBF_OK; n++) {
		rbf_job other;
		memcpy(kept, c->lambertian, sizeof kept);
		if (rbf_job_copy(j, channels, 1, &other) || rbf_cross_planes_complete(&other.measured, &plan, by[n]))
			status = out_of_memory(context);
		else if (has_guesses(&other))
			status = n ? rbf_job_fit(context, name, channels, lobes, from, &other, c)
				: try_other(context, name, channels, lobes, from, to, INFINITY, j, &other, c);
		if (n)
			memcpy(c->lambertian, kept, sizeof kept);
		if (status == BSDFRBF_OK && n && has_guesses(&other) && doubt_guess(j, &other, c))
			status = out_of_memory(context);
		rbf_job_free(&other);
	}
	if (status == BSDFRBF_OK && !has_guesses(j))
		rbf_warn(context, "%s: planes of incidence do not tell what planes at other azimuths are like: what lies beside them stays dark", name);
	return status;
}

/* Where samples were taken along lines, whether it is smooth or dark between these, and whether other incidences tell, is told by how well each way
 * predicts incidences that are left out; likewise, of an isotropic material, whether light falls off as in the plane of incidence, and how. */
static bsdfrbf_status try_others(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, rbf_job *j,
	rbf_component *c)
{
	int lines;
	if (j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	if (rbf_scan_lines(&j->measured, &lines))
		return out_of_memory(context);
	if (has_guesses(j)) /* by tangential components so far */
		RBF_TRY(try_guess(context, name, channels, lobes, from, to, RBF_PLANE_ANGLES, j, c));
	const int guess = lines && j->turned && !has_guesses(j);
	if (!j->turned && rbf_cross_planes_only(&j->measured)) {
		RBF_TRY(try_cross(context, name, channels, lobes, from, to, j, c));
		if (has_guesses(j))
			return BSDFRBF_OK;
	}
	for (rbf_lines way = RBF_LINES_BRIDGED; way <= RBF_LINES_FILLED && lines; way++) {
		rbf_job other;
		bsdfrbf_status status = rbf_job_copy(j, channels, 0, &other) ? out_of_memory(context) : BSDFRBF_OK;
		for (size_t b = 0; b < j->measured.count && status == BSDFRBF_OK; b++)
			other.measured.incidence[b].lines = way;
		if (status == BSDFRBF_OK)
			status = try_other(context, name, channels, lobes, from, to, OTHER_GAIN, j, &other, c);
		rbf_job_free(&other);
		RBF_TRY(status);
	}
	for (enum rbf_one_plane by = RBF_PLANE_COSINES; by < RBF_PLANES && guess; by++)
		RBF_TRY(try_guess(context, name, channels, lobes, from, to, by, j, c));
	return BSDFRBF_OK;
}

/* symmetry: 0, as asked for or, if `found`, by the data. Sets *found, and goes no further, if these say that the material is isotropic. */
static bsdfrbf_status build_component(bsdfrbf_context *context, const rbf_measured *all, const char *name, int channels,
	const bsdfrbf_build_options *o, char symmetry, double from, double to, int *found, rbf_job *j, rbf_component *c)
{
	const double span = to - from;
	j->fitted.team = o->team;
	RBF_TRY(rbf_job_select(context, all, name, j));
	RBF_TRY(rbf_symmetry_choose(context, j->measured.count, j->direction, symmetry, &j->symmetry));
	if (*found)
		rbf_symmetry_found(RBF_ISOTROPIC, &j->symmetry);
	if (all->ready && o->lobes)
		rbf_warn(context, "%s: its lobes are ready in the .sir file; the number asked for does not count", name);
	if (j->symmetry.symmetry == RBF_ISOTROPIC) {
		j->turned = 1;
		if (rbf_turn(&j->measured, channels, j->direction) || guess_beside(&j->measured, channels))
			return out_of_memory(context);
	}
	if (rbf_progress(context, "lobes", from))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	RBF_TRY(rbf_job_fit(context, name, channels, (uint32_t)o->lobes, from + .2 * span, j, c));
	RBF_TRY(settle_symmetry(context, name, j, c));
	if (j->turned && !all->ready)
		RBF_TRY(join_turned(context, name, channels, (uint32_t)o->lobes, from + .2 * span, j, c));
	RBF_TRY(rbf_mesh_build(context, j->symmetry.symmetry, j->measured.count, j->direction, NULL, &j->fitted.mesh));
	c->mesh = j->fitted.mesh; /* from here on the component's */
	c->present = 1;
	if (rbf_label_prepare(&j->fitted))
		return out_of_memory(context);
	RBF_TRY(choose_frames(context, from + .4 * span, from + .6 * span, j, c));
	if (!symmetry)
		RBF_TRY(find_isotropy(context, name, j, c, found));
	if (*found && !j->turned)
		return BSDFRBF_OK;
	if (!symmetry)
		RBF_TRY(find_images(context, name, channels, (uint32_t)o->lobes, from + .6 * span, from + .8 * span, j, c));
	RBF_TRY(fill_unseen(context, from + .6 * span, from + .8 * span, j, c));
	RBF_TRY(try_others(context, name, channels, (uint32_t)o->lobes, from + .6 * span, from + .8 * span, j, c));
	c->filled = j->filled;
	tell_scale(context, name, j);
	j->fitted.scale = j->scale;
	if (rbf_assemble_sets(&j->fitted, j->choice.frames, j->choice.frame, j->choice.label, j->choice.limit, c))
		return out_of_memory(context);
	if (rbf_levels_make(&j->fitted, j->choice.even, j->choice.slopes, c))
		return out_of_memory(context);
	if (j->choice.cap > 0) {
		RBF_TRY(rbf_edges_move(context, &j->fitted, &j->choice, c));
		c->residual = 1;
	}
	if (rbf_progress(context, "tables", from + .85 * span))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	if (rbf_assemble_cull(o->team, c, longest(c)) || (j->choice.tune && rbf_tune_make(&j->fitted, j->choice.tune, c))
			|| rbf_assemble_dhr(o->team, c))
		return out_of_memory(context);
	return set_facts(context, j, c);
}

static bsdfrbf_status build(bsdfrbf_context *context, const bsdfrbf_data *data, const bsdfrbf_build_options *o, bsdfrbf_model *model)
{
	int components = 0, done = 0;
	RBF_TRY(rbf_data_check(context, data));
	for (int i = 0; i < 4; i++)
		components += data->component[i].count > 0;
	model->channels = (uint32_t)data->channels;
	for (int i = 0; i < 4; i++) {
		if (!data->component[i].count)
			continue;
		const double from = (double)done / components, to = (double)++done / components;
		const char symmetry = o->symmetry ? o->symmetry : data->component[i].isotropic ? 'I' : 0;
		int found = 0;
		bsdfrbf_status status = BSDFRBF_OK;
		for (int pass = 0; pass <= found && status == BSDFRBF_OK; pass++) {
			rbf_job j = {.transmits = i == BSDFRBF_TF || i == BSDFRBF_TB};
			rbf_component_free(&model->component[i]); /* of the former pass */
			status = build_component(context, &data->component[i], rbf_component_name(i), data->channels, o, found ? 'I' : symmetry,
				from + .6 * found * (to - from), to, &found, &j, &model->component[i]);
			rbf_job_free(&j);
		}
		RBF_TRY(status);
	}
	if (rbf_trend_set(model))
		return out_of_memory(context);
	for (int i = 0; i < 4; i++)
		if (model->component[i].present && rbf_assemble_dhr_grid(&model->component[i]))
			return out_of_memory(context);
	RBF_TRY(rbf_energy_warn(context, model, data));
	if (data->name)
		RBF_TRY(bsdfrbf_set_text(context, model, "name", data->name));
	rbf_progress(context, "done", 1);
	return BSDFRBF_OK;
}

bsdfrbf_status bsdfrbf_build(bsdfrbf_context *context, const bsdfrbf_data *data, const bsdfrbf_build_options *options,
	bsdfrbf_model **model)
{
	bsdfrbf_build_options o;
	if (!model)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_build: model is NULL");
	*model = NULL;
	bsdfrbf_build_defaults(&o);
	if (options) {
		if (options->size < sizeof o.size || options->size > 4096)
			return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_build: options were not set by bsdfrbf_build_defaults()");
		memcpy(&o, options, options->size < sizeof o ? options->size : sizeof o);
	}
	if (o.threads < 0 || o.lobes < 0 || o.lobes > 20000)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_build: threads or lobes out of range");
	if (o.team && (o.team->size < 1 || o.team->rank < 0 || o.team->rank >= o.team->size || !o.team->gather))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_build: a team needs a rank below its size, and a function to gather");
	if (!data || !data->channels)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "no measurements to build from");
	bsdfrbf_model *made = rbf_model_new();
	if (!made)
		return out_of_memory(context);
	const int threads = omp_get_max_threads(); /* a setting of the calling thread, put back below */
	if (o.threads)
		omp_set_num_threads(o.threads);
	const bsdfrbf_status status = build(context, data, &o, made);
	omp_set_num_threads(threads);
	if (status == BSDFRBF_OK)
		*model = made;
	else if (status == BSDFRBF_ERR_MEMORY && o.team)
		rbf_fail(context, status, "out of memory, or another process of the team gave up");
	if (status != BSDFRBF_OK)
		bsdfrbf_close(made);
	return status;
}
