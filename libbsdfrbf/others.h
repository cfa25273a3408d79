/* SPDX-License-Identifier: BSD-3-Clause */
/* Other readings of the same measurement, one of which may predict incidences better that are left out. */
#ifndef RBF_OTHERS_H
#define RBF_OTHERS_H
#include "job.h"

/* Where samples were taken along lines, whether it is smooth or dark between these, and whether other incidences tell, is told by how well each way
 * predicts incidences that are left out; likewise, of an isotropic material, whether light falls off as in the plane of incidence, and how. Of any other,
 * measured in planes of incidence alone, planes at other azimuths may tell. The job becomes what is best. progress and errors: as of
 * rbf_job_fit() and rbf_frames_choose(). */
bsdfrbf_status rbf_others_try(bsdfrbf_context *context, double from, double to, rbf_job *job, rbf_component *component);
#endif
