/* SPDX-License-Identifier: BSD-3-Clause */
/* A coloured material as a grey one, for whoever asks where light goes: what only one channel has counts as much as what all have. */
#ifndef RBF_GREY_H
#define RBF_GREY_H
#include "label.h"

/* What the fits had before, and by how much each channel counts: such that all send as much light, together what luminance says. */
typedef struct rbf_grey {
	uint32_t channels;
	rbf_lobes *lobes;   /* [bases]; NULL: nothing was changed */
	float mix[3];
} rbf_grey;

/* Fits of three channels become fits of one, those of one stay. labels (label.h) are to be renewed. Returns 0, or -1 when out of memory, and
 * nothing was changed. */
int rbf_grey_begin(rbf_fitted *fitted, rbf_grey *grey);

/* As they were. */
void rbf_grey_end(rbf_fitted *fitted, rbf_grey *grey);

/* One number for three. */
float rbf_grey_of(const rbf_grey *grey, const float value[3]);
#endif
