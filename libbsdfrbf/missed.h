/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a fit is too low at several neighbouring samples, by more than noise. */
#ifndef RBF_MISSED_H
#define RBF_MISSED_H
#include "neighbours.h"

/* Samples and how a fit meets them. */
typedef struct rbf_misses {
	const rbf_tree *tree;
	const uint32_t (*near)[RBF_NEAR]; /* [tree->count]; that tell whether a sample is missed by chance */
	const float *miss;       /* what the fit lacks, over `total`: negative where it is too high */
	const float *total;      /* > 0: what noise is in proportion to */
	const uint8_t *outlier;  /* 1: does not count */
	float spread;            /* of `miss` by noise */
} rbf_misses;

/* A lobe that would mend one. */
typedef struct rbf_missed {
	uint32_t sample; /* its centre */
	float kappa, gain; /* gain: by how many variances the squares of the misses fall */
} rbf_missed;

/* The at most `most` ones of largest gain; sigma: least and largest of a lobe. Returns how many, or -1 when out of memory. */
int rbf_missed_find(const rbf_misses *misses, const double sigma[2], int most, rbf_missed *found);
#endif
