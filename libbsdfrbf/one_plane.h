/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Isotropic materials are often measured in the plane of incidence alone, or closely there and at few places elsewhere. Beside it light is then taken to fall off
 * from each peak as it does along the plane, by slopes of facets, tangential components or angles; what goes back to the source does so by the angle.
 */
#ifndef RBF_ONE_PLANE_H
#define RBF_ONE_PLANE_H
#include "falloff.h"

/* Whether that can be done: the measured samples are all in one plane that holds the normal, which *normal is then that of. */
int rbf_one_plane_only(const rbf_incidence *incidence, double normal[3]);

/* Sets `guessed` samples beside the plane of such an incidence; others stay as they are, but if `all`: then those of an incidence at azimuth 0 are
 * made from its samples in the plane of incidence, if these are many, and lie where no others are near. lambertian: what is common to all, per channel, and goes
 * nowhere, or NULL. Arrays are realloc'ed. Returns 0, or -1 when out of memory. */
int rbf_one_plane_complete(rbf_incidence *incidence, int channels, enum rbf_falloff by, const float *lambertian, int all);

/* Samples beside the plane, by tangential components, if all incidences were measured in one alone; else those that were not tell more. Returns
 * 0, or -1 when out of memory. */
int rbf_one_plane_beside(rbf_measured *measured, int channels);
#endif
