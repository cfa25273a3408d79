/* SPDX-License-Identifier: BSD-3-Clause */
/* Ellipses by which distances are compared that differ with azimuth. */
#ifndef RBF_ELLIPSE_H
#define RBF_ELLIPSE_H
#include <math.h>

/* Azimuth of an axis; what distances along it and across it are multiplied by. */
typedef struct rbf_ellipse { double axis, along, across; } rbf_ellipse;

#define RBF_ROUND (rbf_ellipse){0, 1, 1}

/* In [0, 2 pi). */
static inline double rbf_azimuth(double azimuth)
{
	const double turn = 6.283185307179586;
	azimuth = fmod(azimuth, turn);
	return azimuth < 0 ? azimuth + turn : azimuth;
}

/* Where an ellipse puts an azimuth, and how far what is at distance 1 there, and the other way round. */
static inline double rbf_ellipse_on(const rbf_ellipse *e, double azimuth, double *times)
{
	const double x = e->along * cos(azimuth - e->axis), y = e->across * sin(azimuth - e->axis);
	*times = hypot(x, y);
	return rbf_azimuth(atan2(y, x) + e->axis);
}

static inline double rbf_ellipse_off(const rbf_ellipse *e, double azimuth, double *times)
{
	const rbf_ellipse back = {e->axis, 1 / e->along, 1 / e->across};
	return rbf_ellipse_on(&back, azimuth, times);
}
#endif
