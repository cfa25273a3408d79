/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A sample far above all but a few of those around it is a spike, or sits on a peak that is narrower than samples are apart. Peaks show at other
 * incidences, too, where they move to, and spikes do not. So those are left out that
 *  - are several times as high as all around but two of these, and above them by far more than these differ among each other;
 *  - are not where a mirror, plain or retro-reflecting, would send a beam;
 *  - are not found again at most of the nearest incidences, in the same place or moved along by any one of the listed maps;
 *  - come by chance: at narrow lines and patterns they would lie beside each other more often.
 * The last is asked of all incidences together.
 */
#include "spikes.h"
#include "map.h"
#include "neighbours.h"

#include <stdlib.h>
#include <string.h>

enum { AROUND = 16, MORE = 8, HIGH = 3, HIGHER = 5 }; /* neighbours; so many more where some do not count; which of them is exceeded, from above */
enum { ROUNDS = 3 };                    /* in which known spikes no longer count as what others are found again by */
enum { BEFORE = 8 };                    /* in the tree's order, as near as these are */
enum { OTHERS = 6, THERE = 3, BEAMS = 2 }; /* incidences that are asked; samples of each; of them with the same beam */
static const float TIMES = 2, CLEAR = 8; /* what is exceeded; what it is above the median */
static const float STEPS = 8;           /* of coarse numbers, and of counts of photons */
static const float SAME = 1.f / 3;      /* of the height: found again */
static const double MOST = .1;          /* of all samples */
static const double CHANCE = .1, ERRORS = 2.5, FEW = 2; /* by how much chance may be missed: as a share; in standard errors; in any case */

enum { STEADY, ALONE, HIDDEN, SPIKE }; /* HIDDEN: alone but for those that are ALONE */

/* One incidence: its samples in the order of the tree. */
typedef struct scan {
	float direction[3];
	rbf_tree tree;
	float *value;
	uint32_t *from;  /* which sample each is */
	uint8_t *state, *sample; /* in the tree's order; in that of the samples */
	size_t alone, spikes;
	double beside, chance; /* neighbours of spikes that are spikes; as many as would be by chance */
} scan;

static int prepare(const rbf_incidence *in, int channels, scan *s)
{
	const size_t y = rbf_luminance((uint32_t)channels);
	for (int n = 0; n < 3; n++)
		s->direction[n] = (float)in->direction[n];
	s->value = malloc((in->count + 1) * sizeof *s->value);
	s->from = malloc((in->count + 1) * sizeof *s->from);
	s->state = calloc(in->count + 1, 1);
	s->sample = calloc(in->count + 1, 1);
	if (!s->value || !s->from || !s->state || !s->sample || rbf_tree_of(&s->tree, in->count, in->outgoing))
		return -1;
	rbf_tree_own_order(&s->tree, s->from);
	for (size_t i = 0; i < in->count; i++)
		s->value[i] = in->dsf[(size_t)s->from[i] * (size_t)channels + y];
	return 0;
}

static void release(scan *s)
{
	rbf_tree_free(&s->tree);
	free(s->value);
	free(s->from);
	free(s->state);
	free(s->sample);
}

/* Those next to each other in the tree are near: few samples need more than these to be asked. */
static int stands_out(const scan *s, size_t i)
{
	const size_t from = i > BEFORE ? i - BEFORE : 0, to = i + BEFORE < s->tree.count ? i + BEFORE : s->tree.count - 1;
	size_t high = 0;
	for (size_t k = from; k <= to; k++)
		high += TIMES * s->value[k] > s->value[i];
	return s->value[i] > 0 && 2 * high <= to - from;
}

static int descending(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;
	return x > y ? -1 : x < y;
}

