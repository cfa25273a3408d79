/* SPDX-License-Identifier: BSD-3-Clause */
/* Does a material have a symmetry that its scan plan does not claim? */
#ifndef RBF_IMAGES_H
#define RBF_IMAGES_H
#include "left_out.h"

/* The highest symmetry under which images of incidences are what was measured around these, as far as interpolation and noise let that be seen; or the one that
 * they are meshed under. left_out: incidences that are; choice: of first frames (choose.h), with its errors for these; scatter[bases]: error of the fits. *difference: mean relative L1 of these images, if it is another.
 * Opens OpenMP regions. Errors: MEMORY. */
bsdfrbf_status rbf_images_find(bsdfrbf_context *context, const rbf_left_out *left_out, float lambertian, const rbf_choice *choice, const float *scatter,
	rbf_symmetry *found, float *difference);
#endif
