/* SPDX-License-Identifier: BSD-3-Clause */
#include "sample.h"
#include "bounds.h"
#include "exitant.h"
#include "kernel.h"
#include "shirley_chiu.h"

#include <stdlib.h>
#include <string.h>

static const float REACH = 3.5f; /* sigmas around a lobe that are looked at closely */

int rbf_exitant_begin(rbf_exitant *e, int first, int finest, int deepest)
{
	memset(e, 0, sizeof *e);
	e->finest = finest;
	e->first = first < finest ? first : finest;
	e->points = 4;
	e->energy = 1;
	e->deepest = deepest < RBF_EXITANT_LEVELS ? deepest : RBF_EXITANT_LEVELS - 1;
	for (int level = 0; level <= finest; level++)
		if (!(e->need[level] = malloc((size_t)1 << 2 * level))) {
			rbf_exitant_end(e);
			return 0;
		}
	return 1;
}

void rbf_exitant_end(rbf_exitant *e)
{
	for (int level = 0; level < RBF_EXITANT_LEVELS; level++)
		free(e->need[level]);
	memset(e->need, 0, sizeof e->need);
}

/* Where a lobe of a corner is seen from the site, not folded. Returns the factor of its value, 0 if nowhere. */
static float place(const rbf_site *site, uint32_t corner, uint32_t frame, uint32_t block, int lane, float exitant[3])
{
	float centre[3], p[3], folded[3];
	rbf_site_centre(site, corner, block, (uint32_t)lane, centre);
	centre[2] = fmaxf(centre[2], .02f); /* a lobe from below the horizon still shows above it */
	rbf_mirror(site->vertex_op[corner], centre, p);
	rbf_warp warp;
	rbf_site_warp(site, corner, frame, &warp);
	const float factor = rbf_warp_inverse(&warp, p, folded);
	if (!(factor > 0))
		return 0;
	folded[2] = fmaxf(folded[2], 0);
	rbf_normalize(folded);
	rbf_site_unfold(site, folded, exitant);
	return factor;
}

/* Marks the cells that a lobe of spread sigma at direction d reaches, as needing cells of `deepest` at most. */
static void mark(rbf_exitant *e, const float d[3], float sigma, int deepest)
{
	/* on the disk the lobe is an ellipse: sigma across, sigma cos(theta) along the radius; half of it on the square */
	const float along = sigma * fmaxf(d[2], fmaxf(.5f * sigma, .1f));
	int level = (int)ceilf(-log2f(.5f * along));
	level = level < 0 ? 0 : level > deepest ? deepest : level;
	const int grid = level < e->finest ? level : e->finest;
	const float r = hypotf(d[0], d[1]), x = r > 0 ? d[0] / r : 1, y = r > 0 ? d[1] / r : 0;
	const double reach[2] = {.64 * REACH * (double)hypotf(along * x, sigma * y), .64 * REACH * (double)hypotf(along * y, sigma * x)};
	double cell[2];
	long low[2], high[2];
	const long size = 1L << grid;
	rbf_cell_from_direction(d, cell);
	for (int n = 0; n < 2; n++) {
		low[n] = (long)floor((cell[n] - reach[n]) * (double)size);
		high[n] = (long)floor((cell[n] + reach[n]) * (double)size);
		low[n] = low[n] < 0 ? 0 : low[n];
		high[n] = high[n] >= size ? size - 1 : high[n];
	}
	for (long j = low[1]; j <= high[1]; j++)
		for (long i = low[0]; i <= high[0]; i++) {
			uint8_t *need = &e->need[grid][j << grid | i];
			if (*need < level)
				*need = (uint8_t)level;
		}
}

