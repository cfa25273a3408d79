/* SPDX-License-Identifier: BSD-3-Clause */
/* Body of the lobe sum, compiled once per instruction set with RBF_KERNEL_NAME defined. GCC's vector extension maps
 * onto whatever the target has. */
#include "kernel.h"
#include <string.h>

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

static inline vf select_less(vf a, vf b, vf yes, vf no)
{
	const vi m = a < b;
	return (vf)((m & (vi)yes) | (~m & (vi)no));
}

/* 2^t for t <= 0, relative error below 3e-7; exactly 0 below 2^-126. */
static inline vf exp2_negative(vf t)
{
	const vf low = {-126, -126, -126, -126, -126, -126, -126, -126};
	const vf zero = {0};
	const vf u = select_less(t, low, low, t);
	/* floor for u in [-126, 0]: shift into positive range so that truncation rounds down */
	/* unsigned, so that it wraps where a damaged file has a negative or no number */
	const vu n = (vu)__builtin_convertvector(u + 127.f, vi) - 127;
	const vf x = u - __builtin_convertvector((vi)n, vf);
	/* minimax polynomial of 2^x on [0, 1], degree 6 (Remez) */
	vf p = x * 2.1702255e-4f + 1.2439688e-3f;
	p = p * x + 9.6788317e-3f;
	p = p * x + 5.5483342e-2f;
	p = p * x + 2.4022984e-1f;
	p = p * x + 6.9314698e-1f;
	p = p * x + 1.0000000f;
	const vf r = (vf)((vu)p + (n << 23));
	return select_less(t, low, zero, r);
}

void RBF_KERNEL_NAME(const rbf_kernel_job *job, float sum[3])
{
	const float dx = job->direction[0], dy = job->direction[1], dz = job->direction[2];
	const uint32_t blocks = job->blocks, group = job->group;
	vf total[3] = {{0}, {0}, {0}};
	uint64_t mask = job->mask;
	while (mask) {
		const uint32_t g = (uint32_t)__builtin_ctzll(mask);
		mask &= mask - 1;
		const uint32_t begin = g * group;
		if (begin >= blocks)
			break;
		const uint32_t end = begin + group < blocks ? begin + group : blocks;
		for (uint32_t b = begin; b < end; b++) {
			const rbf_block *block = job->block + b;
			vf x = load(block->x), y = load(block->y), z = load(block->z);
			vf d2;
			if (job->shift[0] || job->shift[1]) {
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
				vf r = 1.5f - 0.5f * q;
				const vf low = {.6f, .6f, .6f, .6f, .6f, .6f, .6f, .6f};
				r = select_less(r, low, low, r);
				r = r * (1.5f - 0.5f * q * r * r);
				r = r * (1.5f - 0.5f * q * r * r);
				r = r * (1.5f - 0.5f * q * r * r);
				x *= r;
				y *= r;
				z *= r;
			}
			x -= dx;
			y -= dy;
			z -= dz;
			d2 = x*x + y*y + z*z;
			const vf e = exp2_negative(load(block->k) * d2 * -0.72134752f); /* log2(e)/2 */
			const rbf_amplitude *a = job->amplitude + b;
			total[0] += e * load(a->a);
			if (job->channels == 3) {
				total[1] += e * load(a[job->stride].a);
				total[2] += e * load(a[2 * job->stride].a);
			}
		}
	}
	for (uint32_t c = 0; c < job->channels; c++) {
		const vf t = total[c];
		sum[c] = ((t[0] + t[4]) + (t[1] + t[5])) + ((t[2] + t[6]) + (t[3] + t[7]));
	}
}
