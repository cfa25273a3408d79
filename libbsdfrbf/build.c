/* SPDX-License-Identifier: BSD-3-Clause */
/* From measurements to a model: the stages in their order. */
#include "arrange.h"
#include "assemble.h"
#include "asymmetry.h"
#include "choose.h"
#include "difference.h"
#include "edges.h"
#include "energy.h"
#include "expect.h"
#include "isotropy.h"
#include "levels.h"
#include "lobe_count.h"
#include "sample.h"
#include "scan_lines.h"
#include "trend.h"
#include "tune.h"
#include "turned.h"
#include "unseen.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

static const double SAME_DEG = .25;      /* incidences closer than this are one */
static const double GRAZING_DEG = 89.5;  /* no incidence beyond */
static const float ASYMMETRY_NOISE = 3, ASYMMETRY_MIN = .06f; /* times the fit's error; at least */
static const float ASYMMETRY_LESS = .3f; /* of what a mirror image is off by: half a turn is meant */
static const float LINES_GAIN = .95f; /* of the leave-one-out error */
static const float ISOTROPIC = .5f; /* of the leave-one-out error */
static const float READY_ERROR = .14f; /* typical error of the fits in a .sir file against exact truth, which the file does not tell */

enum { FILL_ROUNDS = 2 };

void bsdfrbf_build_defaults(bsdfrbf_build_options *options)
{
	memset(options, 0, sizeof *options);
	options->size = sizeof *options;
}

/* What one component's build holds until it is done. */
typedef struct job {
	rbf_measured measured;  /* chosen incidences; samples borrowed, unless turned */
	int turned;             /* samples are our own copies */
	double *direction;
	rbf_symmetry_choice symmetry;
	float *fit_error;
	uint32_t *lobes;        /* places of lobes in each fit, if they are ours */
	float *scatter;         /* error of the fits by expect.h, if they are ours */
	float held_out;         /* mean error of fits against samples left out, < 0: not measured */
	rbf_fitted fitted;
	rbf_choice choice;
	uint32_t filled;        /* as of rbf_component */
} job;

static void free_fits(job *j)
{
	for (uint32_t b = 0; b < j->fitted.bases && j->fitted.lobes; b++)
		rbf_lobes_free(&j->fitted.lobes[b]);
	free(j->fitted.lobes);
	free(j->fit_error);
	free(j->lobes);
	free(j->scatter);
	j->fitted.lobes = NULL;
	j->fit_error = j->scatter = NULL;
	j->lobes = NULL;
}

static void job_free(job *j)
{
	if (j->turned)
		rbf_turned_free(&j->measured);
	free_fits(j);
	free(j->measured.incidence);
	free(j->direction);
	rbf_label_release(&j->fitted);
	rbf_choice_free(&j->choice);
}

static bsdfrbf_status out_of_memory(bsdfrbf_context *context)
{
	return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
}

static void angles(const double d[3], double *theta, double *phi)
{
	*theta = atan2(hypot(d[0], d[1]), d[2]) * 180 / RBF_PI;
	*phi = *theta < 1e-3 ? 0 : fmod(atan2(d[1], d[0]) * 180 / RBF_PI + 360, 360);
}

