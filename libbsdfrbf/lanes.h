/* SPDX-License-Identifier: BSD-3-Clause */
/* Floats at once, by the compiler's vector types: four, for what is done at all corners of a site. A file that is compiled for AVX-512 may
 * define RBF_ABREAST as 4 before it includes this or what needs it: then four sites are treated at once, each in four lanes. */
#ifndef RBF_LANES_H
#define RBF_LANES_H
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef RBF_ABREAST
#define RBF_ABREAST 1
#endif
#define RBF_WIDTH (4 * RBF_ABREAST)

#if RBF_ABREAST > 1
#include <immintrin.h>
typedef __m512 rbf_register;
#define RBF_REGISTER(name) _mm512_##name
#elif defined(__SSE2__)
#include <xmmintrin.h>
typedef __m128 rbf_register;
#define RBF_REGISTER(name) _mm_##name
#endif

typedef float rbf_lanes __attribute__((vector_size(4 * RBF_WIDTH)));
typedef int32_t rbf_lane_mask __attribute__((vector_size(4 * RBF_WIDTH)));

static inline rbf_lanes rbf_lanes_load(const float *p)
{
	rbf_lanes v;
	memcpy(&v, p, sizeof v);
	return v;
}

static inline void rbf_lanes_store(float *p, rbf_lanes v)
{
	memcpy(p, &v, sizeof v);
}

static inline rbf_lanes rbf_lanes_all(float x)
{
#if defined(RBF_REGISTER)
	return (rbf_lanes)RBF_REGISTER(set1_ps)(x);
#else
	return (rbf_lanes){x, x, x, x};
#endif
}

static inline rbf_lanes rbf_lanes_select(rbf_lane_mask m, rbf_lanes a, rbf_lanes b)
{
	return (rbf_lanes)((m & (rbf_lane_mask)a) | (~m & (rbf_lane_mask)b));
}

/* As rbf_min() and rbf_max(). */
static inline rbf_lanes rbf_lanes_min(rbf_lanes a, rbf_lanes b)
{
#if defined(RBF_REGISTER)
	return (rbf_lanes)RBF_REGISTER(min_ps)((rbf_register)a, (rbf_register)b);
#else
	return rbf_lanes_select(a < b, a, b);
#endif
}

static inline rbf_lanes rbf_lanes_max(rbf_lanes a, rbf_lanes b)
{
#if defined(RBF_REGISTER)
	return (rbf_lanes)RBF_REGISTER(max_ps)((rbf_register)a, (rbf_register)b);
#else
	return rbf_lanes_select(a > b, a, b);
#endif
}

static inline rbf_lanes rbf_lanes_sqrt(rbf_lanes v)
{
#if defined(RBF_REGISTER)
	return (rbf_lanes)RBF_REGISTER(sqrt_ps)((rbf_register)v);
#else
	return (rbf_lanes){sqrtf(v[0]), sqrtf(v[1]), sqrtf(v[2]), sqrtf(v[3])};
#endif
}

/* The sum of a site's four, in each. */
static inline rbf_lanes rbf_lanes_sum(rbf_lanes v)
{
#if defined(RBF_REGISTER)
	const rbf_register x = (rbf_register)v, pairs = RBF_REGISTER(add_ps)(x, RBF_REGISTER(shuffle_ps)(x, x, _MM_SHUFFLE(2, 3, 0, 1)));
	return (rbf_lanes)RBF_REGISTER(add_ps)(pairs, RBF_REGISTER(shuffle_ps)(pairs, pairs, _MM_SHUFFLE(1, 0, 3, 2)));
#else
	return rbf_lanes_all((v[0] + v[1]) + (v[2] + v[3]));
#endif
}

/* Rows to columns, of each site. */
static inline void rbf_lanes_transpose(rbf_lanes v[4])
{
#if defined(RBF_REGISTER)
	const rbf_register a = (rbf_register)v[0], b = (rbf_register)v[1], c = (rbf_register)v[2], d = (rbf_register)v[3];
	const rbf_register low[2] = {RBF_REGISTER(unpacklo_ps)(a, b), RBF_REGISTER(unpacklo_ps)(c, d)};
	const rbf_register high[2] = {RBF_REGISTER(unpackhi_ps)(a, b), RBF_REGISTER(unpackhi_ps)(c, d)};
	v[0] = (rbf_lanes)RBF_REGISTER(shuffle_ps)(low[0], low[1], _MM_SHUFFLE(1, 0, 1, 0));
	v[1] = (rbf_lanes)RBF_REGISTER(shuffle_ps)(low[0], low[1], _MM_SHUFFLE(3, 2, 3, 2));
	v[2] = (rbf_lanes)RBF_REGISTER(shuffle_ps)(high[0], high[1], _MM_SHUFFLE(1, 0, 1, 0));
	v[3] = (rbf_lanes)RBF_REGISTER(shuffle_ps)(high[0], high[1], _MM_SHUFFLE(3, 2, 3, 2));
#else
	rbf_lanes out[4];
	for (int i = 0; i < 4; i++)
		out[i] = (rbf_lanes){v[0][i], v[1][i], v[2][i], v[3][i]};
	memcpy(v, out, sizeof out);
#endif
}

/* Four floats of each site. */
static inline rbf_lanes rbf_lanes_rows(const float *const row[RBF_ABREAST])
{
#if RBF_ABREAST > 1
	__m512 v = _mm512_castps128_ps512(_mm_loadu_ps(row[0]));
	v = _mm512_insertf32x4(v, _mm_loadu_ps(row[1]), 1);
	v = _mm512_insertf32x4(v, _mm_loadu_ps(row[2]), 2);
	return (rbf_lanes)_mm512_insertf32x4(v, _mm_loadu_ps(row[3]), 3);
#else
	return rbf_lanes_load(row[0]);
#endif
}

/* Four floats of each lane, as four columns. */
static inline void rbf_lanes_columns(const float *const of[RBF_WIDTH], rbf_lanes column[4])
{
	for (int k = 0; k < 4; k++) {
		const float *row[RBF_ABREAST];
		for (int n = 0; n < RBF_ABREAST; n++)
			row[n] = of[4*n + k];
		column[k] = rbf_lanes_rows(row);
	}
	rbf_lanes_transpose(column);
}

#if RBF_ABREAST == 1
/* Bit n: whether lane n of a mask is set. */
static inline unsigned rbf_lanes_bits(rbf_lane_mask m)
{
#if defined(__SSE2__)
	return (unsigned)_mm_movemask_ps((__m128)m);
#else
	return (m[0] & 1u) | (m[1] & 2u) | (m[2] & 4u) | (m[3] & 8u);
#endif
}
#endif

static inline rbf_lanes rbf_lanes_abs(rbf_lanes v)
{
	return (rbf_lanes)((rbf_lane_mask)v & 0x7fffffff);
}
#endif
