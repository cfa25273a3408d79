/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "cells.h"
#include "clones.h"
#include "evaluate.h"
#include "extent.h"
#include "pairs.h"

#include <string.h>

/* Culling mask for a set, index s. below: -1 below the horizon, where everything counts, else 0: no branch, as it cannot be foreseen. */
static inline uint64_t groups_at(const uint64_t *packed, const uint64_t *wide, size_t s, const rbf_set *set, uint32_t cell, int32_t below)
{
	return (rbf_cull_read(rbf_cull_at(packed, wide, s, set, cell)) | (uint64_t)(int64_t)below) & rbf_cull_all(set->blocks);
}

/* The same without masks, while a model is made. moves: whether the set's lobes do. */
static inline __attribute__((always_inline)) uint64_t groups_near(const rbf_component *c, const rbf_set *set, const float direction[3], int moves)
{
	return c->extent && !moves && set->blocks <= RBF_CULL_BITS ? rbf_extent_mask(c->extent, c->blocks, set->first, set->blocks, direction)
		: rbf_cull_all(set->blocks);
}

/* What is to be summed at a folded exitant direction, one job for every corner and frame that counts. plain: as in rbf_kernel_lobes.
 * usual (a constant): masks are packed and nothing moves. */
static inline __attribute__((always_inline)) uint32_t add_jobs(const rbf_site *site, const float exitant[3], rbf_kernel_job job[RBF_SITE_JOBS],
	int *plain, int usual)
{
	const rbf_component *c = site->component;
	const uint64_t *packed = c->cull, *wide = usual ? NULL : c->cull_wide;
	const rbf_set *first[3];
	uint32_t jobs = 0, most = 0;
	const rbf_lanes from[3] = {rbf_lanes_all(site->incident[0]), rbf_lanes_all(site->incident[1]), rbf_lanes_all(site->incident[2])};
	const rbf_lanes to[3] = {rbf_lanes_load(site->direction[0]), rbf_lanes_load(site->direction[1]), rbf_lanes_load(site->direction[2])};
	const rbf_lanes at[3] = {rbf_lanes_all(exitant[0]), rbf_lanes_all(exitant[1]), rbf_lanes_all(exitant[2])};
	for (uint32_t k = 0; k < site->corners; k++)
		first[k] = c->set + (size_t)site->base[k] * c->frames;
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_lanes d[3];
		const rbf_lanes factor = rbf_fan_forward(&site->fan[f], from, to, at, d);
		const rbf_lanes weight = rbf_lanes_load(site->part) * rbf_shares_at(site, f, d[2]) * factor;
		d[0] *= rbf_lanes_load(site->flip[0]);
		d[1] *= rbf_lanes_load(site->flip[1]);
		const rbf_lane_mask cell = rbf_cells_at(d), below = ~(d[2] > 0);
		for (uint32_t k = 0; k < site->corners; k++) {
			const rbf_set *set = rbf_bound_to(c, first[k] + f);
			const float w = weight[k], there[3] = {d[0][k], d[1][k], d[2][k]};
			rbf_kernel_job *j = &job[jobs];
			*j = (rbf_kernel_job){{there[0], there[1], there[2]}, w,
				usual || packed || wide ? groups_at(packed, wide, (size_t)(first[k] - c->set) + f, set, (uint32_t)cell[k], below[k])
				: groups_near(c, set, there, site->moves), set->first, set->blocks, NULL, 0};
			if (!usual && site->moves && (site->motion[k].shift[0] || site->motion[k].shift[1])) {
				j->motion = &site->motion[k];
				j->start = set->first - first[k]->first;
			}
			most = set->blocks > most ? set->blocks : most;
			jobs += (w > 0) & (set->blocks > 0); /* else the next one takes its place */
		}
	}
	*plain = (usual || !site->moves) & (most <= RBF_CULL_BITS);
	return jobs;
}

RBF_CLONES static uint32_t jobs_at(const rbf_site *site, const float exitant[3], rbf_kernel_job job[RBF_SITE_JOBS], int *plain)
{
	return site->component->cull && !site->moves ? add_jobs(site, exitant, job, plain, 1) : add_jobs(site, exitant, job, plain, 0);
}

/* All channels of a component, or how wide what is seen is. */
static inline rbf_kernel_lobes lobes_of(const rbf_component *c, int width, int plain)
{
	return (rbf_kernel_lobes){c->block, c->amplitude + (width ? (size_t)rbf_luminance(c->channels) * c->blocks : 0), c->blocks,
		width ? RBF_KERNEL_WIDTH : c->channels, plain};
}

void rbf_site_dsf(const rbf_site *site, const float exitant[3], float value[3])
{
	rbf_kernel_job job[RBF_SITE_JOBS];
	int plain;
	const uint32_t jobs = jobs_at(site, exitant, job, &plain);
	const rbf_kernel_lobes lobes = lobes_of(site->component, 0, plain);
	value[0] = value[1] = value[2] = 0;
	rbf_kernel_sum(job, jobs, &lobes, value);
}

void rbf_site_width(const rbf_site *site, const float exitant[3], float sum[2])
{
	rbf_kernel_job job[RBF_SITE_JOBS];
	float value[3];
	int plain;
	const uint32_t jobs = jobs_at(site, exitant, job, &plain);
	const rbf_kernel_lobes lobes = lobes_of(site->component, 1, plain);
	rbf_kernel_sum(job, jobs, &lobes, value);
	memcpy(sum, value, 2 * sizeof *sum);
}

/* f over the DSF that the kernel sums up. */
static float scale_of(const rbf_site *site, const float folded[3])
{
	return site->scale / rbf_max(folded[2], RBF_HORIZON_Z);
}

