/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice of frames and residual motion by leave-one-incidence-out error. */
#ifndef RBF_CHOOSE_H
#define RBF_CHOOSE_H
#include "left_out.h"

/* Learned frames join fitted->candidate. lambertian: luminance of the Lambertian part (it counts in the denominator). fit_error: of fits against held-out samples, < 0: unknown. Errors: MEMORY, CANCELLED, INTERNAL. */
bsdfrbf_status rbf_choose(bsdfrbf_context *context, rbf_fitted *fitted, float lambertian, float fit_error, double progress_from,
	double progress_to, rbf_choice *choice);
#endif
