/* SPDX-License-Identifier: BSD-3-Clause */
/* Three doubles: measured directions, before they are rounded. */
#ifndef RBF_VECTOR3_H
#define RBF_VECTOR3_H
#include <math.h>

static inline double rbf_dot3(const double a[3], const double b[3])
{
	return a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
}

static inline void rbf_cross3(const double a[3], const double b[3], double out[3])
{
	const double x = a[1]*b[2] - a[2]*b[1], y = a[2]*b[0] - a[0]*b[2], z = a[0]*b[1] - a[1]*b[0];
	out[0] = x;
	out[1] = y;
	out[2] = z;
}

/* Angle to the normal. */
static inline double rbf_theta3(const double a[3])
{
	return atan2(hypot(a[0], a[1]), fmax(a[2], 0));
}

/* Normalises; returns the former length. */
static inline double rbf_unit3(double a[3])
{
	const double length = sqrt(rbf_dot3(a, a));
	if (length > 0)
		for (int i = 0; i < 3; i++)
			a[i] /= length;
	return length;
}
#endif
