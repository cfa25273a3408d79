/* SPDX-License-Identifier: BSD-3-Clause */
/* Is a material isotropic that was measured at several azimuths? */
#ifndef RBF_ISOTROPY_H
#define RBF_ISOTROPY_H
#include "label.h"
#include "seen.h"

typedef struct rbf_isotropy {
	int isotropic;
	float error;    /* mean relative L1 between incidences and what others, turned about the normal to their azimuth, tell of them; < 0: too few
	                 * are there to tell */
	float beyond;   /* that is by so much more than noise, if it is told */
	uint32_t folds; /* all azimuths are one, in so many parts of a turn: a material that repeats in each would look the same; 0: they are not. Then
	                 * isotropic is only what is round as well: along the normal, or if that was not measured, by mirror images at the plane of incidence */
} rbf_isotropy;

/* Isotropic is what differs by no more than noise makes of fits, or than `enough`. lambertian: luminance of the Lambertian part (it counts in the
 * denominator). scatter: error of each fit (expect.h), or NULL: it is
 * no noise. seen: [bases], or NULL: all was measured; else what counts is where both were. Returns 0, or -1 when out of memory. */
int rbf_isotropy_of(const rbf_fitted *fitted, float lambertian, const float *scatter, const rbf_seen *seen, float enough, rbf_isotropy *found);
#endif
