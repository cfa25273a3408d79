/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Each lobe has the cells of the exitant hemisphere in which it matters beside all others. A block begins with the lobe that has most of
 * them, and takes those whose cells are most nearly the ones that it has so far: intersection over union (Jaccard, Etude comparative de la
 * distribution florale, 1901). Lobes of a block, and blocks, are then in the order that lobes had, as far as they can be: neighbours in
 * order are neighbours in direction (arrange.c).
 *
 * Where lobes have their images about the plane of incidence (twins.h), blocks have theirs too: half of them need recording (pack.h).
 */
#include "cluster.h"
#include "vector.h"

#include <stdlib.h>
#include <string.h>

enum { GRID = 16, CELLS = GRID * GRID, WORDS = (CELLS + 63) / 64, CHANNELS = 3 }; /* cells coarser than those of masks do as well */
static const float MATTERS = 2e-4f; /* of all that is sent there */

typedef struct lobe {
	float centre[3], kappa, amplitude[CHANNELS];
	float most;             /* of the amplitudes */
	uint32_t was, twin;     /* its lane, and that of its image, if it has one */
	uint32_t cells;         /* how many, of: */
	uint64_t cell[WORDS];
} lobe;

static float value_at(const lobe *l, const float d[3])
{
	const float x = l->centre[0] - d[0], y = l->centre[1] - d[1], z = l->centre[2] - d[2], e = .5f * l->kappa * (x*x + y*y + z*z);
	return e < 30 ? l->most * expf(-e) : 0;
}

static void set_bit(lobe *l, uint32_t cell, int matters)
{
	l->cell[cell / 64] |= (uint64_t)matters << (cell % 64);
}

static uint32_t cell_of(const float d[3])
{
	float disc[2];
	uint32_t at[2];
	rbf_disc_from_direction(d, disc);
	for (int n = 0; n < 2; n++)
		at[n] = (uint32_t)rbf_min(rbf_max((disc[n] + 1) * (GRID * .5f), 0), GRID - .5f);
	return at[1] * GRID + at[0];
}

static void find_cells(lobe *l, uint32_t count, float lambertian, float *value)
{
	for (uint32_t cell = 0; cell < CELLS; cell++) {
		const double disc[2] = {(cell % GRID + .5) * (2. / GRID) - 1, (cell / GRID + .5) * (2. / GRID) - 1};
		double d[3];
		rbf_direction_from_disc(disc, d);
		const float at[3] = {(float)d[0], (float)d[1], (float)d[2]};
		float sum = lambertian * at[2] * (float)(1 / RBF_PI);
		for (uint32_t i = 0; i < count; i++) {
			value[i] = value_at(&l[i], at);
			sum += value[i];
		}
		for (uint32_t i = 0; i < count; i++)
			set_bit(&l[i], cell, value[i] > MATTERS * sum);
	}
	for (uint32_t i = 0; i < count; i++) {
		set_bit(&l[i], cell_of(l[i].centre), 1);
		l[i].cells = 0;
		for (int n = 0; n < WORDS; n++)
			l[i].cells += (uint32_t)__builtin_popcountll(l[i].cell[n]);
	}
}

/* How like a lobe's cells are to those of a block, 0 to 1. */
static float likeness(const uint64_t block[WORDS], const lobe *l)
{
	uint32_t both = 0, any = 0;
	for (int n = 0; n < WORDS; n++) {
		both += (uint32_t)__builtin_popcountll(block[n] & l->cell[n]);
		any += (uint32_t)__builtin_popcountll(block[n] | l->cell[n]);
	}
	return (float)both / (float)any;
}

/* The member of order[] that is next in a block, which has some cells unless it begins, takes its place at `to`. */
static void join(const lobe *l, uint32_t count, uint32_t order[], uint32_t to, int begins, uint64_t block[WORDS])
{
	uint32_t found = to;
	float best = -1;
	for (uint32_t i = to; i < count; i++) {
		const float like = begins ? (float)l[order[i]].cells : likeness(block, &l[order[i]]);
		if (like > best) {
			best = like;
			found = i;
		}
	}
	const uint32_t taken = order[found];
	for (uint32_t i = found; i > to; i--)
		order[i] = order[i - 1]; /* the rest stays in its order */
	order[to] = taken;
	for (int n = 0; n < WORDS; n++)
		block[n] = (begins ? 0 : block[n]) | l[taken].cell[n];
}

static int ascending(const void *a, const void *b)
{
	const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return x < y ? -1 : x > y;
}

static void find_order(const lobe *l, uint32_t count, uint32_t order[])
{
	uint64_t block[WORDS] = {0};
	for (uint32_t i = 0; i < count; i++)
		order[i] = i;
	for (uint32_t i = 0; i < count; i++)
		join(l, count, order, i, i % RBF_LANES == 0, block);
	for (uint32_t i = 0; i < count; i += RBF_LANES)
		qsort(order + i, count - i < RBF_LANES ? count - i : RBF_LANES, sizeof *order, ascending);
	qsort(order, count / RBF_LANES, RBF_LANES * sizeof *order, ascending); /* by the first lobe of each full block */
}

