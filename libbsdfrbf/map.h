/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Maps ("frames"): how an exitant direction at one incidence corresponds to one at another.
 * A new map joins here: an id, a name, and a case in the functions below. All vectors are unit and in the
 * component's half space, z >= 0 for incident and exitant ones alike; mapped exitant ones may sink below.
 */
#ifndef RBF_MAP_H
#define RBF_MAP_H
#include "vector.h"

enum rbf_map {
	RBF_MAP_FIXED = 0,  /* o' = o: diffuse part, fixed exits */
	RBF_MAP_MIRROR = 1, /* smallest rotation from D i to D k, D = diag(-,-,+): specular, straight through */
	RBF_MAP_XFLIP = 2,  /* D = diag(+,-,+): mirrored beam with x turned back */
	RBF_MAP_YFLIP = 3,  /* D = diag(-,+,+): mirrored beam with y turned back */
	RBF_MAP_RETRO = 4,  /* D = identity: retro-reflection */
	RBF_MAP_HALF = 5,   /* same half vector: facets */
	/* tangential components shift with the source's by factors (a, b) along x and y; f is carried unchanged */
	RBF_MAP_SHIFT = 6,        /* (-1,-1): straight through or mirrored, blurred or deflected by a constant in cosine space */
	RBF_MAP_SHIFT_X = 7,      /* (-1, 0): what is ruled along y scatters y away, and keeps x */
	RBF_MAP_SHIFT_Y = 8,      /* ( 0,-1) */
	RBF_MAP_SHIFT_XFLIP = 9,  /* (+1,-1): a facet inside turns x back */
	RBF_MAP_SHIFT_YFLIP = 10, /* (-1,+1) */
	RBF_MAP_SHIFT_RETRO = 11, /* (+1,+1) */
	RBF_MAPS = 12
};

static inline int rbf_map_shifts(unsigned map)
{
	return map >= RBF_MAP_SHIFT && map < RBF_MAPS;
}

static inline const char *rbf_map_name(unsigned map)
{
	static const char *const name[RBF_MAPS] = {"fixed", "mirror", "x-flip", "y-flip", "retro", "half", "shift",
		"shift x", "shift y", "shift x-flip", "shift y-flip", "shift retro"};
	return map < RBF_MAPS ? name[map] : "unknown";
}

/* If all incidences lie in the plane y = 0, maps that differ in y alone are the same: 1 for the first of each kind. */
static inline int rbf_map_counts_in_plane(unsigned map)
{
	return map == RBF_MAP_FIXED || map == RBF_MAP_MIRROR || map == RBF_MAP_RETRO || map == RBF_MAP_HALF || map == RBF_MAP_SHIFT
		|| map == RBF_MAP_SHIFT_RETRO;
}

#define RBF_VALID_Z 0.3f     /* mapped directions lower than this lose weight: lobes are less certain there */
#define RBF_SHIFT_MIN_Z 0.02f
#define RBF_SLANT_MAX 11.43f /* tan 85 degrees: beyond, the half map's change of solid angle is held, so that it has a bound */

/* A map made ready for incident direction i and a corner's measured direction k. */
typedef struct rbf_warp {
	unsigned map;
	float i[3], k[3];
	float m[9];      /* rotations; shifts: the first two, by how much; else 0 */
	float gain;      /* half: cos k / cos i */
	float sine;      /* sine of the angle between i and k */
	float most;      /* half: limit of the change of solid angle */
} rbf_warp;

static inline void rbf_warp_set(rbf_warp *w, unsigned map, const float i[3], const float k[3])
{
	w->map = map;
	for (int n = 0; n < 3; n++) {
		w->i[n] = i[n];
		w->k[n] = k[n];
	}
	w->gain = 1;
	w->sine = 0;
	w->most = 1;
	for (int n = 0; n < 9; n++)
		w->m[n] = 0;
	if (map >= RBF_MAP_MIRROR && map <= RBF_MAP_RETRO) {
		const float sx = map == RBF_MAP_XFLIP || map == RBF_MAP_RETRO ? 1.f : -1.f;
		const float sy = map == RBF_MAP_YFLIP || map == RBF_MAP_RETRO ? 1.f : -1.f;
		const float a[3] = {sx * i[0], sy * i[1], i[2]}, b[3] = {sx * k[0], sy * k[1], k[2]};
		const float v[3] = {a[1]*b[2] - a[2]*b[1], a[2]*b[0] - a[0]*b[2], a[0]*b[1] - a[1]*b[0]};
		const float c = rbf_dot(a, b), t = 1 / fmaxf(1 + c, 1e-6f);
		w->m[0] = c + t*v[0]*v[0];    w->m[1] = t*v[0]*v[1] - v[2]; w->m[2] = t*v[0]*v[2] + v[1];
		w->m[3] = t*v[0]*v[1] + v[2]; w->m[4] = c + t*v[1]*v[1];    w->m[5] = t*v[1]*v[2] - v[0];
		w->m[6] = t*v[0]*v[2] - v[1]; w->m[7] = t*v[1]*v[2] + v[0]; w->m[8] = c + t*v[2]*v[2];
	} else if (rbf_map_shifts(map)) {
		static const float along[RBF_MAPS - RBF_MAP_SHIFT][2] = {{-1, -1}, {-1, 0}, {0, -1}, {1, -1}, {-1, 1}, {1, 1}};
		w->m[0] = along[map - RBF_MAP_SHIFT][0] * (k[0] - i[0]);
		w->m[1] = along[map - RBF_MAP_SHIFT][1] * (k[1] - i[1]);
	} else if (map == RBF_MAP_HALF) {
		const float c = rbf_dot(i, k);
		w->gain = k[2] / fmaxf(i[2], 0.01f);
		w->sine = sqrtf(fmaxf(1 - c*c, 0.f));
		w->most = 1 + w->sine * RBF_SLANT_MAX;
	}
}