/* Incidences worth fitting: not grazing, not the same twice. */
static bsdfrbf_status select_incidences(bsdfrbf_context *context, const rbf_measured *all, const char *name, job *j)
{
	j->measured.ready = all->ready;
	j->measured.incidence = calloc(all->count + 1, sizeof *j->measured.incidence);
	j->direction = calloc(3 * all->count + 3, sizeof *j->direction);
	if (!j->measured.incidence || !j->direction)
		return out_of_memory(context);
	for (size_t i = 0; i < all->count; i++) {
		const rbf_incidence *in = &all->incidence[i];
		double theta, phi;
		angles(in->direction, &theta, &phi);
		if (theta > GRAZING_DEG) {
			rbf_warn(context, "%s: incidence theta %.2f phi %.2f is too close to the surface and is left out", name, theta, phi);
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
			angles(other->direction, &theta2, &phi2);
			rbf_warn(context, "%s: incidences theta %.2f phi %.2f and theta %.2f phi %.2f are nearly the same; the one with %zu samples is used",
				name, theta2, phi2, theta, phi, in->count > other->count ? in->count : other->count);
			if (in->count > other->count || in->lobes > other->lobes)
				*other = *in;
			continue;
		}
		j->measured.incidence[j->measured.count++] = *in;
	}
	if (!j->measured.count)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: no usable incidence (all lie in the surface's plane); check the incident angles", name);
	for (size_t b = 0; b < j->measured.count; b++)
		memcpy(j->direction + 3*b, j->measured.incidence[b].direction, 3 * sizeof *j->direction);
	return BSDFRBF_OK;
}

static bsdfrbf_status fit_all(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double progress,
	job *j, rbf_component *c)
{
	const int64_t bases = (int64_t)j->measured.count;
	rbf_fitted *m = &j->fitted;
	if (!j->measured.ready && rbf_fit_lambertian(m->team, &j->measured, channels, c->lambertian)) /* ready lobes contain it */
		return out_of_memory(context);
	m->bases = (uint32_t)bases;
	m->channels = (uint32_t)channels;
	m->direction = j->direction;
	m->symmetry = j->symmetry.symmetry;
	m->lobes = calloc((size_t)bases + 1, sizeof *m->lobes);
	j->fit_error = malloc(((size_t)bases + 1) * sizeof *j->fit_error);
	j->scatter = malloc(((size_t)bases + 1) * sizeof *j->scatter);
	if (!m->lobes || !j->fit_error || !j->scatter)
		return out_of_memory(context);
	uint32_t *count = j->lobes = malloc(((size_t)bases + 1) * sizeof *count);
	rbf_trials trials = {0};
	float error[RBF_TRIALS_MOST];
	int failed = !count || rbf_trials_make(&trials, (size_t)bases, j->direction);
	for (int64_t b = 0; b < bases && !failed; b++) {
		count[b] = lobes;
		j->fit_error[b] = -1;
	}
	j->held_out = -1;
	if (!failed && !lobes && !j->measured.ready) {
		failed = rbf_lobe_count(m->team, &j->measured, &trials, channels, c->lambertian, count, error);
		double sum = 0;
		for (uint32_t t = 0; t < trials.count && !failed; t++) {
			j->fit_error[rbf_trial_base(&trials, t)] = error[t];
			sum += (double)error[t];
		}
		j->held_out = (float)(sum / trials.count);
	}
	if (failed || rbf_progress(context, "lobes", progress)) {
		rbf_trials_free(&trials);
		return failed ? out_of_memory(context) : rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	}
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < bases; b++) {
		if (rbf_team_mine(m->team, (uint64_t)b))
			failed |= (j->measured.ready ? rbf_arrange_ready(&j->measured.incidence[b], channels, &m->lobes[b])
			: rbf_fit(&j->measured.incidence[b], channels, c->lambertian, count[b], 0, &m->lobes[b], NULL)) != 0;
	}
	failed = rbf_team_failed(m->team, failed) || rbf_lobes_share(m->team, (uint32_t)bases, (uint32_t)channels, m->lobes)
		|| (!j->measured.ready && rbf_expect_fit(&j->measured, &trials, m, c->lambertian, count, j->scatter));
	rbf_trials_free(&trials);
	if (failed)
		return out_of_memory(context);
	double energy = 0;
	for (int64_t b = 0; b < bases; b++)
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			energy += m->lobes[b].mass[i];
	if (!(energy + (double)c->lambertian[rbf_luminance((uint32_t)channels)] > 0))
		return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: no sample is above zero; nothing to interpolate", name);
	return BSDFRBF_OK;
}

