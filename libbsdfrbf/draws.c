/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "draws.h"
#include "elementary.h"
#include "kernel.h"
#include "takeover.h"

#include <stdlib.h>
#include <string.h>

enum { ALIGN = 64 };

static const float STEEPEST = 45.f; /* slope of J for half vectors at 88.7 degrees */

/* Cosine and sine of the angle around a lobe's centre that bounds of J cover. */
static void spread(const rbf_reach *r, float kappa, float *cosine, float *sine)
{
	const float w = kappa > 0 ? rbf_min(.5f * RBF_LOBE_SPREAD * RBF_LOBE_SPREAD / kappa, 2) : 2;
	*cosine = 1 - w;
	*sine = sqrtf(w * (2 - w));
	if (r->motion > 0) {
		const float angle = rbf_min(acosf(*cosine) + r->motion, (float)RBF_PI);
		*cosine = cosf(angle);
		*sine = sinf(angle);
	}
}

float rbf_reach_lowest(const float base[3], float beyond)
{
	const float theta = acosf(rbf_min(rbf_max(base[2], -1.f), 1.f)) + (float)(RBF_PI / 2) + beyond;
	return theta < (float)RBF_PI ? cosf(theta) : -1;
}

/* Largest slope of J over the directions of a lobe: the tangent of half the angle to the base. Exitant ones above the horizon map to at most `beyond`
 * below it. */
static float steepest(const rbf_reach *r, float to_k, float cosine, float sine)
{
	const float across = sqrtf(rbf_max(1 - to_k*to_k, 0)), sum = to_k * cosine - across * sine;
	const float least = across * cosine + to_k * sine > 0 ? rbf_max(sum, r->lowest) : r->lowest; /* else the sum is beyond half a turn */
	return rbf_min(sqrtf((1 - least) / rbf_max(1 + least, 1e-6f)), STEEPEST);
}

float rbf_lobe_slant(const rbf_reach *r, const float centre[3], float kappa)
{
	float cosine, sine;
	if (rbf_map_get(r->map)->kind != RBF_KIND_HALF)
		return 0;
	spread(r, kappa, &cosine, &sine);
	return rbf_min(steepest(r, rbf_dot(r->base, centre), cosine, sine), RBF_SLANT_MAX);
}

/* J = cos a + sin a (t.d) / (1 + k.d), a between k and l, t from k towards l: over directions d that is a stereographic projection, in which
 * the circle around a centre is a circle again. */
float rbf_lobe_rise(const rbf_reach *r, const float l[3], const float centre[3], float kappa)
{
	float cosine, sine;
	if (rbf_map_get(r->map)->kind != RBF_KIND_HALF)
		return 1;
	spread(r, kappa, &cosine, &sine);
	const float along = rbf_dot(r->base, l), to_k = rbf_dot(r->base, centre), across = sqrtf(rbf_max(1 - to_k*to_k, 0));
	const float e[3] = {l[0] - along * r->base[0], l[1] - along * r->base[1], l[2] - along * r->base[2]}, away = sqrtf(rbf_dot(e, e));
	float slope = steepest(r, to_k, cosine, sine);
	if (!(away > 0))
		return 1;
	if (across * cosine + to_k * sine > 0 && to_k + cosine > 1e-4f)
		slope = rbf_min((rbf_dot(e, centre) / away + sine) / (to_k + cosine) + 1e-4f, slope);
	return rbf_max(along + away * slope, 0);
}

/* By how much ways around the triangle of three directions turn, somewhat more than its solid angle; or, for two, what lies between their arc
 * and the horizon. */
static float twist_of(const float *a, const float *b, const float *c)
{
	const float e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
	if (!c)
		return 1.2f * sqrtf(rbf_dot(e, e)) * asinf(rbf_min(rbf_max(rbf_max(a[2], b[2]), 0), 1));
	const float f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
	float n[3];
	rbf_cross(e, f, n);
	return .6f * sqrtf(rbf_dot(n, n));
}

/* What tables are made for. */
typedef struct place {
	const rbf_component *component;
	const rbf_vertex *corner[3];
	uint32_t corners;
	int inside, chain;
	const uint32_t *shift_of;   /* of the element's corners, or NULL */
} place;

/* One corner in one frame. */
typedef struct maker {
	const place *at;
	rbf_reach reach;
	const rbf_linear *linear;
	const rbf_shift *shift[2];
	rbf_neighbour near[2];
	uint32_t others, op;
	float limit;
} maker;

