/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "clones.h"
#include "cull.h"
#include "dhr.h"
#include "evaluate.h"

#include <string.h>

/* One component of the corners' directions, in lanes; those without a corner are as the last one. */
#define IN_LANES(member) (rbf_lanes){corner[0]->member, corner[1]->member, corner[2]->member, corner[2]->member}

RBF_CLONES static void set_corners(rbf_site *site, const rbf_vertex *const vertex[3], const float weight[3])
{
	const rbf_component *c = site->component;
	const rbf_vertex *corner[3] = {NULL, NULL, NULL};
	uint32_t k = 0;
	for (int n = 0; n < RBF_FAN; n++)
		site->weight[n] = 0;
	for (uint32_t n = 0; n < 3; n++)
		if (weight[n] > 0) {
			corner[k] = vertex[n];
			site->base[k] = rbf_bound_base(c, vertex[n]);
			site->vertex_op[k] = vertex[n]->op;
			site->weight[k] = weight[n];
			site->motion[k] = (rbf_motion){{NULL, NULL}, {0, 0}};
			k++;
		}
	site->corners = k;
	site->moves = 0;
	if (!k)
		return;
	for (uint32_t n = k; n < 3; n++)
		corner[n] = corner[k - 1];
	for (int i = 0; i < 3; i++)
		rbf_lanes_store(site->direction[i], IN_LANES(direction[i]));
	const rbf_lane_mask op = {(int32_t)corner[0]->op, (int32_t)corner[1]->op, (int32_t)corner[2]->op, (int32_t)corner[2]->op};
	rbf_lanes_store(site->flip[0], __builtin_convertvector(1 - 2 * (op & 1), rbf_lanes));
	rbf_lanes_store(site->flip[1], __builtin_convertvector(1 - (op & 2), rbf_lanes));
	/* Facets without shadows send out as 1/cos of the incidence, real surfaces less so: at most the same everywhere. The corners' weights,
	 * whose sum is even for the one, are taken half way to those that are even for the other. */
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_fan *fan = &site->fan[f];
		rbf_fan_set(fan, c->frame[f], rbf_frame_linear(c, f), site->incident, (const float (*)[RBF_FAN])site->direction);
		if (fan->kind != RBF_KIND_HALF)
			continue;
		const rbf_lanes gain = rbf_lanes_load(fan->gain), each = rbf_lanes_load(site->weight) * gain;
		const float total = each[0] + each[1] + each[2];
		if (total > 0)
			rbf_lanes_store(fan->gain, gain * (1 / sqrtf(total)));
	}
}

/* An incident direction that is folded already. */
static void set_folded(const rbf_component *c, const float incident[3], rbf_site *site)
{
	site->component = c;
	site->scale = 1;
	site->op = RBF_OP_NONE;
	site->cosine = 1;
	site->sine = 0;
	memcpy(site->incident, incident, sizeof site->incident);
}

void rbf_site_turn(const rbf_component *c, const float incident[3], rbf_site *site)
{
	set_folded(c, incident, site);
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		const float s = sqrtf(incident[0]*incident[0] + incident[1]*incident[1]);
		if (s > 0) {
			site->cosine = incident[0] / s;
			site->sine = incident[1] / s;
		}
		site->incident[0] = s;
		site->incident[1] = 0;
	} else {
		site->op = (unsigned)rbf_symmetry_fold(c->mesh.symmetry, incident);
		rbf_mirror(site->op, incident, site->incident);
	}
}

#define OUTSIDE_GAIN 2.f /* at most */

/* Beyond the last measured incidence lobes are carried on as from its edge, and DHR follows its trend: facets without shadows would
 * gain energy there (1/cos), and lobes that sink below the horizon would lose it. Returns the factor that does so; value: DHR with that
 * factor. */
