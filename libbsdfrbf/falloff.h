/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * How light falls off about a direction in the plane of incidence: by the slopes of the facets that mirror it there (Torrance and Sparrow, Theory for off-specular
 * reflection from roughened surfaces, 1967), by distance in tangential components (Harvey, Light-scattering characteristics of optical surfaces, 1976), or by the
 * angle. Coordinates: along the plane of incidence towards the source, across it, and up. The middle is an angle from the normal, positive towards the source.
 */
#ifndef RBF_FALLOFF_H
#define RBF_FALLOFF_H
#include "plane_scan.h"

#include <math.h>

enum rbf_falloff { RBF_FALLOFF_SLOPES, RBF_FALLOFF_COSINES, RBF_FALLOFF_ANGLES, RBF_FALLOFFS };

/* The place in the plane, a sine, that is at a distance from the middle towards the source (side 1) or away from it (-1); beyond 1 if there is none. */
double rbf_falloff_along(enum rbf_falloff by, double middle, double distance, int side);

/* The direction at a distance and an azimuth, 0 towards the source. Returns 0 if there is none. */
int rbf_falloff_direction(enum rbf_falloff by, double middle, double distance, double azimuth, double w[3]);

/* The other way round. */
void rbf_falloff_place(enum rbf_falloff by, double middle, const double w[3], double *distance, double *azimuth);

/* What f is multiplied by where it is compared, so that as much light is sent from wherever it comes: facets send it into solid angles that shrink with the cosine
 * of incidence. */
static inline double rbf_falloff_carried(enum rbf_falloff by, double exitant, double incident)
{
	return by == RBF_FALLOFF_COSINES ? 1 : fmax(by == RBF_FALLOFF_SLOPES ? exitant * incident : exitant, RBF_PLANE_LOWEST);
}
#endif
