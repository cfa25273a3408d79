/* SPDX-License-Identifier: BSD-3-Clause */
/* The error to expect between measured incidences. */
#ifndef RBF_EXPECT_H
#define RBF_EXPECT_H
#include "fit.h"
#include "label.h"
#include "trials.h"

/* Error of the fits themselves, relative L1, by incidence: how far a fit to every other sample (count[b] lobes) is from the fit to all, which for
 * least squares and independent noise is as far as the latter from the truth. Found at the trials, and interpolated. Opens OpenMP
 * regions. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_expect_fit(const rbf_measured *measured, const rbf_trials *trials, const rbf_fitted *fitted, const float lambertian[3],
	const uint32_t *count, float *fit);

/* Mean relative L1 to expect in the triangles around each incidence, expected[bases], from the errors with which incidences were
 * predicted when left out (< 0: not known) and those of the fits; 0 where nothing is known. component: made of these fits. Opens an OpenMP
 * region. Errors: as rbf_mesh_build(). */
bsdfrbf_status rbf_expect(bsdfrbf_context *context, const rbf_fitted *fitted, const rbf_component *component, const float *left_out,
	const float *fit, float *expected);

/* Mean over the mesh by solid angle; < 0: unknown. */
float rbf_expected_mean(const rbf_component *component);
#endif