/* out: a state whose samples do not count. step: of the numbers as DSF and as f. */
static int is_alone(const scan *s, size_t i, uint8_t out, const float step[2])
{
	uint32_t index[AROUND + MORE];
	float distance[AROUND + MORE], around[AROUND + MORE];
	const int near = rbf_tree_nearest(&s->tree, s->tree.point[i], AROUND + (out ? MORE : 1), index, distance);
	int count = 0;
	for (int k = 0; k < near && count < AROUND; k++)
		if (index[k] != i && (!out || s->state[index[k]] != out))
			around[count++] = s->value[index[k]];
	if (count < AROUND)
		return 0;
	qsort(around, AROUND, sizeof *around, descending);
	const float high = around[out ? HIGHER - 1 : HIGH - 1], middle = around[AROUND / 2], above = s->value[i] - high;
	return above > (TIMES - 1) * high && above > (CLEAR - 1) * (high - middle) && above > STEPS * fmaxf(step[0], step[1] * s->tree.point[i][2]);
}

static void find_alone(scan *s)
{
	const float (*w)[3] = (const float (*)[3])s->tree.point, step[2] = {rbf_faults_step(s->value, NULL, s->tree.count), rbf_faults_step(s->value, w, s->tree.count)};
	for (uint8_t state = ALONE; state <= HIDDEN && (state == ALONE || s->alone); state++)
		for (size_t i = 0; i < s->tree.count; i++)
			if (s->state[i] == STEADY && stands_out(s, i) && is_alone(s, i, state == HIDDEN ? ALONE : STEADY, step)) {
				s->state[i] = state;
				s->alone++;
			}
}

/* The incidences nearest to one; returns how many. */
static int find_others(const scan *all, size_t count, const scan *s, const scan *other[OTHERS])
{
	float square[OTHERS];
	int others = 0;
	for (const scan *o = all; o < all + count; o++) {
		const float e[3] = {o->direction[0] - s->direction[0], o->direction[1] - s->direction[1], o->direction[2] - s->direction[2]};
		int at = others < OTHERS ? others : OTHERS - 1;
		if (o == s || (others == OTHERS && !(rbf_dot(e, e) < square[at])))
			continue;
		others += others < OTHERS;
		for (; at > 0 && square[at - 1] > rbf_dot(e, e); at--) {
			square[at] = square[at - 1];
			other[at] = other[at - 1];
		}
		square[at] = rbf_dot(e, e);
		other[at] = o;
	}
	return others;
}

/* The highest of the samples where a map takes sample i, but for known spikes; < 0: nowhere. */
static float found_there(const scan *s, size_t i, unsigned map, const scan *o)
{
	rbf_warp warp;
	float there[3], distance[THERE], most = 0;
	uint32_t index[THERE];
	rbf_warp_set(&warp, map, NULL, s->direction, o->direction);
	if (!(rbf_warp_forward(&warp, s->tree.point[i], there) > 0) || !(there[2] > 0))
		return -1;
	const int near = rbf_tree_nearest(&o->tree, there, THERE, index, distance);
	for (int k = 0; k < near; k++)
		most = o->state[index[k]] == SPIKE ? most : fmaxf(most, o->value[index[k]]);
	return most;
}

/* Whether a sample is of those nearest to where a mirror would send a beam, or one that turns back x, or y, or both: such a beam is found again at some
 * of the others. */
static int is_beam(const scan *s, size_t i, int others, const scan *other[OTHERS])
{
	static const unsigned map[4] = {RBF_MAP_MIRROR, RBF_MAP_XFLIP, RBF_MAP_YFLIP, RBF_MAP_RETRO};
	for (int n = 0; n < 4; n++) {
		const float *along = rbf_map_get(map[n])->along, beam[3] = {along[0] * s->direction[0], along[1] * s->direction[1], s->direction[2]};
		uint32_t index[THERE];
		float distance[THERE];
		const int near = rbf_tree_nearest(&s->tree, beam, THERE, index, distance);
		int here = 0, found = 0;
		for (int k = 0; k < near; k++)
			here |= index[k] == i;
		for (int k = 0; k < others && here; k++)
			found += found_there(s, i, map[n], other[k]) > SAME * s->value[i];
		if (found >= BEAMS)
			return 1;
	}
	return 0;
}

