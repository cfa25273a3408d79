/* SPDX-License-Identifier: BSD-3-Clause */
#include "fit_error.h"
#include "difference.h"
#include "neighbours.h"
#include "noise.h"

#include <stdlib.h>

enum { SAMPLES = 1024, AROUND = 8 }; /* that are looked at; that tell what solid angle one stands for */
static const double SURELY = 1.5; /* times the noise: less is chance, or noise that is not normal */
static const double MOST = .85, HALF = .5; /* of what a fit to all samples but some misses, and of a fit to every other one, the fit to all does */

/* Samples that the fit to every other one has not seen, as the fit to all misses them, and what it misses itself, relative L1. Returns how many
 * there are, or -1 when out of memory. */
static int look(const rbf_incidence *in, const rbf_lobes *all, const rbf_lobes *half, float lambertian, rbf_noisy list[SAMPLES], double *missed)
{
	const size_t step = 2 * ((in->count / 2 + SAMPLES - 1) / SAMPLES), channels = all->channels, y = rbf_luminance(all->channels);
	double off = 0, sum = 0;
	rbf_tree tree;
	int count = 0;
	if (rbf_tree_of(&tree, in->count, in->outgoing))
		return -1;
	for (size_t i = 1; step && i < in->count && count < SAMPLES; i += step) {
		const float w[3] = {(float)in->outgoing[3*i], (float)in->outgoing[3*i + 1], (float)in->outgoing[3*i + 2]};
		const double base = (double)(lambertian * w[2]) / RBF_PI, truth = (double)in->dsf[i * channels + y];
		uint32_t near[AROUND];
		float square[AROUND];
		const int found = rbf_tree_nearest(&tree, w, AROUND, near, square);
		const double light = (double)rbf_lobes_luminance(all, w) + base, area = (double)square[found - 1];
		list[count++] = (rbf_noisy){light, truth, area, fabs(light - truth)};
		off += area * fabs((double)rbf_lobes_luminance(half, w) + base - truth);
		sum += area * fabs(truth);
	}
	rbf_tree_free(&tree);
	*missed = sum > 0 ? off / sum : 0;
	return count;
}

static double beyond(double error, double noise)
{
	return sqrt(fmax(error * error - SURELY * SURELY * noise * noise, 0));
}

/* Returns 0, or -1 when out of memory. */
static int missed_at(const rbf_incidence *in, const rbf_lobes *all, const rbf_lobes *half, float lambertian, float held_out, float *missed)
{
	rbf_noisy *list = malloc(SAMPLES * sizeof *list);
	double off;
	const int count = list ? look(in, all, half, lambertian, list, &off) : -1;
	*missed = 0;
	if (count > 0) {
		const double noise = rbf_noise_of(count, list);
		*missed = (float)fmin(fmax(MOST * beyond(fmax((double)held_out, 0), noise), HALF * beyond(off, noise)), 1);
	}
	free(list);
	return count < 0 ? -1 : 0;
}

/* Near the geometric mean: errors grow manifold towards grazing incidence. */
static float between(float before, float after, double share)
{
	const double root = (1 - share) * sqrt(sqrt((double)before)) + share * sqrt(sqrt((double)after));
	return (float)(root * root * root * root);
}

int rbf_fit_error(const rbf_measured *measured, const rbf_trials *trials, const rbf_fitted *m, const float lambertian[3], const uint32_t *count,
	const float *held_out, float *by_noise, float *missed)
{
	const float base = lambertian[rbf_luminance(m->channels)];
	float error[RBF_TRIALS_MOST][2];
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < trials->count; t++) {
		const uint32_t b = rbf_trial_base(trials, t);
		const rbf_incidence *in = &measured->incidence[b];
		rbf_lobes half;
		if (!rbf_team_mine(m->team, t))
			continue;
		if (rbf_fit(in, (int)m->channels, lambertian, count[b], 2, &half, NULL)) {
			failed = 1;
			continue;
		}
		error[t][0] = rbf_difference(&m->lobes[b], &half, NULL, base, 0);
		failed |= missed_at(in, &m->lobes[b], &half, base, held_out[b], &error[t][1]) != 0;
		rbf_lobes_free(&half);
	}
	if (rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, trials->count, sizeof *error, error))
		return -1;
	for (uint32_t i = 0; i < trials->bases; i++) {
		uint32_t before, after;
		rbf_trials_around(trials, i, &before, &after);
		const double from = m->direction[3*rbf_trial_base(trials, before) + 2], to = m->direction[3*rbf_trial_base(trials, after) + 2];
		const double z = m->direction[3*trials->order[i] + 2], share = from > to ? fmin(fmax((from - z) / (from - to), 0), 1) : 1;
		by_noise[trials->order[i]] = between(error[before][0], error[after][0], share);
		missed[trials->order[i]] = between(error[before][1], error[after][1], share);
	}
	return 0;
}