static uint32_t read_lobes(const rbf_component *c, const rbf_set *set, lobe *l)
{
	uint32_t count = 0;
	for (uint32_t at = set->first * RBF_LANES; at < (set->first + set->blocks) * RBF_LANES; at++) {
		const uint32_t b = at / RBF_LANES, lane = at % RBF_LANES;
		const rbf_block *from = &c->block[b];
		if (!(from->k[lane] > 0))
			continue;
		lobe *to = &l[count++];
		*to = (lobe){.was = at, .centre = {from->x[lane], from->y[lane], from->z[lane]}, .kappa = from->k[lane]};
		for (uint32_t n = 0; n < c->channels; n++) {
			to->amplitude[n] = c->amplitude[(size_t)n * c->blocks + b].a[lane];
			to->most = fmaxf(to->most, to->amplitude[n]);
		}
	}
	return count;
}

/* Where lobes go. */
typedef struct places {
	rbf_block *block;
	rbf_amplitude *amplitude;
	uint32_t *was; /* or NULL */
} places;

static void write_lobe(const rbf_component *c, const lobe *l, uint32_t at, const places *to)
{
	const uint32_t b = at / RBF_LANES, lane = at % RBF_LANES;
	to->block[b].x[lane] = l->centre[0];
	to->block[b].y[lane] = l->centre[1];
	to->block[b].z[lane] = l->centre[2];
	to->block[b].k[lane] = l->kappa;
	for (uint32_t n = 0; n < c->channels; n++)
		to->amplitude[(size_t)n * c->blocks + b].a[lane] = l->amplitude[n];
	if (to->was)
		to->was[at] = l->was;
}

static int are_twins(const lobe *a, const lobe *b)
{
	return a->centre[1] > 0 && a->centre[0] == b->centre[0] && a->centre[1] == -b->centre[1] && a->centre[2] == b->centre[2] && a->kappa == b->kappa
		&& !memcmp(a->amplitude, b->amplitude, sizeof a->amplitude);
}

/* Lobes of y > 0 whose image is there as well come first, as many as fill blocks: those farthest from y = 0. Images of these are dropped. What is left,
 * *rest of them, follows. `to` has room for all. Returns how many come first. */
static uint32_t part_twins(const lobe *l, uint32_t count, uint32_t *twin, lobe *to, uint32_t *rest)
{
	uint32_t twins = 0, first = 0;
	for (uint32_t i = 0; i < count; i++)
		twin[i] = count;
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t j = 0; j < count && l[i].centre[1] > 0 && twin[i] == count; j++)
			if (twin[j] == count && are_twins(&l[i], &l[j])) {
				twin[i] = j;
				twin[j] = i;
				twins++;
			}
	for (; twins % RBF_LANES; twins--) {
		uint32_t nearest = count;
		for (uint32_t i = 0; i < count; i++)
			if (twin[i] < count && l[i].centre[1] > 0 && (nearest == count || l[i].centre[1] < l[nearest].centre[1]))
				nearest = i;
		twin[twin[nearest]] = count;
		twin[nearest] = count;
	}
	*rest = 0;
	for (uint32_t i = 0; i < count; i++)
		if (twin[i] < count && l[i].centre[1] > 0) {
			to[first] = l[i];
			to[first++].twin = l[twin[i]].was;
		} else if (twin[i] == count)
			to[twins + (*rest)++] = l[i];
	return twins;
}

/* Lobes, and their images in as many blocks after them, the last block first: so that what follows each other is near each other. */
static void write_twins(const rbf_component *c, const rbf_set *set, const lobe *l, const uint32_t *order, uint32_t twins, const places *to)
{
	for (uint32_t i = 0; i < twins; i++) {
		lobe image = l[order[i]];
		image.centre[1] *= -1;
		image.was = image.twin;
		write_lobe(c, &l[order[i]], set->first * RBF_LANES + i, to);
		write_lobe(c, &image, set->first * RBF_LANES + 2 * twins - RBF_LANES - i / RBF_LANES * RBF_LANES + i % RBF_LANES, to);
	}
}

int rbf_cluster(const rbf_component *c, const rbf_set *set, rbf_block *block, rbf_amplitude *amplitude, uint32_t *was)
{
	const places to = {block, amplitude, was};
	const size_t room = (size_t)set->blocks * RBF_LANES + 1;
	lobe *l = malloc(room * sizeof *l), *parted = malloc(room * sizeof *parted);
	float *value = malloc(room * sizeof *value);
	uint32_t *order = malloc(room * sizeof *order);
	const int failed = !l || !parted || !value || !order;
	if (!failed) {
		const uint32_t count = read_lobes(c, set, l);
		uint32_t rest = count, twins = 0;
		find_cells(l, count, c->lambertian[rbf_luminance(c->channels)], value);
		if (c->mesh.symmetry == RBF_ISOTROPIC)
			twins = part_twins(l, count, order, parted, &rest);
		const lobe *left = twins ? parted + twins : l;
		rest = twins ? rest : count;
		find_order(parted, twins, order);
		write_twins(c, set, parted, order, twins, &to);
		find_order(left, rest, order);
		for (uint32_t i = 0; i < rest; i++)
			write_lobe(c, &left[order[i]], set->first * RBF_LANES + 2 * twins + i, &to);
	}
	free(l);
	free(parted);
	free(value);
	free(order);
	return failed ? -1 : 0;
}
