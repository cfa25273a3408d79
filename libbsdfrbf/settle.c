/* SPDX-License-Identifier: BSD-3-Clause */
#include "settle.h"
#include "clones.h"
#include "elementary.h"
#include "extent.h"

#include <stdlib.h>
#include <string.h>

enum { SETTLING = 30 }; /* rounds at an incidence */
static const float WIDE = 5; /* sigmas: beams that are nearer share lobes */

/* How near the beams of two frames come to each other at a base. */
static float nearest_beams(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float share[], uint32_t base)
{
	const float k[3] = {(float)m->direction[3*base], (float)m->direction[3*base + 1], (float)m->direction[3*base + 2]};
	float e[RBF_MAX_FRAMES][3], near = INFINITY;
	for (uint32_t f = 0; f < frames; f++) {
		const rbf_candidate *c = &m->candidate[frame[f]];
		rbf_map_source(rbf_map_get(c->map)->kind == RBF_KIND_HALF ? RBF_MAP_MIRROR : c->map, &c->linear, k, e[f]);
		for (uint32_t g = 0; g < f; g++)
			if (share[f] > 0 && share[g] > 0)
				near = rbf_min(hypotf(e[f][0] - e[g][0], e[f][1] - e[g][1]), near);
	}
	return near;
}

/* Whether they coincide for a lobe. reach: sigmas. */
static int coincide(float near, const rbf_lobes *l, uint32_t lobe, float reach)
{
	return near < reach / sqrtf(rbf_lobe_kappa(l, lobe));
}

enum { SPREAD = 5 }; /* points that stand for a lobe: its middle, and four that have its width; exact for what changes as a cubic */
static const float SPREAD_WEIGHT[SPREAD] = {.5f, .125f, .125f, .125f, .125f};

static void spread_of(const rbf_lobes *l, uint32_t lobe, float point[SPREAD][3])
{
	const float step = 2 / sqrtf(rbf_lobe_kappa(l, lobe));
	float t[2][3];
	rbf_lobe_centre(l, lobe, point[0]);
	rbf_basis(point[0], t[0], t[1]);
	for (int n = 1; n < SPREAD; n++) {
		for (int x = 0; x < 3; x++)
			point[n][x] = point[0][x] + (n % 2 ? step : -step) * t[(n - 1) / 2][x];
		rbf_normalize(point[n]);
	}
}

/* What is settled at one incidence: lobes where beams coincide. */
typedef struct matter {
	uint32_t lobes;
	uint32_t *lobe;
	float (*point)[SPREAD][3];
	float (*wanted)[SPREAD][RBF_MAX_FRAMES]; /* what the neighbours predict of each frame there */
	uint32_t *first;        /* [lobes * SPREAD + 1]: where in the following what is seen at a point begins */
	rbf_amplitude *seen;    /* what each lobe of a block is there, for an amplitude of 1 */
	uint32_t *block;        /* which block; those that do not reach the point are left out */
} matter;

static void free_matter(matter *m)
{
	free(m->lobe);
	free(m->point);
	free(m->wanted);
	free(m->first);
	free(m->seen);
	free(m->block);
}

/* What each lobe is at a point, of those blocks that reach it. Returns how many do. */
RBF_CLONES static uint32_t see(const rbf_lobes *l, const float point[3], rbf_amplitude *seen, uint32_t *which)
{
	uint32_t count = 0;
	for (uint32_t from = 0; from < l->blocks; from += RBF_CULL_BITS) {
		const uint32_t blocks = rbf_lobes_rest(l, from);
		for (uint64_t left = rbf_extent_mask(l->extent, l->blocks, from, blocks, point); left; left &= left - 1) {
			const uint32_t b = from + (uint32_t)__builtin_ctzll(left);
			for (int i = 0; i < RBF_LANES; i++) {
				const float x = l->block[b].x[i] - point[0], y = l->block[b].y[i] - point[1], z = l->block[b].z[i] - point[2];
				seen[count].a[i] = rbf_exp_negative(-.5f * l->block[b].k[i] * (x*x + y*y + z*z));
			}
			which[count++] = b;
		}
	}
	return count;
}

