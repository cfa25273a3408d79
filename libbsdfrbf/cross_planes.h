/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A material that is not isotropic, measured in the plane of incidence alone, at several azimuths. What it sends beside that plane, at an azimuth about
 * the mirrored direction (the straight one in transmission), is taken to be what it sends along the plane of incidence when lit from that azimuth:
 * exactly so of facets, whose slopes each plane shows along a line (Torrance and Sparrow, 1967), if these do not shade each other, and of a blur in
 * tangential components. Between azimuths contours are taken to be ellipses.
 */
#ifndef RBF_CROSS_PLANES_H
#define RBF_CROSS_PLANES_H
#include "falloff.h"
#include "mesh.h"

/* Whether all incidences were measured in their plane of incidence alone, and at more than one azimuth. */
int rbf_cross_planes_only(const rbf_measured *measured);

typedef struct rbf_cross_plan {
	int channels, transmits;
	rbf_symmetry symmetry;
	const float *lambertian; /* common to all, per channel: goes nowhere */
} rbf_cross_plan;

/* How far, by that, planes of incidence are from what others at their azimuth tell, lit at other angles, and half of how far from what the opposite azimuth
 * tells, of all light. What is not alike even there is not at other azimuths. Returns 0, or -1 when out of memory. */
int rbf_cross_planes_error(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by, double *error);

/* Sets `guessed` samples beside the planes of such incidences. Arrays are realloc'ed. Opens an OpenMP region. Returns 0, or -1 when out of memory. */
int rbf_cross_planes_complete(rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by);
#endif