float rbf_site_eval_width(const rbf_site *site, const float exitant[3], float sum[2])
{
	float folded[3];
	rbf_site_fold(site, exitant, folded);
	rbf_site_width(site, folded, sum);
	return sum[0] * scale_of(site, folded);
}

void rbf_site_eval(const rbf_site *site, const float exitant[3], float value[3])
{
	float folded[3];
	rbf_site_fold(site, exitant, folded);
	rbf_site_dsf(site, folded, value);
	const float scale = scale_of(site, folded);
	for (uint32_t n = 0; n < site->component->channels; n++)
		value[n] *= scale;
}

static int unit(const float in[3], float out[3])
{
	memcpy(out, in, 3 * sizeof *out);
	return rbf_normalize(out) > 0;
}

const rbf_component *rbf_query_side(const bsdfrbf_model *model, const float incident[3], int transmit, int *swapped)
{
	*swapped = 0;
	if (incident[2] == 0 || isnan(incident[2]))
		return NULL;
	const int back = incident[2] < 0;
	const rbf_component *c = &model->component[(transmit ? BSDFRBF_TF : BSDFRBF_RF) + back];
	if (c->present)
		return c;
	if (transmit) {
		c = &model->component[BSDFRBF_TF + !back];
		*swapped = 1;
		if (c->present)
			return c;
	}
	return NULL;
}

const rbf_component *rbf_query_incident(const bsdfrbf_model *model, const float incident[3], int transmit, float local[3], int *swapped)
{
	float d[3] = {incident[0], incident[1], incident[2]};
	*swapped = 0;
	if (!(rbf_normalize(d) > 0))
		return NULL;
	local[0] = d[0];
	local[1] = d[1];
	local[2] = fabsf(d[2]);
	return rbf_query_side(model, d, transmit, swapped);
}

int rbf_query_pair(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], rbf_query *q)
{
	float i[3], o[3];
	q->component = NULL;
	if (!unit(incident, i) || !unit(outgoing, o) || i[2] == 0 || o[2] == 0)
		return 0;
	q->component = rbf_query_side(model, i, (i[2] < 0) != (o[2] < 0), &q->swapped);
	if (!q->component)
		return 0;
	i[2] = fabsf(i[2]);
	o[2] = fabsf(o[2]);
	memcpy(q->incident, q->swapped ? o : i, sizeof i);
	memcpy(q->exitant, q->swapped ? i : o, sizeof o);
	return 1;
}

static void clear(const bsdfrbf_model *model, float *value)
{
	for (uint32_t n = 0; n < model->channels; n++)
		value[n] = 0;
}

/* f at a site, and so much of the Lambertian DHR. */
static inline void eval_at(const rbf_site *site, const float exitant[3], float lambertian, float *value)
{
	const rbf_component *c = site->component;
	float v[3];
	rbf_site_eval(site, exitant, v);
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] = v[n] + lambertian * c->lambertian[n];
}

static inline void eval_pair(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float lambertian, float *value)
{
	rbf_query q;
	rbf_site site;
	if (!rbf_query_pair(model, incident, outgoing, &q)) {
		clear(model, value);
		return;
	}
	rbf_site_locate(q.component, q.incident, &site);
	eval_at(&site, q.exitant, lambertian, value);
}

/* At one incidence, or few: a site answers as long as it is the same. step: from one incidence to the next. */
static inline void eval_list(const bsdfrbf_model *model, size_t count, const float *incident, size_t step, const float *outgoing,
	float *values)
{
	const float *last = NULL;
	rbf_site site;
	int known = 0; /* the site answers for `last` */
	for (size_t n = 0; n < count; n++) {
		const float *in = incident + step * n;
		float *value = values + n * model->channels;
		rbf_query q;
		if (!rbf_query_pair(model, in, outgoing + 3 * n, &q)) {
			clear(model, value);
			continue;
		}
		if (!known || q.component != site.component || (in != last && memcmp(in, last, 3 * sizeof *in))) {
			rbf_site_locate(q.component, q.incident, &site);
			known = !q.swapped;
			last = in;
		}
		eval_at(&site, q.exitant, (float)(1 / RBF_PI), value);
	}
}

/* How many pairs from the first on have its incidence. */
static size_t alike(const float *incident, size_t count)
{
	size_t n = 1;
	while (n < count && !memcmp(incident, incident + 3 * n, 3 * sizeof *incident))
		n++;
	return n;
}

/* How many from the first on have another one than the next, as far as they are treated at once. */
static size_t apart(const float *incident, size_t count)
{
	size_t n = 0;
	while (n < RBF_PAIRS_MOST && n < count && (n + 1 == count || memcmp(incident + 3 * n, incident + 3 * (n + 1), 3 * sizeof *incident)))
		n++;
	return n;
}

void bsdfrbf_eval(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value)
{
	eval_pair(model, incident, outgoing, (float)(1 / RBF_PI), value);
}

void bsdfrbf_eval_scatter(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value)
{
	eval_pair(model, incident, outgoing, 0, value);
}

void bsdfrbf_eval_many(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *values)
{
	const int wide = rbf_kernel_has_avx512();
	for (size_t n = 0, more; n < count; n += more) {
		const float *in = incident + 3 * n, *out = outgoing + 3 * n;
		float *value = values + n * model->channels;
		more = wide ? apart(in, count - n) : 0;
		if (more > 1)
			rbf_pairs_eval(model, more, in, out, value);
		else {
			more = wide ? alike(in, count - n) : count;
			eval_list(model, more, in, 3, out, value);
		}
	}
}

void bsdfrbf_eval_exitant(const bsdfrbf_model *model, const float incident[3], size_t count, const float *outgoing, float *values)
{
	eval_list(model, count, incident, 0, outgoing, values);
}
