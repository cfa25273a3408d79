/* SPDX-License-Identifier: BSD-3-Clause */
#include "symmetry_told.h"
#include "asymmetry.h"
#include "cross_planes.h"
#include "expect.h"
#include "frames.h"
#include "images.h"
#include "isotropy.h"
#include "mirrored.h"
#include "offset.h"
#include "one_plane.h"
#include "turned.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ASKED = 8 }; /* incidences, at most, that tell whether there are holes */
static const float ASYMMETRY_NOISE = 3, ASYMMETRY_MIN = .06f; /* times the fit's error; at least */
static const float ASYMMETRY_LESS = .3f; /* of what a mirror image is off by: half a turn is meant */
static const float OFFSET_LESS = .33f; /* of what those by the planes were off by: all are turned about the normal, not each by another angle */
static const float ISOTROPIC = .5f; /* of the leave-one-out error */
static const double SIDES = 2; /* times the error of fits that noise makes: if one side differs by less from the mean of both than that */
static const float ALIKE = .7f; /* of the error expected between incidences: half of it is meant, and incidences differ from their mean by 2/3 of what they do from each other */
static const float READY_ERROR = .14f; /* typical error of the fits in a .sir file against exact truth, which the file does not tell */

/* What to do about data that differ from their images: the end of a sentence. */
static void advise(const rbf_offset *o, char *text, size_t size)
{
	if (o->after >= 0 && o->after < OFFSET_LESS * o->before)
		snprintf(text, size, "turned about the normal by %.1f degrees, %s, those by the mirror planes differ by %.1f %% instead of %.1f %%: %s by %.1f",
			o->degrees, o->incident_alone ? "incident directions alone" : "all directions", 100 * (double)o->after, 100 * (double)o->before,
			o->incident_alone ? "if azimuths of incidence were counted from elsewhere, change #inphi" : "if the sample was turned on its mount, change #upphi",
			o->incident_alone ? o->degrees : -o->degrees);
	else
		snprintf(text, size, "check the sample's orientation, or measure the other azimuths");
}

static void free_seen(size_t count, rbf_seen *seen)
{
	for (size_t b = 0; b < count && seen; b++)
		rbf_seen_free(&seen[b]);
	free(seen);
}

/* As the incidences were measured; *seen is NULL if some of them, and so all, were in all directions. Returns 0, or -1 when out of memory; free_seen() in either case. */
static int look(const rbf_measured *measured, rbf_seen **seen)
{
	const int64_t count = (int64_t)measured->count, step = (count + ASKED - 1) / ASKED;
	float most = 0;
	int failed = !(*seen = calloc(measured->count + 1, sizeof **seen));
	for (int pass = 0; pass < 2 && !failed && (!pass || most > .5f * RBF_SEEN_ONE_SIDED); pass++) {
		#pragma omp parallel for schedule(dynamic) reduction(|:failed) reduction(max:most)
		for (int64_t b = 0; b < count; b++)
			if (!(b % step) == !pass) {
				failed |= rbf_seen_make(&measured->incidence[b], &(*seen)[b]) != 0;
				most = fmaxf(most, (*seen)[b].share);
			}
	}
	if (!failed && !(most > .5f * RBF_SEEN_ONE_SIDED)) {
		free_seen(measured->count, *seen);
		*seen = NULL;
	}
	return failed ? -1 : 0;
}

