/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The least sum of |difference - (g_a - g_b)| over all pairs gives the gains, but for one factor for all that pairs join: that of most of them
 * is taken to be right, or, where there is no such thing, their mean. Where no gains make the pairs of one scan agree, their scatter is what its
 * gain has to stand out from.
 */
#include "gains.h"
#include "median.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 60, PAIRS_LEAST = 3 };
static const double NOISE = .005;    /* ln: residuals below count alike */
static const double ERRORS = 3;      /* that a gain is beyond */
static const double CONSISTENT = 1;  /* of the scatter of its pairs, that a gain exceeds: then five of six have its sign */
static const double MANY = 1. / 3;   /* share of a part: where more stand out, it is not a slip: all are told, and their light is kept */
static const double OUTSIDE = 4;     /* scatters from the middle of the gains: no part of most */
static const double NORMAL = 1.4826; /* of a normal distribution: standard deviation over the median of |x| */

typedef struct graph {
	uint32_t scans;
	const float *light, *least;
	const rbf_pair *pair;
	uint32_t *first, *at;  /* of each scan: its pairs, 2 i if it is their a, else 2 i + 1 */
	uint32_t *part;        /* number of what pairs join it to */
	double *gain, *room;   /* room: for a list of scans, or pairs */
} graph;

static void list_pairs(graph *g, uint32_t pairs)
{
	uint32_t *end = g->first + 1;
	for (uint32_t i = 0; i < pairs; i++) {
		g->first[g->pair[i].a + 2]++;
		g->first[g->pair[i].b + 2]++;
	}
	for (uint32_t k = 2; k < g->scans + 2; k++)
		g->first[k] += g->first[k - 1];
	for (uint32_t i = 0; i < pairs; i++) {
		g->at[end[g->pair[i].a]++] = 2 * i;
		g->at[end[g->pair[i].b]++] = 2 * i + 1;
	}
}

/* Each scan gets the least number of a scan that it is joined to. */
static void find_parts(graph *g, uint32_t pairs)
{
	for (uint32_t k = 0; k < g->scans; k++)
		g->part[k] = k;
	for (int changed = 1; changed;) {
		changed = 0;
		for (uint32_t i = 0; i < pairs; i++) {
			uint32_t *a = &g->part[g->pair[i].a], *b = &g->part[g->pair[i].b];
			changed |= *a != *b;
			*a = *b = *a < *b ? *a : *b;
		}
	}
}

/* The gain of a scan by one of its pairs. */
static double tells(const graph *g, uint32_t entry)
{
	const rbf_pair *p = &g->pair[entry / 2];
	return entry & 1 ? g->gain[p->a] - p->difference : g->gain[p->b] + p->difference;
}

/* Weighted least squares, again and again, with what makes squares of residuals count as these themselves (Lawson 1961). */
static void find_gains(graph *g)
{
	for (int round = 0; round < ROUNDS; round++)
		for (uint32_t k = 0; k < g->scans; k++) {
			double sum = 0, weights = 0;
			for (uint32_t e = g->first[k]; e < g->first[k + 1]; e++) {
				const double told = tells(g, g->at[e]), weight = g->pair[g->at[e] / 2].weight / fmax(fabs(told - g->gain[k]), NOISE);
				sum += weight * told;
				weights += weight;
			}
			g->gain[k] = weights > 0 ? sum / weights : 0;
		}
}

/* Scatter of a scan's pairs; INFINITY: there are too few. */
static double scatter(const graph *g, uint32_t k)
{
	const uint32_t count = g->first[k + 1] - g->first[k];
	for (uint32_t e = 0; e < count; e++)
		g->room[e] = fabs(tells(g, g->at[g->first[k] + e]) - g->gain[k]);
	return count < PAIRS_LEAST ? INFINITY : NORMAL * rbf_median(g->room, count);
}

/* The gain of most in a part: their mean weighted by light, without those that stand apart (Tukey's biweight). */
static double most(const graph *g, uint32_t part)
{
	uint32_t count = 0;
	double sum = 0, weights = 0;
	for (uint32_t k = 0; k < g->scans; k++)
		if (g->part[k] == part)
			g->room[count++] = g->gain[k];
	const double middle = rbf_median(g->room, count);
	for (uint32_t i = 0; i < count; i++)
		g->room[i] = fabs(g->room[i] - middle);
	const double far = OUTSIDE * fmax(NORMAL * rbf_median(g->room, count), .5 * (double)g->least[part]);
	for (uint32_t k = 0; k < g->scans; k++) {
		const double x = (g->gain[k] - middle) / far;
		if (g->part[k] != part || !(fabs(x) < 1))
			continue;
		const double weight = (double)g->light[k] * (1 - x * x) * (1 - x * x);
		sum += weight * g->gain[k];
		weights += weight;
	}
	return weights > 0 ? sum / weights : middle;
}

/* The gain that leaves a part's light as it is. */
static double mean(const graph *g, uint32_t part)
{
	double light = 0, divided = 0;
	for (uint32_t k = part; k < g->scans; k++)
		if (g->part[k] == part) {
			light += (double)g->light[k];
			divided += (double)g->light[k] * exp(-g->gain[k]);
		}
	return light > 0 ? -log(divided / light) : 0;
}

/* How many of a part stand out; of: how many there are. */
static uint32_t tell_part(const graph *g, uint32_t part, int all, double told[], uint32_t *of)
{
	const double usual = all ? mean(g, part) : most(g, part);
	uint32_t found = 0;
	*of = 0;
	for (uint32_t k = part; k < g->scans; k++) {
		if (g->part[k] != part)
			continue;
		const double gain = g->gain[k] - usual, apart = scatter(g, k), pairs = g->first[k + 1] - g->first[k];
		const int clear = fabs(gain) > fmax(fmax(ERRORS / sqrt(fmax(pairs - 1, 1)), CONSISTENT) * apart, all ? 0 : (double)g->least[k]);
		told[k] = clear ? gain : 0;
		found += (uint32_t)clear;
		++*of;
	}
	return found;
}

static int tell(const graph *g, double told[])
{
	uint32_t sum = 0;
	for (uint32_t part = 0; part < g->scans; part++) {
		uint32_t of;
		if (g->part[part] != part)
			continue;
		const uint32_t found = tell_part(g, part, 0, told, &of);
		sum += found > MANY * of ? tell_part(g, part, 1, told, &of) : found;
	}
	return (int)sum;
}

int rbf_gains_solve(uint32_t scans, const float light[], const float least[], uint32_t pairs, const rbf_pair pair[], double told[])
{
	graph g = {.scans = scans, .light = light, .least = least, .pair = pair};
	int found = -1;
	g.first = calloc((size_t)scans + 2, sizeof *g.first);
	g.at = malloc((2 * (size_t)pairs + 1) * sizeof *g.at);
	g.part = malloc(((size_t)scans + 1) * sizeof *g.part);
	g.gain = calloc((size_t)scans + 1, sizeof *g.gain);
	g.room = malloc(((size_t)scans + pairs + 1) * sizeof *g.room);
	if (g.first && g.at && g.part && g.gain && g.room) {
		list_pairs(&g, pairs);
		find_parts(&g, pairs);
		find_gains(&g);
		found = tell(&g, told);
	}
	free(g.first);
	free(g.at);
	free(g.part);
	free(g.gain);
	free(g.room);
	return found;
}