/* The next whole number, of what is not negative. */
static long rounded_up(double x)
{
	const long whole = (long)x;
	return whole + ((double)whole < x);
}

/* Running sums of shares that are at least the parts, which become these shares, and guides, of one table; returns the unit. */
static float shares(double *part, const rbf_draw_set *set, uint32_t table)
{
	const uint32_t count = set->blocks * RBF_LANES;
	uint8_t *guide = (uint8_t *)rbf_draw_guide(set, table);
	double total = 0;
	uint32_t some = 0, largest = 0, block = 0;
	for (uint32_t i = 0; i < count; i++) {
		total += part[i];
		some += part[i] > 0;
		largest = part[i] > part[largest] ? i : largest;
	}
	if (!(total > 0) || some >= RBF_DRAW_TOTAL / 2)
		return 0;
	const float unit = nextafterf((float)(total / (double)(RBF_DRAW_TOTAL - some)), INFINITY);
	const double scale = 1 / (double)unit;
	long rest = RBF_DRAW_TOTAL, sum = 0;
	for (uint32_t i = 0; i < count; i++) {
		const long share = rounded_up(part[i] * scale);
		part[i] = (double)share;
		rest -= share;
	}
	part[largest] += (double)rest;
	for (uint32_t b = 0; b <= set->blocks; b++) {
		uint16_t *row = (uint16_t *)rbf_draw_row(set, b, table);
		for (uint32_t n = 0; n < RBF_LANES; n++) {
			sum += b < set->blocks ? (long)part[b * RBF_LANES + n] : 0;
			row[n] = (uint16_t)sum;
		}
	}
	for (uint32_t g = 0; g < RBF_DRAW_GUIDES; g++) {
		while (rbf_draw_row(set, block, table)[RBF_LANES - 1] <= g * ((RBF_DRAW_TOTAL + 1) / RBF_DRAW_GUIDES))
			block++;
		const uint32_t most = (256 * block + set->blocks - 1) / set->blocks;
		guide[g] = (uint8_t)(most < 256 ? most : 255);
		while (rbf_draw_begin(guide[g], set->blocks) > block)
			guide[g]--;
	}
	return unit;
}

/* The part of a lobe that may lie where its corner takes over from another; kappa is above RBF_LOBE_SHARP. */
static float tail(const maker *m, const float at[3], float kappa)
{
	/* beyond, less than 1/65535 is left */
	const float enough = m->reach.motion + 4.9f / sqrtf(kappa);
	float angle = INFINITY;
	for (uint32_t i = 0; i < m->others && angle > 0; i++)
		angle = rbf_min(rbf_takeover_angle(&m->near[i], m->reach.map, m->linear, at, enough), angle);
	angle = rbf_min(rbf_max(angle - m->reach.motion, 0), 3);
	return rbf_exp_negative(-kappa * .5f * angle * angle * (1 - angle * angle * (1 / 12.f)));
}

/* Largest residual motion of a lobe, rad. */
static float motion(const maker *m, uint32_t block, uint32_t lane)
{
	float most = 0;
	for (int n = 0; n < 2; n++)
		if (m->shift[n])
			most = rbf_max(rbf_shift_motion(&m->shift[n][block], lane), most);
	return most;
}

