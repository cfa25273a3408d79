/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice of frames and residual motion by leave-one-incidence-out error. */
#ifndef RBF_CHOOSE_H
#define RBF_CHOOSE_H
#include "left_out.h"

/* The first frames: those of the list that lower the error clearly, one after the other; nothing else is tried. Errors: MEMORY, CANCELLED. */
bsdfrbf_status rbf_choose_first(bsdfrbf_context *context, const rbf_left_out *left_out, double progress_from, double progress_to, rbf_choice *choice);

/* Goes on from these. Learned frames join left_out->fitted->candidate. lambertian: luminance of the Lambertian part (it counts in the denominator).
 * fit_error: of fits against held-out samples, < 0: unknown. Errors: MEMORY, CANCELLED, INTERNAL. */
bsdfrbf_status rbf_choose(bsdfrbf_context *context, const rbf_left_out *left_out, float lambertian, float fit_error, double progress_from,
	double progress_to, rbf_choice *choice);
#endif
