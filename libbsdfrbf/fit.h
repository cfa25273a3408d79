/* SPDX-License-Identifier: BSD-3-Clause */
/* Non-negative lobe fit of one measured incidence. */
#ifndef RBF_FIT_H
#define RBF_FIT_H
#include "lobes.h"
#include "measure.h"
#include "team.h"

/* DHR of the Lambertian part common to all incidences, per channel: from below the noise, 0 if there is none.
 * Returns 0, or -1 when out of memory or a process gave up. Opens OpenMP regions. */
int rbf_fit_lambertian(const rbf_team *team, const rbf_measured *measured, int channels, float lambertian[3]);

/* With a number of places: narrower lobes there as well, for edges and thin lines. */
#define RBF_FIT_NARROW 0x80000000u
/* With a number of places: the middle between each two samples that are next to each other counts as a sample of their mean. */
#define RBF_FIT_BETWEEN 0x40000000u
#define RBF_FIT_PLACES 0x3fffffffu

/* Fits lobes to the samples less the Lambertian part: at `lobes` places, with wider ones among them, and where those miss several samples
 * alike. `hold` > 1 leaves out one sample in so many (held_out.h) and puts the relative L1 of the fit against those, each for the solid angle it
 * stands for and all channels alike, in *error, unless that is NULL (-1: none left out). Returns 0, or -1 when out of memory. Thread-safe. */
int rbf_fit(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t lobes, uint32_t hold,
	rbf_lobes *out, float *error);

/* The same in steps, for several numbers of lobes: what they share is done once. between: all of them RBF_FIT_BETWEEN, or none. rbf_fit_begin() returns
 * NULL when out of memory; the incidence must stay. */
typedef struct rbf_fitting rbf_fitting;
rbf_fitting *rbf_fit_begin(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t hold, int between);
int rbf_fit_lobes(rbf_fitting *fitting, uint32_t lobes, rbf_lobes *out, float *error);
float rbf_fit_noise(const rbf_fitting *fitting, const rbf_lobes *lobes); /* what the error of a fit would be by noise alone; -1: out of memory */
void rbf_fit_end(rbf_fitting *fitting);
#endif
