/* SPDX-License-Identifier: BSD-3-Clause */
/* Lobes for narrow peaks. */
#ifndef RBF_PEAKS_H
#define RBF_PEAKS_H
#include "neighbours.h"

enum { RBF_PEAKS_MOST = 96 };

typedef struct rbf_peaks_samples {
	const rbf_tree *tree;
	const uint32_t (*near)[RBF_NEAR];
	const float *level, *smooth; /* the signal, and the same without noise */
	float floor;                 /* lower than this there are no peaks */
} rbf_peaks_samples;

/* sigma: least and largest of a lobe. Writes at most RBF_PEAKS_MOST lobes; returns how many. */
uint32_t rbf_peaks_find(const rbf_peaks_samples *samples, const double sigma[2], float (*centre)[3], float *kappa);
#endif
