/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A cell of exitant directions is a piece of a ring, with 3 x 3 nodes in polar angle and azimuth (if isotropic 3 x 1). The incident
 * hemisphere, as the unit square of shirley_chiu.h, is cut into quarters from above, and every leaf is evaluated at four points
 * for all nodes. That gives
 *   - the integral at each node, DHR times the cosine, which is smooth: between the nodes it is quadratic;
 *   - a bound for each leaf. A direction is drawn by the bounds, evaluated, and kept with the probability value / bound: what is kept is
 *     distributed as the interpolant itself, but where it exceeds a bound, which is set above all that was seen in the leaf.
 */
#include "bounds.h"
#include "dhr.h"
#include "reciprocal.h"
#include "sample.h"
#include "shirley_chiu.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { NODES = 9, POINTS = 4, LEAVES = 400, FIRST_LEVEL = 3, LAST_LEVEL = 11, TRIES = 4096, BASES_LOOKED_AT = 64, RINGS_LEAST = 9 };
static const float ABOVE_SEEN = 1.5f;   /* bound over the largest value seen in a leaf */
static const float ABOVE_AROUND = .1f;  /* and over what was seen in the leaf that it is a quarter of */
static const float EVEN = .002f;        /* share of the whole by which one leaf may be uneven */

typedef struct leaf {
	uint16_t x, y, level;  /* lower corner in sides of 2^-level */
	float running;         /* sum of bound times area up to this one */
} leaf;

typedef struct cell {
	uint32_t leaves;
	float node[NODES][3];  /* integral of DSF cos over the incident hemisphere, per channel */
	leaf leaf[LEAVES];
} cell;

/* What is known of a leaf while a cell is made. */
typedef struct seen {
	float most;            /* of the values, and of what may be hidden between the points */
	float unevenness;      /* largest difference at one node, times area; 0 on the last level */
	float energy;          /* mean of all values, times area */
	float sum[NODES][3];   /* of the points */
} seen;

typedef struct maker {
	const rbf_component *component;
	uint32_t nodes;
	float node[NODES][3];  /* exitant directions */
	const float *middle;   /* the one amid the others */
	float radius;          /* largest angle from it to another one */
	leaf leaf[LEAVES];
	seen seen[LEAVES];
	uint32_t leaves;
} maker;

static float area(const leaf *l)
{
	return ldexpf(1, -2 * l->level);
}

/* f times the limited cosine: DSF where the cosine counts. */
static void value_at(const rbf_component *c, const rbf_site *site, const float exitant[3], float value[3])
{
	rbf_site_eval(site, exitant, value);
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] *= rbf_max(exitant[2], RBF_HORIZON_Z);
}

/* Lobes of less than `narrow` sigma, as broad as if the cell's middle and the site were anywhere within `radius`: the four points
 * may miss such lobes. */
static float hidden(const rbf_site *site, const float exitant[3], float narrow, float radius)
{
	const rbf_component *c = site->component;
	const rbf_amplitude *luminance = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
	float folded[3], sum = 0;
	rbf_site_fold(site, exitant, folded);
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			float mapped[3], d[3], part = 0;
			rbf_warp warp;
			rbf_site_warp(site, k, f, &warp);
			const float factor = rbf_warp_forward(&warp, folded, mapped);
			rbf_mirror(site->vertex_op[k], mapped, d);
			for (uint32_t b = set->first; b < set->first + set->blocks; b++) {
				const rbf_block *l = &c->block[b];
				for (int i = 0; i < RBF_LANES; i++) {
					const float x = l->x[i] - d[0], y = l->y[i] - d[1], z = l->z[i] - d[2];
					const float share = 1 / (1 + l->k[i] * radius * radius); /* of kappa that is left, so of the height */
					float t = 1 + .125f * share * l->k[i] * (x*x + y*y + z*z); /* to the -4th: as exp(-k d^2 / 2), but with tails */
					t *= t;
					part += l->k[i] * narrow * narrow > 1 ? luminance[b].a[i] * share / (t * t) : 0;
				}
			}
			sum += site->part[k] * factor * part;
		}
	return sum;
}