/* Whether it is found where any one map takes it, at most of the others. */
static int is_found_again(const scan *s, size_t i, int others, const scan *other[OTHERS])
{
	for (unsigned map = 0; map < RBF_MAPS_LISTED; map++) {
		int asked = 0, found = 0;
		for (int n = 0; n < others && 3 * (asked - found) <= others; n++) {
			const float there = found_there(s, i, map, other[n]);
			asked += there >= 0;
			found += there > SAME * s->value[i];
		}
		if (3 * asked >= 2 * others && 3 * found >= 2 * asked)
			return 1;
	}
	return 0;
}

/* Those that are not found again. */
static void find_spikes(const scan *all, size_t count, scan *s)
{
	const scan *other[OTHERS];
	const int others = find_others(all, count, s, other);
	for (size_t i = 0; i < s->tree.count; i++)
		if ((s->state[i] == ALONE || s->state[i] == HIDDEN) && !is_beam(s, i, others, other) && !is_found_again(s, i, others, other))
			s->sample[s->from[i]] = SPIKE;
}

/* From now on they are known. Returns how many are new. */
static size_t know_spikes(scan *s)
{
	size_t found = 0;
	for (size_t i = 0; i < s->tree.count; i++)
		if (s->sample[s->from[i]] == SPIKE && s->state[i] != SPIKE) {
			s->state[i] = SPIKE;
			found++;
		}
	s->spikes += found;
	return found;
}

static void count_beside(scan *s)
{
	for (size_t i = 0; i < s->tree.count; i++) {
		uint32_t index[AROUND + 1];
		float distance[AROUND + 1];
		if (s->state[i] != SPIKE)
			continue;
		rbf_tree_nearest(&s->tree, s->tree.point[i], AROUND + 1, index, distance);
		for (int k = 0; k <= AROUND; k++)
			s->beside += index[k] != i && s->state[index[k]] == SPIKE;
		s->chance += AROUND * (double)(s->spikes - 1) / (double)(s->tree.count - 1);
	}
}

static int come_by_chance(size_t count, const scan *scans)
{
	double samples = 0, spikes = 0, beside = 0, chance = 0;
	for (size_t b = 0; b < count; b++) {
		samples += (double)scans[b].tree.count;
		spikes += (double)scans[b].spikes;
		beside += scans[b].beside;
		chance += scans[b].chance;
	}
	return spikes <= MOST * samples && beside - chance <= CHANCE * chance + ERRORS * sqrt(2 * chance) + FEW; /* neighbours are each other's */
}

int rbf_spikes_leave_out(const rbf_measured *all, int channels, rbf_measured *rest, rbf_faults *found)
{
	scan *scans = calloc(all->count + 1, sizeof *scans);
	uint8_t **state = calloc(all->count + 1, sizeof *state);
	int failed = !scans || !state;
	const int64_t count = failed ? 0 : (int64_t)all->count;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < count; b++) {
		const int none = prepare(&all->incidence[b], channels, &scans[b]);
		failed |= none;
		if (!none && all->incidence[b].count > AROUND + MORE)
			find_alone(&scans[b]);
	}
	size_t more = !failed;
	for (int round = 0; round < ROUNDS && more; round++) {
		more = 0;
		#pragma omp parallel for schedule(dynamic)
		for (int64_t b = 0; b < count; b++)
			if (scans[b].alone > scans[b].spikes)
				find_spikes(scans, (size_t)count, &scans[b]);
		for (int64_t b = 0; b < count; b++)
			more += know_spikes(&scans[b]);
	}
	#pragma omp parallel for schedule(dynamic)
	for (int64_t b = 0; b < (failed ? 0 : count); b++) {
		count_beside(&scans[b]);
		state[b] = scans[b].sample;
	}
	failed |= rbf_faults_leave_out(all, channels, !failed && come_by_chance(all->count, scans) ? state : NULL, SPIKE, rest, found);
	for (int64_t b = 0; b < count; b++)
		release(&scans[b]);
	free(scans);
	free(state);
	return failed ? -1 : 0;
}
