/* SPDX-License-Identifier: BSD-3-Clause */
#include "unseen.h"
#include "fit.h"
#include "one_plane.h"
#include "outlook.h"
#include "trials.h"
#include "unknown.h"

#include <stdlib.h>
#include <string.h>

static const float WIDE = .25f;        /* of what is within 60 degrees of the normal */
static const double GAIN = .9, WORTH = 5e-4; /* filling must lower the error in the band to this share; and by this of all light */
static const float MUCH_LESS = .1f;    /* of the hemisphere */
static const double SHOWN = .5;        /* of the light that is hidden */
enum { NONE = RBF_CARRIES, UNKNOWN };
enum { BAND_MOST = 400 }; /* samples of the band that are tried */

struct rbf_unseen {
	const rbf_measured *measured;
	rbf_seen *seen;          /* [measured->count] */
	rbf_incidence *with;     /* with what was filled; its arrays are owned where they are longer */
	rbf_choice by;           /* frames that fill, without labels */
	int carry;               /* rbf_carry, NONE, or UNKNOWN as long as it was not tried */
	float risk;              /* error of what is told, as a share of its light */
};

static void forget(rbf_unseen *u, size_t b)
{
	if (u->with[b].count > u->measured->incidence[b].count) {
		free(u->with[b].outgoing);
		free(u->with[b].dsf);
	}
	u->with[b] = u->measured->incidence[b];
}

void rbf_unseen_end(rbf_unseen *u)
{
	if (!u)
		return;
	for (size_t b = 0; b < u->measured->count; b++) {
		if (u->seen)
			rbf_seen_free(&u->seen[b]);
		if (u->with)
			forget(u, b);
	}
	free(u->seen);
	free(u->with);
	free(u);
}

static float largest(const rbf_unseen *u)
{
	float most = 0;
	for (size_t b = 0; b < u->measured->count; b++)
		most = rbf_max(most, u->seen[b].share);
	return most;
}

static int make_seen(rbf_unseen *u, size_t b)
{
	return rbf_seen_make(&u->measured->incidence[b], &u->seen[b]);
}

static int refine_seen(rbf_unseen *u, size_t b)
{
	return rbf_seen_refine(&u->seen[b]);
}

static int band_seen(rbf_unseen *u, size_t b)
{
	return rbf_seen_band(&u->seen[b]);
}

/* A step for all incidences. Returns 0, or -1 when out of memory. */
static int see(rbf_unseen *u, int step(rbf_unseen *u, size_t b))
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)u->measured->count; b++)
		failed |= step(u, (size_t)b) != 0;
	return failed ? -1 : 0;
}

rbf_unseen *rbf_unseen_begin(const rbf_measured *measured)
{
	const size_t bases = measured->count;
	rbf_unseen *u = calloc(1, sizeof *u);
	if (!u)
		return NULL;
	*u = (rbf_unseen){.measured = measured, .carry = UNKNOWN};
	u->seen = calloc(bases + 1, sizeof *u->seen);
	u->with = malloc((bases + 1) * sizeof *u->with);
	int failed = !u->seen || !u->with;
	for (size_t b = 0; b < bases && u->with; b++)
		u->with[b] = measured->incidence[b];
	failed = failed || see(u, make_seen) || (largest(u) > .5f * RBF_SEEN_LEAST && see(u, refine_seen)) || (rbf_unseen_most(u) > 0 && see(u, band_seen));
	if (failed) {
		rbf_unseen_end(u);
		return NULL;
	}
	return u;
}

float rbf_unseen_most(const rbf_unseen *u)
{
	const float most = largest(u);
	return most > RBF_SEEN_LEAST ? most : 0;
}

float rbf_unseen_left(const rbf_unseen *u)
{
	int unknown = 0; /* in ten thousandths: they add up to the same in any order */
	#pragma omp parallel for schedule(dynamic) reduction(+:unknown)
	for (int64_t b = 0; b < (int64_t)u->measured->count; b++)
		if (u->seen[b].upper > 0)
			unknown += (int)(1e4f * rbf_seen_unknown(&u->seen[b]));
	return 1e-4f * (float)unknown / (float)u->measured->count;
}

size_t rbf_unseen_wide(const rbf_unseen *u, size_t *first)
{
	size_t wide = 0;
	double normal[3];
	for (size_t b = 0; b < u->measured->count; b++) {
		const rbf_incidence *in = &u->measured->incidence[b];
		if (u->seen[b].upper > WIDE && !in->guessed && !rbf_one_plane_only(in, normal) && !wide++)
			*first = b;
	}
	return wide;
}

