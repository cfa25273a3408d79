/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples in a plane through the normal: what they tell along it, and which peaks. */
#ifndef RBF_PLANE_SCAN_H
#define RBF_PLANE_SCAN_H
#include "measure.h"

enum { RBF_PLANE_PEAKS = 4, RBF_PLANE_CHANNELS = 3 };
#define RBF_PLANE_LOWEST .02 /* of the cosine: f is DSF over it */

/* A sample's place along the plane, a sine, and its f; luminance smoothed. */
typedef struct rbf_plane_point { double s, f[RBF_PLANE_CHANNELS], smooth; } rbf_plane_point;

/* Samples in the plane with that normal, by their place along a horizontal unit vector in it. p: room for all. Returns how many. */
size_t rbf_plane_points(const rbf_incidence *incidence, int channels, const double normal[3], const double along[2], rbf_plane_point *p);

/* f at a place; 0: nothing is known there. */
int rbf_plane_at(const rbf_plane_point *p, size_t count, int channels, double s, double f[RBF_PLANE_CHANNELS]);

/* Places of peaks, highest first; row k of p is left with what falls off from the k-th. p: RBF_PLANE_PEAKS + 1 rows of `points`, of which the first is given.
 * Returns how many. */
int rbf_plane_peaks(rbf_plane_point *p, size_t points, int channels, double place[RBF_PLANE_PEAKS]);

/* Whether a place is next to that of the source, and not half way to the mirrored one. */
int rbf_plane_goes_back(double s, double source);
#endif
