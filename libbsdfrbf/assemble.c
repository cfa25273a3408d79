/* SPDX-License-Identifier: BSD-3-Clause */
#include "assemble.h"
#include "bands.h"
#include "cluster.h"
#include "cull.h"
#include "kernel.h"
#include "pack.h"

#include <stdlib.h>
#include <string.h>

static const float CULL_ERROR = 1e-3f;  /* relative to the set's value in the cell, with its part of the Lambertian one */

/* limit: as rbf_assemble_sets() takes it. Returns 0, or -1 when out of memory. */
static int set_limits(const float limit[], rbf_component *c)
{
	float *limits = malloc(c->frames * sizeof *limits);
	const int failed = limits ? 0 : -1;
	c->limit = NULL;
	c->limited = 0;
	for (uint32_t f = 0; f < c->frames && limits; f++) {
		const float own = rbf_frame_limit(c, f);
		limits[f] = limit && limit[f] > 0 && own > 1 ? limit[f] : own;
		c->limited |= limits[f] != own;
	}
	if (c->limited)
		c->limit = limits;
	else
		free(limits);
	return failed;
}

int rbf_assemble_sets(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float *label, const float limit[],
	rbf_component *c)
{
	const uint32_t lobes = m->lobe_first[m->bases];
	c->channels = m->channels;
	c->mesh = m->mesh;
	c->frames = frames;
	c->sets = m->bases * frames;
	rbf_set *set = calloc((size_t)c->sets + 1, sizeof *set);
	if (!set)
		return -1;
	c->blocks = 0;
	for (uint32_t b = 0; b < m->bases; b++)
		for (uint32_t f = 0; f < frames; f++) {
			uint32_t count = 0;
			for (uint32_t i = m->lobe_first[b]; i < m->lobe_first[b + 1]; i++)
				count += label[(size_t)f * lobes + i] > 0;
			set[b * frames + f].first = c->blocks;
			set[b * frames + f].blocks = (count + RBF_LANES - 1) / RBF_LANES;
			c->blocks += set[b * frames + f].blocks;
		}
	const size_t room = c->blocks + 1;
	rbf_block *block = calloc(room, sizeof *block);
	rbf_amplitude *amplitude = calloc(room * m->channels, sizeof *amplitude);
	rbf_linear *linear = calloc(frames, sizeof *linear);
	for (uint32_t f = 0; f < frames; f++)
		c->frame[f] = m->candidate[frame[f]].map;
	const int failed = set_limits(limit, c);
	c->set = set;
	c->block = block;
	c->amplitude = amplitude;
	c->learned = 0;
	c->linear = NULL;
	if (!block || !amplitude || !linear || failed) {
		free(linear);
		rbf_assemble_release(c);
		return -1;
	}
	for (uint32_t f = 0; f < frames; f++) {
		linear[f] = m->candidate[frame[f]].linear;
		c->learned |= (uint32_t)rbf_map_learned(c->frame[f]);
	}
	if (c->learned)
		c->linear = linear;
	else
		free(linear);
	for (uint32_t b = 0; b < m->bases; b++) {
		const rbf_lobes *l = &m->lobes[b];
		for (uint32_t f = 0; f < frames; f++) {
			uint32_t at = set[b * frames + f].first * RBF_LANES;
			for (uint32_t i = 0; i < l->count; i++) {
				const float part = label[(size_t)f * lobes + m->lobe_first[b] + i];
				if (!(part > 0))
					continue;
				const uint32_t to = at / RBF_LANES, lane = at++ % RBF_LANES;
				float centre[3];
				rbf_lobe_centre(l, i, centre);
				block[to].x[lane] = centre[0];
				block[to].y[lane] = centre[1];
				block[to].z[lane] = centre[2];
				block[to].k[lane] = rbf_lobe_kappa(l, i);
				for (uint32_t n = 0; n < m->channels; n++)
					amplitude[(size_t)n * c->blocks + to].a[lane] = part * rbf_lobe_amplitude(l, n, i);
			}
			for (; at % RBF_LANES; at++) /* unused lanes */
				block[at / RBF_LANES].z[at % RBF_LANES] = 1;
		}
	}
	return 0;
}

void rbf_assemble_release(rbf_component *c)
{
	free((void *)c->set);
	free((void *)c->block);
	free((void *)c->amplitude);
	free((void *)c->linear);
	free((void *)c->limit);
	c->linear = NULL;
	c->limit = NULL;
	c->set = NULL;
	c->block = NULL;
	c->amplitude = NULL;
}