const rbf_incidence *rbf_unseen_incidence(const rbf_unseen *u, size_t base)
{
	return &u->with[base];
}

/* The samples that are not hidden; hidden: in the order of `seen`. Returns 0, or -1 when out of memory. */
static int leave_hidden(const rbf_seen *seen, const uint8_t *hidden, const rbf_incidence *in, size_t channels, rbf_incidence *without)
{
	*without = *in;
	without->count = 0;
	without->outgoing = malloc((in->count + 1) * 3 * sizeof *without->outgoing);
	without->dsf = malloc((in->count + 1) * channels * sizeof *without->dsf);
	for (size_t i = 0; i < in->count && without->outgoing && without->dsf; i++)
		if (!hidden[i]) {
			memcpy(without->outgoing + 3 * without->count, in->outgoing + 3 * (size_t)seen->sample[i], 3 * sizeof *without->outgoing);
			memcpy(without->dsf + channels * without->count++, in->dsf + channels * seen->sample[i], channels * sizeof *without->dsf);
		}
	return without->outgoing && without->dsf ? 0 : -1;
}

/* Frames that may be what fills, and how they may carry light. */
typedef struct filler {
	rbf_choice choice;
	rbf_sources sources;
	int carries;             /* ways: the first so many of rbf_carry */
} filler;
enum { FILLERS = 1 + RBF_MAPS_LISTED, WAYS = FILLERS * RBF_CARRIES };

static int has_turn(const rbf_fitted *m, const rbf_choice *choice)
{
	int turns = 0;
	for (uint32_t f = 0; f < choice->frames; f++)
		turns |= rbf_map_get(m->candidate[choice->frame[f]].map)->kind == RBF_KIND_TURN;
	return turns;
}

static int is_way(const filler list[], int way)
{
	return way % RBF_CARRIES < list[way / RBF_CARRIES].carries;
}

/* As chosen so far, or one listed map for all light. Those that are not there have no ways. Returns 0, or -1 when out of
 * memory; to be freed in any case. */
static int make_fillers(const rbf_fitted *m, const rbf_seen *seen, const rbf_choice *chosen, filler list[FILLERS])
{
	const int plane = m->symmetry == RBF_ISOTROPIC;
	int count = 0;
	for (int n = -1; n < RBF_MAPS_LISTED; n++) {
		if (n >= 0 && plane && !rbf_map_get((unsigned)n)->plane)
			continue;
		filler *to = &list[count++];
		to->choice = n < 0 ? *chosen : (rbf_choice){.frames = 1, .frame = {(uint32_t)n}, .belief = chosen->belief};
		to->carries = has_turn(m, &to->choice) ? RBF_CARRIES : 1;
		if ((n >= 0 && rbf_choice_label(m, &to->choice)) || rbf_sources_make(m, seen, &to->choice, &to->sources))
			return -1;
	}
	return 0;
}

static void free_fillers(filler list[FILLERS])
{
	for (int n = 0; n < FILLERS; n++) {
		rbf_sources_free(&list[n].sources);
		if (n) /* the first one's labels are borrowed */
			rbf_choice_free(&list[n].choice);
	}
}

/* What a trial tells, as shares of the incidence's light. Errors in what is hidden: by each way, filler * RBF_CARRIES + carry; of a fit to the other samples alone; and of
 * that one where each way tells nothing, and is the same. And what light there is where it does tell, and in all that is hidden. */
enum { ALONE = WAYS, UNTOLD, LIGHT = UNTOLD + WAYS, HIDDEN = LIGHT + WAYS, ERRORS };

/* A trial: directions of an incidence that are taken to be unseen. */
typedef struct hiding {
	uint32_t base;
	const rbf_seen *as;      /* where that one was not measured; NULL: the band, at all incidences */
} hiding;

/* Of each sample of an incidence, in the order of its `seen`, whether it is hidden. NULL: out of memory. */
static uint8_t *hide(const rbf_seen *seen, const hiding *h)
{
	uint8_t *hidden = malloc(seen->measured.count + 1);
	for (size_t i = 0; i < seen->measured.count && hidden; i++)
		hidden[i] = h->as ? !rbf_seen_is(h->as, seen->measured.point[i]) : seen->band[i];
	return hidden;
}

