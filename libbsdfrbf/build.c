/* SPDX-License-Identifier: BSD-3-Clause */
/* From measurements to a model: the stages in their order. */
#include "assemble.h"
#include "diagonals.h"
#include "edges.h"
#include "energy.h"
#include "expect.h"
#include "frames.h"
#include "levels.h"
#include "detector_limits.h"
#include "one_plane.h"
#include "others.h"
#include "repeated.h"
#include "spikes.h"
#include "symmetry_told.h"
#include "tell.h"
#include "trend.h"
#include "tune.h"
#include "turned.h"
#include "unread.h"
#include "unsteady.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void bsdfrbf_build_defaults(bsdfrbf_build_options *options)
{
	memset(options, 0, sizeof *options);
	options->size = sizeof *options;
}

/* Says what was left out, and notes it in a text of the model. */
static bsdfrbf_status tell_left_out(bsdfrbf_context *context, const char *name, const rbf_measured *all, const rbf_faults *found, const char *why,
	const char *key, bsdfrbf_model *model)
{
	char text[512];
	double theta, phi;
	if (!found->samples)
		return BSDFRBF_OK;
	rbf_job_angles(all->incidence[found->first].direction, &theta, &phi);
	rbf_warn(context, "%s: %zu samples at %zu of %zu incidences, the first at theta %.2f phi %.2f, %s", name, found->samples, found->incidences, all->count,
		theta, phi, why);
	const char *before = bsdfrbf_get_text(model, key);
	snprintf(text, sizeof text, "%s%s%s %zu samples", before, *before ? ", " : "", name, found->samples);
	return bsdfrbf_set_text(context, model, key, text);
}