static float scale_outside(const rbf_component *c, uint32_t border, const float weight[3], const float incident[3], float value[3])
{
	const uint32_t y = rbf_luminance(c->channels);
	const float *a = c->mesh.vertex[rbf_bound_vertex(&c->mesh, c->mesh.border[border][0])].direction;
	const float *b = c->mesh.vertex[rbf_bound_vertex(&c->mesh, c->mesh.border[border][1])].direction;
	float nearest[3], edge[3], trend;
	for (int n = 0; n < 3; n++)
		nearest[n] = weight[0] * a[n] + weight[1] * b[n];
	rbf_normalize(nearest);
	rbf_dhr_outside(c, border, weight, incident, value, edge, &trend);
	const float wanted = edge[y] * rbf_max(incident[2], RBF_DHR_Z) * expf(trend), here = value[y] * rbf_max(nearest[2], RBF_DHR_Z);
	const float scale = here > 0 ? rbf_min(wanted / here, OUTSIDE_GAIN) : 1;
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] *= scale;
	return scale;
}

void rbf_site_corners(const rbf_component *component, const float incident[3], const rbf_vertex vertex[3], const float weight[3],
	rbf_site *site)
{
	const rbf_vertex *const corner[3] = {&vertex[0], &vertex[1], &vertex[2]};
	rbf_site_turn(component, incident, site);
	set_corners(site, corner, weight);
}

/* Residual motion of the site's corners in element e. */
static void set_shifts(rbf_site *site, uint32_t e, const uint32_t corner[3], const float weight[3])
{
	const rbf_component *component = site->component;
	if (e >= component->mesh.elements)
		return;
	/* the element's corners, where a border or a weight of 0 may have left some out */
	const uint32_t *v = component->mesh.element[e].v;
	uint32_t k = 0;
	for (int n = 0; n < 3; n++) {
		if (!(weight[n] > 0))
			continue;
		int own = 0;
		while (own < 2 && v[own] != corner[n])
			own++;
		for (int m = 0; m < 2; m++) {
			const int other = (own + 1 + m) % 3;
			const uint32_t at = component->shift_of[e * 6 + (uint32_t)own * 2 + (uint32_t)m];
			float w = 0;
			for (int l = 0; l < 3; l++)
				if (l != n && corner[l] == v[other] && corner[l] != corner[n])
					w += weight[l];
			if (at != RBF_NO_SHIFT && w > 0) {
				site->motion[k].shift[m] = rbf_bound_shift(component, at, site->base[k]);
				site->motion[k].weight[m] = w;
				site->moves = 1;
			}
		}
		k++;
	}
}

/* Corners and motion of a site whose incident direction is set. */
static void set_place(rbf_site *site, uint32_t item, const float weight[3])
{
	const rbf_component *component = site->component;
	const rbf_mesh *mesh = &component->mesh;
	uint32_t corner[3];
	rbf_bound_corners(mesh, item, corner);
	const rbf_vertex *const vertex[3] = {&mesh->vertex[corner[0]], &mesh->vertex[corner[1]], &mesh->vertex[corner[2]]};
	set_corners(site, vertex, weight);
	if (component->residual)
		set_shifts(site, item & RBF_MESH_BORDER ? mesh->border[item & ~RBF_MESH_BORDER][2] : item, corner, weight);
}

void rbf_site_place(const rbf_component *component, uint32_t item, const float weight[3], const float incident[3], rbf_site *site)
{
	set_folded(component, incident, site);
	set_place(site, item, weight);
}

void rbf_site_locate(const rbf_component *component, const float incident[3], rbf_site *site)
{
	uint32_t corner[3];
	float weight[3], dhr[3];
	rbf_site_turn(component, incident, site);
	const uint32_t item = rbf_mesh_locate(&component->mesh, site->incident, corner, weight);
	set_place(site, item, weight);
	if (item & RBF_MESH_BORDER && component->dhr)
		site->scale = scale_outside(component, item & ~RBF_MESH_BORDER, weight, site->incident, dhr);
}

