/* SPDX-License-Identifier: BSD-3-Clause */
/* Compiled with -mavx2 -mfma. */
#if defined(__AVX2__) && defined(__FMA__)
#define RBF_KERNEL_NAME rbf_kernel_avx2
#include "kernel_template.h"
#else
#include "kernel.h"
void rbf_kernel_avx2(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	rbf_kernel_generic(job, jobs, of, sum);
}
#endif
