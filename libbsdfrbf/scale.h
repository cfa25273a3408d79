/* SPDX-License-Identifier: BSD-3-Clause */
/* Incidences that were measured at another scale than all others. */
#ifndef RBF_SCALE_H
#define RBF_SCALE_H
#include "label.h"

/* scale[bases]: how many times the light that those around it tell an incidence sends, where no material does that; else 1. fitted: with its
 * neighbours; lambertian: luminance of the Lambertian part. Returns how many are not 1, or -1 when out of memory. */
int rbf_scale_find(const rbf_fitted *fitted, float lambertian, float scale[]);

/* Divides each incidence's lobes by its scale, or multiplies them if `back`. */
void rbf_scale_lobes(const rbf_fitted *fitted, const float scale[], int back);
#endif