/* Tries all ways. Returns 0, or -1 when out of memory. */
static int try_hidden(const filler list[], const rbf_incidence *in, const hiding *h, const float lambertian[3], uint32_t lobes, double error[ERRORS])
{
	const rbf_sources *s = &list[0].sources;
	const uint32_t base = h->base;
	const rbf_seen *seen = &s->seen[base];
	const uint32_t channels = s->fitted->channels, y = rbf_luminance(channels);
	const enum rbf_hidden kind = h->as ? RBF_HIDDEN_HERE : RBF_HIDDEN_BAND;
	uint8_t *hidden = hide(seen, h);
	rbf_incidence without = {0};
	rbf_lobes inner = {0};
	rbf_seen outer = {0};
	rbf_outlook by[WAYS] = {{0}};
	double total = 0;
	size_t band = 0, at = 0;
	int failed = !hidden || leave_hidden(seen, hidden, in, channels, &without) || rbf_fit(&without, (int)channels, lambertian, lobes, 0, &inner, NULL)
		|| rbf_seen_make(&without, &outer);
	for (int w = 0; w < WAYS && !failed; w++)
		if (is_way(list, w))
			failed = rbf_outlook_make(&list[w / RBF_CARRIES].sources, base, (enum rbf_carry)(w % RBF_CARRIES), &outer.measured, kind, &inner, &by[w]);
	for (int w = 0; w < ERRORS; w++)
		error[w] = 0;
	for (size_t i = 0; i < in->count && hidden; i++)
		band += hidden[i];
	for (size_t i = 0; i < in->count && !failed; i++) {
		const float *p = seen->measured.point[i], dsf = in->dsf[channels * (size_t)seen->sample[i] + y];
		uint32_t index[RBF_NEAR];
		float distance[RBF_NEAR], value[3];
		const int found = rbf_tree_nearest(&seen->measured, p, RBF_NEAR, index, distance);
		const double area = (double)distance[found - 1]; /* up to a common factor */
		total += area * (double)fabsf(dsf);
		if (!hidden[i] || at++ % (band / BAND_MOST + 1))
			continue;
		const double here = (double)(band / BAND_MOST + 1) * area;
		for (int w = 0; w <= WAYS; w++) {
			if (w < WAYS && !is_way(list, w))
				continue;
			const int tells = w < WAYS && rbf_outlook_value(&by[w], p, value) > 0;
			if (!tells)
				rbf_lobes_sum(&inner, p, value);
			const double off = here * (double)fabsf(value[y] + lambertian[y] * p[2] * (float)(1 / RBF_PI) - dsf);
			error[w] += off;
			if (w < WAYS)
				error[(tells ? LIGHT : UNTOLD) + w] += tells ? here * (double)fabsf(dsf) : off;
		}
		error[HIDDEN] += here * (double)fabsf(dsf);
	}
	for (int w = 0; w < ERRORS && total > 0; w++)
		error[w] /= total;
	for (int w = 0; w < WAYS; w++)
		rbf_outlook_free(&by[w]);
	rbf_seen_free(&outer);
	rbf_lobes_free(&inner);
	free(without.outgoing);
	free(without.dsf);
	free(hidden);
	return failed ? -1 : 0;
}

/* Of what lies next to an incidence in the mesh, the one that was measured least, if that is much less than it was itself; else NULL. */
static const rbf_seen *sees_less(const rbf_unseen *u, const rbf_fitted *m, uint32_t b)
{
	const rbf_seen *least = NULL;
	float most = u->seen[b].share + MUCH_LESS;
	for (uint32_t n = m->neighbour_first[b]; n < m->neighbour_first[b + 1]; n++) {
		const rbf_seen *other = &u->seen[m->neighbour[n].base];
		if (other->share > most) {
			most = other->share;
			least = other;
		}
	}
	return least;
}

/* Some of the incidences that lack something, without their bands; or some of those next to them that were measured where they were not, without that. Returns how many,
 * or -1 when out of memory. */
static int list_hidings(const rbf_unseen *u, const rbf_fitted *m, int others, hiding list[RBF_TRIALS_MOST])
{
	uint32_t *base = malloc((m->bases + 1) * sizeof *base), some = 0;
	double *direction = malloc(3 * ((size_t)m->bases + 1) * sizeof *direction);
	rbf_trials trials = {0};
	for (uint32_t b = 0; b < m->bases && base && direction; b++)
		if (others ? sees_less(u, m, b) != NULL : u->seen[b].share > 0) {
			memcpy(direction + 3 * (size_t)some, m->direction + 3 * (size_t)b, 3 * sizeof *direction);
			base[some++] = b;
		}
	const int failed = !base || !direction || (some && rbf_trials_make(&trials, some, direction));
	const uint32_t count = failed || !some ? 0 : trials.count;
	for (uint32_t t = 0; t < count; t++) {
		const uint32_t b = base[rbf_trial_base(&trials, t)];
		list[t] = (hiding){b, others ? sees_less(u, m, b) : NULL};
	}
	rbf_trials_free(&trials);
	free(base);
	free(direction);
	return failed ? -1 : (int)count;
}

