/* SPDX-License-Identifier: BSD-3-Clause */
#include "one_plane.h"
#include "model.h"
#include "neighbours.h"
#include "scan_lines.h"
#include "vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RINGS = 40, AROUND = 24, PEAKS = 4, HALF_SMOOTH = 2, CHANNELS = 3, LEAST = 3, MANY = 30 };
static const double RISE = 1.5;     /* over the lowest so far: another peak begins */
static const double BESIDE = .15;   /* sine of the azimuth to the plane: what is nearer is measured */
static const double BACK = .2;      /* rad */
static const double SEEN = .3;      /* of the distance to the peak: a sample that near tells more */
static const double NEAREST = .003; /* of the rings */
static const double FAINT = 1e-3;   /* of the highest peak */
static const double LOWEST = .02;   /* of the cosine: f is DSF over it */

/* A sample's place along the plane, a sine, and its f; luminance smoothed. */
typedef struct point { double s, f[CHANNELS], smooth; } point;

static int by_place(const void *a, const void *b)
{
	const double x = ((const point *)a)->s, y = ((const point *)b)->s;
	return (x > y) - (x < y);
}

/* A peak: its place, and how it falls off. */
typedef struct peak { double s; enum rbf_one_plane by; } peak;

/* What lies at a distance to one side of a peak; 0: nothing is known there. */
static int profile(const peak *of, const point *p, size_t count, int channels, double distance, int side, double f[CHANNELS])
{
	const double angle = asin(of->s) + side * distance;
	const double s = of->by == RBF_PLANE_COSINES ? of->s + side * distance : fabs(angle) < RBF_PI / 2 ? sin(angle) : 2;
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

/* Direction (along, across, normal) at a distance from a peak, at an azimuth that is 0 along the plane. Returns 0 if it is none. */
static int direction_at(const peak *from, double distance, double azimuth, double w[3])
{
	const double a = cos(azimuth), h = sin(azimuth), place = asin(from->s);
	if (from->by == RBF_PLANE_COSINES) {
		w[0] = from->s + distance * a;
		w[1] = distance * h;
		w[2] = sqrt(fmax(1 - w[0]*w[0] - w[1]*w[1], 0));
	} else {
		w[0] = cos(distance) * sin(place) + sin(distance) * a * cos(place);
		w[1] = sin(distance) * h;
		w[2] = cos(distance) * cos(place) - sin(distance) * a * sin(place);
	}
	return w[2] > LOWEST && distance < RBF_PI;
}

/* Adds what a peak sends to a direction. Returns whether it is known. */
static int add_peak(const peak *of, const point *p, size_t count, int channels, const double w[3], double f[CHANNELS])
{
	const double place = asin(of->s), along = of->by == RBF_PLANE_COSINES ? w[0] - of->s : w[0] * cos(place) - w[2] * sin(place), tangent = hypot(along, w[1]);
	const double distance = of->by == RBF_PLANE_COSINES ? tangent : atan2(tangent, w[0] * sin(place) + w[2] * cos(place));
	const double ahead = tangent > 0 ? .5 * (1 + along / tangent) : .5;
	double side[2][CHANNELS];
	const int front = profile(of, p, count, channels, distance, 1, side[0]), back = profile(of, p, count, channels, distance, -1, side[1]);
	const double share = front && back ? ahead : front;
	for (int c = 0; c < channels; c++)
		f[c] += (front ? share * side[0][c] : 0) + (back ? (1 - share) * side[1][c] : 0);
	return front || back;
}

static double highest(const point *p, size_t count)
{
	double top = 0;
	for (size_t i = 0; i < count; i++)
		top = fmax(top, p[i].smooth);
	return top;
}

/* Keeps in `main` what falls off from its highest point, and moves the rest, other peaks, to `other`. Returns the place of the highest. */
static double split(point *main, point *other, size_t count, int channels)
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

/* Smoothed luminance: noise must not look like peaks. */
static void smooth(point *p, size_t count, int luminance)
{
	for (size_t i = 0; i < count; i++) {
		const size_t from = i > HALF_SMOOTH ? i - HALF_SMOOTH : 0, to = i + HALF_SMOOTH < count ? i + HALF_SMOOTH : count - 1;
		p[i].smooth = 0;
		for (size_t n = from; n <= to; n++)
			p[i].smooth += fmax(p[n].f[luminance], 0) / (double)(to - from + 1);
	}
}

/* Whether a sample is that near for how far the peak is. */
static int is_seen(const rbf_tree *tree, const double w[3], double distance)
{
	const float at[3] = {(float)w[0], (float)w[1], (float)w[2]};
	uint32_t nearest;
	float square;
	return rbf_tree_nearest(tree, at, 1, &nearest, &square) && (double)square < SEEN * SEEN * distance * distance;
}

/* Rings about each peak, added to `samples` samples; tree: of these, NULL: what is near the plane is seen, nothing else. Room is there. Returns the
 * new count. */
static size_t add_rings(const point *p, const peak peak[PEAKS], int peaks, size_t count, int channels, const double plane[2], const rbf_tree *tree,
	size_t samples, double *outgoing, float *dsf)
{
	for (int r = 0; r < RINGS * peaks; r++)
		for (int a = 0; a < AROUND; a++) {
			const double distance = NEAREST * pow(2 / NEAREST, (r % RINGS + .5) / RINGS), azimuth = 2 * RBF_PI * (a + .5) / AROUND;
			double w[3], f[CHANNELS] = {0}, *to = outgoing + 3 * samples;
			int known = fabs(sin(azimuth)) > BESIDE && direction_at(&peak[r / RINGS], distance, azimuth, w);
			for (int k = 0; k < peaks && known; k++)
				known = add_peak(&peak[k], p + (size_t)k * count, count, channels, w, f) || k;
			if (!known)
				continue;
			to[0] = w[0] * plane[0] - w[1] * plane[1];
			to[1] = w[0] * plane[1] + w[1] * plane[0];
			to[2] = w[2];
			if (tree && is_seen(tree, to, distance))
				continue;
			for (int c = 0; c < channels; c++)
				dsf[samples * (size_t)channels + (size_t)c] = (float)(f[c] * w[2]);
			samples++;
		}
	return samples;
}

int rbf_one_plane_only(const rbf_incidence *in, double normal[3])
{
	const rbf_incidence measured = {.count = in->count - in->guessed, .outgoing = in->outgoing};
	return measured.count >= LEAST && rbf_scan_plane(&measured, normal) && fabs(normal[2]) < BESIDE;
}

/* Whether a place is next to that of the source, and not half way to the mirrored one. */
static int goes_back(double s, double source)
{
	const double apart = fabs(asin(s) - asin(source));
	return apart < BACK && apart < .5 * fabs(asin(source));
}

/* Samples in the plane with that normal. */
static size_t points_of(const rbf_incidence *in, int channels, const double normal[3], const double plane[2], point *p)
{
	size_t points = 0;
	for (size_t i = 0; i < in->count; i++) {
		const double *w = in->outgoing + 3*i;
		if (fabs(rbf_dot3(normal, w)) > RBF_SCAN_FLAT)
			continue;
		p[points].s = fmin(fmax(w[0]*plane[0] + w[1]*plane[1], -1), 1);
		for (int c = 0; c < channels; c++)
			p[points].f[c] = (double)in->dsf[i * (size_t)channels + (size_t)c] / fmax(w[2], LOWEST);
		points++;
	}
	qsort(p, points, sizeof *p, by_place);
	smooth(p, points, (int)rbf_luminance((uint32_t)channels));
	return points;
}

/* The peaks of so many points, in rows of p. Returns how many. */
static int peaks_of(point *p, size_t points, int channels, double source, enum rbf_one_plane by, peak peak[PEAKS])
{
	const double least = FAINT * highest(p, points);
	int peaks = 0;
	for (; peaks < PEAKS; peaks++) {
		point *own = p + (size_t)peaks * points;
		if (peaks && !(highest(own, points) > least))
			break;
		peak[peaks].s = split(own, own + points, points, channels);
		peak[peaks].by = goes_back(peak[peaks].s, source) ? RBF_PLANE_ANGLES : by;
	}
	return peaks;
}

int rbf_one_plane_complete(rbf_incidence *in, int channels, enum rbf_one_plane by, int all)
{
	double normal[3];
	const int only = rbf_one_plane_only(in, normal);
	const size_t count = in->count -= in->guessed, room = count + PEAKS * RINGS * AROUND;
	in->guessed = 0;
	if (!only && !all)
		return 0;
	if (!only)
		normal[0] = normal[2] = 0, normal[1] = 1;
	point *p = malloc((PEAKS + 1) * count * sizeof *p);
	double *outgoing = realloc(in->outgoing, 3 * room * sizeof *outgoing);
	in->outgoing = outgoing ? outgoing : in->outgoing;
	float *dsf = realloc(in->dsf, (size_t)channels * room * sizeof *dsf);
	in->dsf = dsf ? dsf : in->dsf;
	rbf_tree tree = {0};
	int failed = !p || !outgoing || !dsf || (!only && rbf_tree_of(&tree, count, outgoing));
	if (!failed) {
		const double length = hypot(normal[0], normal[1]), plane[2] = {normal[1] / length, -normal[0] / length};
		const double source = fmin(fmax(in->direction[0]*plane[0] + in->direction[1]*plane[1], -1), 1);
		const size_t points = points_of(in, channels, normal, plane, p);
		peak peak[PEAKS];
		const int peaks = points >= (only ? LEAST : MANY) ? peaks_of(p, points, channels, source, by, peak) : 0;
		in->count = add_rings(p, peak, peaks, points, channels, plane, only ? NULL : &tree, count, outgoing, dsf);
		in->guessed = in->count - count;
	}
	rbf_tree_free(&tree);
	free(p);
	return failed ? -1 : 0;
}