/* Fills in the tables of a set. part: room for three numbers of each lane. */
static void make_set(maker *m, const rbf_component *c, uint32_t offset, rbf_draw_set *set, double *part)
{
	const uint32_t y = rbf_luminance(c->channels), count = set->blocks * RBF_LANES;
	const float excess = m->others ? rbf_draw_excess(m->limit) : 0;
	for (uint32_t i = 0; i < count; i++) {
		const rbf_block *b = &c->block[set->first + i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		const float centre[3] = {b->x[lane], b->y[lane], b->z[lane]}, kappa = b->k[lane];
		const double mass = (double)c->amplitude[(size_t)y * c->blocks + set->first + i / RBF_LANES].a[lane] * (kappa > RBF_LOBE_SHARP
			? 2 * RBF_PI / (double)kappa : rbf_lobe_integral((double)kappa));
		float at[3];
		part[i] = part[count + i] = part[2 * count + i] = 0;
		if (!(kappa > 0) || !(mass > 0) || !(mass < 1e30))
			continue;
		rbf_mirror(m->op, centre, at);
		m->reach.motion = motion(m, offset + i / RBF_LANES, lane);
		uint16_t *outer = (uint16_t *)rbf_draw_row(set, i / RBF_LANES, set->tables) + lane;
		if (excess > 0)
			*outer = (uint16_t)ceilf(kappa > RBF_LOBE_SHARP ? 65535 * rbf_min(tail(m, at, kappa), 1) : 65535);
		part[i] = mass * (1 + (double)(excess * (1 / 65535.f) * (float)*outer));
		for (uint32_t t = 1; t <= m->others && set->tables > 1; t++)
			part[t * count + i] = part[i] * (double)(m->at->inside ? rbf_lobe_rise(&m->reach, m->near[t - 1].l, at, kappa)
				: t == 1 ? rbf_lobe_slant(&m->reach, at, kappa) : 0);
	}
	for (uint32_t t = 0; t < set->tables; t++)
		set->unit[t] = shares(part + t * count, set, t);
}

static void make_corner(const place *at, uint32_t k, rbf_draws *draws, double *part)
{
	const rbf_component *c = at->component;
	const rbf_vertex *own = at->corner[k];
	const uint32_t base = rbf_bound_base(c, own), start = c->set[base * c->frames].first;
	float beyond = 0;
	maker m = {.at = at, .op = own->op, .others = at->corners - 1};
	memcpy(m.reach.base, own->direction, sizeof m.reach.base);
	for (uint32_t i = 0; i < m.others; i++) {
		const rbf_vertex *other = at->corner[(k + 1 + i) % at->corners], *third = at->corner[(k + 2 - i) % at->corners];
		rbf_neighbour *n = &m.near[i];
		memcpy(n->k, own->direction, sizeof n->k);
		memcpy(n->l, other->direction, sizeof n->l);
		n->twist = at->chain ? 0 : twist_of(n->k, n->l, at->corners > 2 ? third->direction : NULL);
		beyond = rbf_max(rbf_angle(n->k, n->l), beyond);
	}
	for (uint32_t i = 0; i < 2 && at->shift_of; i++)
		m.shift[i] = rbf_bound_shift(c, at->shift_of[2 * k + i], base);
	if (!at->inside && !at->chain)
		beyond = (float)(RBF_PI / 2); /* anywhere outside the mesh */
	m.reach.lowest = rbf_reach_lowest(m.reach.base, beyond);
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_draw_set *set = &draws->set[k * c->frames + f];
		m.reach.map = c->frame[f];
		m.linear = rbf_frame_linear(c, f);
		m.limit = rbf_frame_limit(c, f);
		make_set(&m, c, set->first - start, set, part);
	}
}

static uint32_t tables_of(const rbf_component *c, uint32_t frame)
{
	return rbf_map_get(c->frame[frame])->kind == RBF_KIND_HALF ? RBF_DRAW_TABLES : 1;
}

/* An aligned piece of memory that holds nothing yet. */
static void *piece(size_t bytes)
{
	void *at = bytes < UINT32_MAX ? aligned_alloc(ALIGN, (bytes + ALIGN - 1) / ALIGN * ALIGN) : NULL;
	if (at)
		memset(at, 0, bytes);
	return at;
}

/* Bytes of a set's entries. */
static size_t bytes_of(uint32_t blocks, uint32_t tables)
{
	return ((size_t)blocks + 2) * (tables + 1) * RBF_LANES * sizeof(uint16_t);
}

