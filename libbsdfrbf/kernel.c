/* SPDX-License-Identifier: BSD-3-Clause */
#include "kernel.h"

static void add_job(const rbf_kernel_job *job, uint32_t channels, double total[3])
{
	for (uint32_t b = 0; b < job->blocks; b++) {
		if (!(job->mask >> (b / job->group) & 1))
			continue;
		const rbf_block *block = job->block + b;
		for (int i = 0; i < RBF_LANES; i++) {
			double c[3] = {block->x[i], block->y[i], block->z[i]};
			if (job->shift[0] || job->shift[1]) {
				for (int n = 0; n < 2; n++)
					if (job->shift[n]) {
						c[0] += (double)job->shift_weight[n] * job->shift[n][b].x[i];
						c[1] += (double)job->shift_weight[n] * job->shift[n][b].y[i];
						c[2] += (double)job->shift_weight[n] * job->shift[n][b].z[i];
					}
				const double length = sqrt(c[0]*c[0] + c[1]*c[1] + c[2]*c[2]);
				for (int n = 0; n < 3; n++)
					c[n] /= length;
			}
			double d2 = 0;
			for (int n = 0; n < 3; n++)
				d2 += (c[n] - job->direction[n]) * (c[n] - job->direction[n]);
			const double e = exp(-.5 * block->k[i] * d2);
			for (uint32_t channel = 0; channel < channels; channel++)
				total[channel] += job->weight * e * (channels != RBF_KERNEL_WIDTH ? job->amplitude[b + channel * job->stride].a[i]
					: job->amplitude[b].a[i] * (channel ? block->k[i] : 1));
		}
	}
}

void rbf_kernel_reference(const rbf_kernel_job *job, uint32_t jobs, float sum[3])
{
	double total[3] = {0, 0, 0};
	for (uint32_t n = 0; n < jobs; n++)
		add_job(job + n, job->channels, total);
	for (uint32_t channel = 0; jobs && channel < job->channels; channel++)
		sum[channel] = (float)total[channel];
}

void rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, float sum[3])
{
#if defined(__x86_64__)
	if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
		rbf_kernel_avx2(job, jobs, sum);
		return;
	}
#endif
	rbf_kernel_generic(job, jobs, sum);
}
