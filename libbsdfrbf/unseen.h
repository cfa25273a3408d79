/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Exitant directions in which incidences were not measured, beyond a goniophotometer's reach or in its shadow, are filled from the incidences
 * around, if that is what would have told best of the measured directions next to them.
 */
#ifndef RBF_UNSEEN_H
#define RBF_UNSEEN_H
#include "left_out.h"
#include "measure.h"

typedef struct rbf_unseen rbf_unseen;

/* The measured samples, to borrow. NULL: out of memory. Opens an OpenMP region. */
rbf_unseen *rbf_unseen_begin(const rbf_measured *measured);
void rbf_unseen_end(rbf_unseen *unseen);

/* The largest share of the hemisphere that an incidence was not measured in; 0: what is missing is too little to be filled. */
float rbf_unseen_most(const rbf_unseen *unseen);

/* How many incidences lack a quarter of what is within 60 degrees of the normal, where devices reach, and of these the first; those that were measured in one plane
 * alone do not count. */
size_t rbf_unseen_wide(const rbf_unseen *unseen, size_t *first);

/* Fills from fits and labels so far, in place of what was filled before: the next time it comes farther. Sets *filled; 0: it would not help.
 * lambertian, lobes: as for the fits. Opens OpenMP regions. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_unseen_fill(rbf_unseen *unseen, const rbf_fitted *fitted, const rbf_choice *choice, const float lambertian[3], const uint32_t *lobes,
	int *filled);

/* The error that each incidence is likely to have where it was not measured, as a share of its light. Opens an OpenMP region. Returns 0, or -1 when
 * out of memory. */
int rbf_unseen_doubt(const rbf_unseen *unseen, const rbf_fitted *fitted, const float lambertian[3], float *error);

/* What is still unknown within 60 degrees of the normal: the mean share. Opens an OpenMP region. */
float rbf_unseen_left(const rbf_unseen *unseen);

/* An incidence with what was filled, or as it was measured; to borrow. */
const rbf_incidence *rbf_unseen_incidence(const rbf_unseen *unseen, size_t base);
#endif