void rbf_site_fold(const rbf_site *site, const float exitant[3], float folded[3])
{
	if (site->component->mesh.symmetry == RBF_ISOTROPIC) {
		folded[0] = site->cosine*exitant[0] + site->sine*exitant[1];
		folded[1] = site->cosine*exitant[1] - site->sine*exitant[0];
		folded[2] = exitant[2];
	} else
		rbf_mirror(site->op, exitant, folded);
}

void rbf_site_unfold(const rbf_site *site, const float folded[3], float exitant[3])
{
	if (site->component->mesh.symmetry == RBF_ISOTROPIC) {
		exitant[0] = site->cosine*folded[0] - site->sine*folded[1];
		exitant[1] = site->cosine*folded[1] + site->sine*folded[0];
		exitant[2] = folded[2];
	} else
		rbf_mirror(site->op, folded, exitant);
}

/* Shares of the corners whose mapped directions have these z. No branch depends on the direction: it could not be foreseen. */
static inline __attribute__((always_inline)) rbf_lanes shares_at(const rbf_site *site, uint32_t frame, rbf_lanes z)
{
	if (site->fan[frame].kind == RBF_KIND_FIXED)
		z = rbf_lanes_all(1);
	/* as rbf_warp_validity() */
	rbf_lanes v = z * (1 / RBF_VALID_Z);
	v = rbf_lanes_min(rbf_lanes_max(v, rbf_lanes_all(RBF_VALID_LEAST)), rbf_lanes_all(1));
	v *= v;
	const rbf_lanes weighted = v * rbf_lanes_load(site->weight);
	return rbf_lanes_min(v * (1 / (weighted[0] + weighted[1] + weighted[2])), rbf_lanes_all(RBF_VALID_GAIN));
}

RBF_CLONES static void shares_alone(const rbf_site *site, uint32_t frame, const float exitant[3], float share[RBF_FAN])
{
	rbf_lanes mapped[3];
	rbf_fan_forward(&site->fan[frame], site->incident, site->direction, exitant, mapped);
	rbf_lanes_store(share, shares_at(site, frame, mapped[2]));
}

void rbf_site_shares(const rbf_site *site, uint32_t frame, const float exitant[3], float share[RBF_FAN])
{
	shares_alone(site, frame, exitant, share);
}

/* Cells of culling masks (as by rbf_disc_from_direction(), whose result does not matter below the horizon). */
static inline __attribute__((always_inline)) rbf_lane_mask cells_at(const rbf_lanes d[3])
{
	const rbf_lanes scale = (RBF_CULL_GRID * .5f) / rbf_lanes_sqrt(1 + rbf_lanes_abs(d[2]));
	rbf_lanes t[2];
	for (int n = 0; n < 2; n++) /* may be not a number */
		t[n] = rbf_lanes_min(rbf_lanes_max(d[n] * scale + RBF_CULL_GRID * .5f, rbf_lanes_all(0)), rbf_lanes_all(RBF_CULL_GRID - .5f));
	return __builtin_convertvector(t[1], rbf_lane_mask) * RBF_CULL_GRID + __builtin_convertvector(t[0], rbf_lane_mask);
}

/* Culling mask for a set, index s. Below the horizon everything counts. */
static inline uint64_t groups_at(const uint64_t *packed, const uint64_t *wide, uint32_t s, const rbf_set *set, uint32_t cell, int above)
{
	static const uint64_t everything = ~(uint64_t)0; /* from any bit at which a mask begins */
	if (!packed && !wide)
		return everything;
	rbf_cull_mask mask = rbf_cull_at(packed, wide, s, set, cell);
	mask.at = above ? mask.at : (const char *)&everything;
	return rbf_cull_read(mask);
}

