/* SPDX-License-Identifier: BSD-3-Clause */
/* Where two beams lie on each other, as a mirror's and a retro-reflector's do at normal incidence, what is bright there predicts neither of
 * them. What the neighbours, where they lie apart, have of each frame does. */
#ifndef RBF_SETTLE_H
#define RBF_SETTLE_H
#include "label.h"

enum { RBF_SETTLE_SWEEPS = 2 }; /* when wide: what one incidence shows depends on how its neighbours are settled */

/* Changes the labels of lobes where beams of frames with a share coincide, so that what belongs to each frame there looks as the labelled
 * neighbours predict; arguments as of rbf_label(). wide: also where they are near each other. Opens OpenMP regions. Returns 0, or -1 when out of memory or
 * a process gave up. */
int rbf_settle(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], int wide, float *label, const float share[]);

/* Whether that is the same, wide or not. */
int rbf_settle_alike(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], const float share[]);
#endif
