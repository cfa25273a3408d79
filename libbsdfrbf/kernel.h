/* SPDX-License-Identifier: BSD-3-Clause */
/* Sum of lobes at a direction: the inner loop of everything. */
#ifndef RBF_KERNEL_H
#define RBF_KERNEL_H
#include "model.h"

#define RBF_KERNEL_WIDTH 2 /* in place of channels: the first channel, and as a second one the same with each lobe times its kappa */

/* What is summed, for one set. Channels are those of the first job of a call. */
typedef struct rbf_kernel_job {
	uint32_t blocks;
	const rbf_block *block;
	const rbf_amplitude *amplitude; /* of the first channel; others follow at `stride` */
	size_t stride;
	uint32_t channels;              /* 1, 3 or RBF_KERNEL_WIDTH */
	const rbf_shift *shift[2];      /* residual motion towards two corners, NULL: none */
	float shift_weight[2];
	uint64_t mask;                  /* bit g: group g of `group` blocks is summed */
	uint32_t group;
	float direction[3];
	float weight;                   /* of this set's sum */
} rbf_kernel_job;

/* Energy of a lobe of amplitude 1 over the whole sphere, sr. */
static inline double rbf_lobe_integral(double kappa)
{
	return kappa > 0 ? 2 * RBF_PI / kappa * -expm1(-2 * kappa) : 4 * RBF_PI;
}

/* sum[channels] = sum over the jobs of weight x the sum of amplitude exp(-kappa/2 |direction - centre|^2). */
void rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, float sum[3]);

/* The same in scalar C with libm's exp: the reference for tests. */
void rbf_kernel_reference(const rbf_kernel_job *job, uint32_t jobs, float sum[3]);

/* Compiled from kernel_template.h for each instruction set; chosen by rbf_kernel_sum(). */
void rbf_kernel_generic(const rbf_kernel_job *job, uint32_t jobs, float sum[3]);
void rbf_kernel_avx2(const rbf_kernel_job *job, uint32_t jobs, float sum[3]);
#endif