/* Takes exitant o at i to out at k. Returns the factor g in DSF_i(o) = g DSF_k(out), 0 if nothing corresponds. */
static inline float rbf_warp_forward(const rbf_warp *w, const float o[3], float out[3])
{
	switch (w->map) {
	case RBF_MAP_MIRROR: case RBF_MAP_XFLIP: case RBF_MAP_YFLIP: case RBF_MAP_RETRO:
		out[0] = w->m[0]*o[0] + w->m[1]*o[1] + w->m[2]*o[2];
		out[1] = w->m[3]*o[0] + w->m[4]*o[1] + w->m[5]*o[2];
		out[2] = w->m[6]*o[0] + w->m[7]*o[1] + w->m[8]*o[2];
		return 1;
	case RBF_MAP_HALF: {
		const float s[3] = {w->i[0] + o[0], w->i[1] + o[1], w->i[2] + o[2]};
		const float q = rbf_dot(s, s), c = rbf_dot(s, w->k);
		if (!(c > 0) || !(q > 1e-12f)) {
			out[0] = out[1] = 0;
			out[2] = -1;
			return 0;
		}
		const float t = 2 * c / q;
		for (int n = 0; n < 3; n++)
			out[n] = t*s[n] - w->k[n];
		const float ci = rbf_dot(s, w->i);
		return ci <= w->most * c ? w->gain : w->gain * (w->most * c / ci);
	}
	case RBF_MAP_SHIFT: case RBF_MAP_SHIFT_X: case RBF_MAP_SHIFT_Y: case RBF_MAP_SHIFT_XFLIP: case RBF_MAP_SHIFT_YFLIP:
	case RBF_MAP_SHIFT_RETRO: {
		const float x = o[0] + w->m[0], y = o[1] + w->m[1], z2 = 1 - x*x - y*y;
		out[0] = x;
		out[1] = y;
		if (!(z2 > 0)) {
			out[2] = z2;
			return 0;
		}
		out[2] = sqrtf(z2);
		return fminf(o[2] / fmaxf(out[2], RBF_SHIFT_MIN_Z), 20.f);
	}
	default:
		out[0] = o[0];
		out[1] = o[1];
		out[2] = o[2];
		return 1;
	}
}

/* How far the mapped direction may be trusted: weight of a corner among corners, in (0, 1]. */
static inline float rbf_warp_validity(const rbf_warp *w, float mapped_z)
{
	if (w->map == RBF_MAP_FIXED)
		return 1;
	const float v = fminf(fmaxf(mapped_z * (1 / RBF_VALID_Z), 1e-3f), 1.f);
	return v * v;
}

/* Takes exitant p at k back to out at i. Returns g times the change of solid angle d(out)/d(p), the factor by which
 * the map changes a lobe's energy here; 0 if nothing corresponds. Never above rbf_warp_bound(). */
static inline float rbf_warp_inverse(const rbf_warp *w, const float p[3], float out[3])
{
	switch (w->map) {
	case RBF_MAP_MIRROR: case RBF_MAP_XFLIP: case RBF_MAP_YFLIP: case RBF_MAP_RETRO:
		out[0] = w->m[0]*p[0] + w->m[3]*p[1] + w->m[6]*p[2];
		out[1] = w->m[1]*p[0] + w->m[4]*p[1] + w->m[7]*p[2];
		out[2] = w->m[2]*p[0] + w->m[5]*p[1] + w->m[8]*p[2];
		return 1;
	case RBF_MAP_HALF: {
		const float s[3] = {w->k[0] + p[0], w->k[1] + p[1], w->k[2] + p[2]};
		const float q = rbf_dot(s, s), ci = rbf_dot(s, w->i), ck = rbf_dot(s, w->k);
		if (!(ci > 0) || !(q > 1e-12f) || !(ck > 0))
			return 0;
		const float t = 2 * ci / q;
		for (int n = 0; n < 3; n++)
			out[n] = t*s[n] - w->i[n];
		return w->gain * fminf(ci / ck, w->most); /* Walter et al. 2007, eq. 14: d(o) = 4 (o.h) d(h) */
	}
	case RBF_MAP_SHIFT: case RBF_MAP_SHIFT_X: case RBF_MAP_SHIFT_Y: case RBF_MAP_SHIFT_XFLIP: case RBF_MAP_SHIFT_YFLIP:
	case RBF_MAP_SHIFT_RETRO: {
		const float x = p[0] - w->m[0], y = p[1] - w->m[1], z2 = 1 - x*x - y*y;
		if (!(z2 > 0) || !(p[2] > 0))
			return 0;
		out[0] = x;
		out[1] = y;
		out[2] = sqrtf(z2);
		const float g = fminf(out[2] / fmaxf(p[2], RBF_SHIFT_MIN_Z), 20.f);
		return g * p[2] / fmaxf(out[2], 1e-12f);
	}
	default:
		out[0] = p[0];
		out[1] = p[1];
		out[2] = p[2];
		return 1;
	}
}

/* Bound of what rbf_warp_inverse() returns for a lobe of slant t = tan(half the largest angle between k and the lobe):
 * for the half map i.h / k.h <= cos a + sin a tan b, a between i and k, b between h and k. */
static inline float rbf_warp_bound(const rbf_warp *w, float t)
{
	return w->map == RBF_MAP_HALF ? w->gain * (1 + w->sine * fminf(t, RBF_SLANT_MAX)) : 1.f;
}
#endif
