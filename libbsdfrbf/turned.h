/* SPDX-License-Identifier: BSD-3-Clause */
/* Measurements of an isotropic material, turned about the normal to one azimuth. */
#ifndef RBF_TURNED_H
#define RBF_TURNED_H
#include "measure.h"

/* Turns all incidences to azimuth 0: measured gets its own copies of samples and lobes, to be freed by rbf_turned_free(); direction:
 * count x 3, follows. Returns 0, or -1 when out of memory; rbf_turned_free() in either case. */
int rbf_turn(rbf_measured *measured, int channels, double *direction);
/* The same copies of what is not turned. */
int rbf_turned_copy(rbf_measured *measured, int channels);
void rbf_turned_free(rbf_measured *measured);

/* Joins the samples of those that are one incidence now; directions follow. Returns how many are gone, or -1 when out of memory. */
int rbf_turned_join(rbf_measured *turned, int channels, double *direction);
#endif
