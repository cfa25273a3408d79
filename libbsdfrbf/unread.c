/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Samples that are exactly zero are shadows, the lower end of noise, or no readings at all. Readings get lost one by one, or several in
 * a row: where they are lost does not depend on what lies beside them, light around them is as steady as elsewhere, and nothing close to
 * zero is read there. So zeros are left out that
 *  - do not belong to a patch that is dark inside, which is a shadow;
 *  - are not too many, and lie beside each other as often as by chance: at thin shadows, blinds and edges more often, where these are regular less;
 *  - have no readings around them that are nearly zero, as noise has, and are far below those by their scatter;
 *  - are far below what is around by the step of coarse numbers, too.
 * The second and the third are asked of all incidences together: there are few zeros at one, and on the flank of a peak light scatters, too.
 */
#include "unread.h"
#include "model.h"
#include "neighbours.h"

#include <stdlib.h>
#include <string.h>

enum { AROUND = 24, LIT = 13, LINKED = 6, BESIDE = 6, LEVEL = 12 }; /* neighbours: all; of them with light; of one patch; beside; that tell the level */
static const double MOST = .2; /* of all amid light: an instrument that loses more tells little, and a fine pattern is likelier */
static const double FAINT = .1, FAINT_SHARE = .02; /* of the level: nearly zero; so many of those around are that */
static const double CHANCE = .1, ERRORS = 2.5, FEW = 2; /* by how much chance may be missed: as a share; in standard errors; in any case */
static const double SIGMAS = 3, APART_SHARE = .5; /* of scatter, that zeros are below what is around; so many of them */
static const float STEPS = 3; /* of coarse numbers, likewise */

enum { READ, ZERO, SHADOW, UNREAD };

/* One incidence: states of samples; how many are not zero; of its zeros amid light, how many there are, and are far below the readings around;
 * how many others lie beside them, and would by chance, with its variance; of the readings around, how many there are, and are nearly zero. */
typedef struct scan {
	uint8_t *state;
	double readings, zeros, apart, beside, chance, variance, around, faint;
} scan;

/* What is known of one incidence while it is looked at. */
typedef struct work {
	size_t count, zeros;
	float *value;       /* f, luminance */
	uint32_t *zero;     /* samples that are zero, */
	uint32_t (*near)[AROUND]; /* and what is around each */
	uint32_t *patch;    /* of each sample: another one of the same patch, at last the first of it */
	rbf_tree tree;
} work;

static uint32_t first_of(uint32_t *patch, uint32_t i)
{
	while (patch[i] != i)
		i = patch[i] = patch[patch[i]];
	return i;
}

static void join(uint32_t *patch, uint32_t i, uint32_t j)
{
	const uint32_t a = first_of(patch, i), b = first_of(patch, j);
	patch[a > b ? a : b] = a > b ? b : a;
}

/* Patches are of zeros next to each other. One with a zero amid zeros is a shadow. */
static void find_shadows(const work *k, uint8_t *state)
{
	for (size_t i = 0; i < k->count; i++)
		k->patch[i] = (uint32_t)i;
	for (size_t n = 0; n < k->zeros; n++) {
		const uint32_t i = k->zero[n];
		for (int j = 0; j <= LINKED; j++)
			if (state[k->near[n][j]] == ZERO)
				join(k->patch, i, k->near[n][j]);
	}
	for (size_t n = 0; n < k->zeros; n++) {
		int light = 0;
		for (int j = 0; j < AROUND; j++)
			light += k->value[k->near[n][j]] > 0;
		if (light < LIT)
			state[first_of(k->patch, k->zero[n])] = SHADOW;
	}
	for (size_t n = 0; n < k->zeros; n++)
		state[k->zero[n]] = state[first_of(k->patch, k->zero[n])];
}

/* Zeros beside one, but for those of its own row and what ends that, as these are what they are because of it. */
static void count_beside(const work *k, size_t n, size_t lit, scan *s)
{
	const uint8_t *state = s->state;
	size_t from = k->zero[n], to = from, asked = 0, beside = 0;
	while (from && state[from - 1] == ZERO)
		from--;
	while (to + 1 < k->count && state[to + 1] == ZERO)
		to++;
	for (int j = 0; j < AROUND && asked < BESIDE; j++) {
		const uint32_t i = k->near[n][j];
		if (state[i] == SHADOW || (i + 1 >= from && i <= to + 1))
			continue;
		beside += state[i] == ZERO;
		asked++;
	}
	const double row = (double)(to + 1 - from), others = (double)lit - row, readings = (double)(k->count - k->zeros);
	const double chance = (double)asked * others / (others + readings);
	s->beside += (double)beside;
	s->chance += chance;
	s->variance += 2 * row * chance; /* neighbours are each other's, and those of a row meet the same ones */
}

