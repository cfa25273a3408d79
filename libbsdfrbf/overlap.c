/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * New samples are compared with the nearest former ones. Those of another grid are elsewhere on the slope of a peak, now higher, now lower: only a
 * factor that nearly all have is told.
 */
#include "overlap.h"
#include "median.h"

#include <math.h>
#include <string.h>

enum { COMPARED = 300, LEAST = 20, PATH_MOST = 200 };
static const double DEGREE = 3.14159265358979323846 / 180;
static const double NEAR_DEG = 1;  /* apart, at most */
static const double CLEAR = 1.5;   /* standard deviations of ln of the ratios, that the factor exceeds */
static const double SMALL = .03;   /* ln of a factor that harms no one */
static const double NORMAL = 1.4826;

/* ln of new over former values; 0: there is no such factor. */
static double factor(const rbf_incidence *former, const rbf_batch *more, size_t channels)
{
	const size_t y = channels == 3, step = (more->count + COMPARED - 1) / COMPARED;
	const double chord = 2 * sin(.5 * NEAR_DEG * DEGREE);
	double ratio[COMPARED];
	size_t count = 0;
	for (size_t i = 0; i < more->count; i += step) {
		const double *o = more->outgoing + 3 * i;
		double least = chord * chord;
		float there = 0;
		for (size_t k = 0; k < former->count; k++) {
			const double *p = former->outgoing + 3 * k, x = o[0] - p[0], u = o[1] - p[1], z = o[2] - p[2], square = x*x + u*u + z*z;
			if (square < least) {
				least = square;
				there = former->dsf[channels * k + y];
			}
		}
		if (there > 0 && more->dsf[channels * i + y] > 0)
			ratio[count++] = log((double)more->dsf[channels * i + y] / (double)there);
	}
	if (count < LEAST)
		return 0;
	const double middle = rbf_median(ratio, count);
	for (size_t i = 0; i < count; i++)
		ratio[i] = fabs(ratio[i] - middle);
	return fabs(middle) > fmax(SMALL, CLEAR * NORMAL * rbf_median(ratio, count)) ? middle : 0;
}

/* Line of a list, the end of it if it is long. */
static void name_of(const char *list, size_t line, char text[PATH_MOST + 1])
{
	for (; list && line > 1; line--) {
		list = strchr(list, '\n');
		list += list != NULL;
	}
	const size_t length = list && line ? strcspn(list, "\n") : 0, kept = length < PATH_MOST ? length : PATH_MOST;
	if (kept)
		memcpy(text, list + length - kept, kept);
	text[kept] = 0;
}

void rbf_overlap_warn(bsdfrbf_context *context, const bsdfrbf_data *data, int component, size_t incidence, const rbf_batch *more, const char *path)
{
	const rbf_incidence *former = &data->component[component].incidence[incidence];
	const double *d = former->direction, times = exp(factor(former, more, (size_t)data->channels));
	char first[PATH_MOST + 1], second[PATH_MOST + 1];
	if (!(times < 1 || times > 1))
		return;
	const double theta = atan2(hypot(d[0], d[1]), component & 1 ? -d[2] : d[2]) / DEGREE, phi = atan2(d[1], d[0]) / DEGREE;
	name_of(data->source, former->file, first);
	name_of(path, 1, second);
	rbf_warn(context, "%s: incidence theta %.1f phi %.1f is measured twice: %s has %.*f times the values of %s; leave one of them out, or scale it to "
		"the other", rbf_component_name(component), theta, phi < -.05 ? phi + 360 : fabs(phi), *second ? second : "the latter", times < .95 ? 3 : 2, times,
		*first ? first : "the former");
}
