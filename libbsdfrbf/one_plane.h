/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Isotropic materials are often measured in the plane of incidence alone. Beside it light is then taken to fall off from each peak as it does
 * along the plane, by the distance in tangential components (Harvey, Light-scattering characteristics of optical surfaces, 1976) or by the angle.
 */
#ifndef RBF_ONE_PLANE_H
#define RBF_ONE_PLANE_H
#include "measure.h"

enum rbf_one_plane { RBF_PLANE_COSINES, RBF_PLANE_ANGLES, RBF_PLANES };

/* Sets `guessed` samples beside the plane of an incidence whose measured samples are all in one that holds the normal; others stay as they are.
 * Arrays are realloc'ed. Returns 0, or -1 when out of memory. */
int rbf_one_plane_complete(rbf_incidence *incidence, int channels, enum rbf_one_plane by);
#endif
