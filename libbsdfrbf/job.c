/* SPDX-License-Identifier: BSD-3-Clause */
#include "job.h"
#include "arrange.h"
#include "difference.h"
#include "fit_error.h"
#include "lobe_count.h"
#include "turned.h"

#include <stdlib.h>
#include <string.h>

static const double SAME_DEG = .25;      /* incidences closer than this are one */
static const double MOST = 2;            /* that an incidence counts */
static const double WORSE = 1.05;        /* times as far from held-out samples: no more than chance makes it */
static const double GRAZING_DEG = 89.5;  /* no incidence beyond */

static void free_fits(rbf_job *j)
{
	for (uint32_t b = 0; b < j->fitted.bases && j->fitted.lobes; b++)
		rbf_lobes_free(&j->fitted.lobes[b]);
	free(j->fitted.lobes);
	free(j->fit_error);
	free(j->lobes);
	free(j->scatter);
	free(j->missed);
	j->fitted.lobes = NULL;
	j->fit_error = j->scatter = j->missed = NULL;
	j->lobes = NULL;
}

void rbf_job_free(rbf_job *j)
{
	if (j->turned)
		rbf_turned_free(&j->measured);
	rbf_folded_free(&j->own);
	free_fits(j);
	free(j->measured.incidence);
	free(j->direction);
	free(j->coarse);
	free(j->guess);
	free(j->doubt);
	free(j->scale);
	rbf_label_release(&j->fitted);
	rbf_left_out_free(&j->left_out);
	rbf_choice_free(&j->choice);
}

bsdfrbf_status rbf_job_select(bsdfrbf_context *context, const rbf_measured *all, rbf_job *j)
{
	j->measured.ready = all->ready;
	j->measured.incidence = calloc(all->count + 1, sizeof *j->measured.incidence);
	j->direction = calloc(3 * all->count + 3, sizeof *j->direction);
	if (!j->measured.incidence || !j->direction)
		return rbf_out_of_memory(context);
	for (size_t i = 0; i < all->count; i++) {
		const rbf_incidence *in = &all->incidence[i];
		double theta, phi;
		rbf_job_angles(in->direction, &theta, &phi);
		if (theta > GRAZING_DEG) {
			rbf_warn(context, "%s: incidence theta %.2f phi %.2f is too close to the surface and is left out", j->name, theta, phi);
			continue;
		}
		size_t twin = j->measured.count;
		for (size_t b = 0; b < j->measured.count && twin == j->measured.count; b++) {
			const double *d = j->measured.incidence[b].direction;
			const double x = d[0] - in->direction[0], y = d[1] - in->direction[1], z = d[2] - in->direction[2];
			if (sqrt(x*x + y*y + z*z) < SAME_DEG * RBF_PI / 180)
				twin = b;
		}
		if (twin < j->measured.count) {
			double theta2, phi2;
			rbf_incidence *other = &j->measured.incidence[twin];
			rbf_job_angles(other->direction, &theta2, &phi2);
			rbf_warn(context, "%s: incidences theta %.2f phi %.2f and theta %.2f phi %.2f are nearly the same; the one with %zu samples is used",
				j->name, theta2, phi2, theta, phi, in->count > other->count ? in->count : other->count);
			if (in->count > other->count || in->lobes > other->lobes)
				*other = *in;
			continue;
		}
		j->measured.incidence[j->measured.count++] = *in;
	}
	if (!j->measured.count)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: no usable incidence (all lie in the surface's plane); check the incident angles", j->name);
	for (size_t b = 0; b < j->measured.count; b++)
		memcpy(j->direction + 3*b, j->measured.incidence[b].direction, 3 * sizeof *j->direction);
	return BSDFRBF_OK;
}

static int paired(const rbf_job *j)
{
	return j->measured.count && j->measured.incidence->paired;
}

static double mean_of(const rbf_trials *trials, const float *error)
{
	double sum = 0;
	for (uint32_t t = 0; t < trials->count; t++)
		sum += (double)error[t];
	return sum / trials->count;
}

static void set_held_out(const rbf_trials *trials, const float *error, rbf_job *j)
{
	for (uint32_t t = 0; t < trials->count; t++)
		j->fit_error[rbf_trial_base(trials, t)] = error[t];
	j->held_out = (float)mean_of(trials, error);
}

/* With numbers of lobes that are known. */
static int fit_all(const rbf_trials *trials, const float lambertian[3], rbf_job *j)
{
	rbf_fitted *m = &j->fitted;
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)m->bases; b++) {
		if (rbf_team_mine(m->team, (uint64_t)b))
			failed |= (j->measured.ready ? rbf_arrange_ready(&j->measured.incidence[b], j->channels, &m->lobes[b])
			: rbf_fit(&j->measured.incidence[b], j->channels, lambertian, j->lobes[b], 0, &m->lobes[b], NULL)) != 0;
	}
	return rbf_team_failed(m->team, failed) || rbf_lobes_share(m->team, m->bases, m->channels, m->lobes)
		|| (!j->measured.ready && rbf_fit_error(&j->measured, trials, m, lambertian, j->lobes, j->fit_error, j->scatter, j->missed));
}

