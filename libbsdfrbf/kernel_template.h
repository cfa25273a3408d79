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

/* The mask of the groups that there are; of one block each: `single`. */
static inline __attribute__((always_inline)) uint64_t groups_of(const rbf_kernel_job *job, int single)
{
	const uint32_t group = rbf_cull_group(job->blocks), groups = single ? job->blocks : (job->blocks + group - 1) / group;
	return groups >= 64 ? job->mask : job->mask & (((uint64_t)1 << groups) - 1);
}

/* The common case: one channel, groups of one block. All blocks of all jobs in one loop, since how many a job has cannot be foreseen.
 * `moving` is constant. */
static inline __attribute__((always_inline)) float one_channel(const rbf_kernel_job *job, const rbf_kernel_job *end,
	const rbf_kernel_lobes *of, int moving)
{
	vf total = all(0);
	uint64_t mask = groups_of(job, 1);
	while (1) {
		while (__builtin_expect(!mask, 0)) {
			if (++job == end)
				return across(total);
			mask = groups_of(job, 1);
		}
		const uint32_t b = (uint32_t)__builtin_ctzll(mask);
		const vf e = moving && job->motion ? block_at(job, of, b, 1) : block_at(job, of, b, 0);
		total += load(of->amplitude[job->first + b].a) * job->weight * e;
		mask &= mask - 1;
		const int done = mask == 0;
		job += done;
		if (job == end)
			return across(total);
		mask |= done ? groups_of(job, 1) : 0;
	}
}

/* Adds a job. Inlined with a constant number of channels; the first sum is rounded as one_channel() does. */
static inline __attribute__((always_inline)) void any_channels(const rbf_kernel_job *job, const rbf_kernel_lobes *of, uint32_t channels,
	vf total[3])
{
	const uint32_t group = rbf_cull_group(job->blocks);
	for (uint64_t mask = groups_of(job, 0); mask; mask &= mask - 1) {
		const uint32_t begin = (uint32_t)__builtin_ctzll(mask) * group, end = job->blocks - begin < group ? job->blocks : begin + group;
		for (uint32_t b = begin; b < end; b++) {
			const rbf_amplitude *a = of->amplitude + job->first + b;
			const vf e = job->motion ? block_at(job, of, b, 1) : block_at(job, of, b, 0), first = load(a->a) * job->weight;
			total[0] += first * e;
			if (channels == RBF_KERNEL_WIDTH)
				total[1] += first * load(of->block[job->first + b].k) * e;
			else if (channels == 3) {
				total[1] += load(a[of->stride].a) * job->weight * e;
				total[2] += load(a[2 * of->stride].a) * job->weight * e;
			}
		}
	}
}

void RBF_KERNEL_NAME(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	const rbf_kernel_job *const end = job + jobs;
	int several = of->channels != 1, moving = 0;
	for (uint32_t n = 0; n < jobs; n++) {
		several |= job[n].blocks > RBF_CULL_BITS;
		moving |= job[n].motion != NULL;
	}
	if (!several) {
		sum[0] = !jobs ? 0 : moving ? one_channel(job, end, of, 1) : one_channel(job, end, of, 0);
		return;
	}
	vf total[3] = {{0}, {0}, {0}};
	for (; job < end; job++)
		if (job->blocks)
			switch (of->channels) {
			case 1: any_channels(job, of, 1, total); break;
			case RBF_KERNEL_WIDTH: any_channels(job, of, RBF_KERNEL_WIDTH, total); break;
			default: any_channels(job, of, 3, total);
			}
	for (uint32_t c = 0; c < of->channels; c++)
		sum[c] = across(total[c]);
}
