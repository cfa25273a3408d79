/* SPDX-License-Identifier: BSD-3-Clause */
/* Small vectors, and maps of the hemisphere. */
#ifndef RBF_VECTOR_H
#define RBF_VECTOR_H
#include <math.h>

#define RBF_PI 3.14159265358979323846

/* fminf() and fmaxf() are calls unless the compiler may assume finite numbers. Of two where one is no number: the second. */
static inline float rbf_min(float a, float b)
{
	return a < b ? a : b;
}

static inline float rbf_max(float a, float b)
{
	return a > b ? a : b;
}

static inline float rbf_dot(const float a[3], const float b[3])
{
	return a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
}

static inline void rbf_cross(const float a[3], const float b[3], float out[3])
{
	out[0] = a[1]*b[2] - a[2]*b[1];
	out[1] = a[2]*b[0] - a[0]*b[2];
	out[2] = a[0]*b[1] - a[1]*b[0];
}

/* Angle between unit vectors, rad. */
static inline float rbf_angle(const float a[3], const float b[3])
{
	return acosf(rbf_min(rbf_max(rbf_dot(a, b), -1.f), 1.f));
}

/* Normalises in place; returns the former length, 0 (and leaves v alone) if it has none. What is a unit vector but for rounding stays
 * as it is. */
static inline float rbf_normalize(float v[3])
{
	const double square = (double)v[0]*v[0] + (double)v[1]*v[1] + (double)v[2]*v[2];
	if (square > 1 - 2e-7 && square < 1 + 2e-7)
		return 1;
	const double length = sqrt(square);
	if (!(length > 0) || !isfinite(length))
		return 0;
	for (int i = 0; i < 3; i++)
		v[i] = (float)(v[i] / length);
	return (float)length;
}

/* Two unit vectors across the unit vector n and each other: Duff et al., Building an orthonormal basis, revisited, 2017. */
static inline void rbf_basis(const float n[3], float t[3], float s[3])
{
	const float sign = copysignf(1, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
	t[0] = 1 + sign * n[0]*n[0]*a;
	t[1] = sign * b;
	t[2] = -sign * n[0];
	s[0] = b;
	s[1] = sign + n[1]*n[1]*a;
	s[2] = -n[1];
}

/* Applies a mirror operation (mesh.h): bit 0 flips x, bit 1 flips y. Which it is cannot be foreseen: no branch. */
static inline void rbf_mirror(unsigned op, const float in[3], float out[3])
{
	out[0] = in[0] * (float)(1 - (int)(op << 1 & 2));
	out[1] = in[1] * (float)(1 - (int)(op & 2));
	out[2] = in[2];
}

/* Arc tangent of t in [0, 1] over t, to 1e-7, s the square of t: a polynomial, fitted to the smallest largest error (4e-8, without
 * rounding). Of numbers or lanes. */
#define RBF_ARCTANGENT_OVER(s) (0.99999934f + (s) * (-0.3332986f + (s) * (0.19946554f + (s) * (-0.13908572f + (s) * (0.09642052f \
	+ (s) * (-0.05591038f + (s) * (0.021861634f + (s) * -0.0040542081f)))))))
static inline float rbf_arctangent(float t)
{
	const float s = t * t;
	return t * RBF_ARCTANGENT_OVER(s);
}

/* Angle of (x, y) to +x, y >= 0: in [0, pi], to 2e-7; 0 for (0, 0). */
static inline float rbf_upper_angle(float y, float x)
{
	const float across = fabsf(x), high = rbf_max(y, across), t = rbf_min(y, across) / rbf_max(high, 1e-30f);
	float angle = rbf_arctangent(t);
	angle = y > across ? (float)(RBF_PI / 2) - angle : angle;
	return x < 0 ? (float)RBF_PI - angle : angle;
}

/* Angle to +z of a unit direction, z >= 0 (below: as if z were 0). */
static inline float rbf_polar_angle(const float d[3])
{
	const float z = d[2] > 0 ? d[2] : 0, s2 = d[0]*d[0] + d[1]*d[1], sine = s2 > 0 ? sqrtf(s2) : 0;
	if (sine < z)
		return rbf_arctangent(sine / z);
	return (float)(RBF_PI / 2) - (sine > 0 ? rbf_arctangent(z / sine) : (float)(RBF_PI / 2));
}

/* Equal-angle square map of the hemisphere z >= 0: concentric (Shirley and Chiu, A low distortion map between disk
 * and square, 1997) with radius theta / (pi/2). Result in [-1, 1]^2; z < 0 is treated as z = 0. */
static inline void rbf_square_from_direction(const float d[3], float square[2])
{
	const float x = fabsf(d[0]), y = fabsf(d[1]), z = fmaxf(d[2], 0.f), sine = sqrtf(x*x + y*y);
	if (!(sine > 0)) {
		square[0] = square[1] = 0;
		return;
	}
	const float polar = rbf_arctangent(fminf(sine, z) / fmaxf(sine, z)) * (float)(2 / RBF_PI);
	const float r = sine > z ? 1 - polar : polar;
	const float across = r * (float)(4 / RBF_PI) * rbf_arctangent(fminf(x, y) / fmaxf(x, y));
	square[0] = copysignf(x >= y ? r : across, d[0]);
	square[1] = copysignf(x >= y ? across : r, d[1]);
}

/* Equal-area map of the hemisphere z >= 0 onto the unit disc (Lambert, Anmerkungen und Zusaetze, 1772), for tables that are looked
 * up often: no more than a root and a division. A step in the disc is at least half as long as on the sphere. */
static inline void rbf_disc_from_direction(const float d[3], float disc[2])
{
	const float scale = 1 / sqrtf(1 + (d[2] > 0 ? d[2] : 0));
	disc[0] = d[0] * scale;
	disc[1] = d[1] * scale;
}

/* Points outside the disc are taken to its edge. */
static inline void rbf_direction_from_disc(const double disc[2], double d[3])
{
	const double r = sqrt(disc[0]*disc[0] + disc[1]*disc[1]), scale = r > 1 ? 1 / r : sqrt(2 - r*r);
	d[0] = disc[0] * scale;
	d[1] = disc[1] * scale;
	d[2] = r > 1 ? 0 : 1 - r*r;
}
#endif