/* Whether those around show by some way most of what is hidden. */
static int shown(const double error[ERRORS])
{
	double most = 0;
	for (int w = 0; w < WAYS; w++)
		most = fmax(most, error[LIGHT + w]);
	return most > SHOWN * error[HIDDEN];
}

/* Means over the bands, and over such holes: where incidences were measured that lie next to others that were not, hiding from them what these lack tells as much as all
 * bands. */
static void set_means(const double error[][ERRORS], uint32_t bands, uint32_t holes, double mean[ERRORS])
{
	uint32_t told = 0;
	for (uint32_t t = 0; t < holes; t++)
		told += (uint32_t)shown(error[bands + t]);
	for (int w = 0; w < ERRORS; w++) {
		double band = 0, hole = 0;
		for (uint32_t t = 0; t < bands; t++)
			band += error[t][w] / bands;
		for (uint32_t t = 0; t < holes; t++)
			hole += shown(error[bands + t]) ? error[bands + t][w] / told : 0;
		mean[w] = bands && told ? .5 * (band + hole) : band + hole;
	}
}

/* Tries by which way to fill. */
static int choose_way(rbf_unseen *u, const rbf_fitted *m, const rbf_choice *chosen, const float lambertian[3], const uint32_t *lobes)
{
	static const filler none;
	filler list[FILLERS] = {none};
	hiding hidden[2 * RBF_TRIALS_MOST];
	double error[2 * RBF_TRIALS_MOST][ERRORS], mean[ERRORS] = {0};
	const int bands = list_hidings(u, m, 0, hidden), holes = bands < 0 ? -1 : list_hidings(u, m, 1, hidden + bands);
	int failed = holes < 0 || make_fillers(m, u->seen, chosen, list);
	const uint32_t count = failed ? 0 : (uint32_t)(bands + holes);
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < count; t++) {
		const uint32_t b = hidden[t].base;
		if (rbf_team_mine(m->team, t))
			failed |= try_hidden(list, &u->measured->incidence[b], &hidden[t], lambertian, lobes[b], error[t]) != 0;
	}
	failed = rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, count, sizeof *error, error);
	int best = 0;
	if (!failed)
		set_means((const double (*)[ERRORS])error, (uint32_t)bands, (uint32_t)holes, mean);
	for (int w = 0; w < WAYS && !failed; w++)
		if (is_way(list, w) && mean[w] < (w / RBF_CARRIES == best / RBF_CARRIES ? 1 : GAIN) * mean[best])
			best = w;
	if (!failed) {
		u->carry = best % RBF_CARRIES;
		u->by = list[best / RBF_CARRIES].choice;
		u->by.label = u->by.base_error = NULL;
		const double same = mean[UNTOLD + best], light = mean[LIGHT + best];
		u->risk = light > 0 ? (float)fmin((mean[best] - same) / light, 1) : 1;
		if (!(mean[best] - same < GAIN * (mean[ALONE] - same)) || !(mean[best] < mean[ALONE] - WORTH))
			u->carry = NONE;
	}
	free_fillers(list);
	return failed;
}

/* What is filled at an incidence: rows of a direction, DSF of all channels, and how certain they are. */
typedef struct fill {
	uint32_t count;
	float *row;
} fill;

static size_t row_of(const rbf_fitted *m)
{
	return 3 + m->channels + 1;
}

static int make_fill(const rbf_sources *s, enum rbf_carry carry, uint32_t base, const float lambertian[3], fill *to)
{
	const rbf_fitted *m = s->fitted;
	const size_t each = row_of(m);
	rbf_outlook o;
	float (*w)[3] = NULL;
	int failed = rbf_outlook_make(s, base, carry, &s->seen[base].measured, RBF_HIDDEN_NOTHING, NULL, &o) || rbf_outlook_samples(&o, &w, &to->count);
	to->row = failed ? NULL : malloc((to->count * each + 1) * sizeof *to->row);
	for (uint32_t i = 0; i < to->count && to->row; i++) {
		float *row = to->row + i * each, value[3];
		memcpy(row, w[i], sizeof *w);
		row[each - 1] = RBF_SECOND_HAND * rbf_outlook_value(&o, w[i], value);
		for (uint32_t c = 0; c < m->channels; c++)
			row[3 + c] = value[c] + lambertian[c] * w[i][2] * (float)(1 / RBF_PI);
	}
	free(w);
	rbf_outlook_free(&o);
	return to->row ? 0 : -1;
}

