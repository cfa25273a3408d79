/* SPDX-License-Identifier: BSD-3-Clause */
#include "settle.h"
#include "clones.h"
#include "elementary.h"

#include <stdlib.h>
#include <string.h>

enum { SETTLING = 30, SWEEPS = 2 }; /* rounds at an incidence; over all of them, as what one shows depends on how its neighbours are settled */
static const float WIDE = 5; /* sigmas: beams that are nearer share lobes */

/* Whether the beams of two frames are that near to each other at incidence k. */
static int coincide(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float share[], const float k[3], float near)
{
	float e[RBF_MAX_FRAMES][3];
	for (uint32_t f = 0; f < frames; f++) {
		const rbf_candidate *c = &m->candidate[frame[f]];
		rbf_map_source(rbf_map_get(c->map)->kind == RBF_KIND_HALF ? RBF_MAP_MIRROR : c->map, &c->linear, k, e[f]);
		for (uint32_t g = 0; g < f; g++)
			if (share[f] > 0 && share[g] > 0 && hypotf(e[f][0] - e[g][0], e[f][1] - e[g][1]) < near)
				return 1;
	}
	return 0;
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
	rbf_amplitude *seen;    /* [lobes][SPREAD][blocks]: what each lobe of the incidence is there, for an amplitude of 1 */
} matter;

static void free_matter(matter *m)
{
	free(m->lobe);
	free(m->point);
	free(m->wanted);
	free(m->seen);
}

/* What each lobe is at a point. */
RBF_CLONES static void see(const rbf_block *block, uint32_t blocks, const float point[3], rbf_amplitude *seen)
{
	for (uint32_t b = 0; b < blocks; b++)
		for (int i = 0; i < RBF_LANES; i++) {
			const float x = block[b].x[i] - point[0], y = block[b].y[i] - point[1], z = block[b].z[i] - point[2];
			seen[b].a[i] = rbf_exp_negative(-.5f * block[b].k[i] * (x*x + y*y + z*z));
		}
}

typedef float lanes __attribute__((vector_size(4 * RBF_LANES)));

/* Sum of all lobes with their amplitudes. */
RBF_CLONES static float add_up(const rbf_amplitude *seen, const rbf_amplitude *amplitude, uint32_t blocks)
{
	lanes sum = {0};
	for (uint32_t b = 0; b < blocks; b++) {
		lanes one, of;
		memcpy(&one, &seen[b], sizeof one);
		memcpy(&of, &amplitude[b], sizeof of);
		sum += one * of;
	}
	return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

static int set_matter(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float share[], float near, rbf_lobes *const part[],
	uint32_t base, matter *to)
{
	const rbf_lobes *l = &m->lobes[base];
	const float k[3] = {(float)m->direction[3*base], (float)m->direction[3*base + 1], (float)m->direction[3*base + 2]};
	*to = (matter){.lobe = malloc((l->count + 1) * sizeof *to->lobe)};
	for (uint32_t i = 0; i < l->count && to->lobe; i++)
		if (coincide(m, frames, frame, share, k, near / sqrtf(rbf_lobe_kappa(l, i))))
			to->lobe[to->lobes++] = i;
	to->point = malloc((to->lobes + 1) * sizeof *to->point);
	to->wanted = malloc((to->lobes + 1) * sizeof *to->wanted);
	to->seen = malloc(((size_t)to->lobes * SPREAD * l->blocks + 1) * sizeof *to->seen);
	if (!to->lobe || !to->point || !to->wanted || !to->seen)
		return -1;
	for (uint32_t i = 0; i < to->lobes; i++) {
		spread_of(l, to->lobe[i], to->point[i]);
		for (int n = 0; n < SPREAD; n++) {
			see(l->block, l->blocks, to->point[i][n], to->seen + ((size_t)i * SPREAD + (size_t)n) * l->blocks);
			const float self = rbf_lobes_luminance(l, to->point[i][n]) + 1e-9f;
			for (uint32_t f = 0; f < frames; f++)
				to->wanted[i][n][f] = expf(rbf_label_prediction(m, &m->candidate[frame[f]], part[f], base, to->point[i][n], self));
		}
	}
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
			float *r = next + to->lobe[i] * frames, sum = 0;
			for (uint32_t f = 0; f < frames; f++) {
				float ratio = 0;
				for (int n = 0; n < SPREAD; n++)
					ratio += SPREAD_WEIGHT[n] * to->wanted[i][n][f]
						/ (add_up(to->seen + ((size_t)i * SPREAD + (size_t)n) * l->blocks, own[f].amplitude, l->blocks) + 1e-9f);
				sum += r[f] *= ratio;
			}
			for (uint32_t f = 0; f < frames; f++)
				r[f] /= sum;
		}
	}
}

static int sweep(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], float near, float *label, const float share[])
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
		if (set_matter(m, frames, frame, share, near, part, (uint32_t)b, &to))
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
	int failed = 0;
	for (int n = 0; n < (wide ? SWEEPS : 1) && !failed; n++)
		failed = sweep(m, frames, frame, wide ? WIDE : 1, label, share);
	return failed;
}
