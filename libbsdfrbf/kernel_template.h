/* SPDX-License-Identifier: BSD-3-Clause */
/* Body of the lobe sum, compiled once per instruction set with RBF_KERNEL_NAME defined. GCC's vector extension maps
 * onto whatever the target has. */
#include "elementary.h"
#include "kernel.h"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi" /* nothing here crosses a file boundary */
#endif

typedef float vf __attribute__((vector_size(32)));
typedef int32_t vi __attribute__((vector_size(32)));
typedef uint32_t vu __attribute__((vector_size(32)));

static inline vf load(const float *p)
{
	vf v;
	memcpy(&v, p, sizeof v);
	return v;
}

static inline vf all(float x)
{
	return (vf){x, x, x, x, x, x, x, x};
}

static inline vf largest(vf a, vf b)
{
#if defined(__AVX__)
	return (vf)__builtin_ia32_maxps256(a, b);
#else
	const vi m = a < b;
	return (vf)((m & (vi)b) | (~m & (vi)a));
#endif
}

/* 2^t for t <= 0, relative error below 3e-7; never below 2^-100, so that no product becomes denormal. */
static inline vf exp2_negative(vf t)
{
	const vf u = largest(t, all(-100));
	const vf shifted = u + 12582912.f; /* 1.5 x 2^23: the nearest whole number is in the low bits, also of what is no number */
	const vf x = u - (shifted - 12582912.f);
	/* in pairs, so that little waits for something else */
	const vf x2 = x * x, low = x * RBF_EXP2_1 + RBF_EXP2_0, middle = x * RBF_EXP2_3 + RBF_EXP2_2;
	const vf p = ((x * RBF_EXP2_5 + RBF_EXP2_4) * x2 + middle) * x2 + low;
	return (vf)((vu)p + ((vu)shifted << 23));
}

/* exp(-kappa/2 |direction - centre|^2), eight lobes. */
static inline vf lobes_at(const float *kappa, vf x, vf y, vf z, vf dx, vf dy, vf dz)
{
	x -= dx;
	y -= dy;
	z -= dz;
	return exp2_negative(load(kappa) * -0.72134752f * (x*x + y*y + z*z)); /* log2(e)/2 */
}

static inline float across(vf t)
{
	return ((t[0] + t[4]) + (t[1] + t[5])) + ((t[2] + t[6]) + (t[3] + t[7]));
}

static inline vf moved_lobes_at(const rbf_kernel_job *job, const rbf_block *block, uint32_t b, vf dx, vf dy, vf dz)
{
	vf x = load(block->x), y = load(block->y), z = load(block->z);
	for (int n = 0; n < 2; n++)
		if (job->motion->shift[n]) {
			const rbf_shift *s = job->motion->shift[n] + job->start + b;
			const float w = job->motion->weight[n];
			x += load(s->x) * w;
			y += load(s->y) * w;
			z += load(s->z) * w;
		}
	const vf q = x*x + y*y + z*z;
	/* 1/sqrt(q), q near 1: a series start and three Newton steps, exact to float for 0.2 < q < 2.5 */
	vf r = largest(1.5f - 0.5f * q, all(.6f));
	r = r * (1.5f - 0.5f * q * r * r);
	r = r * (1.5f - 0.5f * q * r * r);
	r = r * (1.5f - 0.5f * q * r * r);
	return lobes_at(block->k, x * r, y * r, z * r, dx, dy, dz);
}

/* Block b of a job. `moves` is constant. */
static inline __attribute__((always_inline)) vf block_at(const rbf_kernel_job *job, const rbf_kernel_lobes *of, uint32_t b, int moves)
{
	const rbf_block *block = of->block + job->first + b;
	const vf dx = all(job->direction[0]), dy = all(job->direction[1]), dz = all(job->direction[2]);
	return moves ? moved_lobes_at(job, block, b, dx, dy, dz) : lobes_at(block->k, load(block->x), load(block->y), load(block->z), dx, dy, dz);
}

/* Adds block b of a job. `channels` and `moves` are constant. */
static inline __attribute__((always_inline)) void add_block(const rbf_kernel_job *job, const rbf_kernel_lobes *of, uint32_t b,
	uint32_t channels, int moves, vf total[3])
{
	const rbf_amplitude *a = of->amplitude + job->first + b;
	const vf e = block_at(job, of, b, moves), first = load(a->a) * job->weight;
	total[0] += first * e;
	if (channels == RBF_KERNEL_WIDTH)
		total[1] += first * load(of->block[job->first + b].k) * e;
	else if (channels == 3) {
		total[1] += load(a[of->stride].a) * job->weight * e;
		total[2] += load(a[2 * of->stride].a) * job->weight * e;
	}
}

/* The common case: groups of one block, without motion. All blocks of all jobs in one loop, since how many a job has cannot be foreseen; the
 * next job's mask is there before it is needed. `channels` is constant. */
static inline __attribute__((always_inline)) void plain_blocks(const rbf_kernel_job *job, const rbf_kernel_job *end,
	const rbf_kernel_lobes *of, uint32_t channels, vf total[3])
{
	const rbf_kernel_job *const last = end - 1;
	uint64_t mask = job->mask;
	while (1) {
		while (__builtin_expect(!mask, 0)) {
			if (job == last)
				return;
			mask = (++job)->mask;
		}
		const uint64_t coming = job[job != last].mask;
		const uint32_t b = (uint32_t)__builtin_ctzll(mask);
		add_block(job, of, b, channels, 0, total);
		mask &= mask - 1;
		const uint64_t done = mask == 0;
		if (done & (job == last))
			return;
		job += done;
		mask |= coming & -done;
	}
}

/* Any groups, with motion or without. `channels` is constant. */
static inline __attribute__((always_inline)) void any_blocks(const rbf_kernel_job *job, const rbf_kernel_job *end,
	const rbf_kernel_lobes *of, uint32_t channels, vf total[3])
{
	for (; job < end; job++) {
		const uint32_t group = rbf_cull_group(job->blocks);
		for (uint64_t mask = job->mask; mask; mask &= mask - 1) {
			const uint32_t begin = (uint32_t)__builtin_ctzll(mask) * group, last = job->blocks - begin < group ? job->blocks : begin + group;
			for (uint32_t b = begin; b < last; b++)
				if (job->motion)
					add_block(job, of, b, channels, 1, total);
				else
					add_block(job, of, b, channels, 0, total);
		}
	}
}

static inline __attribute__((always_inline)) void add_jobs(const rbf_kernel_job *job, const rbf_kernel_job *end, const rbf_kernel_lobes *of,
	uint32_t channels, float sum[3])
{
	vf total[3] = {{0}, {0}, {0}};
	if (of->plain)
		plain_blocks(job, end, of, channels, total);
	else
		any_blocks(job, end, of, channels, total);
	for (uint32_t c = 0; c < channels; c++)
		sum[c] = across(total[c]);
}

void RBF_KERNEL_NAME(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	for (uint32_t c = 0; !jobs && c < of->channels; c++)
		sum[c] = 0;
	if (!jobs)
		return;
	switch (of->channels) {
	case 1: add_jobs(job, job + jobs, of, 1, sum); break;
	case RBF_KERNEL_WIDTH: add_jobs(job, job + jobs, of, RBF_KERNEL_WIDTH, sum); break;
	default: add_jobs(job, job + jobs, of, 3, sum);
	}
}
