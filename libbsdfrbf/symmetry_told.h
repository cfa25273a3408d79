/* SPDX-License-Identifier: BSD-3-Clause */
/* A component's symmetry, as the data tell it beyond the azimuths of its scan plan. Errors of all: MEMORY, and those of rbf_job_fit() and
 * rbf_frames_choose() where they do that again. They open OpenMP regions. */
#ifndef RBF_SYMMETRY_TOLD_H
#define RBF_SYMMETRY_TOLD_H
#include "job.h"

/* What the azimuths say of the symmetry, the data may contradict: then the other one that these allow is taken, if the data agree with that;
 * else the user is told. */
bsdfrbf_status rbf_told_settle(bsdfrbf_context *context, rbf_job *job, rbf_component *component);

/* Incidences of an isotropic material that were measured at several azimuths, and compared, are fitted as one; and what was measured on one side of a
 * mirror plane alone counts on both (mirrored.h). */
bsdfrbf_status rbf_told_join(bsdfrbf_context *context, double progress, rbf_job *job, rbf_component *component);

/* Sets *found if other azimuths, turned about the normal, tell as much of an incidence as noise allows, or far more than its neighbours do: then the
 * material is isotropic, whatever the azimuths say. */
bsdfrbf_status rbf_told_isotropic(bsdfrbf_context *context, rbf_job *job, const rbf_component *component, int *found);

enum { RBF_TOLD_LATE = 2 };

/* To be asked of a component that is done: sets *found to RBF_TOLD_LATE if interpolation between its few azimuths errs by more than it would to take these as one. */
bsdfrbf_status rbf_told_alike(bsdfrbf_context *context, const rbf_job *job, const rbf_component *component, int *found);

/* What the azimuths say of the symmetry may be less than the data show: measured all round, or over half a circle. To be asked of a job that has its
 * first frames, and becomes another one, which has them, too. */
bsdfrbf_status rbf_told_images(bsdfrbf_context *context, double from, double to, rbf_job *job, rbf_component *component);
#endif