/* All processes get what each made. */
static int share_fills(const rbf_fitted *m, fill *made)
{
	const size_t each = row_of(m) * sizeof *made->row;
	uint32_t *number = malloc((m->bases + 1) * sizeof *number);
	uint64_t *first = calloc((size_t)m->bases + 1, sizeof *first);
	char *row = NULL;
	int failed = !number || !first;
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		number[b] = made[b].count;
	failed = failed || rbf_team_share_rows(m->team, m->bases, sizeof *number, number);
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		first[b + 1] = first[b] + number[b] * each;
	failed = failed || !(row = malloc(first[m->bases] + 1));
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		if (rbf_team_mine(m->team, b) && made[b].count)
			memcpy(row + first[b], made[b].row, made[b].count * each);
	failed = failed || rbf_team_share(m->team, m->bases, first, row);
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		if (!rbf_team_mine(m->team, b)) {
			made[b] = (fill){number[b], malloc(number[b] * each + 1)};
			failed = !made[b].row;
			if (!failed)
				memcpy(made[b].row, row + first[b], number[b] * each);
		}
	free(number);
	free(first);
	free(row);
	return failed;
}

/* Puts it where others find it, and the next fit. */
static int take(rbf_unseen *u, size_t b, const rbf_fitted *m, const fill *from)
{
	const rbf_incidence *in = &u->measured->incidence[b];
	const size_t each = row_of(m), channels = m->channels, count = in->count + from->count;
	float (*w)[3] = malloc((from->count + 1) * sizeof *w), *certainty = malloc((from->count + 1) * sizeof *certainty);
	double *outgoing = malloc((count + 1) * 3 * sizeof *outgoing);
	float *dsf = malloc((count + 1) * channels * sizeof *dsf);
	int failed = !w || !certainty || !outgoing || !dsf;
	for (uint32_t i = 0; i < from->count && !failed; i++) {
		const float *row = from->row + i * each;
		memcpy(w[i], row, sizeof *w);
		certainty[i] = row[each - 1];
		for (int a = 0; a < 3; a++)
			outgoing[3 * (in->count + i) + (size_t)a] = (double)row[a];
		memcpy(dsf + channels * (in->count + i), row + 3, channels * sizeof *dsf);
	}
	failed = failed || rbf_seen_fill(&u->seen[b], from->count, (const float (*)[3])w, certainty);
	forget(u, b);
	if (!failed && from->count) {
		memcpy(outgoing, in->outgoing, 3 * in->count * sizeof *outgoing);
		memcpy(dsf, in->dsf, channels * in->count * sizeof *dsf);
		u->with[b].count = count;
		u->with[b].outgoing = outgoing;
		u->with[b].dsf = dsf;
	} else {
		free(outgoing);
		free(dsf);
	}
	free(w);
	free(certainty);
	return failed;
}

int rbf_unseen_fill(rbf_unseen *u, const rbf_fitted *m, const rbf_choice *chosen, const float lambertian[3], const uint32_t *lobes, int *filled)
{
	rbf_sources s = {0};
	fill *made = calloc(m->bases + 1, sizeof *made);
	int failed = rbf_team_failed(m->team, !made);
	if (u->carry == UNKNOWN && !failed)
		failed = choose_way(u, m, chosen, lambertian, lobes);
	*filled = !failed && u->carry != NONE;
	rbf_choice by = u->by;
	if (*filled)
		failed = rbf_team_failed(m->team, rbf_choice_label(m, &by) || rbf_sources_make(m, u->seen, &by, &s));
	const int ready = *filled && !failed; /* each thread counts its own failures */
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)m->bases; b++)
		if (ready && u->seen[b].share > 0 && rbf_team_mine(m->team, (uint64_t)b))
			failed |= make_fill(&s, (enum rbf_carry)u->carry, (uint32_t)b, lambertian, &made[b]) != 0;
	failed = rbf_team_failed(m->team, failed) || (m->team && share_fills(m, made));
	for (uint32_t b = 0; b < m->bases && *filled && !failed; b++)
		failed = take(u, b, m, &made[b]);
	for (uint32_t b = 0; b < m->bases && made; b++)
		free(made[b].row);
	free(made);
	rbf_sources_free(&s);
	rbf_choice_free(&by);
	return failed ? -1 : 0;
}

int rbf_unseen_doubt(const rbf_unseen *u, const rbf_fitted *m, const float lambertian[3], float *error)
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)m->bases; b++) {
		error[b] = u->seen[b].share > 0 ? rbf_unknown_error(&u->seen[b], &m->lobes[b], lambertian, u->risk) : 0;
		failed |= error[b] < 0;
	}
	return failed ? -1 : 0;
}