/* Evaluates a leaf at the four points of Gauss's rule for all nodes. */
static void look(maker *m, uint32_t at, float around)
{
	static const double gauss[2] = {.2113248654, .7886751346};
	const rbf_component *c = m->component;
	const uint32_t y = rbf_luminance(c->channels);
	const leaf *l = &m->leaf[at];
	seen *s = &m->seen[at];
	float low[NODES], high[NODES], middle[3];
	rbf_site site;
	memset(s, 0, sizeof *s);
	for (uint32_t n = 0; n < m->nodes; n++) {
		low[n] = INFINITY;
		high[n] = 0;
	}
	for (int p = 0; p < POINTS; p++) {
		float d[3], value[3];
		rbf_direction_from_cell(ldexp(l->x + gauss[p & 1], -l->level), ldexp(l->y + gauss[p >> 1], -l->level), d);
		rbf_site_locate(c, d, &site);
		for (uint32_t n = 0; n < m->nodes; n++) {
			value_at(c, &site, m->node[n], value);
			for (uint32_t k = 0; k < c->channels; k++)
				s->sum[n][k] += value[k];
			s->energy += value[y];
			low[n] = rbf_min(value[y], low[n]);
			high[n] = rbf_max(value[y], high[n]);
		}
	}
	for (uint32_t n = 0; n < m->nodes; n++) {
		s->most = rbf_max(high[n], s->most);
		s->unevenness = rbf_max(high[n] - low[n], s->unevenness);
	}
	rbf_direction_from_cell(ldexp(l->x + .5, -l->level), ldexp(l->y + .5, -l->level), middle);
	rbf_site_locate(c, middle, &site);
	const float side = ldexpf(2, -l->level) / rbf_max(middle[2], .3f); /* in angle: longer towards the horizon */
	const float may = hidden(&site, m->middle, .35f * side, .7f * side + m->radius);
	s->unevenness = l->level < LAST_LEVEL ? rbf_max(s->unevenness, may) * area(l) : 0;
	s->energy *= area(l) / (float)(POINTS * m->nodes);
	s->most = rbf_max(s->most, rbf_max(may, ABOVE_AROUND * around));
}

/* Cuts the hemisphere where values differ most, until what differs in one leaf is a small share of the whole. */
static void cut(maker *m)
{
	const uint32_t side = 1u << FIRST_LEVEL;
	for (uint32_t n = 0; n < side * side; n++) {
		m->leaf[n] = (leaf){(uint16_t)(n % side), (uint16_t)(n / side), FIRST_LEVEL, 0};
		look(m, m->leaves++, 0);
	}
	while (m->leaves + POINTS <= LEAVES) {
		uint32_t worst = 0;
		float total = 0;
		for (uint32_t n = 0; n < m->leaves; n++) {
			total += m->seen[n].energy;
			if (m->seen[n].unevenness > m->seen[worst].unevenness)
				worst = n;
		}
		if (!(m->seen[worst].unevenness > EVEN * total))
			break;
		const leaf l = m->leaf[worst];
		const float around = m->seen[worst].most;
		for (uint32_t q = 0; q < 4; q++) {
			const uint32_t at = q ? m->leaves++ : worst;
			m->leaf[at] = (leaf){(uint16_t)(2 * l.x + (q & 1)), (uint16_t)(2 * l.y + (q >> 1)), (uint16_t)(l.level + 1), 0};
			look(m, at, around);
		}
	}
}

/* Leaves with nothing in them are left out. */
static void keep(const maker *m, cell *t)
{
	float running = 0;
	memset(t->node, 0, sizeof t->node);
	t->leaves = 0;
	for (uint32_t i = 0; i < m->leaves; i++) {
		const float share = area(&m->leaf[i]);
		if (!(m->seen[i].most > 0))
			continue;
		for (uint32_t n = 0; n < m->nodes; n++)
			for (int k = 0; k < 3; k++)
				t->node[n][k] += (float)(RBF_PI / POINTS) * share * m->seen[i].sum[n][k];
		t->leaf[t->leaves] = m->leaf[i];
		t->leaf[t->leaves++].running = running += ABOVE_SEEN * m->seen[i].most * share;
	}
}

/* Where a folded exitant direction is: its cell, and how far in it, from 0 to 2 each way. */
typedef struct place { uint32_t index, ring, sector, sectors; float along[2]; } place;

static uint32_t sectors_of(const rbf_component *c, uint32_t rings, uint32_t ring)
{
	return c->mesh.symmetry == RBF_ISOTROPIC ? 1 : 4 * (uint32_t)ceil(rings * sin((ring + .5) * RBF_PI / 2 / rings));
}

