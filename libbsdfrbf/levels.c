/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A surface of second degree through an incidence's own level and, by least squares, those of the incidences around it and of their mirror
 * images. Half its slope at each corner, added to linear interpolation, makes that exact for whatever is of second degree: on a
 * triangle sum w_k (a_k + g_k.(x - x_k) / 2).
 */
#include "levels.h"
#include "assemble.h"
#include "integrate.h"
#include "kernel.h"
#include "small_system.h"

#include <stdlib.h>
#include <string.h>

enum { AROUND = 14, IN_PLANE = 4, TERMS = 5 };
static const double SOFT = .02; /* of the farthest squared distance: incidences that are nearer than that to each other count alike */
static const double RIDGE = 1e-5, RIDGE_SECOND = 1e-4; /* of slopes, of second derivatives, in shares of the trace */
static const double ALONG_LEAST = .02; /* of a lobe's half vector, not normalised, along the incidence */
static const double APART = 1e-6; /* squared distance */

typedef struct around {
	int count;
	struct { uint32_t base; float square, d[3]; } near[AROUND + 1];
} around;

static double square_between(const float a[3], const float b[3])
{
	const float e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	return (double)rbf_dot(e, e);
}

/* Keeps the nearest ones. */
static void keep(around *a, int most, uint32_t base, const float d[3], double square)
{
	int at = a->count < most ? a->count++ : most;
	for (; at > 0 && (double)a->near[at - 1].square > square; at--)
		a->near[at] = a->near[at - 1];
	if (at >= most)
		return;
	a->near[at].base = base;
	a->near[at].square = (float)square;
	memcpy(a->near[at].d, d, sizeof a->near[at].d);
}

static void look_around(const rbf_fitted *m, const unsigned char *out, const float k[3], around *a)
{
	const int plane = m->symmetry == RBF_ISOTROPIC;
	int op[4] = {RBF_OP_NONE, RBF_OP_X};
	const int ops = plane ? 2 : rbf_symmetry_ops(m->symmetry, op);
	a->count = 0;
	for (uint32_t b = 0; b < m->bases; b++) {
		if (out && out[b])
			continue;
		const float own[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]};
		for (int n = 0; n < ops; n++) {
			float d[3];
			rbf_mirror((unsigned)op[n], own, d);
			const double square = square_between(d, k);
			if (square > APART && (!op[n] || square_between(d, own) > APART)) /* else it is its own image */
				keep(a, plane ? IN_PLANE : AROUND, b, d, square);
		}
	}
}

float *rbf_levels_sent(const rbf_fitted *m)
{
	float *root = malloc(((size_t)m->bases + 1) * sizeof *root);
	for (uint32_t b = 0; b < m->bases && root; b++) {
		double sum = 0;
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			sum += m->lobes[b].mass[i];
		root[b] = (float)sqrt(sqrt(m->scale ? sum / (double)m->scale[b] : sum));
	}
	return root;
}

float *rbf_levels_arrived(const rbf_fitted *m)
{
	static const uint32_t fixed[1] = {RBF_MAP_FIXED};
	const uint32_t lobes = m->lobe_first[m->bases], y = rbf_luminance(m->channels);
	rbf_component c = {0};
	float *label = malloc(((size_t)lobes + 1) * sizeof *label), *root = rbf_levels_sent(m);
	for (uint32_t i = 0; i < lobes && label; i++)
		label[i] = 1;
	if (!label || !root || rbf_assemble_sets(m, 1, fixed, label, NULL, &c)) {
		free(label);
		free(root);
		return NULL;
	}
	#pragma omp parallel for schedule(dynamic)
	for (int64_t b = 0; b < (int64_t)m->bases; b++) {
		const float d[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]}, weight[3] = {1, 0, 0};
		const rbf_vertex own = {{d[0], d[1], d[2]}, (uint32_t)b, RBF_OP_NONE}, vertex[3] = {own, own, own};
		rbf_site site;
		double value[3];
		((rbf_set *)c.set)[b].sent = root[b] * root[b] * root[b] * root[b];
		rbf_site_corners(&c, d, vertex, weight, &site);
		rbf_site_dhr(&site, value);
		root[b] = (float)sqrt(sqrt(value[y]));
	}
	rbf_assemble_release(&c);
	free(label);
	return root;
}

