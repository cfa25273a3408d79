/* SPDX-License-Identifier: BSD-3-Clause */
/* What one component's build found that whoever measured should know. */
#ifndef RBF_TELL_H
#define RBF_TELL_H
#include "job.h"

/* Warns of incidences most of whose light stands on single samples; notes them in job->coarse, and how far their light is a guess in job->missed. info: with
 * direction and dhr. Errors: MEMORY. */
bsdfrbf_status rbf_tell_coarse(bsdfrbf_context *context, rbf_job *job, const rbf_base_info *info);

/* Warns of what else there is; after that. Errors: MEMORY. */
bsdfrbf_status rbf_tell(bsdfrbf_context *context, const rbf_job *job, const rbf_component *component);
#endif