static bsdfrbf_status settle(bsdfrbf_context *context, const rbf_seen *seen, rbf_job *j, rbf_component *c)
{
	rbf_fitted *m = &j->fitted;
	const float lambertian = c->lambertian[rbf_luminance(m->channels)];
	const float noise = fmaxf(ASYMMETRY_NOISE * (j->measured.ready ? READY_ERROR : fmaxf(j->held_out, 0)), ASYMMETRY_MIN);
	rbf_asymmetry found, other;
	if (rbf_asymmetry_of(m, m->symmetry, lambertian, seen, &found))
		return rbf_out_of_memory(context);
	c->facts.asymmetry = found.mean;
	if (!(found.mean > noise))
		return BSDFRBF_OK;
	if (j->symmetry.other != m->symmetry) {
		if (rbf_asymmetry_of(m, j->symmetry.other, lambertian, seen, &other))
			return rbf_out_of_memory(context);
		if (other.mean >= 0 && other.mean < fmaxf(noise, ASYMMETRY_LESS * found.mean)) {
			char had[sizeof j->symmetry.text];
			const int asked = j->symmetry.other != RBF_UP;
			memcpy(had, j->symmetry.text, sizeof had);
			rbf_symmetry_found(j->symmetry.other, &j->symmetry);
			rbf_warn(context, "%s: as %s, the data differ from their images by %.0f %% on average, but by %.1f %% as %s: taken so%s", j->name, had,
				100 * (double)found.mean, 100 * (double)other.mean, j->symmetry.text, asked ? "" : "; -s decides otherwise");
			m->symmetry = j->symmetry.symmetry;
			c->facts.asymmetry = other.mean;
			if (!(other.mean > noise))
				return BSDFRBF_OK;
			found = other;
		}
	}
	double theta, phi;
	char advice[300];
	rbf_offset offset;
	rbf_job_angles(j->direction + 3*found.base, &theta, &phi);
	if (rbf_offset_find(m, m->symmetry, lambertian, &offset))
		return rbf_out_of_memory(context);
	advise(&offset, advice, sizeof advice);
	rbf_warn(context, "%s: taken as %s, but the data differ from their images by %.0f %% on average and %.0f %% at theta %.1f phi %.1f; %s",
		j->name, j->symmetry.text, 100 * (double)found.mean, 100 * (double)found.worst, theta, phi, advice);
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_told_settle(bsdfrbf_context *context, rbf_job *j, rbf_component *c)
{
	rbf_seen *seen = NULL;
	const int failed = !j->measured.ready && j->symmetry.symmetry != RBF_ANISOTROPIC && look(&j->measured, &seen);
	const bsdfrbf_status status = failed ? rbf_out_of_memory(context) : settle(context, seen, j, c);
	free_seen(j->measured.count, seen);
	return status;
}

/* Again for another symmetry, if need be. Returns 0, or -1 when out of memory. */
static int add_mirrored(rbf_job *j)
{
	float most;
	const int failed = rbf_mirrored_add(j->symmetry.symmetry, j->channels, j->turned, &j->measured, &j->own, &most);
	j->mirrored = (uint32_t)ceilf(1000 * most);
	return failed;
}

/* Whether the sides of planes of incidence differ by no more than noise does, such that their mean is nearer to the truth than each. */
static int alike(const rbf_job *j, const rbf_component *c)
{
	double noise = 0;
	for (uint32_t b = 0; b < j->fitted.bases; b++)
		noise += (double)j->scatter[b] / j->fitted.bases;
	return (double)c->facts.asymmetry < SIDES * noise;
}

bsdfrbf_status rbf_told_join(bsdfrbf_context *context, double progress, rbf_job *j, rbf_component *c)
{
	const int gone = j->turned ? rbf_turned_join(&j->measured, j->channels, j->direction) : 0;
	if (gone < 0 || (gone && rbf_one_plane_beside(&j->measured, j->channels)) || add_mirrored(j))
		return rbf_out_of_memory(context);
	if (gone || j->mirrored)
		RBF_TRY(rbf_job_fit(context, progress, j, c));
	return j->turned && !j->measured.ready && alike(j, c) ? rbf_job_pair(context, j, c) : BSDFRBF_OK;
}

bsdfrbf_status rbf_told_isotropic(bsdfrbf_context *context, rbf_job *j, const rbf_component *c, int *found)
{
	const rbf_fitted *m = &j->fitted;
	rbf_isotropy is;
	char repeated[100] = "";
	j->azimuths = -1;
	if (j->turned || j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	rbf_seen *seen = NULL;
	const float *scatter = rbf_cross_planes_only(&j->measured) ? NULL : j->scatter; /* fits are dark beside planes */
	const int failed = look(&j->measured, &seen)
		|| rbf_isotropy_of(m, c->lambertian[rbf_luminance(m->channels)], scatter, seen, ISOTROPIC * j->choice.error, &is);
	free_seen(j->measured.count, seen);
	if (failed)
		return rbf_out_of_memory(context);
	j->azimuths = is.error < 0 || !scatter ? -1 : is.beyond;
	if (!is.isotropic)
		return BSDFRBF_OK;
	if (is.folds)
		snprintf(repeated, sizeof repeated, " (a material that repeats every %.0f degrees may look the same)", 360. / is.folds);
	rbf_warn(context, "%s: turned about the normal, incidences at other azimuths differ by no more than %.1f %% on average%s: taken as isotropic, "
		"not as %s; -s decides otherwise", j->name, 100 * (double)is.error, repeated, j->symmetry.text);
	*found = 1;
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_told_alike(bsdfrbf_context *context, const rbf_job *j, const rbf_component *c, int *found)
{
	const rbf_symmetry is = j->symmetry.symmetry;
	if (j->azimuths < 0 || j->doubt || j->guess) /* what was not measured tells nothing of azimuths */
		return BSDFRBF_OK;
	const float expected = rbf_expected_mean(c);
	if (!(j->azimuths < ALIKE * expected))
		return BSDFRBF_OK;
	rbf_warn(context, "%s: turned about the normal, incidences at other azimuths differ by %.1f %% beyond noise, less than interpolation between so few azimuths errs "
		"(%.0f %%): taken as isotropic, not as %s; -s %c keeps that, and more azimuths would tell", j->name, 100 * (double)j->azimuths, 100 * (double)expected,
		j->symmetry.text, is == RBF_BILATERAL_X || is == RBF_BILATERAL_Y ? 'B' : (char)is);
	*found = RBF_TOLD_LATE;
	return BSDFRBF_OK;
}

/* The same incidences, and their images, under a symmetry. Takes the job's place if it predicts what is left out better. */
static bsdfrbf_status try_images(bsdfrbf_context *context, double from, double to, rbf_symmetry symmetry,
	float difference, rbf_fold *fold, rbf_job *j, rbf_job *other, rbf_component *c)
{
	const char *const had = j->symmetry.text;
	double error[2];
	memset(&other->fitted.mesh, 0, sizeof other->fitted.mesh);
	rbf_mirrored_drop(&other->measured);
	if (rbf_folded_join(symmetry, j->channels, &other->measured, other->direction, fold, &other->own))
		return rbf_out_of_memory(context);
	rbf_symmetry_found(symmetry, &other->symmetry);
	if (add_mirrored(other))
		return rbf_out_of_memory(context);
	if (rbf_job_fit_joined(j, fold, c->lambertian, other))
		return rbf_out_of_memory(context);
	RBF_TRY(rbf_mesh_build(context, symmetry, other->measured.count, other->direction, NULL, &other->fitted.mesh));
	bsdfrbf_status status = rbf_label_prepare(&other->fitted) ? rbf_out_of_memory(context) : rbf_frames_first(context, from, to, other, c);
	if (status == BSDFRBF_OK && rbf_job_compare(j, other, fold, c->lambertian[rbf_luminance((uint32_t)j->channels)], error) && error[1] < error[0]) {
		rbf_warn(context, "%s: images of incidences differ from what was measured around them by %.1f %% on average, as interpolation and noise do: "
			"taken as %s, not as %s; -s %c keeps them apart", j->name, 100 * (double)difference, other->symmetry.text, had,
			j->symmetry.symmetry == RBF_ANISOTROPIC || j->symmetry.symmetry == RBF_UP ? (char)j->symmetry.symmetry : 'B');
		if (rbf_folded_merge(&other->own, &j->own))
			status = rbf_out_of_memory(context);
		const rbf_job former = *j;
		*j = *other;
		*other = former;
		j->left_out.fitted = &j->fitted;
		c->mesh = j->fitted.mesh;
		c->facts.asymmetry = difference;
	}
	rbf_mesh_free(&other->fitted.mesh);
	return status;
}

bsdfrbf_status rbf_told_images(bsdfrbf_context *context, double from, double to, rbf_job *j, rbf_component *c)
{
	rbf_symmetry symmetry;
	float difference = 0;
	if (j->turned || j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	RBF_TRY(rbf_images_find(context, &j->left_out, c->lambertian[rbf_luminance((uint32_t)j->channels)], &j->choice, j->scatter, &symmetry, &difference));
	if (symmetry == j->symmetry.symmetry)
		return BSDFRBF_OK;
	rbf_job other;
	rbf_fold *fold = malloc((j->measured.count + 1) * sizeof *fold);
	const int failed = rbf_job_copy(j, 0, &other) || !fold;
	const bsdfrbf_status status = failed ? rbf_out_of_memory(context)
		: try_images(context, from, to, symmetry, difference, fold, j, &other, c);
	free(fold);
	rbf_job_free(&other);
	return status;
}
