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

static inline vf moved_lobes_at(const rbf_kernel_job *job, uint32_t b, vf dx, vf dy, vf dz)
{
	const rbf_block *block = job->block + b;
	vf x = load(block->x), y = load(block->y), z = load(block->z);
	for (int n = 0; n < 2; n++)
		if (job->shift[n]) {
			const rbf_shift *s = job->shift[n] + b;
			const float w = job->shift_weight[n];
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

/* Adds the blocks from `begin` to `end`. */
static inline void add_blocks(const rbf_kernel_job *job, uint32_t begin, uint32_t end, uint32_t channels, vf dx, vf dy, vf dz, vf total[3])
{
	const int moves = job->shift[0] || job->shift[1];
	for (uint32_t b = begin; b < end; b++) {
		const rbf_block *block = job->block + b;
		const rbf_amplitude *a = job->amplitude + b;
		const vf e = moves ? moved_lobes_at(job, b, dx, dy, dz)
			: lobes_at(block->k, load(block->x), load(block->y), load(block->z), dx, dy, dz);
		total[0] += e * load(a->a);
		if (channels == RBF_KERNEL_WIDTH)
			total[1] += e * (load(a->a) * load(block->k)); /* so that the first sum is rounded as without a second */
		else if (channels == 3) {
			total[1] += e * load(a[job->stride].a);
			total[2] += e * load(a[2 * job->stride].a);
		}
	}
}

/* The mask of the groups that there are. */
static inline uint64_t groups_of(const rbf_kernel_job *job, uint32_t groups)
{
	return groups >= 64 ? job->mask : job->mask & (((uint64_t)1 << groups) - 1);
}

/* The common case, one short loop: one channel, groups of one block. `moves` is constant. */
static inline __attribute__((always_inline)) vf one_channel(const rbf_kernel_job *job, int moves)
{
	const vf dx = all(job->direction[0]), dy = all(job->direction[1]), dz = all(job->direction[2]);
	const rbf_block *block = job->block;
	const rbf_amplitude *amplitude = job->amplitude;
	vf total = all(0);
	for (uint64_t mask = groups_of(job, job->blocks); mask; mask &= mask - 1) {
		const uint32_t b = (uint32_t)__builtin_ctzll(mask);
		total += load(amplitude[b].a) * (moves ? moved_lobes_at(job, b, dx, dy, dz)
			: lobes_at(block[b].k, load(block[b].x), load(block[b].y), load(block[b].z), dx, dy, dz));
	}
	return total;
}

/* Inlined with a constant number of channels. */
static inline __attribute__((always_inline)) void any_channels(const rbf_kernel_job *job, uint32_t channels, vf all_total[3])
{
	const vf dx = all(job->direction[0]), dy = all(job->direction[1]), dz = all(job->direction[2]);
	vf total[3] = {{0}, {0}, {0}};
	for (uint64_t mask = groups_of(job, (job->blocks + job->group - 1) / job->group); mask; mask &= mask - 1) {
		const uint32_t begin = (uint32_t)__builtin_ctzll(mask) * job->group;
		add_blocks(job, begin, job->blocks - begin < job->group ? job->blocks : begin + job->group, channels, dx, dy, dz, total);
	}
	for (uint32_t n = 0; n < channels; n++)
		all_total[n] += total[n] * job->weight;
}

static inline float across(vf t)
{
	return ((t[0] + t[4]) + (t[1] + t[5])) + ((t[2] + t[6]) + (t[3] + t[7]));
}

void RBF_KERNEL_NAME(const rbf_kernel_job *job, uint32_t jobs, float sum[3])
{
	const rbf_kernel_job *const end = job + jobs;
	if (!jobs)
		return;
	const uint32_t channels = job->channels;
	if (channels == 1) {
		vf total = all(0);
		for (; job < end && job->group <= 1; job++)
			total += (job->shift[0] || job->shift[1] ? one_channel(job, 1) : one_channel(job, 0)) * job->weight;
		sum[0] = across(total);
		if (job == end)
			return;
	} else
		for (uint32_t c = 0; c < channels; c++)
			sum[c] = 0;
	vf total[3] = {{0}, {0}, {0}};
	for (; job < end; job++)
		if (job->blocks)
			switch (channels) {
			case 1: any_channels(job, 1, total); break;
			case RBF_KERNEL_WIDTH: any_channels(job, RBF_KERNEL_WIDTH, total); break;
			default: any_channels(job, 3, total);
			}
	for (uint32_t c = 0; c < channels; c++)
		sum[c] += across(total[c]);
}
