/* SPDX-License-Identifier: BSD-3-Clause */
/* Frames of one component's fits, and what other incidences tell by them of what was not measured. */
#ifndef RBF_FRAMES_H
#define RBF_FRAMES_H
#include "job.h"

/* Chooses the frames of a job that has its fits, mesh and labels. component: with the Lambertian part. Progress runs over `from` to `to`. Errors:
 * MEMORY, CANCELLED. Opens OpenMP regions. */
bsdfrbf_status rbf_frames_choose(bsdfrbf_context *context, double from, double to, rbf_job *job, const rbf_component *component);

/* The same in two steps, between which others may ask of the first frames (choose.h). */
bsdfrbf_status rbf_frames_first(bsdfrbf_context *context, double from, double to, rbf_job *job, const rbf_component *component);
bsdfrbf_status rbf_frames_rest(bsdfrbf_context *context, double from, double to, rbf_job *job, const rbf_component *component);

/* Fills what was not measured (unseen.h) and fits again, which tells what is still farther; in the end frames are chosen anew. Errors and regions as
 * above; warns where much is missing, if asked to tell. */
bsdfrbf_status rbf_frames_fill(bsdfrbf_context *context, int tell, double from, double to, rbf_job *job, const rbf_component *component);
#endif
