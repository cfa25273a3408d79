/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Lobes cost: bytes, and time of everything that follows. Their number is doubled as long as that takes a tenth off the error against
 * held-out samples, noise included, and halved where that adds next to nothing. Where samples held out are missed much, and by more than noise,
 * there may be edges or thin lines: narrower lobes are tried, and samples between samples. That is judged by samples held out by chance, since
 * columns of a table that lack as a whole tell of gaps twice as wide as there are.
 */
#include "lobe_count.h"
#include "held_out.h"

#include <math.h>

enum { HOLD = 8, START = 150, MOST = 600, KINDS = 3, STEPS = 4 };
enum { EACH = 3, FOLDS = 4, ENOUGH = 3200 }; /* samples a place at least; times others are held out, with samples so many in all if that is more */
static const float GAIN = .9f, SAME = 1.005f;
static const float NOISE = 1.73f, MUCH = .05f; /* times what noise alone would make it: what is missed besides is, in squares, twice that; and of all light */
static const uint32_t KIND[KINDS] = {0, RBF_FIT_NARROW, RBF_FIT_BETWEEN};

/* What was found at a trial. */
typedef struct trial {
	float error;                    /* < 0: none told */
	uint32_t lobes;                 /* places */
	int missed;                     /* much, by more than noise, and by those held out by chance as well; of each kind: */
	uint32_t best[KINDS];           /* places */
	float cost[KINDS], lack[KINDS]; /* logarithm of the error, with what its lobes should have taken off it; the error */
} trial;

/* What was found with so many places, twice as many, and so on: sums over the folds. */
typedef struct steps {
	int count;
	float cost[STEPS], lack[STEPS];
} steps;

/* Error against held-out samples with a number of places. */
static int try_lobes(rbf_fitting *fitting, uint32_t places, float *error, uint32_t *lobes)
{
	rbf_lobes fitted;
	const int failed = rbf_fit_lobes(fitting, places, &fitted, error);
	*lobes = fitted.count;
	rbf_lobes_free(&fitted);
	return failed;
}

/* All steps, since there may be no gain before lobes are as near as samples; of plain ones, which were tried before, the first. */
static int try_kind(rbf_fitting *fitting, uint32_t from, uint32_t most, int kind, steps *s)
{
	s->count = 0;
	for (uint32_t places = from; s->count < STEPS && (!s->count || (kind && places <= most)); places *= 2, s->count++) {
		float error;
		uint32_t lobes;
		if (try_lobes(fitting, places | KIND[kind], &error, &lobes))
			return -1;
		s->cost[s->count] += logf(fmaxf(error, 1e-6f)) - logf(GAIN) / logf(2) * logf((float)lobes + 1);
		s->lack[s->count] += error;
	}
	return 0;
}

static int try_kinds(const rbf_incidence *in, int channels, const float lambertian[3], trial *t)
{
	const uint32_t most = in->count / EACH < MOST ? (uint32_t)(in->count / EACH) : MOST;
	const uint32_t enough = in->count < ENOUGH ? (uint32_t)(ENOUGH / (in->count + 1)) : 1, folds = enough < 1 ? 1 : enough < FOLDS ? enough : FOLDS;
	steps found[KINDS] = {{0}};
	for (uint32_t run = 0; run < 2 * folds; run++) {
		const int between = run % 2;
		rbf_fitting *fitting = rbf_fit_begin(in, channels, lambertian, RBF_HOLD_BY_CHANCE(HOLD, run / 2), between);
		int failed = !fitting;
		for (int kind = 0; kind < KINDS && !failed; kind++)
			if (between == (KIND[kind] == RBF_FIT_BETWEEN))
				failed = try_kind(fitting, t->lobes, most, kind, &found[kind]);
		rbf_fit_end(fitting);
		if (failed)
			return -1;
	}
	for (int kind = 0; kind < KINDS; kind++) {
		int best = 0;
		for (int s = 1; s < found[kind].count; s++)
			if (found[kind].cost[s] < found[kind].cost[best])
				best = s;
		t->best[kind] = t->lobes << best | KIND[kind];
		t->cost[kind] = found[kind].cost[best] / (float)folds;
		t->lack[kind] = found[kind].lack[best] / (float)folds;
	}
	t->missed = t->missed && t->lack[0] > MUCH;
	return 0;
}