static rbf_draws *make(const place *at)
{
	const rbf_component *c = at->component;
	const uint32_t sets = at->corners * c->frames;
	const rbf_set *from[3 * RBF_MAX_FRAMES];
	uint32_t longest = 0;
	size_t lobes = 0, guides = 0, header = sizeof(rbf_draws) + sets * sizeof(rbf_draw_set);
	for (uint32_t s = 0; s < sets; s++) {
		const uint32_t tables = tables_of(c, s % c->frames);
		from[s] = rbf_bound_set(c, (size_t)rbf_bound_base(c, at->corner[s / c->frames]) * c->frames + s % c->frames);
		longest = from[s]->blocks > longest ? from[s]->blocks : longest;
		lobes += bytes_of(from[s]->blocks, tables);
		guides += tables * RBF_DRAW_GUIDES;
	}
	const size_t first = (header + guides + ALIGN - 1) / ALIGN * ALIGN;
	rbf_draws *draws = piece(first + lobes);
	double *part = malloc((RBF_DRAW_TABLES * (size_t)longest * RBF_LANES + 1) * sizeof *part);
	if (!draws || !part) {
		free(draws);
		free(part);
		return NULL;
	}
	*draws = (rbf_draws){.corners = (uint16_t)at->corners, .tables = 1, .inside = (uint16_t)at->inside, .frames = (uint16_t)c->frames,
		.first = (uint32_t)first};
	lobes = guides = 0;
	for (uint32_t s = 0; s < sets; s++) {
		const uint32_t tables = tables_of(c, s % c->frames);
		const size_t here = sizeof *draws + s * sizeof(rbf_draw_set);
		draws->tables = tables > draws->tables ? (uint16_t)tables : draws->tables;
		draws->set[s] = (rbf_draw_set){.first = from[s]->first, .blocks = from[s]->blocks, .tables = tables,
			.guide = (uint32_t)(header + guides - here), .lobe = (uint32_t)(first + lobes - here)};
		lobes += bytes_of(from[s]->blocks, tables);
		guides += tables * RBF_DRAW_GUIDES;
	}
	for (uint32_t k = 0; k < at->corners; k++)
		make_corner(at, k, draws, part);
	free(part);
	return draws;
}

rbf_draws *rbf_draws_of_item(const rbf_component *c, uint32_t item)
{
	const rbf_mesh *mesh = &c->mesh;
	const uint32_t border = item & RBF_MESH_BORDER, index = item & ~RBF_MESH_BORDER;
	const uint32_t element = border ? mesh->border[index][2] : index;
	uint32_t corner[3];
	rbf_bound_corners(mesh, item, corner);
	place at = {.component = c, .chain = mesh->symmetry == RBF_ISOTROPIC};
	at.corners = border || at.chain ? 2 : 3;
	at.inside = at.corners == 3;
	for (uint32_t k = 0; k < at.corners; k++)
		at.corner[k] = &mesh->vertex[corner[k]];
	uint32_t shift_of[6] = {RBF_NO_SHIFT, RBF_NO_SHIFT, RBF_NO_SHIFT, RBF_NO_SHIFT, RBF_NO_SHIFT, RBF_NO_SHIFT};
	if (c->residual && element < mesh->elements) {
		/* of the element's corners, some of which a border leaves out */
		for (uint32_t k = 0; k < at.corners; k++)
			for (uint32_t own = 0; own < 3; own++)
				if (mesh->element[element].v[own] == corner[k])
					memcpy(shift_of + 2 * k, c->shift_of + element * 6 + 2 * own, 2 * sizeof *shift_of);
		at.shift_of = shift_of;
	}
	return make(&at);
}

rbf_draws *rbf_draws_of_corners(const rbf_component *c, const rbf_vertex vertex[3], const float weight[3])
{
	place at = {.component = c};
	for (int k = 0; k < 3; k++)
		if (weight[k] > 0)
			at.corner[at.corners++] = &vertex[k];
	return make(&at);
}

const rbf_draws *rbf_draws_at(const bsdfrbf_model *model, const rbf_component *c, uint32_t item)
{
	const uint32_t border = item & RBF_MESH_BORDER;
	const size_t items = c->mesh.elements + (size_t)c->mesh.borders, index = border ? c->mesh.elements + (size_t)(item & ~RBF_MESH_BORDER) : item;
	rbf_kept_draws *_Atomic *list = &model->late->draws[c - model->component], *kept = atomic_load_explicit(list, memory_order_acquire);
	if (!kept) {
		rbf_kept_draws *made = calloc(1, sizeof *made + items * sizeof *made->of);
		if (!made)
			return NULL;
		made->items = items;
		if (atomic_compare_exchange_strong_explicit(list, &kept, made, memory_order_acq_rel, memory_order_acquire))
			kept = made;
		else
			free(made);
	}
	void *found = atomic_load_explicit(&kept->of[index], memory_order_acquire);
	if (!found) {
		rbf_draws *made = rbf_draws_of_item(c, item);
		if (!made)
			return NULL;
		if (atomic_compare_exchange_strong_explicit(&kept->of[index], &found, made, memory_order_acq_rel, memory_order_acquire))
			found = made;
		else
			free(made);
	}
	return found;
}
