/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The error that an incidence is likely to have where it was not measured. What was filled errs as what was hidden for a trial did, as many times as it was handed on. Of
 * what no other incidence tells, nothing is known but what there is at the same polar angle, at other azimuths: it may be as dark as the darkest of that, or in the middle,
 * whatever the fit has there.
 */
#ifndef RBF_UNKNOWN_H
#define RBF_UNKNOWN_H
#include "lobes.h"
#include "seen.h"

/* As a share of the incidence's light. risk: the error of what is filled from incidences that were measured there, as a share of its own light. Returns < 0 when out of
 * memory. Thread-safe. */
float rbf_unknown_error(const rbf_seen *seen, const rbf_lobes *lobes, const float lambertian[3], float risk);
#endif
