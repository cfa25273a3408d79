/* SPDX-License-Identifier: BSD-3-Clause */
/* The error to expect between measured incidences. */
#ifndef RBF_EXPECT_H
#define RBF_EXPECT_H
#include "label.h"

/* Relative L1 by incidence: with which each was predicted when left out (< 0: not known), and of the fits (fit_error.h). */
typedef struct rbf_errors { const float *left_out, *by_noise, *missed; } rbf_errors;

/* Mean relative L1 to expect in the elements around each incidence, expected[bases]; 0 where nothing is known. component: made of these fits, and has
 * base_info->dhr. Opens an OpenMP region. Errors: as rbf_mesh_build(). */
bsdfrbf_status rbf_expect(bsdfrbf_context *context, const rbf_fitted *fitted, const rbf_component *component, const rbf_errors *errors, float *expected);

/* Mean over the mesh by solid angle; < 0: unknown. */
float rbf_expected_mean(const rbf_component *component);
#endif
