/* SPDX-License-Identifier: BSD-3-Clause */
/* Is the sample, or what counts incident azimuths, turned about the normal? */
#ifndef RBF_OFFSET_H
#define RBF_OFFSET_H
#include "label.h"

typedef struct rbf_offset {
	double degrees;        /* that have to be added to azimuths, so that the mirror planes come to lie on the axes */
	int incident_alone;    /* to those of incident directions alone; 0: to all */
	float before, after;   /* mean difference between incidences by the planes and their images; < 0: no incidence is by a plane */
} rbf_offset;

/* The turn that makes most symmetric what was measured near to the planes that the symmetry mirrors about (isotropic: to the plane of incidence,
 * which is to be y = 0). Both kinds are tried. lambertian: as in asymmetry.h.
 * Returns 0, or -1 when out of memory. */
int rbf_offset_find(const rbf_fitted *fitted, rbf_symmetry symmetry, float lambertian, rbf_offset *found);
#endif