uint32_t rbf_assemble_blocks(const rbf_component *c, uint32_t base)
{
	uint32_t blocks = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		blocks += c->set[base * c->frames + f].blocks;
	return blocks;
}

void rbf_assemble_shift(const rbf_fitted *m, const rbf_component *c, const float *label, uint32_t base,
	const float (*motion)[3], rbf_shift *shift)
{
	const uint32_t lobes = m->lobe_first[m->bases];
	memset(shift, 0, rbf_assemble_blocks(c, base) * sizeof *shift);
	for (uint32_t f = 0; f < c->frames; f++) {
		uint32_t at = (c->set[base * c->frames + f].first - c->set[base * c->frames].first) * RBF_LANES;
		for (uint32_t i = 0; i < m->lobes[base].count; i++) {
			if (!(label[(size_t)f * lobes + m->lobe_first[base] + i] > 0))
				continue;
			shift[at / RBF_LANES].x[at % RBF_LANES] = motion[i][0];
			shift[at / RBF_LANES].y[at % RBF_LANES] = motion[i][1];
			shift[at / RBF_LANES].z[at % RBF_LANES] = motion[i][2];
			at++;
		}
	}
}

/* Corners and middles of the cells and of their sides, and a radius about each middle. */
enum { POINTS = 2 * RBF_CULL_GRID + 1 };
typedef struct cell_points {
	float point[POINTS][POINTS][3]; /* [y][x] */
	float radius[RBF_CULL_GRID][RBF_CULL_GRID];
} cell_points;

static void set_points(cell_points *p)
{
	for (int y = 0; y < POINTS; y++)
		for (int x = 0; x < POINTS; x++) {
			const double disc[2] = {.5 * x * (2. / RBF_CULL_GRID) - 1, .5 * y * (2. / RBF_CULL_GRID) - 1};
			double d[3];
			rbf_direction_from_disc(disc, d);
			for (int k = 0; k < 3; k++)
				p->point[y][x][k] = (float)d[k];
		}
	for (int y = 0; y < RBF_CULL_GRID; y++)
		for (int x = 0; x < RBF_CULL_GRID; x++) {
			const float *centre = p->point[2*y + 1][2*x + 1];
			float radius = 0;
			for (int n = 0; n < 9; n++) {
				const float *to = p->point[2*y + n / 3][2*x + n % 3], d[3] = {to[0] - centre[0], to[1] - centre[1], to[2] - centre[2]};
				radius = fmaxf(radius, sqrtf(d[0]*d[0] + d[1]*d[1] + d[2]*d[2]));
			}
			p->radius[y][x] = radius;
		}
}

/* What a set has at all points, the Lambertian part counted as evenly among the frames. */
static void set_sums(const rbf_component *c, const rbf_set *set, const cell_points *p, float sum[POINTS][POINTS])
{
	const uint32_t y = rbf_luminance(c->channels);
	const rbf_kernel_lobes luminance = {c->block, c->amplitude + (size_t)y * c->blocks, 0, 1, rbf_cull_group(set->blocks) <= 1};
	rbf_kernel_job job = {.weight = 1, .first = set->first, .blocks = set->blocks, .mask = rbf_cull_all(set->blocks)};
	for (int row = 0; row < POINTS; row++)
		for (int column = 0; column < POINTS; column++) {
			float value[3];
			memcpy(job.direction, p->point[row][column], sizeof job.direction);
			rbf_kernel_sum(&job, 1, &luminance, value);
			sum[row][column] = value[0] + c->lambertian[y] / (float)c->frames * job.direction[2] * (float)(1 / RBF_PI);
		}
}

/* For every cell of the exitant hemisphere: groups of blocks whose largest possible sum in the cell is negligible beside the
 * set's smallest value there are left out. The cell is taken as a disc around its centre. */