static void tell_limits(bsdfrbf_context *context, const char *name, const rbf_measured *measured, int channels)
{
	static const double MUCH = .02;
	const rbf_limits found = rbf_limits_of(measured, channels);
	double theta, phi;
	if (found.clipped) {
		rbf_job_angles(measured->incidence[found.first].direction, &theta, &phi);
		rbf_warn(context, "%s: %zu samples at %zu incidences, the first at theta %.2f phi %.2f, share the highest value there is: a detector that was "
			"saturated does this, and light is brighter there than what is recorded: measure these with less light", name, found.clipped, found.incidences,
			theta, phi);
	}
	if ((double)found.lowest > MUCH * (double)found.samples)
		rbf_warn(context, "%s: %.0f %% of the samples share the lowest value of their incidence, as where a detector's floor or coarse numbers end: light may be "
			"fainter there than what is recorded", name, 100 * (double)found.lowest / (double)found.samples);
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

/* A scan that is off by some factor as a whole is an error of its own fit. */
static bsdfrbf_status set_expected(bsdfrbf_context *context, const rbf_job *j, const rbf_component *c, rbf_base_info *info)
{
	static const double MEAN = .8; /* of |x|, of a normal distribution, over the standard deviation */
	const rbf_fitted *m = &j->fitted;
	float *expected = calloc(2 * (size_t)m->bases + 1, sizeof *expected);
	if (!expected)
		return rbf_out_of_memory(context);
	float *own = expected + m->bases;
	bsdfrbf_status status = BSDFRBF_OK;
	for (uint32_t b = 0; b < m->bases; b++)
		own[b] = info[b].dhr;
	const double gain = j->measured.ready ? 0 : rbf_unsteady(m->symmetry, m->bases, m->direction, own);
	for (uint32_t b = 0; b < m->bases && !j->measured.ready; b++)
		own[b] = hypotf(j->scatter[b], (float)(MEAN * gain));
	if (gain < 0)
		status = rbf_out_of_memory(context);
	else if (!j->measured.ready)
		status = rbf_expect(context, m, c, &(rbf_errors){j->choice.base_error, own, j->missed}, expected);
	for (uint32_t b = 0; b < m->bases; b++) {
		info[b].expected = j->guess ? hypotf(expected[b], j->guess[b]) : expected[b];
		if (j->doubt)
			info[b].expected = hypotf(info[b].expected, j->doubt[b]);
	}
	free(expected);
	return status;
}

static bsdfrbf_status set_facts(bsdfrbf_context *context, rbf_job *j, rbf_component *c)
{
	const rbf_fitted *m = &j->fitted;
	rbf_base_info *info = calloc((size_t)m->bases + 1, sizeof *info);
	c->base_info = info;
	if (!info)
		return rbf_out_of_memory(context);
	const uint32_t y = rbf_luminance(m->channels);
	for (uint32_t b = 0; b < m->bases; b++) {
		float value[3];
		for (int n = 0; n < 3; n++)
			info[b].direction[n] = (float)m->direction[3*b + (uint32_t)n];
		info[b].lobes = m->lobes[b].count;
		rbf_component_dhr(c, info[b].direction, value);
		info[b].dhr = value[y] + c->lambertian[y];
		info[b].fit_error = j->fit_error[b];
		info[b].loo_error = j->choice.base_error[b];
	}
	RBF_TRY(rbf_tell_coarse(context, j, info));
	const bsdfrbf_status status = set_expected(context, j, c, info);
	c->facts.fit_error = j->held_out;
	c->facts.loo_error = j->choice.error;
	memcpy(c->facts.frame_share, j->choice.share, sizeof c->facts.frame_share);
	memcpy(c->facts.symmetry_text, j->symmetry.text, sizeof c->facts.symmetry_text);
	return status;
}

/* symmetry: 0, as asked for or, if `found`, by the data. Sets *found if these say that the material is isotropic, and goes no
 * further, unless that turns out only when the component is done. */
static bsdfrbf_status build_component(bsdfrbf_context *context, const rbf_measured *all, char symmetry, double from, double to, int *found,
	rbf_job *j, rbf_component *c)
{
	const double span = to - from;
	RBF_TRY(rbf_job_select(context, all, j));
	RBF_TRY(rbf_symmetry_choose(context, j->measured.count, j->direction, symmetry, &j->symmetry));
	if (*found)
		rbf_symmetry_found(RBF_ISOTROPIC, &j->symmetry);
	if (all->ready && j->asked)
		rbf_warn(context, "%s: its lobes are ready in the .sir file; the number asked for does not count", j->name);
	if (j->symmetry.symmetry == RBF_ISOTROPIC) {
		j->turned = 1;
		if (rbf_turn(&j->measured, j->channels, j->direction) || rbf_one_plane_beside(&j->measured, j->channels))
			return rbf_out_of_memory(context);
	}
	if (rbf_progress(context, "lobes", from))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	RBF_TRY(rbf_job_fit(context, from + .2 * span, j, c));
	RBF_TRY(rbf_told_settle(context, j, c));
	if (!all->ready)
		RBF_TRY(rbf_told_join(context, from + .2 * span, j, c));
	RBF_TRY(rbf_mesh_build(context, j->symmetry.symmetry, j->measured.count, j->direction, NULL, &j->fitted.mesh));
	c->mesh = j->fitted.mesh; /* from here on the component's */
	c->present = 1;
	if (rbf_label_prepare(&j->fitted))
		return rbf_out_of_memory(context);
	RBF_TRY(rbf_frames_first(context, from + .4 * span, from + .6 * span, j, c));
	if (!symmetry)
		RBF_TRY(rbf_told_images(context, from + .4 * span, from + .6 * span, j, c));
	RBF_TRY(rbf_frames_rest(context, from + .4 * span, from + .6 * span, j, c));
	if (!symmetry)
		RBF_TRY(rbf_told_isotropic(context, j, c, found));
	if (*found && !j->turned)
		return BSDFRBF_OK;
	RBF_TRY(rbf_frames_fill(context, 1, from + .6 * span, from + .8 * span, j, c));
	RBF_TRY(rbf_others_try(context, from + .6 * span, from + .8 * span, j, c));
	c->filled = j->filled;
	c->mirrored = j->mirrored;
	j->fitted.scale = j->scale;
	RBF_TRY(rbf_diagonals_choose(context, &j->choice, &j->fitted, c));
	if (rbf_assemble_sets(&j->fitted, j->choice.frames, j->choice.frame, j->choice.label, j->choice.limit, c))
		return rbf_out_of_memory(context);
	if (rbf_levels_make(&j->fitted, j->choice.even, j->choice.slopes, c))
		return rbf_out_of_memory(context);
	if (j->choice.cap > 0) {
		RBF_TRY(rbf_edges_move(context, &j->fitted, &j->choice, c));
		c->residual = 1;
	}
	if (rbf_progress(context, "tables", from + .85 * span))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	if (rbf_assemble_cull(j->fitted.team, c, longest(c)) || (j->choice.tune && rbf_tune_make(&j->fitted, j->choice.tune, c))
			|| rbf_assemble_dhr(j->fitted.team, c))
		return rbf_out_of_memory(context);
	RBF_TRY(set_facts(context, j, c));
	RBF_TRY(rbf_tell(context, j, c));
	return symmetry || *found ? BSDFRBF_OK : rbf_told_alike(context, j, c, found);
}

/* The component of these measurements, with progress between two shares of the whole. */
static bsdfrbf_status build_passes(bsdfrbf_context *context, const rbf_measured *read, int component, int channels, const bsdfrbf_build_options *o,
	double from, double to, rbf_component *c)
{
	const char symmetry = o->symmetry ? o->symmetry : read->isotropic ? 'I' : 0;
	int found = 0;
	bsdfrbf_status status = BSDFRBF_OK;
	for (int pass = 0; pass < (found ? 2 : 1) && status == BSDFRBF_OK; pass++) {
		rbf_job j = {.name = rbf_component_name(component), .channels = channels, .asked = (uint32_t)o->lobes, .fitted = {.team = o->team},
			.transmits = component == BSDFRBF_TF || component == BSDFRBF_TB};
		rbf_component_free(c); /* of the former pass */
		status = build_component(context, read, found ? 'I' : symmetry,
			from + (found == RBF_TOLD_LATE ? .86 : .6 * found) * (to - from), to, &found, &j, c);
		rbf_job_free(&j);
	}
	return status;
}

/* The component of what is left when repeated samples are joined, and faults of the measurement left out. */
static bsdfrbf_status build_sound(bsdfrbf_context *context, const rbf_measured *all, int component, int channels, const bsdfrbf_build_options *o,
	double from, double to, bsdfrbf_model *model)
{
	const char *name = rbf_component_name(component);
	rbf_measured joined, steady = {0}, read = {0};
	rbf_faults spikes, unread;
	const int failed = rbf_repeated_join(all, channels, &joined) || rbf_spikes_leave_out(&joined, channels, &steady, &spikes)
		|| rbf_unread_leave_out(&steady, channels, &read, &unread);
	bsdfrbf_status status = failed ? rbf_out_of_memory(context) : tell_left_out(context, name, all, &spikes,
		"are far above all that is around them, and nothing like it is seen at other incidences: they count as spikes, and are left out", "spikes", model);
	if (status == BSDFRBF_OK)
		status = tell_left_out(context, name, all, &unread, "are zero amid steady light, here and there: they count as not read, and are left out", "unread",
			model);
	if (status == BSDFRBF_OK)
		tell_limits(context, name, &read, channels);
	if (status == BSDFRBF_OK)
		status = build_passes(context, &read, component, channels, o, from, to, &model->component[component]);
	rbf_faults_release(&steady, &read);
	rbf_faults_release(&joined, &steady);
	rbf_faults_release(all, &joined);
	return status;
}

static bsdfrbf_status build(bsdfrbf_context *context, const bsdfrbf_data *data, const bsdfrbf_build_options *o, bsdfrbf_model *model)
{
	int components = 0, done = 0;
	RBF_TRY(rbf_data_check(context, data));
	for (int i = 0; i < 4; i++)
		components += data->component[i].count > 0;
	model->channels = (uint32_t)data->channels;
	for (int i = 0; i < 4; i++)
		if (data->component[i].count) {
			const double from = (double)done / components, to = (double)++done / components;
			RBF_TRY(build_sound(context, &data->component[i], i, data->channels, o, from, to, model));
		}
	if (rbf_trend_set(model))
		return rbf_out_of_memory(context);
	for (int i = 0; i < 4; i++)
		if (model->component[i].present && rbf_assemble_dhr_grid(&model->component[i]))
			return rbf_out_of_memory(context);
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
		return rbf_out_of_memory(context);
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