static void mark_lobes(rbf_exitant *e)
{
	const rbf_site *site = e->site;
	const rbf_component *c = site->component;
	const uint32_t luminance = rbf_luminance(c->channels);
	for (int level = 0; level <= e->finest; level++)
		memset(e->need[level], 0, (size_t)1 << 2 * level);
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			for (uint32_t b = set->first; b < set->first + set->blocks; b++)
				for (int i = 0; i < RBF_LANES; i++) {
					const float kappa = c->block[b].k[i];
					float d[3], factor;
					if (!(kappa > 0) || !((factor = place(site, k, f, b, i, d)) > 0))
						continue;
					/* one that is lower than the differences that are left alone needs no attention */
					factor *= site->part[k];
					const double share = (double)(factor * c->amplitude[(size_t)luminance * c->blocks + b].a[i])
						* rbf_lobe_integral((double)kappa) / e->energy;
					factor /= fmaxf(d[2], .1f);
					int matters = 0;
					for (uint32_t n = 0; n < c->channels; n++)
						matters |= factor * c->amplitude[(size_t)n * c->blocks + b].a[i] > .5f * e->spread[n];
					if (matters)
						mark(e, d, 1 / sqrtf(kappa), share > 1e-3 ? e->deepest + 1 : share > 1e-4 ? e->finest + 2 : e->finest);
				}
		}
	for (int level = e->finest; level > 0; level--)
		for (uint32_t y = 0; y < 1u << level; y++)
			for (uint32_t x = 0; x < 1u << level; x++) {
				uint8_t *above = &e->need[level - 1][(y >> 1) << (level - 1) | x >> 1];
				const uint8_t need = e->need[level][y << level | x];
				if (*above < need)
					*above = need;
			}
}

static void visit(rbf_exitant *e, int level, uint32_t x, uint32_t y, int need)
{
	if (level <= e->finest)
		need = e->need[level][y << level | x];
	int cut = level < e->finest ? need > level : level < e->deepest && need > level + 1;
	if (!cut) {
		static const double gauss[2] = {.5 - .28867513459481288, .5 + .28867513459481288}; /* two points a side: cubics are exact */
		const double size = 1. / (double)(1 << level);
		rbf_exitant_leaf leaf;
		leaf.level = level;
		leaf.x = x;
		leaf.y = y;
		if (level == e->finest && need < level && e->points == 1) {
			rbf_direction_from_cell((x + .5) * size, (y + .5) * size, leaf.direction[0]);
			rbf_site_eval(e->site, leaf.direction[0], leaf.value[0]);
			for (int n = 1; n < 4; n++) {
				memcpy(leaf.direction[n], leaf.direction[0], sizeof leaf.direction[n]);
				memcpy(leaf.value[n], leaf.value[0], sizeof leaf.value[n]);
			}
			e->leaf(e->user, &leaf);
			return;
		}
		for (int n = 0; n < 4; n++) {
			rbf_direction_from_cell((x + gauss[n & 1]) * size, (y + gauss[n >> 1]) * size, leaf.direction[n]);
			rbf_site_eval(e->site, leaf.direction[n], leaf.value[n]);
		}
		if (level < e->finest)
			for (uint32_t c = 0; c < e->site->component->channels; c++) {
				float low = leaf.value[0][c], high = low;
				for (int n = 1; n < 4; n++) {
					low = fminf(low, leaf.value[n][c]);
					high = fmaxf(high, leaf.value[n][c]);
				}
				cut |= high - low > e->spread[c];
			}
		if (!cut) {
			e->leaf(e->user, &leaf);
			return;
		}
	}
	for (uint32_t n = 0; n < 4; n++)
		visit(e, level + 1, 2*x + (n & 1), 2*y + (n >> 1), need);
}

void rbf_exitant_run(rbf_exitant *e, const rbf_site *site)
{
	e->site = site;
	mark_lobes(e);
	for (uint32_t y = 0; y < 1u << e->first; y++)
		for (uint32_t x = 0; x < 1u << e->first; x++)
			visit(e, e->first, x, y, 0);
}

double rbf_exitant_width(const rbf_site *site)
{
	const rbf_component *c = site->component;
	const uint32_t y = rbf_luminance(c->channels);
	double weight = 0, kappa = 0;
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			for (uint32_t b = set->first; b < set->first + set->blocks; b++)
				for (int i = 0; i < RBF_LANES; i++) {
					const double w = (double)(site->part[k] * c->amplitude[(size_t)y * c->blocks + b].a[i]);
					if (w > 0 && c->block[b].k[i] > 0) {
						kappa += w;
						weight += w / (double)c->block[b].k[i];
					}
				}
		}
	return weight > 0 ? sqrt(weight / kappa) : 1;
}