static uint32_t whole(float x, uint32_t count)
{
	return x > 0 ? x < (float)(count - 1) ? (uint32_t)x : count - 1 : 0;
}

static place find(const rbf_reciprocal_grid *r, const rbf_component *c, const float d[3])
{
	place p;
	const float theta = rbf_polar_angle(d) * (float)(2 / RBF_PI) * (float)r->rings;
	p.ring = whole(theta, r->rings);
	p.along[0] = 2 * (theta - (float)p.ring);
	p.sectors = r->first[p.ring + 1] - r->first[p.ring];
	float phi = c->mesh.symmetry == RBF_ISOTROPIC ? 0 : atan2f(d[1], d[0]) * (float)(.5 / RBF_PI);
	phi = (phi < 0 ? phi + 1 : phi) * (float)p.sectors;
	p.sector = whole(phi, p.sectors);
	p.along[1] = 2 * (phi - (float)p.sector);
	p.index = r->first[p.ring] + p.sector;
	return p;
}

static void make(const rbf_reciprocal_grid *r, const rbf_component *c, const place *p, cell *t)
{
	maker m = {.component = c, .nodes = c->mesh.symmetry == RBF_ISOTROPIC ? 3 : NODES};
	for (uint32_t n = 0; n < m.nodes; n++) {
		const double theta = (p->ring + n % 3 / 2.) * RBF_PI / 2 / r->rings, phi = (p->sector + n / 3 / 2.) * 2 * RBF_PI / p->sectors;
		m.node[n][0] = (float)(sin(theta) * cos(phi));
		m.node[n][1] = (float)(sin(theta) * sin(phi));
		m.node[n][2] = (float)fmax(cos(theta), 1e-3);
	}
	m.middle = m.node[m.nodes / 2];
	m.radius = rbf_max(rbf_angle(m.middle, m.node[0]), rbf_angle(m.middle, m.node[2]));
	cut(&m);
	keep(&m, t);
}

/* Spread of the lobes, weighted by their energy, radians. Narrow ones count for more than their share. */
static double width(const rbf_component *c)
{
	const rbf_amplitude *luminance = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
	const uint32_t step = (c->mesh.bases + BASES_LOOKED_AT - 1) / BASES_LOOKED_AT;
	double energy = 0, kappas = 0;
	for (size_t base = 0; base < c->mesh.bases; base += step)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, base * c->frames + f);
			for (uint32_t i = 0; i < set->blocks * RBF_LANES; i++) {
				const uint32_t b = set->first + i / RBF_LANES;
				const double kappa = (double)c->block[b].k[i % RBF_LANES], amplitude = (double)luminance[b].a[i % RBF_LANES];
				energy += kappa > 0 ? amplitude / kappa : 0;
				kappas += kappa > 0 ? amplitude : 0;
			}
		}
	return energy > 0 && kappas > 0 ? sqrt(energy / kappas) : 1;
}

/* Nodes lie two widths apart at most, within what memory and time allow. */
static void set_grid(const rbf_component *c, rbf_reciprocal_grid *g)
{
	const double rings = ceil(RBF_PI / 8 / width(c));
	g->rings = rings > RINGS_LEAST ? rings < RBF_RECIPROCAL_RINGS ? (uint32_t)rings : RBF_RECIPROCAL_RINGS : RINGS_LEAST;
	g->first[0] = 0;
	for (uint32_t ring = 0; ring < g->rings; ring++)
		g->first[ring + 1] = g->first[ring] + sectors_of(c, g->rings, ring);
}

/* The model's cells for one component; NULL if there is no memory for them, and *grid is set instead. */
static rbf_reciprocal *cells_of(const bsdfrbf_model *model, const rbf_component *c, rbf_reciprocal_grid *grid)
{
	rbf_reciprocal *_Atomic *kept = &model->late->reciprocal[c == &model->component[BSDFRBF_TB]];
	rbf_reciprocal *r = atomic_load_explicit(kept, memory_order_acquire), *faster = NULL;
	if (r)
		return r;
	set_grid(c, grid);
	r = calloc(1, sizeof *r + grid->first[grid->rings] * sizeof *r->cell);
	if (!r)
		return NULL;
	r->grid = *grid;
	if (atomic_compare_exchange_strong(kept, &faster, r))
		return r;
	free(r); /* another thread made them meanwhile */
	return faster;
}