/* What the azimuths say of the symmetry, the data may contradict: then the other one that these allow is taken, if the data agree with that;
 * else the user is told. */
static bsdfrbf_status settle_symmetry(bsdfrbf_context *context, const char *name, job *j, rbf_component *c)
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
	angles(j->direction + 3*found.base, &theta, &phi);
	rbf_warn(context, "%s: taken as %s, but the data differ from their images by %.0f %% on average and %.0f %% at theta %.1f phi %.1f; "
		"check the sample's orientation, or measure the other azimuths", name, j->symmetry.text,
		100 * (double)found.mean, 100 * (double)found.worst, theta, phi);
	return BSDFRBF_OK;
}

/* Incidences of an isotropic material that were measured at several azimuths, and compared, are fitted as one. */
static bsdfrbf_status join_turned(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double progress, job *j,
	rbf_component *c)
{
	const int gone = j->measured.ready ? 0 : rbf_turned_join(&j->measured, channels, j->direction);
	if (gone <= 0)
		return gone ? out_of_memory(context) : BSDFRBF_OK;
	free_fits(j);
	return fit_all(context, name, channels, lobes, progress, j, c);
}

/* Sets *found if other azimuths, turned about the normal, tell far more of an incidence than its neighbours do: then the material is isotropic,
 * whatever the azimuths say. Where both tell as much, azimuths are of use: frames are learned from them. */
static bsdfrbf_status find_isotropy(bsdfrbf_context *context, const char *name, const job *j, const rbf_component *c, int *found)
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

static bsdfrbf_status set_facts(bsdfrbf_context *context, const job *j, rbf_component *c)
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
		info[b].expected = expected[b];
	}
	free(expected);
	c->facts.fit_error = j->held_out;
	c->facts.loo_error = j->choice.error;
	memcpy(c->facts.frame_share, j->choice.share, sizeof c->facts.frame_share);
	memcpy(c->facts.symmetry_text, j->symmetry.text, sizeof c->facts.symmetry_text);
	return status;
}

/* Fits anew what was filled. */
static int fit_filled(const rbf_unseen *unseen, const float lambertian[3], job *j)
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
static bsdfrbf_status fill_unseen(bsdfrbf_context *context, double from, double to, job *j, const rbf_component *c)
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
	return rbf_choose(context, m, c->lambertian[rbf_luminance(m->channels)], j->held_out, from, to, &j->choice);
}

/* The same incidences, if scan lines are something else to their fits. It has its own fits and choice, but borrows samples and mesh. */
static bsdfrbf_status fit_lines(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, rbf_lines lines,
	const job *j, job *other, rbf_component *c)
{
	const size_t count = j->measured.count;
	*other = (job){.measured = j->measured, .symmetry = j->symmetry, .fitted = {.team = j->fitted.team, .mesh = j->fitted.mesh}};
	other->measured.incidence = malloc((count + 1) * sizeof *other->measured.incidence);
	other->direction = malloc((3 * count + 1) * sizeof *other->direction);
	if (!other->measured.incidence || !other->direction)
		return out_of_memory(context);
	memcpy(other->direction, j->direction, 3 * count * sizeof *j->direction);
	for (size_t b = 0; b < count; b++) {
		other->measured.incidence[b] = j->measured.incidence[b];
		other->measured.incidence[b].lines = lines;
	}
	RBF_TRY(fit_all(context, name, channels, lobes, from, other, c));
	if (rbf_label_prepare(&other->fitted))
		return out_of_memory(context);
	RBF_TRY(rbf_choose(context, &other->fitted, c->lambertian[rbf_luminance((uint32_t)channels)], other->held_out, from, to, &other->choice));
	return fill_unseen(context, from, to, other, c);
}

/* Where samples were taken along lines, what lies between these is not known: whether it is smooth or dark there, and whether other incidences
 * tell, is told by how well each way predicts incidences that are left out. */
