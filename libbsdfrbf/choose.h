/* SPDX-License-Identifier: BSD-3-Clause */
/* Choice of frames and residual motion by leave-one-incidence-out error. */
#ifndef RBF_CHOOSE_H
#define RBF_CHOOSE_H
#include "label.h"

typedef struct rbf_choice {
	uint32_t frames, frame[RBF_MAX_FRAMES]; /* indices of candidates */
	float share[RBF_MAX_FRAMES];
	rbf_belief belief; /* that labels were made with */
	float *label;      /* as from rbf_label(); owned */
	float cap;         /* of residual motion (advect.h); 0: none */
	float error;       /* mean leave-one-out L1, < 0: could not be measured */
	float *base_error; /* [bases], < 0: not measured; owned */
} rbf_choice;

/* Learned frames join fitted->candidate. lambertian: luminance of the Lambertian part (it counts in the denominator). fit_error: of fits against held-out samples, < 0: unknown. Errors: MEMORY, CANCELLED, INTERNAL. */
bsdfrbf_status rbf_choose(bsdfrbf_context *context, rbf_fitted *fitted, float lambertian, float fit_error, double progress_from,
	double progress_to, rbf_choice *choice);
void rbf_choice_free(rbf_choice *choice);
#endif
