/* SPDX-License-Identifier: BSD-3-Clause */
/* Elementary functions without a branch, for loops that the compiler turns into vector code. */
#ifndef RBF_ELEMENTARY_H
#define RBF_ELEMENTARY_H
#include "vector.h"

#include <stdint.h>
#include <string.h>

/* Minimax polynomial of 2^x on [-1/2, 1/2], degree 5, relative error 7.5e-8: coefficients of 1, x, .. */
#define RBF_EXP2_0 1.00000007f
#define RBF_EXP2_1 6.93146967e-1f
#define RBF_EXP2_2 2.40221197e-1f
#define RBF_EXP2_3 5.55071328e-2f
#define RBF_EXP2_4 9.67554138e-3f
#define RBF_EXP2_5 1.32764716e-3f

/* exp(x), x <= 0, relative error below 3e-7; never below 2^-100, so that no product becomes denormal. */
static inline float rbf_exp_negative(float x)
{
	const float t = rbf_max(x * 1.44269504f, -100.f), shifted = t + 12582912.f; /* 1.5 x 2^23: the nearest whole number is in the low bits */
	const float r = t - (shifted - 12582912.f);
	const float p = ((((r * RBF_EXP2_5 + RBF_EXP2_4) * r + RBF_EXP2_3) * r + RBF_EXP2_2) * r + RBF_EXP2_1) * r + RBF_EXP2_0;
	uint32_t power, bits;
	float result;
	memcpy(&power, &shifted, sizeof power);
	memcpy(&bits, &p, sizeof bits);
	bits += power << 23;
	memcpy(&result, &bits, sizeof result);
	return result;
}

/* -ln x, x in (0, 1], to 1e-6 of it or of 1: the exponent, and for what is left x - x^2/2 + x^3 P(x), P fitted to the smallest largest
 * relative error (2.6e-7) on [sqrt(1/2) - 1, sqrt(2) - 1]. In pairs, so that little waits for something else. */
static inline float rbf_minus_log(float x)
{
	uint32_t bits;
	memcpy(&bits, &x, sizeof bits);
	const uint32_t above = bits - 0x3f3504f3u; /* root 1/2 */
	const int32_t e = (int32_t)above >> 23;
	bits = (above & 0x007fffffu) + 0x3f3504f3u;
	float m;
	memcpy(&m, &bits, sizeof m);
	const float t = m - 1, s = t * t;
	const float low = 0.33334664f - 0.24984232f * t, middle = 0.19908643f - 0.17102376f * t, high = 0.16154113f - 0.10487674f * t;
	const float p = low + s * (middle + s * high);
	return -.69314718f * (float)e - t + s * (.5f - t * p);
}
#endif
