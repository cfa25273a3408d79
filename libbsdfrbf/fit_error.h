/* SPDX-License-Identifier: BSD-3-Clause */
/* How far fits are from the truth, as samples tell that they have not seen. */
#ifndef RBF_FIT_ERROR_H
#define RBF_FIT_ERROR_H
#include "fit.h"
#include "label.h"
#include "trials.h"

/* Relative L1 of fits at the trials (count[b] lobes), and interpolated. by_noise[bases]: how far a fit to every other sample is from the fit to all, which for
 * least squares and independent noise is as far as the latter from the truth. missed[bases]: what there is of other samples beyond noise, as where a peak is
 * narrower than these are apart: that is missed everywhere alike. held_out[bases]: error of a fit to all samples but some against those, noise included;
 * < 0: unknown. Opens an OpenMP region. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_fit_error(const rbf_measured *measured, const rbf_trials *trials, const rbf_fitted *fitted, const float lambertian[3], const uint32_t *count,
	const float *held_out, float *by_noise, float *missed);
#endif