bsdfrbf_status rbf_job_fit(bsdfrbf_context *context, double progress, rbf_job *j, rbf_component *c)
{
	const int64_t bases = (int64_t)j->measured.count;
	const int channels = j->channels;
	free_fits(j);
	rbf_fitted *m = &j->fitted;
	if (!j->measured.ready && rbf_fit_lambertian(m->team, &j->measured, channels, c->lambertian)) /* ready lobes contain it */
		return rbf_out_of_memory(context);
	m->bases = (uint32_t)bases;
	m->channels = (uint32_t)channels;
	m->direction = j->direction;
	m->symmetry = j->symmetry.symmetry;
	m->lobes = calloc((size_t)bases + 1, sizeof *m->lobes);
	j->fit_error = malloc(((size_t)bases + 1) * sizeof *j->fit_error);
	j->scatter = malloc(((size_t)bases + 1) * sizeof *j->scatter);
	j->missed = malloc(((size_t)bases + 1) * sizeof *j->missed);
	if (!m->lobes || !j->fit_error || !j->scatter || !j->missed)
		return rbf_out_of_memory(context);
	uint32_t *count = j->lobes = malloc(((size_t)bases + 1) * sizeof *count);
	rbf_trials trials = {0};
	float error[RBF_TRIALS_MOST];
	int failed = !count || rbf_trials_make(&trials, (size_t)bases, j->direction);
	for (int64_t b = 0; b < bases && !failed; b++) {
		count[b] = j->asked;
		j->fit_error[b] = -1;
	}
	j->held_out = -1;
	if (!failed && !j->asked && !j->measured.ready) {
		failed = rbf_lobe_count(m->team, &j->measured, &trials, channels, c->lambertian, count, error)
			|| (paired(j) && rbf_lobe_count_error(m->team, &j->measured, &trials, channels, c->lambertian, count, error));
		if (!failed)
			set_held_out(&trials, error, j);
	}
	if (failed || rbf_progress(context, "lobes", progress)) {
		rbf_trials_free(&trials);
		return failed ? rbf_out_of_memory(context) : rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	}
	failed = fit_all(&trials, c->lambertian, j);
	rbf_trials_free(&trials);
	if (failed)
		return rbf_out_of_memory(context);
	double energy = 0;
	for (int64_t b = 0; b < bases; b++)
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			energy += m->lobes[b].mass[i];
	if (!(energy + (double)c->lambertian[rbf_luminance((uint32_t)channels)] > 0))
		return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: no sample is above zero; nothing to interpolate", j->name);
	return BSDFRBF_OK;
}

/* Numbers of lobes with which paired fits are as near to held-out samples as others are, for error[]: those there are or, where these tell too little of
 * two sides that follow the same law, twice as many. Returns 1, 0 if there are none, or -1 when out of memory or a process gave up. */
static int count_paired(const rbf_trials *trials, const float lambertian[3], rbf_job *j, float *error)
{
	for (int round = 0; round < 2; round++) {
		for (size_t b = 0; b < j->measured.count && round; b++)
			j->lobes[b] *= 2;
		if (rbf_lobe_count_error(j->fitted.team, &j->measured, trials, j->channels, lambertian, j->lobes, error))
			return -1;
		if (mean_of(trials, error) <= WORSE * (double)j->held_out)
			return 1;
	}
	for (size_t b = 0; b < j->measured.count; b++)
		j->lobes[b] /= 2;
	return 0;
}

