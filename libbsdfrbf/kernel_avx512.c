/* SPDX-License-Identifier: BSD-3-Clause */
/* Compiled for AVX-512: blocks two at a time, of whichever jobs. Motion and groups of blocks are left to the kernel for AVX2. */
#include "kernel.h"

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__)
#include "elementary.h"

#include <immintrin.h>

/* Where the blocks of some jobs are met, one after the other. */
typedef struct walk {
	const rbf_kernel_job *job, *last;
	uint64_t mask;      /* of blocks that are left of the job; 0: of all jobs */
} walk;

static inline __attribute__((always_inline)) void skip_empty(walk *w)
{
	while (__builtin_expect(!w->mask, 0) && w->job != w->last)
		w->mask = (++w->job)->mask;
}

/* The next block, if there is one, and goes on to the one after it. Which job has it cannot be foreseen: nothing branches on that. */
static inline __attribute__((always_inline)) uint32_t next_block(walk *w, const rbf_kernel_job **job)
{
	const uint64_t coming = w->job != w->last ? w->job[1].mask : 0;
	const uint32_t block = w->job->first + (uint32_t)__builtin_ctzll(w->mask);
	*job = w->job;
	w->mask &= w->mask - 1;
	const uint64_t done = w->mask == 0;
	w->job += done & (w->job != w->last);
	w->mask |= coming & -done;
	skip_empty(w);
	return block;
}

static inline __m512 both(const float *low, const float *high)
{
	return _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(low)), _mm256_loadu_ps(high), 1);
}

static inline __m512 each(float low, float high)
{
	return _mm512_mask_broadcastss_ps(_mm512_set1_ps(low), 0xff00, _mm_set_ss(high));
}

/* As exp2_negative() of kernel_template.h. */
static inline __m512 exp2_negative(__m512 t)
{
	const __m512 u = _mm512_max_ps(t, _mm512_set1_ps(-100)), magic = _mm512_set1_ps(12582912.f), shifted = _mm512_add_ps(u, magic);
	const __m512 x = _mm512_sub_ps(u, _mm512_sub_ps(shifted, magic)), x2 = _mm512_mul_ps(x, x);
	const __m512 low = _mm512_fmadd_ps(x, _mm512_set1_ps(RBF_EXP2_1), _mm512_set1_ps(RBF_EXP2_0));
	const __m512 middle = _mm512_fmadd_ps(x, _mm512_set1_ps(RBF_EXP2_3), _mm512_set1_ps(RBF_EXP2_2));
	const __m512 high = _mm512_fmadd_ps(x, _mm512_set1_ps(RBF_EXP2_5), _mm512_set1_ps(RBF_EXP2_4));
	const __m512 p = _mm512_fmadd_ps(_mm512_fmadd_ps(high, x2, middle), x2, low);
	return _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(p), _mm512_slli_epi32(_mm512_castps_si512(shifted), 23)));
}

/* `channels` is constant. */
static inline __attribute__((always_inline)) void add_jobs(walk w, const rbf_kernel_lobes *of, uint32_t channels, float sum[3])
{
	__m512 total[3] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
	while (w.mask) {
		const rbf_kernel_job *p, *q;
		const uint32_t a = next_block(&w, &p);
		uint32_t b = a;
		float weight = 0;
		q = p;
		if (w.mask) { /* else the last one is alone */
			b = next_block(&w, &q);
			weight = q->weight;
		}
		const rbf_block *k = of->block + a, *l = of->block + b;
		const __m512 x = _mm512_sub_ps(both(k->x, l->x), each(p->direction[0], q->direction[0]));
		const __m512 y = _mm512_sub_ps(both(k->y, l->y), each(p->direction[1], q->direction[1]));
		const __m512 z = _mm512_sub_ps(both(k->z, l->z), each(p->direction[2], q->direction[2]));
		const __m512 square = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x))), kappa = both(k->k, l->k);
		const __m512 e = _mm512_mul_ps(exp2_negative(_mm512_mul_ps(_mm512_mul_ps(kappa, _mm512_set1_ps(-.72134752f)), square)),
			each(p->weight, weight));
		const __m512 amplitude = both(of->amplitude[a].a, of->amplitude[b].a);
		total[0] = _mm512_fmadd_ps(e, amplitude, total[0]);
		if (channels == RBF_KERNEL_WIDTH)
			total[1] = _mm512_fmadd_ps(e, _mm512_mul_ps(amplitude, kappa), total[1]);
		for (uint32_t c = 1; channels == 3 && c < 3; c++)
			total[c] = _mm512_fmadd_ps(e, both(of->amplitude[c * of->stride + a].a, of->amplitude[c * of->stride + b].a), total[c]);
	}
	for (uint32_t c = 0; c < channels; c++)
		sum[c] = _mm512_reduce_add_ps(total[c]);
}

void rbf_kernel_avx512(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	if (!jobs || !of->plain) {
		rbf_kernel_avx2(job, jobs, of, sum);
		return;
	}
	walk w = {job, job + jobs - 1, job->mask};
	skip_empty(&w);
	switch (of->channels) {
	case 1: add_jobs(w, of, 1, sum); break;
	case RBF_KERNEL_WIDTH: add_jobs(w, of, RBF_KERNEL_WIDTH, sum); break;
	default: add_jobs(w, of, 3, sum);
	}
}
#else
void rbf_kernel_avx512(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	rbf_kernel_avx2(job, jobs, of, sum);
}
#endif
