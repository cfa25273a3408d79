/* SPDX-License-Identifier: BSD-3-Clause */
/* Compiled for AVX-512: blocks two at a time, of whichever jobs. Motion and groups of blocks are left to the kernel for AVX2. */
#include "kernel.h"

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__) && defined(__AVX512VBMI2__)
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

/* Adds block a at direction p, of which the weight is the fourth number, and block b at direction q by a weight. `channels` is constant. */
static inline __attribute__((always_inline)) void add_two(const rbf_kernel_lobes *of, const float *p, uint32_t a, const float *q,
	uint32_t b, float weight, uint32_t channels, __m512 total[3])
{
	const rbf_block *k = of->block + a, *l = of->block + b;
	const __m512 x = _mm512_sub_ps(both(k->x, l->x), each(p[0], q[0]));
	const __m512 y = _mm512_sub_ps(both(k->y, l->y), each(p[1], q[1]));
	const __m512 z = _mm512_sub_ps(both(k->z, l->z), each(p[2], q[2]));
	const __m512 square = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x))), kappa = both(k->k, l->k);
	const __m512 e = _mm512_mul_ps(exp2_negative(_mm512_mul_ps(_mm512_mul_ps(kappa, _mm512_set1_ps(-.72134752f)), square)),
		each(p[3], weight));
	const __m512 amplitude = both(of->amplitude[a].a, of->amplitude[b].a);
	total[0] = _mm512_fmadd_ps(e, amplitude, total[0]);
	if (channels == RBF_KERNEL_WIDTH)
		total[1] = _mm512_fmadd_ps(e, _mm512_mul_ps(amplitude, kappa), total[1]);
	for (uint32_t c = 1; channels == 3 && c < 3; c++)
		total[c] = _mm512_fmadd_ps(e, both(of->amplitude[c * of->stride + a].a, of->amplitude[c * of->stride + b].a), total[c]);
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
		add_two(of, p->direction, a, q->direction, b, weight, channels, total);
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

/* The blocks of all sums, one after the other: numbers of the job (high byte) and of the block. Each has an even number, if need be by a block
 * without weight. */
enum { PLACES = 4 * RBF_KERNEL_SUMS, NONE = PLACES - 1 };
typedef struct list {
	uint32_t end[RBF_KERNEL_SUMS];
	uint16_t item[PLACES * RBF_MAX_FRAMES * RBF_CULL_BITS + 16];
} list;

/* Which job has how many cannot be foreseen: nothing branches on it, but for a job of very many. */
static inline __attribute__((always_inline)) void list_blocks(const rbf_kernel_frame *frame, uint32_t frames, list *l)
{
	const __m512i numbers = _mm512_set_epi64(0x3f3e3d3c3b3a3938, 0x3736353433323130, 0x2f2e2d2c2b2a2928, 0x2726252423222120,
		0x1f1e1d1c1b1a1918, 0x1716151413121110, 0x0f0e0d0c0b0a0908, 0x0706050403020100);
	uint32_t count = 0;
	for (uint32_t n = 0; n < RBF_KERNEL_SUMS; n++) {
		for (uint32_t f = 0; f < frames; f++)
			for (uint32_t k = 0; k < 3; k++) {
				const uint64_t mask = frame[f].mask[4*k + n];
				const uint32_t end = count + (uint32_t)__builtin_popcountll(mask);
				const __m256i job = _mm256_set1_epi16((int16_t)((PLACES * f + 4*k + n) << 8));
				__m512i which = _mm512_maskz_compress_epi8(mask, numbers);
				do {
					const __m256i item = _mm256_or_si256(job, _mm256_cvtepu8_epi16(_mm512_castsi512_si128(which)));
					_mm256_storeu_si256((__m256i *)(void *)(l->item + count), item);
					which = _mm512_alignr_epi64(which, which, 2);
					count += 16;
				} while (__builtin_expect(count < end, 0));
				count = end;
			}
		l->item[count] = NONE << 8;
		count += count & 1;
		l->end[n] = count;
	}
}

/* All are listed before the first is summed. `channels` is constant. */
static inline __attribute__((always_inline)) void add_sums(const rbf_kernel_frame *frame, uint32_t frames, const rbf_kernel_lobes *of,
	uint32_t channels, float sum[RBF_KERNEL_SUMS][3])
{
	list l;
	list_blocks(frame, frames, &l);
	uint32_t n = 0;
	for (uint32_t k = 0; k < RBF_KERNEL_SUMS; k++) {
		__m512 total[3] = {_mm512_setzero_ps(), _mm512_setzero_ps(), _mm512_setzero_ps()};
		for (; n < l.end[k]; n += 2) {
			const uint32_t a = l.item[n], b = l.item[n + 1], i = a >> 8, j = b >> 8;
			const rbf_kernel_frame *p = frame + i / PLACES, *q = frame + j / PLACES;
			const float *from = p->direction[i % PLACES], *to = q->direction[j % PLACES];
			const uint32_t first = p->first[i % PLACES] + (a & 255), second = q->first[j % PLACES] + (b & 255);
			add_two(of, from, first, to, second, to[3], channels, total);
		}
		for (uint32_t c = 0; c < channels; c++)
			sum[k][c] = _mm512_reduce_add_ps(total[c]);
	}
}

void rbf_kernel_frames_avx512(const rbf_kernel_frame *frame, uint32_t frames, const rbf_kernel_lobes *of, float sum[RBF_KERNEL_SUMS][3])
{
	if (of->channels == 1)
		add_sums(frame, frames, of, 1, sum);
	else
		add_sums(frame, frames, of, 3, sum);
}
#else
void rbf_kernel_avx512(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	rbf_kernel_avx2(job, jobs, of, sum);
}

void rbf_kernel_frames_avx512(const rbf_kernel_frame *frame, uint32_t frames, const rbf_kernel_lobes *of, float sum[RBF_KERNEL_SUMS][3])
{
	(void)frame;
	(void)frames;
	(void)of;
	memset(sum, 0, RBF_KERNEL_SUMS * sizeof *sum);
}
#endif
