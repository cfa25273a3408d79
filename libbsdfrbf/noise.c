/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Noise hardly ever grows more than in proportion to light. So what half of the samples that are no brighter are off by, or less, bounds that of brighter ones, and
 * is not moved by the few that a fit misses because it has not seen what there is between others.
 */
#include "noise.h"
#include "median.h"

#include <math.h>
#include <stdlib.h>

enum { ALIKE = 128 }; /* samples that share a noise */
static const double MEAN = 1.183;  /* of |x|, of a normal distribution, over its median */

static int by_light(const void *a, const void *b)
{
	const rbf_noisy *x = a, *y = b;
	return (x->light > y->light) - (x->light < y->light);
}

double rbf_noise_of(int count, rbf_noisy list[])
{
	double share = INFINITY, noise = 0, all = 0;
	qsort(list, (size_t)count, sizeof *list, by_light);
	for (int first = 0, end; first < count; first = end) {
		end = first + 2 * ALIKE > count ? count : first + ALIKE;
		double off[2 * ALIKE];
		for (int i = first; i < end; i++)
			off[i - first] = list[i].light > 0 ? list[i].miss / list[i].light : INFINITY;
		share = fmin(share, rbf_median(off, (size_t)(end - first)));
		for (int i = first; i < end; i++) {
			noise += list[i].light > 0 ? list[i].area * list[i].light * share : 0;
			all += list[i].area * fabs(list[i].truth);
		}
	}
	return all > 0 ? MEAN * noise / all : 0;
}