bsdfrbf_status rbf_job_pair(bsdfrbf_context *context, rbf_job *j, const rbf_component *c)
{
	rbf_trials trials = {0};
	float error[RBF_TRIALS_MOST];
	int better = 1;
	for (size_t b = 0; b < j->measured.count; b++)
		if (j->lobes[b] & ~RBF_FIT_PLACES) /* of edges that samples hardly show, each side tells for itself */
			return BSDFRBF_OK;
	for (size_t b = 0; b < j->measured.count; b++)
		j->measured.incidence[b].paired = 1;
	int failed = rbf_trials_make(&trials, j->measured.count, j->direction);
	if (!failed && !j->asked)
		better = count_paired(&trials, c->lambertian, j, error);
	failed = failed || better < 0;
	for (size_t b = 0; b < j->measured.count && !better; b++)
		j->measured.incidence[b].paired = 0;
	for (size_t b = 0; b < j->measured.count && better > 0; b++)
		rbf_lobes_free(&j->fitted.lobes[b]);
	if (!failed && better && !j->asked)
		set_held_out(&trials, error, j);
	if (!failed && better)
		failed = fit_all(&trials, c->lambertian, j);
	rbf_trials_free(&trials);
	return failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
}

int rbf_job_fit_joined(const rbf_job *former, const rbf_fold *fold, const float lambertian[3], rbf_job *j)
{
	const size_t bases = j->measured.count;
	const rbf_fitted *had = &former->fitted;
	rbf_fitted *m = &j->fitted;
	m->bases = (uint32_t)bases;
	m->channels = had->channels;
	m->direction = j->direction;
	m->symmetry = j->symmetry.symmetry;
	m->lobes = calloc(bases + 1, sizeof *m->lobes);
	j->fit_error = malloc((bases + 1) * sizeof *j->fit_error);
	j->scatter = malloc((bases + 1) * sizeof *j->scatter);
	j->missed = malloc((bases + 1) * sizeof *j->missed);
	j->lobes = malloc((bases + 1) * sizeof *j->lobes);
	j->held_out = former->held_out;
	int failed = !m->lobes || !j->fit_error || !j->scatter || !j->missed || !j->lobes;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)had->bases; b++) {
		const uint32_t to = fold[b].place;
		if (failed || fold[b].op != RBF_OP_NONE)
			continue;
		const rbf_incidence *in = &j->measured.incidence[to];
		j->fit_error[to] = former->fit_error[b];
		j->scatter[to] = former->scatter[b];
		j->missed[to] = former->missed[b];
		j->lobes[to] = former->lobes[b];
		failed |= (in->count == former->measured.incidence[b].count ? rbf_lobes_copy(&had->lobes[b], &m->lobes[to])
			: rbf_fit(in, (int)m->channels, lambertian, former->lobes[b], 0, &m->lobes[to], NULL)) != 0;
	}
	return failed ? -1 : 0;
}

int rbf_job_copy(const rbf_job *j, int own, rbf_job *other)
{
	const size_t count = j->measured.count;
	*other = (rbf_job){.name = j->name, .channels = j->channels, .asked = j->asked, .transmits = j->transmits, .measured = j->measured, .mirrored = j->mirrored,
		.symmetry = j->symmetry, .fitted = {.team = j->fitted.team, .mesh = j->fitted.mesh}};
	other->measured.incidence = malloc((count + 1) * sizeof *other->measured.incidence);
	other->direction = malloc((3 * count + 1) * sizeof *other->direction);
	if (!other->measured.incidence || !other->direction)
		return -1;
	memcpy(other->measured.incidence, j->measured.incidence, count * sizeof *j->measured.incidence);
	memcpy(other->direction, j->direction, 3 * count * sizeof *j->direction);
	other->turned = own;
	return own ? rbf_turned_copy(&other->measured, j->channels) : 0;
}

int rbf_job_compare(const rbf_job *j, const rbf_job *joined, const rbf_fold *fold, float lambertian, double error[2])
{
	uint32_t count = 0;
	error[0] = error[1] = 0;
	for (uint32_t b = 0; b < j->fitted.bases; b++) {
		const double before = (double)j->choice.base_error[b], after = (double)joined->choice.base_error[fold[b].place];
		const float x = fold[b].op & RBF_OP_X ? -1 : 1, y = fold[b].op & RBF_OP_Y ? -1 : 1, image[9] = {x, 0, 0, 0, y, 0, 0, 0, 1};
		if (before < 0 || after < 0)
			continue;
		const float apart = rbf_difference(&j->fitted.lobes[b], &joined->fitted.lobes[fold[b].place], image, lambertian, 0);
		error[0] += fmin(before, MOST);
		error[1] += fmin(hypot(after, (double)apart), MOST);
		count++;
	}
	for (int n = 0; n < 2; n++)
		error[n] /= count ? count : 1;
	return count > 0;
}
