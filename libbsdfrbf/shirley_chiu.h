/* SPDX-License-Identifier: BSD-3-Clause */
/* Concentric map between square and disk: Shirley and Chiu, A low distortion map between disk and square, 1997. Equal areas of
 * the square are equal projected solid angles of the hemisphere. */
#ifndef RBF_SHIRLEY_CHIU_H
#define RBF_SHIRLEY_CHIU_H
#include "vector.h"

/* Unit direction, z > 0, of a point in [0, 1]^2. */
static inline void rbf_direction_from_cell(double x, double y, float d[3])
{
	const double a = 2*x - 1, b = 2*y - 1;
	double r = 0, phi = 0;
	if (a != 0 || b != 0) {
		if (fabs(a) >= fabs(b)) {
			r = a;
			phi = RBF_PI / 4 * (b / a);
		} else {
			r = b;
			phi = RBF_PI / 2 - RBF_PI / 4 * (a / b);
		}
	}
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)sqrt(fmax(1 - r*r, 1e-9));
}

/* Point in [0, 1]^2 of a direction; only x and y are looked at. */
static inline void rbf_cell_from_direction(const float d[3], double cell[2])
{
	const double x = fabs((double)d[0]), y = fabs((double)d[1]), r = fmin(sqrt(x*x + y*y), 1);
	double across = 0;
	if (r > 0)
		across = r * (4 / RBF_PI) * atan2(fmin(x, y), fmax(x, y));
	cell[0] = .5 + .5 * copysign(x >= y ? r : across, (double)d[0]);
	cell[1] = .5 + .5 * copysign(x >= y ? across : r, (double)d[1]);
}
#endif
