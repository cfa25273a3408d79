/* SPDX-License-Identifier: BSD-3-Clause */
#include "falloff.h"
#include "model.h"
#include "vector3.h"

double rbf_falloff_along(enum rbf_falloff by, double middle, double distance, int side)
{
	const double angle = middle + side * (by == RBF_FALLOFF_SLOPES ? 2 * atan(distance) : distance);
	return by == RBF_FALLOFF_COSINES ? sin(middle) + side * distance : fabs(angle) < RBF_PI / 2 ? sin(angle) : 2;
}

int rbf_falloff_direction(enum rbf_falloff by, double middle, double distance, double azimuth, double w[3])
{
	const double s = sin(middle), c = cos(middle), a = cos(azimuth), b = sin(azimuth);
	if (by == RBF_FALLOFF_COSINES) {
		w[0] = s + distance * a;
		w[1] = distance * b;
		w[2] = sqrt(fmax(1 - w[0]*w[0] - w[1]*w[1], 0));
	} else if (by == RBF_FALLOFF_ANGLES) {
		w[0] = cos(distance) * s + sin(distance) * a * c;
		w[1] = sin(distance) * b;
		w[2] = cos(distance) * c - sin(distance) * a * s;
	} else { /* mirrored by a facet of that slope; the source is at -s, c */
		double h[3] = {distance * a, distance * b, 1};
		rbf_unit3(h);
		const double k = 2 * (h[2] * c - h[0] * s);
		w[0] = k * h[0] + s;
		w[1] = k * h[1];
		w[2] = k * h[2] - c;
	}
	return w[2] > RBF_PLANE_LOWEST && (by != RBF_FALLOFF_ANGLES || distance < RBF_PI);
}

void rbf_falloff_place(enum rbf_falloff by, double middle, const double w[3], double *distance, double *azimuth)
{
	const double s = sin(middle), c = cos(middle), along = by == RBF_FALLOFF_ANGLES ? w[0] * c - w[2] * s : w[0] - s;
	*distance = hypot(along, w[1]);
	*azimuth = atan2(w[1], along);
	if (by == RBF_FALLOFF_ANGLES)
		*distance = atan2(*distance, w[0] * s + w[2] * c);
	else if (by == RBF_FALLOFF_SLOPES)
		*distance /= w[2] + c;
}