static bsdfrbf_status bridge_lines(bsdfrbf_context *context, const char *name, int channels, uint32_t lobes, double from, double to, job *j,
	rbf_component *c)
{
	int lines;
	if (j->measured.ready || !(j->choice.error > 0))
		return BSDFRBF_OK;
	if (rbf_scan_lines(&j->measured, &lines))
		return out_of_memory(context);
	for (rbf_lines way = RBF_LINES_BRIDGED; way <= RBF_LINES_FILLED && lines; way++) {
		job other;
		const bsdfrbf_status status = fit_lines(context, name, channels, lobes, from, to, way, j, &other, c);
		if (status == BSDFRBF_OK && other.choice.error < LINES_GAIN * j->choice.error) {
			const job former = *j;
			*j = other;
			other = former;
			j->turned = former.turned; /* samples are handed over */
			other.turned = 0;
		}
		job_free(&other);
		RBF_TRY(status);
	}
	return BSDFRBF_OK;
}

/* symmetry: 0, as asked for or, if `found`, by the data. Sets *found, and goes no further, if these say that the material is isotropic. */
static bsdfrbf_status build_component(bsdfrbf_context *context, const rbf_measured *all, const char *name, int channels,
	const bsdfrbf_build_options *o, char symmetry, double from, double to, int *found, job *j, rbf_component *c)
{
	const double span = to - from;
	j->fitted.team = o->team;
	RBF_TRY(select_incidences(context, all, name, j));
	RBF_TRY(rbf_symmetry_choose(context, j->measured.count, j->direction, symmetry, &j->symmetry));
	if (*found)
		rbf_symmetry_found(RBF_ISOTROPIC, &j->symmetry);
	if (all->ready && o->lobes)
		rbf_warn(context, "%s: its lobes are ready in the .sir file; the number asked for does not count", name);
	if (j->symmetry.symmetry == RBF_ISOTROPIC) {
		j->turned = 1;
		if (rbf_turn(&j->measured, channels, j->direction))
			return out_of_memory(context);
	}
	if (rbf_progress(context, "lobes", from))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	RBF_TRY(fit_all(context, name, channels, (uint32_t)o->lobes, from + .2 * span, j, c));
	RBF_TRY(settle_symmetry(context, name, j, c));
	if (j->turned)
		RBF_TRY(join_turned(context, name, channels, (uint32_t)o->lobes, from + .2 * span, j, c));
	RBF_TRY(rbf_mesh_build(context, j->symmetry.symmetry, j->measured.count, j->direction, NULL, &j->fitted.mesh));
	c->mesh = j->fitted.mesh; /* from here on the component's */
	c->present = 1;
	if (rbf_label_prepare(&j->fitted))
		return out_of_memory(context);
	RBF_TRY(rbf_choose(context, &j->fitted, c->lambertian[rbf_luminance((uint32_t)channels)], j->held_out, from + .4 * span, from + .6 * span, &j->choice));
	if (!symmetry)
		RBF_TRY(find_isotropy(context, name, j, c, found));
	if (*found && !j->turned)
		return BSDFRBF_OK;
	RBF_TRY(fill_unseen(context, from + .6 * span, from + .8 * span, j, c));
	RBF_TRY(bridge_lines(context, name, channels, (uint32_t)o->lobes, from + .6 * span, from + .8 * span, j, c));
	c->filled = j->filled;
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
	if (rbf_assemble_cull(o->team, c, longest(c)) || (j->choice.tune && rbf_tune_make(&j->fitted, j->choice.tune > 1, c))
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
			job j = {0};
			rbf_component_free(&model->component[i]); /* of the former pass */
			status = build_component(context, &data->component[i], rbf_component_name(i), data->channels, o, found ? 'I' : symmetry,
				from + .6 * found * (to - from), to, &found, &j, &model->component[i]);
			job_free(&j);
		}
		RBF_TRY(status);
	}
	if (rbf_trend_set(model))
		return out_of_memory(context);
	rbf_energy_warn(context, model);
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
