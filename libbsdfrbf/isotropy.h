/* SPDX-License-Identifier: BSD-3-Clause */
/* Is a material isotropic that was measured at several azimuths? */
#ifndef RBF_ISOTROPY_H
#define RBF_ISOTROPY_H
#include "label.h"

/* Mean relative L1 between incidences and others at the same polar angle, or nearly so, turned about the normal to their azimuth; < 0: too few
 * are there to tell. lambertian: luminance of the Lambertian part (it counts in the denominator). enough: by how much a mean is above it does
 * not matter. Returns 0, or -1 when out of memory. */
int rbf_isotropy_of(const rbf_fitted *fitted, float lambertian, float enough, float *error);
#endif
