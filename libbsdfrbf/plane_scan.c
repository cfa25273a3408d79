/* SPDX-License-Identifier: BSD-3-Clause */
#include "plane_scan.h"
#include "model.h"
#include "scan_lines.h"
#include "vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { HALF_SMOOTH = 2 };
static const double RISE = 1.5;     /* over the lowest so far: another peak begins */
static const double BACK = .2;      /* rad */
static const double FAINT = 1e-3;   /* of the highest peak */

static int by_place(const void *a, const void *b)
{
	const double x = ((const rbf_plane_point *)a)->s, y = ((const rbf_plane_point *)b)->s;
	return (x > y) - (x < y);
}

/* Smoothed luminance: noise must not look like peaks. */
static void smooth(rbf_plane_point *p, size_t count, int luminance)
{
	for (size_t i = 0; i < count; i++) {
		const size_t from = i > HALF_SMOOTH ? i - HALF_SMOOTH : 0, to = i + HALF_SMOOTH < count ? i + HALF_SMOOTH : count - 1;
		p[i].smooth = 0;
		for (size_t n = from; n <= to; n++)
			p[i].smooth += fmax(p[n].f[luminance], 0) / (double)(to - from + 1);
	}
}

size_t rbf_plane_points(const rbf_incidence *in, int channels, const double normal[3], const double along[2], rbf_plane_point *p)
{
	size_t points = 0;
	for (size_t i = 0; i < in->count; i++) {
		const double *w = in->outgoing + 3*i;
		if (fabs(rbf_dot3(normal, w)) > RBF_SCAN_FLAT)
			continue;
		p[points].s = fmin(fmax(w[0]*along[0] + w[1]*along[1], -1), 1);
		for (int c = 0; c < channels; c++)
			p[points].f[c] = (double)in->dsf[i * (size_t)channels + (size_t)c] / fmax(w[2], RBF_PLANE_LOWEST);
		points++;
	}
	qsort(p, points, sizeof *p, by_place);
	smooth(p, points, (int)rbf_luminance((uint32_t)channels));
	return points;
}

int rbf_plane_at(const rbf_plane_point *p, size_t count, int channels, double s, double f[RBF_PLANE_CHANNELS])
{
	size_t low = 0, high = count;
	if (!count || s < p[0].s || s > p[count - 1].s)
		return 0;
	while (high - low > 1) {
		const size_t middle = low + (high - low) / 2;
		if (p[middle].s <= s)
			low = middle;
		else
			high = middle;
	}
	const size_t next = low + 1 < count ? low + 1 : low;
	const double wide = p[next].s - p[low].s, t = wide > 0 ? (s - p[low].s) / wide : 0;
	for (int c = 0; c < channels; c++)
		f[c] = (1 - t) * p[low].f[c] + t * p[next].f[c];
	return 1;
}

static double highest(const rbf_plane_point *p, size_t count)
{
	double top = 0;
	for (size_t i = 0; i < count; i++)
		top = fmax(top, p[i].smooth);
	return top;
}

/* Keeps in `main` what falls off from its highest point, and moves the rest, other peaks, to `other`. Returns the place of the highest. */
static double split(rbf_plane_point *main, rbf_plane_point *other, size_t count, int channels)
{
	size_t top = 0;
	const double most = highest(main, count);
	while (main[top].smooth < most)
		top++;
	memcpy(other, main, count * sizeof *other);
	for (size_t i = 0; i < count; i++)
		memset(other[i].f, 0, sizeof other[i].f);
	for (int side = -1; side <= 1; side += 2) {
		size_t low = top;
		for (size_t i = top; side > 0 ? i + 1 < count : i > 0;) {
			i = side > 0 ? i + 1 : i - 1;
			other[i].smooth = 0;
			if (main[i].smooth <= RISE * main[low].smooth) {
				low = main[i].smooth < main[low].smooth ? i : low;
				continue;
			}
			for (int c = 0; c < channels; c++) {
				other[i].f[c] = fmax(main[i].f[c] - main[low].f[c], 0);
				main[i].f[c] = main[low].f[c];
			}
			other[i].smooth = main[i].smooth - main[low].smooth;
		}
	}
	other[top].smooth = 0;
	return main[top].s;
}

int rbf_plane_peaks(rbf_plane_point *p, size_t points, int channels, double place[RBF_PLANE_PEAKS])
{
	const double least = FAINT * highest(p, points);
	int peaks = 0;
	for (; peaks < RBF_PLANE_PEAKS; peaks++) {
		rbf_plane_point *own = p + (size_t)peaks * points;
		if (peaks && !(highest(own, points) > least))
			break;
		place[peaks] = split(own, own + points, points, channels);
	}
	return peaks;
}

int rbf_plane_goes_back(double s, double source)
{
	const double apart = fabs(asin(s) - asin(source));
	return apart < BACK && apart < .5 * fabs(asin(source));
}
