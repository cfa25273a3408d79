/* SPDX-License-Identifier: BSD-3-Clause */
#include "one_plane.h"
#include "model.h"
#include "neighbours.h"
#include "plane_scan.h"
#include "scan_lines.h"
#include "vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RINGS = 40, AROUND = 24, PEAKS = RBF_PLANE_PEAKS, CHANNELS = RBF_PLANE_CHANNELS, LEAST = 3, MANY = 30, APART = 2 /* samples that the highest may be off a peak's middle */ };
static const double BESIDE = .15;   /* sine of the azimuth to the plane: what is nearer is measured */
static const double SEEN = .3;      /* of the distance to the peak: a sample that near tells more */
static const double NEAREST = .003; /* of the rings */

/* A peak: its angle, and how it falls off. */
typedef struct peak { double middle; enum rbf_falloff by; } peak;

/* What lies at a distance to one side of a peak; 0: nothing is known there. */
static int profile(const peak *of, const rbf_plane_point *p, size_t count, int channels, double distance, int side, double f[CHANNELS])
{
	const double s = rbf_falloff_along(of->by, of->middle, distance, side);
	if (!rbf_plane_at(p, count, channels, s, f))
		return 0;
	for (int c = 0; c < channels && of->by == RBF_FALLOFF_SLOPES; c++)
		f[c] *= rbf_falloff_carried(of->by, sqrt(fmax(1 - s*s, 0)), cos(of->middle));
	return 1;
}

/* Adds what a peak sends to a direction. Returns whether it is known. */
static int add_peak(const peak *of, const rbf_plane_point *p, size_t count, int channels, const double w[3], double f[CHANNELS])
{
	double side[2][CHANNELS], distance, azimuth;
	rbf_falloff_place(of->by, of->middle, w, &distance, &azimuth);
	const int front = profile(of, p, count, channels, distance, 1, side[0]), back = profile(of, p, count, channels, distance, -1, side[1]);
	const double share = front && back ? .5 * (1 + cos(azimuth)) : front;
	const double carried = of->by == RBF_FALLOFF_SLOPES ? rbf_falloff_carried(of->by, w[2], cos(of->middle)) : 1;
	for (int c = 0; c < channels; c++)
		f[c] += ((front ? share * side[0][c] : 0) + (back ? (1 - share) * side[1][c] : 0)) / carried;
	return front || back;
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
static size_t add_rings(const rbf_plane_point *p, const peak peak[PEAKS], int peaks, size_t count, int channels, const double floor[CHANNELS], const double plane[2],
	const rbf_tree *tree, size_t samples, double *outgoing, float *dsf)
{
	for (int r = 0; r < RINGS * peaks; r++)
		for (int a = 0; a < AROUND; a++) {
			const double distance = NEAREST * pow(2 / NEAREST, (r % RINGS + .5) / RINGS), azimuth = 2 * RBF_PI * (a + .5) / AROUND;
			double w[3], f[CHANNELS] = {0}, *to = outgoing + 3 * samples;
			int known = fabs(sin(azimuth)) > BESIDE && rbf_falloff_direction(peak[r / RINGS].by, peak[r / RINGS].middle, distance, azimuth, w);
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
				dsf[samples * (size_t)channels + (size_t)c] = (float)((f[c] + floor[c]) * w[2]);
			samples++;
		}
	return samples;
}

int rbf_one_plane_only(const rbf_incidence *in, double normal[3])
{
	const rbf_incidence measured = {.count = in->count - in->guessed, .outgoing = in->outgoing};
	return measured.count >= LEAST && rbf_scan_plane(&measured, normal) && fabs(normal[2]) < BESIDE;
}

/* How many samples lie between two places. */
static size_t between(const rbf_plane_point *p, size_t points, double a, double b)
{
	size_t some = 0;
	for (size_t i = 0; i < points; i++)
		some += p[i].s > fmin(a, b) && p[i].s < fmax(a, b);
	return some;
}

/* The peaks of so many points, in rows of p. What is slopes' middle, or seems to be, is the mirrored direction. Returns how many. */
static int peaks_of(rbf_plane_point *p, size_t points, int channels, double source, enum rbf_falloff by, peak peak[PEAKS])
{
	double place[PEAKS];
	const int peaks = rbf_plane_peaks(p, points, channels, place);
	for (int k = 0; k < peaks; k++) {
		peak[k] = (struct peak){asin(place[k]), rbf_plane_goes_back(place[k], source) ? RBF_FALLOFF_ANGLES : by};
		if (peak[k].by == RBF_FALLOFF_SLOPES || between(p, points, place[k], -source) <= APART)
			peak[k].middle = -asin(source);
	}
	return peaks;
}

int rbf_one_plane_complete(rbf_incidence *in, int channels, enum rbf_falloff by, const float *lambertian, int all)
{
	double normal[3];
	const int only = rbf_one_plane_only(in, normal);
	const size_t count = in->count -= in->guessed, room = count + PEAKS * RINGS * AROUND;
	in->guessed = 0;
	if (!only && !all)
		return 0;
	if (!only)
		normal[0] = normal[2] = 0, normal[1] = 1;
	rbf_plane_point *p = malloc((PEAKS + 1) * count * sizeof *p);
	rbf_tree tree = {0};
	int failed = rbf_incidence_reserve(in, (size_t)channels, room) || !p || (!only && rbf_tree_of(&tree, count, in->outgoing));
	if (!failed) {
		const double length = hypot(normal[0], normal[1]), plane[2] = {normal[1] / length, -normal[0] / length};
		const double source = fmin(fmax(in->direction[0]*plane[0] + in->direction[1]*plane[1], -1), 1);
		const size_t points = rbf_plane_points(in, channels, normal, plane, p);
		double floor[CHANNELS];
		for (int c = 0; c < channels; c++) {
			floor[c] = lambertian ? (double)lambertian[c] / RBF_PI : 0;
			for (size_t i = 0; i < points; i++)
				p[i].f[c] -= floor[c];
		}
		peak peak[PEAKS];
		const int peaks = points >= (only ? LEAST : MANY) ? peaks_of(p, points, channels, source, by, peak) : 0;
		in->count = add_rings(p, peak, peaks, points, channels, floor, plane, only ? NULL : &tree, count, in->outgoing, in->dsf);
		in->guessed = in->count - count;
	}
	rbf_tree_free(&tree);
	free(p);
	return failed ? -1 : 0;
}

int rbf_one_plane_beside(rbf_measured *measured, int channels)
{
	double normal[3];
	int failed = 0, only = !measured->ready;
	for (size_t b = 0; b < measured->count && only; b++)
		only = rbf_one_plane_only(&measured->incidence[b], normal);
	for (size_t b = 0; b < measured->count && only && !failed; b++)
		failed = rbf_one_plane_complete(&measured->incidence[b], channels, RBF_FALLOFF_COSINES, NULL, 0);
	return failed;
}
