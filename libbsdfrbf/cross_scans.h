/* SPDX-License-Identifier: BSD-3-Clause */
/* Planes of incidence, by their azimuths: what they tell of light that comes from between. */
#ifndef RBF_CROSS_SCANS_H
#define RBF_CROSS_SCANS_H
#include "cross_planes.h"
#include "ellipse.h"

#define RBF_CROSS_NONE SIZE_MAX
#define RBF_CROSS_SAME .02   /* rad: azimuths that are one */
#define RBF_CROSS_NORMAL .01 /* sine: an incidence has no azimuth */

/* What goes about the mirrored direction, and what goes about the source. */
enum rbf_cross_part { RBF_CROSS_MIRRORED, RBF_CROSS_BACK, RBF_CROSS_PARTS };

/* One incidence, or a mirror image: its plane of incidence, with f less the Lambertian part. */
typedef struct rbf_cross_scan {
	double azimuth, theta;
	size_t base, count;
	rbf_plane_point *part[RBF_CROSS_PARTS]; /* by place towards the source; RBF_CROSS_BACK: NULL if there is none. Owned by the one that is no image */
	int image;
} rbf_cross_scan;

typedef struct rbf_cross_group { double azimuth; size_t first, count; } rbf_cross_group; /* scans at one azimuth, by polar angle */

typedef struct rbf_cross_scans {
	int channels;
	enum rbf_falloff by;
	int transmits;
	double floor[RBF_PLANE_CHANNELS];
	rbf_cross_scan *scan;
	rbf_cross_group *group;
	size_t scans, groups;
} rbf_cross_scans;

/* From where light comes that is to be told of. */
typedef struct rbf_cross_source {
	double theta, azimuth;
	size_t without; /* an incidence that is not to tell, or RBF_CROSS_NONE */
	enum rbf_falloff by[RBF_CROSS_PARTS];
	rbf_ellipse ellipse[RBF_CROSS_PARTS];
} rbf_cross_source;

/* Returns 0, or -1 when out of memory; to be ended in any case. */
int rbf_cross_begin(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by, rbf_cross_scans *scans);
void rbf_cross_end(rbf_cross_scans *scans);

/* What planes at one azimuth show of a part, at a distance by the ellipse, towards the source (side 1) or away from it (-1), at a polar angle between those that
 * were measured, or at the nearest: f as it is carried. 0: nothing is known there. */
int rbf_cross_at(const rbf_cross_scans *scans, const rbf_cross_source *from, size_t group, enum rbf_cross_part part, double distance, int side,
	double f[RBF_PLANE_CHANNELS]);
#endif