/* What is to be summed at a folded exitant direction, one job for every corner and frame that counts. */
RBF_CLONES static uint32_t jobs_at(const rbf_site *site, const float exitant[3], rbf_kernel_job job[RBF_SITE_JOBS])
{
	const rbf_component *c = site->component;
	const uint64_t *packed = c->cull, *wide = c->cull_wide;
	uint32_t jobs = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_lanes d[3];
		const rbf_lanes factor = rbf_fan_forward(&site->fan[f], site->incident, site->direction, exitant, d);
		const rbf_lanes weight = rbf_lanes_load(site->weight) * shares_at(site, f, d[2]) * factor;
		d[0] *= rbf_lanes_load(site->flip[0]);
		d[1] *= rbf_lanes_load(site->flip[1]);
		const rbf_lane_mask cell = cells_at(d);
		for (uint32_t k = 0; k < site->corners; k++) {
			const uint32_t s = site->base[k] * c->frames + f;
			const rbf_set *set = rbf_bound_set(c, s);
			const float w = weight[k];
			rbf_kernel_job *j = &job[jobs];
			*j = (rbf_kernel_job){{d[0][k], d[1][k], d[2][k]}, w, groups_at(packed, wide, s, set, (uint32_t)cell[k], d[2][k] > 0),
				set->first, set->blocks, NULL, 0};
			if (site->moves && (site->motion[k].shift[0] || site->motion[k].shift[1])) {
				j->motion = &site->motion[k];
				j->start = set->first - c->set[site->base[k] * c->frames].first;
			}
			jobs += (w > 0) & (set->blocks > 0); /* else the next one takes its place */
		}
	}
	return jobs;
}

/* All channels of a component, or how wide what is seen is. */
static inline rbf_kernel_lobes lobes_of(const rbf_component *c, int width)
{
	return (rbf_kernel_lobes){c->block, c->amplitude + (width ? (size_t)rbf_luminance(c->channels) * c->blocks : 0), c->blocks,
		width ? RBF_KERNEL_WIDTH : c->channels};
}

void rbf_site_dsf(const rbf_site *site, const float exitant[3], float value[3])
{
	const rbf_kernel_lobes lobes = lobes_of(site->component, 0);
	rbf_kernel_job job[RBF_SITE_JOBS];
	value[0] = value[1] = value[2] = 0;
	rbf_kernel_sum(job, jobs_at(site, exitant, job), &lobes, value);
}

void rbf_site_width(const rbf_site *site, const float exitant[3], float sum[2])
{
	const rbf_kernel_lobes lobes = lobes_of(site->component, 1);
	rbf_kernel_job job[RBF_SITE_JOBS];
	float value[3];
	rbf_kernel_sum(job, jobs_at(site, exitant, job), &lobes, value);
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

void rbf_component_dhr(const rbf_component *c, const float incident[3], float value[3])
{
	rbf_site site;
	uint32_t corner[3];
	float weight[3];
	if (rbf_dhr_quick(c, incident, value))
		return;
	rbf_site_turn(c, incident, &site);
	const uint32_t item = rbf_mesh_search(&c->mesh, site.incident, corner, weight);
	if (item & RBF_MESH_BORDER)
		scale_outside(c, item & ~RBF_MESH_BORDER, weight, site.incident, value);
	else
		rbf_dhr_inside(c, item, weight, value);
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] /= rbf_max(site.incident[2], RBF_DHR_Z);
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

static void add_lambertian(const rbf_component *c, float scale, float *value)
{
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] += scale * c->lambertian[n];
}

void bsdfrbf_eval_scatter(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value)
{
	rbf_query q;
	rbf_site site;
	if (!rbf_query_pair(model, incident, outgoing, &q)) {
		clear(model, value);
		return;
	}
	rbf_site_locate(q.component, q.incident, &site);
	if (q.component->channels == 1) {
		float v[3];
		rbf_site_eval(&site, q.exitant, v);
		value[0] = v[0];
	} else
		rbf_site_eval(&site, q.exitant, value);
}

/* Pairs go through in batches, one step after the other for all of a batch, so that the memory that a step needs is on its way while the
 * step before is done for other pairs. */