static void cull_cell(const rbf_component *c, const rbf_set *set, const cell_points *p, float sum[POINTS][POINTS], int ix, int iy, float reach,
	float bound[64], uint64_t *mask)
{
	const uint32_t group = rbf_cull_group(set->blocks), groups = set->blocks ? (set->blocks + group - 1) / group : 0;
	const float *centre = p->point[2*iy + 1][2*ix + 1], radius = p->radius[iy][ix] * 1.02f + reach;
	float smallest = INFINITY;
	for (int n = 0; n < 9; n++)
		smallest = fminf(smallest, sum[2*iy + n / 3][2*ix + n % 3]);
	for (uint32_t g = 0; g < groups; g++) {
		bound[g] = 0;
		for (uint32_t b = set->first + g * group; b < set->first + set->blocks && b < set->first + (g + 1) * group; b++)
			for (int i = 0; i < RBF_LANES; i++) {
				const rbf_block *k = &c->block[b];
				float amplitude = 0;
				for (uint32_t n = 0; n < c->channels; n++)
					amplitude = fmaxf(amplitude, c->amplitude[(size_t)n * c->blocks + b].a[i]);
				if (!(amplitude > 0))
					continue;
				const float dx = k->x[i] - centre[0], dy = k->y[i] - centre[1], dz = k->z[i] - centre[2];
				const float d = fmaxf(sqrtf(dx*dx + dy*dy + dz*dz) - radius, 0.f), e = .5f * k->k[i] * d * d;
				if (e < 87) /* else nothing is left of it in a float */
					bound[g] += amplitude * expf(-e);
			}
	}
	/* leave out the least first while their sum stays below the error */
	*mask = rbf_cull_all(set->blocks);
	float spent = 0;
	for (uint32_t n = 0; n < groups; n++) {
		uint32_t least = 0;
		float value = INFINITY;
		for (uint32_t g = 0; g < groups; g++)
			if ((*mask >> g & 1) && bound[g] < value) {
				value = bound[g];
				least = g;
			}
		spent += value;
		if (spent > CULL_ERROR * smallest)
			break;
		*mask &= ~((uint64_t)1 << least);
	}
}

/* Where there is residual motion, lobes were put into blocks together with it (moves.h). */
static int cluster(const rbf_component *c)
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t s = 0; s < c->sets; s++)
		if (!c->residual)
			failed |= rbf_cluster(c, &c->set[s], (rbf_block *)c->block, (rbf_amplitude *)c->amplitude, NULL);
	return failed;
}

/* Blocks that are images of each other have masks that are: whatever rounding makes of them. */
static void reflect_masks(const rbf_component *c, const rbf_set *set, uint64_t mask[RBF_CULL_CELLS])
{
	const uint32_t twins = rbf_cull_group(set->blocks) > 1 ? 0 : rbf_pack_twins(c, set);
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++)
		for (uint32_t x = 0; x < RBF_CULL_GRID; x++)
			for (uint32_t g = 0; g < twins; g++) {
				uint64_t *here = &mask[y * RBF_CULL_GRID + x], *there = &mask[(RBF_CULL_GRID - 1 - y) * RBF_CULL_GRID + x];
				const uint32_t image = 2 * twins - 1 - g;
				const uint64_t any = (*here >> g | *there >> image) & 1;
				*here |= any << g;
				*there |= any << image;
			}
}

/* All masks of a set. Cells beside the disc are asked for by rounding alone: they have that of the nearest cell of their row. */
static void cull_set(const rbf_component *c, const rbf_set *set, const cell_points *p, float reach, uint64_t mask[RBF_CULL_CELLS])
{
	float bound[64], sum[POINTS][POINTS];
	set_sums(c, set, p, sum);
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++) {
		uint32_t first, end;
		uint64_t *row = mask + y * RBF_CULL_GRID;
		rbf_cull_span(y, &first, &end);
		for (uint32_t x = first; x < end; x++)
			cull_cell(c, set, p, sum, (int)x, (int)y, reach, bound, &row[x]);
		for (uint32_t x = 0; x < first; x++)
			row[x] = row[first];
		for (uint32_t x = end; x < RBF_CULL_GRID; x++)
			row[x] = row[end - 1];
	}
	reflect_masks(c, set, mask);
}

int rbf_assemble_cull(const rbf_team *team, rbf_component *c, float reach)
{
	const size_t cells = RBF_CULL_CELLS;
	uint64_t *wide = malloc((c->sets * cells + 1) * sizeof *wide), *cull = calloc((size_t)rbf_cull_words(c->blocks) + 1, sizeof *cull);
	cell_points *points = malloc(sizeof *points);
	rbf_pack_round(c);
	if (!wide || !cull || !points || cluster(c) || rbf_bands_make(c)) {
		free(points);
		free(wide);
		free(cull);
		return -1;
	}
	set_points(points);
	#pragma omp parallel for schedule(dynamic)
	for (int64_t s = 0; s < (int64_t)c->sets; s++)
		if (rbf_team_mine(team, (uint64_t)s))
			cull_set(c, &c->set[s], points, reach, &wide[(size_t)s * cells]);
	free(points);
	c->cull = cull;
	const int failed = rbf_team_share_rows(team, c->sets, cells * sizeof *wide, wide);
	for (size_t i = 0; i < c->sets * cells && !failed; i++)
		rbf_cull_write(cull, &c->set[i / cells], (uint32_t)(i % cells), wide[i]);
	free(wide);
	return failed;
}