/* The table of a folded direction and where in it that is: the model's, which is made if need be, or `room` if there is no memory. */
static const cell *table_at(const bsdfrbf_model *model, const rbf_component *c, const float exitant[3], place *p, cell *room)
{
	rbf_reciprocal_grid grid;
	rbf_reciprocal *r = cells_of(model, c, &grid);
	*p = find(r ? &r->grid : &grid, c, exitant);
	void *faster = NULL;
	cell *t = r ? atomic_load_explicit(&r->cell[p->index], memory_order_acquire) : NULL;
	if (t)
		return t;
	make(r ? &r->grid : &grid, c, p, room);
	const size_t bytes = offsetof(cell, leaf) + room->leaves * sizeof *room->leaf;
	t = r ? malloc(bytes) : NULL;
	if (!t)
		return room;
	memcpy(t, room, bytes);
	if (atomic_compare_exchange_strong(&r->cell[p->index], &faster, t))
		return t;
	free(t);
	return faster;
}

/* The same for a direction that is not folded; the site keeps how it was. */
static const cell *fold_and_find(const bsdfrbf_model *model, const rbf_component *c, const float exitant[3], rbf_site *site, place *p,
	cell *room)
{
	rbf_site_turn(c, exitant, site);
	return table_at(model, c, site->incident, p, room);
}

void rbf_reciprocal_dhr(const bsdfrbf_model *model, const rbf_component *c, const float exitant[3], float value[3])
{
	cell room;
	rbf_site site;
	place p;
	const cell *t = fold_and_find(model, c, exitant, &site, &p, &room);
	const int rows = c->mesh.symmetry == RBF_ISOTROPIC ? 1 : 3;
	float ring[3], around[3] = {1, 0, 0};
	rbf_quadratic(p.along[0], ring);
	if (rows > 1)
		rbf_quadratic(p.along[1], around);
	for (uint32_t k = 0; k < c->channels; k++) {
		float sum = 0;
		for (int j = 0; j < rows; j++)
			for (int i = 0; i < 3; i++)
				sum += around[j] * ring[i] * t->node[3 * j + i][k];
		value[k] = rbf_max(sum, 0) / rbf_max(exitant[2], RBF_HORIZON_Z);
	}
}

int rbf_reciprocal_sample(const bsdfrbf_model *model, const rbf_component *c, const float exitant[3], double u, float incident[3])
{
	cell room;
	rbf_site turned;
	place p;
	const cell *t = fold_and_find(model, c, exitant, &turned, &p, &room);
	uint64_t state;
	float best = 0;
	incident[0] = incident[1] = incident[2] = 0;
	if (!t->leaves)
		return 0;
	u = u > 0 ? u < 1 ? u : 1 - 0x1p-53 : 0;
	memcpy(&state, &u, sizeof state);
	for (int attempt = 0; attempt < TRIES; attempt++) {
		const float target = (float)u * t->leaf[t->leaves - 1].running;
		uint32_t low = 0, high = t->leaves - 1;
		while (low < high) {
			const uint32_t middle = (low + high) / 2;
			if (t->leaf[middle].running > target)
				high = middle;
			else
				low = middle + 1;
		}
		const leaf *l = &t->leaf[low];
		const double from = low ? (double)t->leaf[low - 1].running : 0, step = (double)l->running - from;
		const double rest = step > 0 ? (u * (double)t->leaf[t->leaves - 1].running - from) / step : .5;
		float a, b, d[3], value[3];
		rbf_site site;
		rbf_split_number((uint32_t)((attempt ? rbf_uniform(&state) : rest > 0 ? rest < 1 ? rest : 1 - 0x1p-53 : 0) * 0x1p32), &a, &b);
		rbf_direction_from_cell(ldexp(l->x + (double)a, -l->level), ldexp(l->y + (double)b, -l->level), d);
		rbf_site_locate(c, d, &site);
		value_at(c, &site, turned.incident, value);
		const float kept = value[rbf_luminance(c->channels)] * area(l) / (float)step;
		const int taken = rbf_uniform(&state) < (double)kept;
		if (taken || kept > best) {
			best = kept;
			rbf_site_unfold(&turned, d, incident);
		}
		if (taken)
			return 1;
		u = rbf_uniform(&state);
	}
	return best > 0; /* never in practice; the best candidate then */
}
