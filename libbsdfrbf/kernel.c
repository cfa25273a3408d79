/* SPDX-License-Identifier: BSD-3-Clause */
#include "kernel.h"

static void add_job(const rbf_kernel_job *job, const rbf_kernel_lobes *of, double total[3])
{
	for (uint32_t b = 0; b < job->blocks; b++) {
		if (!(job->mask >> (b / rbf_cull_group(job->blocks)) & 1))
			continue;
		const rbf_block *block = of->block + job->first + b;
		for (int i = 0; i < RBF_LANES; i++) {
			double c[3] = {block->x[i], block->y[i], block->z[i]};
			if (job->motion) {
				for (int n = 0; n < 2; n++)
					if (job->motion->shift[n]) {
						const rbf_shift *s = job->motion->shift[n] + job->start + b;
						c[0] += (double)job->motion->weight[n] * s->x[i];
						c[1] += (double)job->motion->weight[n] * s->y[i];
						c[2] += (double)job->motion->weight[n] * s->z[i];
					}
				const double length = sqrt(c[0]*c[0] + c[1]*c[1] + c[2]*c[2]);
				for (int n = 0; n < 3; n++)
					c[n] /= length;
			}
			double d2 = 0;
			for (int n = 0; n < 3; n++)
				d2 += (c[n] - job->direction[n]) * (c[n] - job->direction[n]);
			const double e = exp(-.5 * block->k[i] * d2);
			for (uint32_t channel = 0; channel < of->channels; channel++)
				total[channel] += job->weight * e * (of->channels != RBF_KERNEL_WIDTH
					? of->amplitude[job->first + b + channel * of->stride].a[i]
					: of->amplitude[job->first + b].a[i] * (channel ? block->k[i] : 1));
		}
	}
}

void rbf_kernel_reference(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	double total[3] = {0, 0, 0};
	for (uint32_t n = 0; n < jobs; n++)
		add_job(job + n, of, total);
	for (uint32_t channel = 0; channel < of->channels; channel++)
		sum[channel] = (float)total[channel];
}

void rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
#if defined(__x86_64__)
	if (rbf_kernel_has_avx512()) {
		rbf_kernel_avx512(job, jobs, of, sum);
		return;
	}
	if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
		rbf_kernel_avx2(job, jobs, of, sum);
		return;
	}
#endif
	rbf_kernel_generic(job, jobs, of, sum);
}