/* The nearest readings: how many of them are nearly zero, and whether zero is far below them. Returns whether it is by the step of the numbers, too. */
static int ask_around(const work *k, size_t n, float step, scan *s)
{
	double mean = 0, square = 0;
	float some[LEVEL], least = 0;
	int count = 0;
	for (int j = 0; j < AROUND && count < LEVEL; j++) {
		const float v = k->value[k->near[n][j]];
		if (v < 0 || v > 0)
			some[count++] = v;
	}
	for (int j = 0; j < count; j++) {
		mean += (double)some[j] / count;
		least = !j || some[j] < least ? some[j] : least;
	}
	for (int j = 0; j < count; j++) {
		const double apart = (double)some[j] - mean;
		square += apart * apart / (count - 1);
		s->faint += (double)some[j] < FAINT * mean;
	}
	s->around += count;
	s->zeros++;
	s->apart += mean > SIGMAS * sqrt(square);
	return least > STEPS * step;
}

static int look(const rbf_incidence *in, int channels, work *k, scan *s)
{
	const size_t y = rbf_luminance((uint32_t)channels);
	k->count = in->count;
	k->value = malloc((in->count + 1) * sizeof *k->value);
	k->zero = malloc((in->count + 1) * sizeof *k->zero);
	k->patch = malloc((in->count + 1) * sizeof *k->patch);
	s->state = calloc(in->count + 1, 1);
	if (!k->value || !k->zero || !k->patch || !s->state)
		return -1;
	for (size_t i = 0; i < in->count; i++) {
		int zero = 1;
		for (size_t c = 0; c < (size_t)channels; c++)
			zero &= !(in->dsf[i * (size_t)channels + c] < 0 || in->dsf[i * (size_t)channels + c] > 0);
		k->value[i] = in->dsf[i * (size_t)channels + y] / (float)in->outgoing[3*i + 2];
		s->state[i] = zero ? ZERO : READ;
		if (zero)
			k->zero[k->zeros++] = (uint32_t)i;
	}
	if (!k->zeros || in->count < AROUND)
		return 0;
	k->near = malloc(k->zeros * sizeof *k->near);
	if (!k->near || rbf_tree_of(&k->tree, in->count, in->outgoing))
		return -1;
	for (size_t n = 0; n < k->zeros; n++) {
		const double *o = in->outgoing + 3 * (size_t)k->zero[n];
		float distance[AROUND];
		rbf_tree_nearest(&k->tree, (float[3]){(float)o[0], (float)o[1], (float)o[2]}, AROUND, k->near[n], distance);
	}
	find_shadows(k, s->state);
	size_t lit = 0;
	for (size_t n = 0; n < k->zeros; n++)
		lit += s->state[k->zero[n]] == ZERO;
	for (size_t n = 0; n < k->zeros; n++)
		if (s->state[k->zero[n]] == ZERO)
			count_beside(k, n, lit, s);
	const float step = rbf_faults_step(k->value, NULL, k->count);
	s->readings = (double)(k->count - k->zeros);
	for (size_t n = 0; n < k->zeros; n++)
		if (s->state[k->zero[n]] == ZERO && ask_around(k, n, step, s))
			s->state[k->zero[n]] = UNREAD;
	return 0;
}

static int look_at(const rbf_incidence *in, int channels, scan *s)
{
	work k = {0};
	const int failed = look(in, channels, &k, s);
	free(k.value);
	free(k.zero);
	free(k.near);
	free(k.patch);
	rbf_tree_free(&k.tree);
	return failed;
}

/* Whether zeros come as readings get lost, at all incidences together. */
static int come_by_chance(size_t count, const scan *scans)
{
	scan all = {0};
	for (size_t b = 0; b < count; b++) {
		all.readings += scans[b].readings;
		all.zeros += scans[b].zeros;
		all.apart += scans[b].apart;
		all.beside += scans[b].beside;
		all.chance += scans[b].chance;
		all.variance += scans[b].variance;
		all.around += scans[b].around;
		all.faint += scans[b].faint;
	}
	return fabs(all.beside - all.chance) <= CHANCE * all.chance + ERRORS * sqrt(all.variance) + FEW
		&& all.zeros <= MOST * (all.zeros + all.readings) && all.faint <= FAINT_SHARE * all.around && all.apart >= APART_SHARE * all.zeros;
}

int rbf_unread_leave_out(const rbf_measured *all, int channels, rbf_measured *read, rbf_faults *found)
{
	scan *scans = calloc(all->count + 1, sizeof *scans);
	uint8_t **state = calloc(all->count + 1, sizeof *state);
	int failed = !scans || !state;
	const int64_t count = failed ? 0 : (int64_t)all->count;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < count; b++) {
		failed |= look_at(&all->incidence[b], channels, &scans[b]) != 0;
		state[b] = scans[b].state;
	}
	const int lost = !failed && come_by_chance(all->count, scans);
	failed |= rbf_faults_leave_out(all, channels, lost ? state : NULL, UNREAD, read, found);
	for (int64_t b = 0; b < count; b++)
		free(state[b]);
	free(scans);
	free(state);
	return failed ? -1 : 0;
}
