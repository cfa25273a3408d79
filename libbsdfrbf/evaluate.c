/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "clones.h"
#include "cull.h"
#include "dhr.h"
#include "evaluate.h"

#include <string.h>

static void set_corners(rbf_site *site, const rbf_vertex vertex[], const float weight[], uint32_t count)
{
	const rbf_component *c = site->component;
	float beam[RBF_MAX_FRAMES][3];
	site->corners = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		rbf_map_source(c->frame[f], rbf_frame_linear(c, f), site->incident, beam[f]);
	for (uint32_t n = 0; n < count; n++) {
		if (!(weight[n] > 0))
			continue;
		const uint32_t k = site->corners++;
		site->base[k] = rbf_bound_base(c, &vertex[n]);
		site->vertex_op[k] = vertex[n].op;
		site->weight[k] = weight[n];
		site->shift[k][0] = site->shift[k][1] = NULL;
		for (uint32_t f = 0; f < c->frames; f++)
			rbf_warp_from(&site->warp[k][f], c->frame[f], rbf_frame_linear(c, f), site->incident, beam[f], vertex[n].direction);
	}
	/* Facets without shadows send out as 1/cos of the incidence, real surfaces less so: at most the same everywhere. The corners' weights,
	 * whose sum is even for the one, are taken half way to those that are even for the other. */
	for (uint32_t f = 0; f < c->frames; f++) {
		float total = 0;
		for (uint32_t k = 0; k < site->corners; k++)
			total += site->weight[k] * site->warp[k][f].gain;
		for (uint32_t k = 0; k < site->corners && total > 0; k++)
			site->warp[k][f].gain /= sqrtf(total);
	}
	for (uint32_t k = site->corners; k < 3; k++)
		site->weight[k] = 0;
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

void rbf_site_corners(const rbf_component *component, const float incident[3], uint32_t corners,
	const rbf_vertex vertex[], const float weight[], rbf_site *site)
{
	rbf_site_turn(component, incident, site);
	set_corners(site, vertex, weight, corners);
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
				site->shift[k][m] = rbf_bound_shift(component, at, site->base[k]);
				site->shift_weight[k][m] = w;
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
	rbf_vertex vertex[3];
	rbf_bound_corners(mesh, item, corner);
	for (int n = 0; n < 3; n++)
		vertex[n] = mesh->vertex[corner[n]];
	set_corners(site, vertex, weight, 3);
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

typedef float lanes __attribute__((vector_size(16)));
typedef int32_t lane_mask __attribute__((vector_size(16)));

static inline lanes select(lane_mask m, lanes a, lanes b)
{
	return (lanes)((m & (lane_mask)a) | (~m & (lane_mask)b));
}

static inline lanes all(float x)
{
	return (lanes){x, x, x, x};
}

/* Corners that a site has not got have no weight. No branch depends on the direction: it could not be foreseen. */
static inline __attribute__((always_inline)) void map_frame(const rbf_site *site, uint32_t frame, const float exitant[3], float share[3], float factor[3], float mapped[3][3])
{
	const uint32_t corners = site->corners;
	const enum rbf_map_kind kind = site->warp[0][frame].kind;
	float z[3] = {1, 1, 1};
#define EACH(forward) \
	for (uint32_t k = 0; k < corners; k++) { \
		factor[k] = forward(&site->warp[k][frame], exitant, mapped[k]); \
		z[k] = mapped[k][2]; \
	}
	switch (kind) {
	case RBF_KIND_TURN: EACH(rbf_turn_forward) break;
	case RBF_KIND_HALF: EACH(rbf_half_forward) break;
	case RBF_KIND_SHIFT: EACH(rbf_shift_forward) break;
	default:
		for (uint32_t k = 0; k < corners; k++)
			factor[k] = rbf_same(exitant, mapped[k]);
	}
#undef EACH
	/* as rbf_warp_validity() */
	lanes v = {z[0], z[1], z[2], 1};
	v *= all(1 / RBF_VALID_Z);
	v = select(v > all(.01f), v, all(.01f));
	v = select(v < all(1), v, all(1));
	v *= v;
	const lanes weighted = v * (lanes){site->weight[0], site->weight[1], site->weight[2], 0};
	v /= all(weighted[0] + weighted[1] + weighted[2]);
	v = select(v < all(RBF_VALID_GAIN), v, all(RBF_VALID_GAIN));
	for (int k = 0; k < 3; k++)
		share[k] = v[k];
}

RBF_CLONES static void map_alone(const rbf_site *site, uint32_t frame, const float exitant[3], float share[3], float factor[3],
	float mapped[3][3])
{
	map_frame(site, frame, exitant, share, factor, mapped);
}

void rbf_site_map(const rbf_site *site, uint32_t frame, const float exitant[3], float share[3], float factor[3], float mapped[3][3])
{
	map_alone(site, frame, exitant, share, factor, mapped);
}

/* Culling mask for a set, index s, and a direction in the base's coordinates. Below the horizon everything counts. */
static inline rbf_cull_mask groups_at(const uint64_t *packed, const uint64_t *wide, uint32_t s, const rbf_set *set, const float direction[3])
{
	static const uint64_t everything = ~(uint64_t)0; /* from any bit at which a mask begins */
	if (!packed && !wide)
		return (rbf_cull_mask){(const char *)&everything, 0};
	/* as rbf_disc_from_direction(), whose result does not matter below the horizon */
	const float scale = 1 / sqrtf(1 + fabsf(direction[2]));
	lanes t = ((lanes){direction[0], direction[1], 0, 0} * all(scale) + 1) * (RBF_CULL_GRID * .5f);
	t = select(t > all(0), t, all(0)); /* may be not a number */
	const lane_mask cell = __builtin_convertvector(select(t < all(RBF_CULL_GRID - .5f), t, all(RBF_CULL_GRID - .5f)), lane_mask);
	rbf_cull_mask mask = rbf_cull_at(packed, wide, s, set, (uint32_t)(cell[1] * RBF_CULL_GRID + cell[0]));
	mask.at = direction[2] > 0 ? mask.at : (const char *)&everything;
	return mask;
}

/* What is to be summed at a folded exitant direction, one job for every corner and frame that counts; the masks are still to be read. */
RBF_CLONES static uint32_t jobs_at(const rbf_site *site, const float exitant[3], uint32_t channels, rbf_kernel_job job[RBF_SITE_JOBS],
	rbf_cull_mask mask[RBF_SITE_JOBS])
{
	const rbf_component *c = site->component;
	const uint64_t *packed = c->cull, *wide = c->cull_wide;
	uint32_t jobs = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		float share[3], factor[3], mapped[3][3];
		map_frame(site, f, exitant, share, factor, mapped);
		for (uint32_t k = 0; k < site->corners; k++) {
			const uint32_t s = site->base[k] * c->frames + f;
			const rbf_set *set = rbf_bound_set(c, s);
			const float w = site->weight[k] * share[k] * factor[k];
			rbf_kernel_job *j = &job[jobs];
			rbf_mirror(site->vertex_op[k], mapped[k], j->direction);
			mask[jobs] = groups_at(packed, wide, s, set, j->direction);
			__builtin_prefetch(mask[jobs].at);
			j->weight = w;
			j->blocks = set->blocks;
			j->block = c->block + set->first;
			j->amplitude = c->amplitude + set->first;
			j->stride = c->blocks;
			j->channels = channels;
			j->group = rbf_cull_group(set->blocks);
			j->shift[0] = j->shift[1] = NULL;
			if (site->shift[k][0] || site->shift[k][1]) { /* also of a component that has none itself, as while it is chosen */
				const uint32_t start = set->first - c->set[site->base[k] * c->frames].first;
				for (int n = 0; n < 2; n++) {
					j->shift[n] = site->shift[k][n] ? site->shift[k][n] + start : NULL;
					j->shift_weight[n] = site->shift_weight[k][n];
				}
			}
			jobs += (w > 0) & (set->blocks > 0); /* else the next one takes its place */
		}
	}
	return jobs;
}

static void read_masks(uint32_t jobs, const rbf_cull_mask mask[], rbf_kernel_job job[])
{
	for (uint32_t n = 0; n < jobs; n++)
		job[n].mask = rbf_cull_read(mask[n]);
}

void rbf_site_dsf(const rbf_site *site, const float exitant[3], float value[3])
{
	rbf_kernel_job job[RBF_SITE_JOBS];
	rbf_cull_mask mask[RBF_SITE_JOBS];
	const uint32_t jobs = jobs_at(site, exitant, site->component->channels, job, mask);
	value[0] = value[1] = value[2] = 0;
	read_masks(jobs, mask, job);
	rbf_kernel_sum(job, jobs, value);
}

void rbf_site_width(const rbf_site *site, const float exitant[3], float sum[2])
{
	const rbf_component *c = site->component;
	rbf_kernel_job job[RBF_SITE_JOBS];
	rbf_cull_mask mask[RBF_SITE_JOBS];
	float value[3] = {0, 0, 0};
	const uint32_t jobs = jobs_at(site, exitant, RBF_KERNEL_WIDTH, job, mask);
	read_masks(jobs, mask, job);
	for (uint32_t n = 0; n < jobs; n++)
		job[n].amplitude += (size_t)rbf_luminance(c->channels) * c->blocks;
	rbf_kernel_sum(job, jobs, value);
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
	const uint32_t item = rbf_mesh_locate(&c->mesh, site.incident, corner, weight);
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
	rbf_cull_mask mask[RBF_SITE_JOBS];
	rbf_kernel_job job[RBF_SITE_JOBS];
} pair;

/* The memory of the first few groups of blocks that a mask asks for. */
static void fetch_blocks(const rbf_kernel_job *job)
{
	uint64_t mask = job->mask;
	for (int n = 0; n < AHEAD && mask; n++, mask &= mask - 1) {
		const uint32_t b = (uint32_t)__builtin_ctzll(mask) * job->group;
		if (b >= job->blocks)
			break;
		__builtin_prefetch(&job->block[b]);
		__builtin_prefetch(&job->block[b].z);
		__builtin_prefetch(&job->amplitude[b]);
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
			p->jobs = jobs_at(&site, folded, q.component->channels, p->job, p->mask);
			p->scale = scale_of(&site, folded);
		}
		for (size_t n = 0; n < pairs; n++) {
			if (!list[n].component)
				continue;
			read_masks(list[n].jobs, list[n].mask, list[n].job);
			for (uint32_t i = 0; i < list[n].jobs; i++)
				fetch_blocks(&list[n].job[i]);
		}
		for (size_t n = 0; n < pairs; n++) {
			float *value = values + (from + n) * model->channels, v[3] = {0, 0, 0};
			clear(model, value);
			if (!list[n].component)
				continue;
			rbf_kernel_sum(list[n].job, list[n].jobs, v);
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