void rbf_level_of(const rbf_fitted *m, const float root[], const unsigned char *out, uint32_t base, rbf_level *level)
{
	const float k[3] = {(float)m->direction[3*base], (float)m->direction[3*base + 1], (float)m->direction[3*base + 2]};
	const double own = (double)root[base];
	float t[3], s[3];
	double normal[TERMS][TERMS] = {{0}}, x[TERMS] = {0}, trace = 0;
	around a;
	*level = (rbf_level){.root = (float)own, .kept = 1};
	look_around(m, out, k, &a);
	if (!a.count)
		return;
	rbf_basis(k, t, s);
	const double farthest = (double)a.near[a.count - 1].square, unit = sqrt(farthest);
	for (int i = 0; i < a.count; i++) {
		const double u = (double)rbf_dot(a.near[i].d, t) / unit, v = (double)rbf_dot(a.near[i].d, s) / unit;
		const double term[TERMS] = {u, v, .5*u*u, u*v, .5*v*v}, near = farthest / ((double)a.near[i].square + SOFT * farthest);
		const double step = (double)root[a.near[i].base] - own;
		for (int n = 0; n < TERMS; n++) {
			for (int l = 0; l < TERMS; l++)
				normal[n][l] += near * near * term[n] * term[l];
			x[n] += near * near * term[n] * step;
		}
	}
	for (int n = 0; n < TERMS; n++)
		trace += normal[n][n];
	for (int n = 0; n < TERMS; n++)
		normal[n][n] += trace * (n < 2 ? RIDGE : RIDGE_SECOND);
	rbf_small_system_solve(TERMS, normal[0], x, 0);
	for (int n = 0; n < 3; n++)
		level->slope[n] = (float)((x[0] * (double)t[n] + x[1] * (double)s[n]) / unit);
}

rbf_level *rbf_levels_all(const rbf_fitted *m, const float *root, int slopes)
{
	rbf_level *level = root ? malloc(((size_t)m->bases + 1) * sizeof *level) : NULL;
	#pragma omp parallel for schedule(static)
	for (int64_t b = 0; b < (level ? (int64_t)m->bases : 0); b++) {
		rbf_level_of(m, root, NULL, (uint32_t)b, &level[b]);
		if (!slopes)
			rbf_level_flatten(&level[b]);
		const float back = m->scale ? sqrtf(sqrtf(m->scale[b])) : 1;
		level[b].root *= back;
		for (int n = 0; n < 3; n++)
			level[b].slope[n] *= back;
	}
	return level;
}

float rbf_level_between(uint32_t corners, const rbf_level level[], const rbf_vertex vertex[], const float weight[])
{
	float at[3] = {0, 0, 0}, plain = 0, rise = 0;
	for (uint32_t k = 0; k < corners; k++)
		for (int n = 0; n < 3; n++)
			at[n] += weight[k] * vertex[k].direction[n];
	rbf_normalize(at);
	for (uint32_t k = 0; k < corners; k++) {
		float own[3];
		rbf_mirror(vertex[k].op, at, own);
		plain += weight[k] * level[k].root;
		rise += weight[k] * rbf_dot(level[k].slope, own);
	}
	return rbf_min(rbf_max(plain + .5f * rise, plain * RBF_LEVEL_SLOPED_LEAST), plain * RBF_LEVEL_SLOPED_MOST);
}

/* A lobe at c is carried to i with the factor h.i / h.k (map.h), h half way between c and k. */
void rbf_level_carried(const rbf_component *c, const float k[3], uint32_t base, rbf_level *level)
{
	double kept = 0, half[3] = {0, 0, 0}, all = 0;
	int some = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		some |= rbf_map_get(c->frame[f])->kind == RBF_KIND_HALF;
	for (uint32_t f = 0; some && f < c->frames; f++) {
		const rbf_set *set = &c->set[(size_t)base * c->frames + f];
		const rbf_amplitude *a = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
		for (uint32_t i = set->first * RBF_LANES; i < (set->first + set->blocks) * RBF_LANES; i++) {
			const rbf_block *b = &c->block[i / RBF_LANES];
			const uint32_t lane = i % RBF_LANES;
			if (!(b->k[lane] > 0))
				continue;
			const double mass = (double)a[i / RBF_LANES].a[lane] * rbf_lobe_integral((double)b->k[lane]);
			all += mass;
			if (rbf_map_get(c->frame[f])->kind != RBF_KIND_HALF) {
				kept += mass;
				continue;
			}
			float h[3] = {k[0] + b->x[lane], k[1] + b->y[lane], k[2] + b->z[lane]};
			const float along = rbf_dot(h, k);
			for (int n = 0; n < 3; n++)
				half[n] += mass * (double)h[n] / fmax((double)along, ALONG_LEAST);
		}
	}
	if (!(all > 0))
		return;
	level->kept = (float)(kept / all);
	for (int n = 0; n < 3; n++)
		level->half[n] = (float)(half[n] / all);
}

int rbf_levels_make(const rbf_fitted *m, uint32_t even, int slopes, rbf_component *c)
{
	c->even = even;
	if (!even)
		return 0;
	float *root = rbf_levels_sent(m);
	rbf_level *level = rbf_levels_all(m, root, slopes);
	free(root);
	c->level = level;
	if (!level)
		return -1;
	for (uint32_t b = 0; b < m->bases; b++) {
		const float k[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]};
		rbf_level_carried(c, k, b, &level[b]);
	}
	return 0;
}