enum { BATCH = 8, AHEAD = 4 };

typedef struct pair {
	const rbf_component *component;
	uint32_t jobs;
	float scale;
	rbf_motion motion[3];
	rbf_kernel_job job[RBF_SITE_JOBS];
} pair;

/* Takes the motion along from a site that will be another's by the time that the jobs are done. */
static void keep_motion(const rbf_site *site, pair *p)
{
	memcpy(p->motion, site->motion, sizeof p->motion);
	for (uint32_t i = 0; i < p->jobs; i++)
		if (p->job[i].motion)
			p->job[i].motion = p->motion + (p->job[i].motion - site->motion);
}

/* The memory of the first few groups of blocks that a mask asks for. */
static void fetch_blocks(const rbf_kernel_job *job, const rbf_kernel_lobes *lobes)
{
	const uint32_t group = rbf_cull_group(job->blocks);
	uint64_t mask = job->mask;
	for (int n = 0; n < AHEAD && mask; n++, mask &= mask - 1) {
		const uint32_t b = (uint32_t)__builtin_ctzll(mask) * group;
		if (b >= job->blocks)
			break;
		__builtin_prefetch(&lobes->block[job->first + b]);
		__builtin_prefetch(&lobes->block[job->first + b].z);
		__builtin_prefetch(&lobes->amplitude[job->first + b]);
	}
}

static void eval_list(const bsdfrbf_model *model, size_t count, const float *incident, size_t step, const float *outgoing, float *values)
{
	const rbf_component *located = NULL;
	const float *last = NULL;
	rbf_site site;
	pair list[BATCH];
	for (size_t from = 0; from < count; from += BATCH) {
		const size_t pairs = count - from < BATCH ? count - from : BATCH;
		for (size_t n = 0; n < pairs; n++) {
			const float *in = incident + step * (from + n);
			rbf_query q;
			float folded[3];
			pair *p = &list[n];
			p->component = NULL;
			if (!rbf_query_pair(model, in, outgoing + 3 * (from + n), &q))
				continue;
			if (q.component != located || (in != last && memcmp(in, last, 3 * sizeof *in))) {
				rbf_site_locate(q.component, q.incident, &site);
				located = q.swapped ? NULL : q.component;
				last = in;
			}
			rbf_site_fold(&site, q.exitant, folded);
			p->component = q.component;
			p->jobs = jobs_at(&site, folded, p->job);
			if (site.moves)
				keep_motion(&site, p);
			p->scale = scale_of(&site, folded);
		}
		for (size_t n = 0; n < pairs; n++) {
			if (!list[n].component)
				continue;
			const rbf_kernel_lobes lobes = lobes_of(list[n].component, 0);
			for (uint32_t i = 0; i < list[n].jobs && pairs > 1; i++)
				fetch_blocks(&list[n].job[i], &lobes);
		}
		for (size_t n = 0; n < pairs; n++) {
			float *value = values + (from + n) * model->channels, v[3] = {0, 0, 0};
			clear(model, value);
			if (!list[n].component)
				continue;
			const rbf_kernel_lobes lobes = lobes_of(list[n].component, 0);
			rbf_kernel_sum(list[n].job, list[n].jobs, &lobes, v);
			for (uint32_t k = 0; k < model->channels; k++)
				value[k] = v[k] * list[n].scale;
			add_lambertian(list[n].component, (float)(1 / RBF_PI), value);
		}
	}
}

void bsdfrbf_eval(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value)
{
	eval_list(model, 1, incident, 0, outgoing, value);
}

void bsdfrbf_eval_many(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *values)
{
	eval_list(model, count, incident, 3, outgoing, values);
}

void bsdfrbf_eval_exitant(const bsdfrbf_model *model, const float incident[3], size_t count, const float *outgoing, float *values)
{
	eval_list(model, count, incident, 0, outgoing, values);
}