typedef float lanes __attribute__((vector_size(4 * RBF_LANES)));

/* What is wanted of each frame over what there is, at lobe i. own: the lobes' parts that belong to it. `frames` is constant. */
static inline __attribute__((always_inline)) void lack_of(const matter *m, uint32_t i, uint32_t frames, const rbf_lobes own[], float ratio[])
{
	const uint32_t *first = m->first + i * SPREAD;
	for (uint32_t f = 0; f < frames; f++)
		ratio[f] = 0;
	for (uint32_t n = 0; n < SPREAD; n++) {
		lanes sum[RBF_MAX_FRAMES];
		for (uint32_t f = 0; f < frames; f++)
			sum[f] = (lanes){0};
		for (uint32_t b = first[n]; b < first[n + 1]; b++) {
			lanes one, of;
			memcpy(&one, &m->seen[b], sizeof one);
			for (uint32_t f = 0; f < frames; f++) {
				memcpy(&of, &own[f].amplitude[m->block[b]], sizeof of);
				sum[f] += one * of;
			}
		}
		for (uint32_t f = 0; f < frames; f++)
			ratio[f] += SPREAD_WEIGHT[n] * m->wanted[i][n][f]
				/ (((sum[f][0] + sum[f][4]) + (sum[f][1] + sum[f][5])) + ((sum[f][2] + sum[f][6]) + (sum[f][3] + sum[f][7])) + 1e-9f);
	}
}

RBF_CLONES static void lack(const matter *m, uint32_t i, uint32_t frames, const rbf_lobes own[], float ratio[])
{
	switch (frames) {
	case 2: lack_of(m, i, 2, own, ratio); break;
	case 3: lack_of(m, i, 3, own, ratio); break;
	default: lack_of(m, i, frames, own, ratio);
	}
}

static int set_matter(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float share[], float reach, rbf_lobes *const part[],
	uint32_t base, matter *to)
{
	const rbf_lobes *l = &m->lobes[base];
	const float near = nearest_beams(m, frames, frame, share, base);
	*to = (matter){.lobe = malloc((l->count + 1) * sizeof *to->lobe)};
	for (uint32_t i = 0; i < l->count && to->lobe; i++)
		if (coincide(near, l, i, reach))
			to->lobe[to->lobes++] = i;
	to->point = malloc((to->lobes + 1) * sizeof *to->point);
	to->wanted = malloc((to->lobes + 1) * sizeof *to->wanted);
	to->first = malloc((to->lobes * SPREAD + 1) * sizeof *to->first);
	to->seen = malloc(((size_t)to->lobes * SPREAD * l->blocks + 1) * sizeof *to->seen);
	to->block = malloc(((size_t)to->lobes * SPREAD * l->blocks + 1) * sizeof *to->block);
	if (!to->lobe || !to->point || !to->wanted || !to->first || !to->seen || !to->block)
		return -1;
	uint32_t at = 0;
	for (uint32_t i = 0; i < to->lobes; i++) {
		spread_of(l, to->lobe[i], to->point[i]);
		for (int n = 0; n < SPREAD; n++) {
			to->first[i * SPREAD + (uint32_t)n] = at;
			at += see(l, to->point[i][n], to->seen + at, to->block + at);
			const float self = rbf_lobes_luminance(l, to->point[i][n]) + 1e-9f;
			for (uint32_t f = 0; f < frames; f++)
				to->wanted[i][n][f] = expf(rbf_label_prediction(m, &m->candidate[frame[f]], part[f], base, to->point[i][n], self));
		}
	}
	to->first[to->lobes * SPREAD] = at;
	return 0;
}

