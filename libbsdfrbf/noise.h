/* SPDX-License-Identifier: BSD-3-Clause */
/* How much of what a fit misses of samples is their noise. */
#ifndef RBF_NOISE_H
#define RBF_NOISE_H

/* A sample: light by the fit; as measured; the solid angle it stands for, up to a common factor; what the fit misses of it. */
typedef struct rbf_noisy {
	double light, truth, area, miss;
} rbf_noisy;

/* Relative L1 of noise. Sorts the list. */
double rbf_noise_of(int count, rbf_noisy list[]);
#endif