/* Whether the error, which is large, is more than noise makes it. */
static int ask_noise(rbf_fitting *fitting, trial *t)
{
	rbf_lobes fitted;
	float error;
	if (rbf_fit_lobes(fitting, t->lobes, &fitted, &error))
		return -1;
	const float noise = rbf_fit_noise(fitting, &fitted);
	rbf_lobes_free(&fitted);
	t->missed = error > NOISE * noise;
	return noise < 0 ? -1 : 0;
}

static int from_samples(const rbf_incidence *in, int channels, const float lambertian[3], trial *t)
{
	rbf_fitting *fitting = rbf_fit_begin(in, channels, lambertian, HOLD, 0);
	uint32_t lobes;
	int failed = !fitting || try_lobes(fitting, START, &t->error, &lobes);
	float next;
	t->lobes = START;
	while (!failed && 2 * t->lobes <= MOST) {
		failed = try_lobes(fitting, 2 * t->lobes, &next, &lobes);
		if (failed || !(next < GAIN * t->error))
			break;
		t->lobes *= 2;
		t->error = next;
	}
	if (!failed && t->lobes == START) {
		failed = try_lobes(fitting, START / 2, &next, &lobes);
		if (!failed && next < SAME * t->error) {
			t->lobes = START / 2;
			t->error = next;
		}
	}
	t->missed = t->error > MUCH;
	if (!failed && t->missed)
		failed = ask_noise(fitting, t);
	rbf_fit_end(fitting);
	return failed ? -1 : 0;
}

/* The kind that is best for all, where much is missed or it is better than none: what an edge needs at one incidence it may need at any. */
static void choose_kind(uint32_t count, trial *trials)
{
	double cost[KINDS] = {0};
	int best = 0, missed = 0;
	for (uint32_t t = 0; t < count; t++)
		missed |= trials[t].missed;
	for (uint32_t t = 0; t < count && missed; t++)
		for (int kind = 0; kind < KINDS; kind++)
			cost[kind] += (double)(trials[t].missed ? trials[t].cost[kind] : fminf(trials[t].cost[kind], trials[t].cost[0]));
	for (int kind = 1; kind < KINDS; kind++)
		if (cost[kind] < cost[best])
			best = kind;
	for (uint32_t t = 0; t < count; t++)
		if (best && (trials[t].missed || trials[t].cost[best] < trials[t].cost[0])) {
			trials[t].lobes = trials[t].best[best];
			trials[t].error = trials[t].lack[best];
		}
}

int rbf_lobe_count(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	uint32_t *lobes, float *error)
{
	trial found[RBF_TRIALS_MOST] = {{0}};
	int failed = 0, missed = 0;
	for (int kinds = 0; kinds <= missed; kinds++) {
		#pragma omp parallel for schedule(dynamic) reduction(|:failed)
		for (uint32_t t = 0; t < trials->count; t++) {
			rbf_incidence in = measured->incidence[rbf_trial_base(trials, t)];
			in.paired = 0; /* twice the samples would ask for more */
			if (rbf_team_mine(team, t))
				failed |= (kinds ? try_kinds(&in, channels, lambertian, &found[t]) : from_samples(&in, channels, lambertian, &found[t])) != 0;
		}
		if (rbf_team_failed(team, failed) || rbf_team_share_rows(team, trials->count, sizeof *found, found))
			return -1;
		for (uint32_t t = 0; t < trials->count; t++)
			missed |= found[t].missed;
	}
	if (missed)
		choose_kind(trials->count, found);
	for (uint32_t t = 0; t < trials->count; t++)
		error[t] = found[t].error;
	for (uint32_t i = 0; i < trials->bases; i++) {
		uint32_t before, after;
		rbf_trials_around(trials, i, &before, &after);
		lobes[trials->order[i]] = found[before].lobes > found[after].lobes ? found[before].lobes : found[after].lobes;
	}
	return 0;
}

int rbf_lobe_count_error(const rbf_team *team, const rbf_measured *measured, const rbf_trials *trials, int channels, const float lambertian[3],
	const uint32_t *lobes, float *error)
{
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < trials->count; t++) {
		const uint32_t b = rbf_trial_base(trials, t);
		rbf_lobes fitted;
		if (!rbf_team_mine(team, t))
			continue;
		failed |= rbf_fit(&measured->incidence[b], channels, lambertian, lobes[b], HOLD, &fitted, &error[t]) != 0;
		rbf_lobes_free(&fitted);
	}
	return rbf_team_failed(team, failed) || rbf_team_share_rows(team, trials->count, sizeof *error, error) ? -1 : 0;
}
