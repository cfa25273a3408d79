/* SPDX-License-Identifier: BSD-3-Clause */
/* Sum of lobes at a direction: the inner loop of everything. */
#ifndef RBF_KERNEL_H
#define RBF_KERNEL_H
#include "cull.h"

#define RBF_KERNEL_WIDTH 2 /* in place of channels: the first channel, and as a second one the same with each lobe times its kappa */

/* Residual motion of a corner's lobes towards two others, NULL: none. */
typedef struct rbf_motion {
	const rbf_shift *shift[2];
	float weight[2];
} rbf_motion;

/* What is summed, for one set. */
typedef struct rbf_kernel_job {
	float direction[3];
	float weight;                   /* of this set's sum */
	uint64_t mask;                  /* bit g: group g of rbf_cull_group(blocks) blocks is summed; none but rbf_cull_all(blocks) */
	uint32_t first, blocks;
	const rbf_motion *motion;       /* NULL: none */
	uint32_t start;                 /* of the set in the arrays of shifts */
} rbf_kernel_job;

/* The same for all jobs of a sum. */
typedef struct rbf_kernel_lobes {
	const rbf_block *block;
	const rbf_amplitude *amplitude; /* of the first channel */
	size_t stride;                  /* from one channel's amplitudes to the next one's */
	uint32_t channels;              /* 1, 3 or RBF_KERNEL_WIDTH */
	int plain;                      /* 1: no job has more than RBF_CULL_BITS blocks, or motion */
} rbf_kernel_lobes;

/* Energy of a lobe of amplitude 1 over the whole sphere, sr. */
static inline double rbf_lobe_integral(double kappa)
{
	return kappa > 0 ? 2 * RBF_PI / kappa * -expm1(-2 * kappa) : 4 * RBF_PI;
}

/* sum[channels] = sum over the jobs of weight x the sum of amplitude exp(-kappa/2 |direction - centre|^2). */
void rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);

/* The same in scalar C with libm's exp: the reference for tests. */
void rbf_kernel_reference(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);

/* Compiled from kernel_template.h for each instruction set; chosen by rbf_kernel_sum(). */
void rbf_kernel_generic(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);
void rbf_kernel_avx2(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);

/* Whether this machine has it, and does not slow down for it (Ice Lake, Zen 4 and later: they have VBMI2). */
static inline int rbf_kernel_has_avx512(void)
{
#if defined(__x86_64__)
	return __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vbmi2");
#else
	return 0;
#endif
}
void rbf_kernel_avx512(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);

/* The jobs of one frame of a component for four sums: corner k of sum n at place 4k + n. All sets are of at most RBF_CULL_BITS blocks. The last four
 * places have no mask and no weight, but a first block that exists if any does. */
#define RBF_KERNEL_SUMS 4
typedef struct rbf_kernel_frame {
	float direction[16][4];         /* and the weight */
	uint64_t mask[16];
	uint32_t first[16];
} rbf_kernel_frame;

/* Sums over all frames; of->plain is 1. Not for RBF_KERNEL_WIDTH. */
void rbf_kernel_frames_avx512(const rbf_kernel_frame *frame, uint32_t frames, const rbf_kernel_lobes *of, float sum[RBF_KERNEL_SUMS][3]);
#endif
