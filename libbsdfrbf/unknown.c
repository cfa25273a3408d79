/* SPDX-License-Identifier: BSD-3-Clause */
#include "unknown.h"
#include "median.h"
#include "spiral.h"

#include <stdlib.h>

enum { COUNT = 1000, RING = 50 }; /* directions that are asked for; known ones that stand for a polar angle */
enum { DARKEST = 10 };            /* all but one in so many are brighter */

typedef struct view {
	float z[COUNT];          /* falling */
	float certainty[COUNT];  /* 1: measured, 0: unknown */
	float f[COUNT];          /* luminance, of the lobes and the Lambertian part */
} view;

static view *look(const rbf_seen *seen, const rbf_lobes *l, const float lambertian[3])
{
	const uint32_t y = rbf_luminance(l->channels);
	view *v = malloc(sizeof *v);
	for (int n = 0; n < COUNT && v; n++) {
		float q[3];
		rbf_spiral(n, COUNT, q);
		v->z[n] = q[2];
		v->certainty[n] = rbf_seen_is(seen, q) ? 1 : rbf_seen_filled(seen, q);
		v->f[n] = rbf_lobes_luminance(l, q) / q[2] + lambertian[y] * (float)(1 / RBF_PI);
	}
	return v;
}

/* f of known directions next to one in polar angle, before and behind it in the list, sorted. Returns how many. */
static int ring_of(const view *v, int n, double f[RING], double *median)
{
	int count = 0;
	for (int step = 1; step < COUNT && count < RING; step++)
		for (int side = -1; side <= 1 && count < RING; side += 2) {
			const int k = n + side * step;
			if (k >= 0 && k < COUNT && v->certainty[k] > 0)
				f[count++] = (double)v->f[k];
		}
	*median = rbf_median(f, (size_t)count);
	return count;
}

/* How far off f may be at an unknown direction. */
static double off(const view *v, int n)
{
	double f[RING], median;
	const int count = ring_of(v, n, f, &median);
	const double darkest = count ? f[count / DARKEST] : 0;
	return fmax(median - darkest, fabs(darkest - (double)v->f[n]));
}

float rbf_unknown_error(const rbf_seen *seen, const rbf_lobes *l, const float lambertian[3], float risk)
{
	double error = 0, all = 0;
	view *v = look(seen, l, lambertian);
	for (int n = 0; n < COUNT && v; n++) {
		const double light = (double)(v->f[n] * v->z[n]), certainty = (double)v->certainty[n];
		all += light;
		if (certainty > 0 && certainty < 1)
			error += fmin((double)risk * log(certainty) / log((double)RBF_SECOND_HAND), 1) * light;
		else if (!(certainty > 0))
			error += off(v, n) * (double)v->z[n];
	}
	const int failed = !v;
	free(v);
	return failed ? -1 : all > 0 ? (float)fmin(error / all, 1) : 0;
}
