/* SPDX-License-Identifier: BSD-3-Clause */
/* Four floats at once, by the compiler's vector types: for what is done at all corners of a site. */
#ifndef RBF_LANES_H
#define RBF_LANES_H
#include <math.h>
#include <stdint.h>
#include <string.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

typedef float rbf_lanes __attribute__((vector_size(16)));
typedef int32_t rbf_lane_mask __attribute__((vector_size(16)));

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
	return (rbf_lanes){x, x, x, x};
}

static inline rbf_lanes rbf_lanes_select(rbf_lane_mask m, rbf_lanes a, rbf_lanes b)
{
	return (rbf_lanes)((m & (rbf_lane_mask)a) | (~m & (rbf_lane_mask)b));
}

/* As rbf_min() and rbf_max(). */
static inline rbf_lanes rbf_lanes_min(rbf_lanes a, rbf_lanes b)
{
#if defined(__SSE2__)
	return (rbf_lanes)_mm_min_ps((__m128)a, (__m128)b);
#else
	return rbf_lanes_select(a < b, a, b);
#endif
}

static inline rbf_lanes rbf_lanes_max(rbf_lanes a, rbf_lanes b)
{
#if defined(__SSE2__)
	return (rbf_lanes)_mm_max_ps((__m128)a, (__m128)b);
#else
	return rbf_lanes_select(a > b, a, b);
#endif
}

static inline rbf_lanes rbf_lanes_sqrt(rbf_lanes v)
{
#if defined(__SSE2__)
	return (rbf_lanes)_mm_sqrt_ps((__m128)v);
#else
	return (rbf_lanes){sqrtf(v[0]), sqrtf(v[1]), sqrtf(v[2]), sqrtf(v[3])};
#endif
}

/* The sum of all four, in each. */
static inline rbf_lanes rbf_lanes_sum(rbf_lanes v)
{
#if defined(__SSE2__)
	const __m128 pairs = _mm_add_ps((__m128)v, _mm_shuffle_ps((__m128)v, (__m128)v, _MM_SHUFFLE(2, 3, 0, 1)));
	return (rbf_lanes)_mm_add_ps(pairs, _mm_shuffle_ps(pairs, pairs, _MM_SHUFFLE(1, 0, 3, 2)));
#else
	return rbf_lanes_all((v[0] + v[1]) + (v[2] + v[3]));
#endif
}

/* Rows to columns. */
static inline void rbf_lanes_transpose(rbf_lanes v[4])
{
#if defined(__SSE2__)
	__m128 a = (__m128)v[0], b = (__m128)v[1], c = (__m128)v[2], d = (__m128)v[3];
	_MM_TRANSPOSE4_PS(a, b, c, d);
	v[0] = (rbf_lanes)a;
	v[1] = (rbf_lanes)b;
	v[2] = (rbf_lanes)c;
	v[3] = (rbf_lanes)d;
#else
	rbf_lanes out[4];
	for (int i = 0; i < 4; i++)
		out[i] = (rbf_lanes){v[0][i], v[1][i], v[2][i], v[3][i]};
	memcpy(v, out, sizeof out);
#endif
}

/* Bit n: whether lane n of a mask is set. */
static inline unsigned rbf_lanes_bits(rbf_lane_mask m)
{
#if defined(__SSE2__)
	return (unsigned)_mm_movemask_ps((__m128)m);
#else
	return (m[0] & 1u) | (m[1] & 2u) | (m[2] & 4u) | (m[3] & 8u);
#endif
}

static inline rbf_lanes rbf_lanes_abs(rbf_lanes v)
{
	return (rbf_lanes)((rbf_lane_mask)v & 0x7fffffff);
}
#endif
