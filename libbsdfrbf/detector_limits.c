/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Light has no reason to end anywhere exactly. Where it is cut off, as many samples share a value as would lie beyond: more than lie within a twentieth
 * on this side of it. Where numbers are only coarse, a value is shared by no more than the next ones are.
 */
#include "detector_limits.h"
#include "model.h"

enum { LEAST = 5 };                  /* samples */
static const float SAME = 2e-4f;     /* of the value: directions are written with few digits */
static const float BESIDE = .05f;
static const double SHARE = .02;     /* of an incidence's samples, that its floor is told by */
static const double WIDE = .1;       /* cosines that these are spread over, at least: a ring without noise is even by symmetry */

static float value_of(const rbf_incidence *in, int channels, size_t i)
{
	return in->dsf[i * (size_t)channels + rbf_luminance((uint32_t)channels)];
}

static size_t count_between(const rbf_incidence *in, int channels, float from, float to)
{
	size_t count = 0;
	for (size_t i = 0; i < in->count; i++)
		count += value_of(in, channels, i) >= from && value_of(in, channels, i) <= to;
	return count;
}

static void find_clipped(const rbf_measured *m, int channels, rbf_limits *found)
{
	float top = 0;
	size_t beside = 0;
	for (size_t b = 0; b < m->count; b++)
		for (size_t i = 0; i < m->incidence[b].count; i++)
			top = fmaxf(top, value_of(&m->incidence[b], channels, i));
	for (size_t b = 0; b < m->count && top > 0; b++) {
		const size_t here = count_between(&m->incidence[b], channels, (1 - SAME) * top, top);
		beside += count_between(&m->incidence[b], channels, (1 - BESIDE) * top, top) - here;
		found->clipped += here;
		found->first = here && !found->incidences ? b : found->first;
		found->incidences += here > 0;
	}
	if (found->clipped < LEAST || found->clipped <= beside)
		found->clipped = 0;
}

static void find_floor(const rbf_incidence *in, int channels, rbf_limits *found)
{
	float low = 0;
	for (size_t i = 0; i < in->count; i++) {
		const float v = value_of(in, channels, i);
		low = v > 0 && !(low > 0 && low <= v) ? v : low;
	}
	const size_t here = count_between(in, channels, low, (1 + SAME) * low), beside = count_between(in, channels, low, (1 + BESIDE) * low) - here;
	double least = 1, most = 0;
	for (size_t i = 0; i < in->count; i++)
		if (value_of(in, channels, i) >= low && value_of(in, channels, i) <= (1 + SAME) * low) {
			least = fmin(least, in->outgoing[3*i + 2]);
			most = fmax(most, in->outgoing[3*i + 2]);
		}
	if (here >= LEAST && (double)here > SHARE * (double)in->count && here > beside && low > 0 && most - least > WIDE)
		found->lowest += here;
}

rbf_limits rbf_limits_of(const rbf_measured *m, int channels)
{
	rbf_limits found = {0};
	find_clipped(m, channels, &found);
	for (size_t b = 0; b < m->count; b++) {
		found.samples += m->incidence[b].count;
		find_floor(&m->incidence[b], channels, &found);
	}
	return found;
}
