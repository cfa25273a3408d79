/* SPDX-License-Identifier: BSD-3-Clause */
/* Directions that were measured more than once at one incidence: the normal, once for every azimuth of a table, or a scan that was repeated. */
#ifndef RBF_REPEATED_H
#define RBF_REPEATED_H
#include "measure.h"

/* Sets `joined` to a component's incidences with one sample, the mean, for each such direction, in the place of the first: borrowed where none is repeated. To be
 * released by rbf_faults_release() in any case, as long as `all` is there. Returns 0, or -1 when out of memory. Opens an OpenMP region. */
int rbf_repeated_join(const rbf_measured *all, int channels, rbf_measured *joined);
#endif