/* Labels such that what belongs to each frame looks as the neighbours predict: by multiplying them with what is wanted over what there is
 * (Lucy, An iterative technique for the rectification of observed distributions, 1974), while those of a lobe add up to 1. own: what belongs
 * to each frame, as labels change. */
static void settle_base(const rbf_fitted *m, uint32_t frames, const matter *to, uint32_t base, rbf_lobes own[], const float *label, float *next)
{
	const rbf_lobes *l = &m->lobes[base];
	const uint32_t y = rbf_luminance(m->channels), lobes = m->lobe_first[m->bases];
	for (uint32_t i = 0; i < l->count; i++)
		for (uint32_t f = 0; f < frames; f++)
			next[i * frames + f] = label[(size_t)f * lobes + m->lobe_first[base] + i];
	for (uint32_t i = 0; i < to->lobes; i++)
		for (uint32_t f = 0; f < frames; f++)
			next[to->lobe[i] * frames + f] = 1 / (float)frames;
	for (int round = 0; round <= SETTLING; round++) {
		for (uint32_t i = 0; i < to->lobes; i++)
			for (uint32_t f = 0; f < frames; f++)
				own[f].amplitude[to->lobe[i] / RBF_LANES].a[to->lobe[i] % RBF_LANES] = next[to->lobe[i] * frames + f] * rbf_lobe_amplitude(l, y, to->lobe[i]);
		if (round == SETTLING)
			return;
		for (uint32_t i = 0; i < to->lobes; i++) {
			float *r = next + to->lobe[i] * frames, ratio[RBF_MAX_FRAMES], sum = 0;
			lack(to, i, frames, own, ratio);
			for (uint32_t f = 0; f < frames; f++)
				sum += r[f] *= ratio[f];
			for (uint32_t f = 0; f < frames; f++)
				r[f] /= sum;
		}
	}
}

static int sweep(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], float reach, float *label, const float share[])
{
	const uint32_t lobes = m->lobe_first[m->bases];
	float *next = malloc(((size_t)lobes * frames + 1) * sizeof *next);
	rbf_lobes *part[RBF_MAX_FRAMES] = {NULL}, *own[RBF_MAX_FRAMES] = {NULL};
	int failed = !next;
	for (uint32_t f = 0; f < frames && !failed; f++)
		failed = !(part[f] = rbf_label_parts(m, label + (size_t)f * lobes, 1)) || !(own[f] = rbf_label_parts(m, label + (size_t)f * lobes, 1));
	const int ready = !failed;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)m->bases; b++) {
		if (!ready || !rbf_team_mine(m->team, (uint64_t)b))
			continue;
		matter to;
		rbf_lobes here[RBF_MAX_FRAMES];
		for (uint32_t f = 0; f < frames; f++)
			here[f] = own[f][b];
		if (set_matter(m, frames, frame, share, reach, part, (uint32_t)b, &to))
			failed = 1;
		else
			settle_base(m, frames, &to, (uint32_t)b, here, label, next + (size_t)m->lobe_first[b] * frames);
		free_matter(&to);
	}
	failed = rbf_team_failed(m->team, failed) || rbf_label_share(m, frames, next);
	for (uint32_t i = 0; i < lobes && !failed; i++)
		rbf_label_set(lobes, frames, next + (size_t)i * frames, i, label);
	for (uint32_t f = 0; f < frames; f++) {
		rbf_label_parts_free(m, part[f]);
		rbf_label_parts_free(m, own[f]);
	}
	free(next);
	return failed ? -1 : 0;
}

int rbf_settle(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], int wide, float *label, const float share[])
{
	return sweep(m, frames, frame, wide ? WIDE : 1, label, share);
}

int rbf_settle_alike(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float share[])
{
	int alike = 1;
	for (uint32_t b = 0; b < m->bases && alike; b++) {
		const float near = nearest_beams(m, frames, frame, share, b);
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			alike &= coincide(near, &m->lobes[b], i, 1) == coincide(near, &m->lobes[b], i, WIDE);
	}
	return alike;
}
