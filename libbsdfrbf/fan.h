/* SPDX-License-Identifier: BSD-3-Clause */
/* A frame's maps at the corners of a site, side by side: what map.h does for one corner, with a corner in each lane. What a lane without
 * a corner holds does not matter, but is finite. */
#ifndef RBF_FAN_H
#define RBF_FAN_H
#include "lanes.h"
#include "map.h"

#define RBF_FAN RBF_WIDTH

/* Members as in rbf_warp, those that its kind needs. */
typedef struct rbf_fan {
	enum rbf_map_kind kind;
	float limit;                /* rbf_frame_limit() */
	float m[9][RBF_FAN];
	float cosine[RBF_FAN], gain[RBF_FAN], sine[RBF_FAN], most[RBF_FAN];
} rbf_fan;

/* The warp of one lane: from i to k, its measured direction. */
static inline void rbf_fan_warp(const rbf_fan *fan, const float i[3], const float k[3][RBF_FAN], uint32_t lane, rbf_warp *w)
{
	const float to[3] = {k[0][lane], k[1][lane], k[2][lane]};
	rbf_warp_clear(w, fan->kind, i, to);
	const int values = fan->kind == RBF_KIND_TURN ? 9 : fan->kind == RBF_KIND_SHIFT ? 2 : 0;
	for (int n = 0; n < values; n++)
		w->m[n] = fan->m[n][lane];
	w->cosine = fan->cosine[lane];
	w->gain = fan->gain[lane];
	w->sine = fan->sine[lane];
	w->most = fan->most[lane];
}

/* As rbf_map_beam() and rbf_map_turned(). */
static inline __attribute__((always_inline)) void rbf_fan_beam(unsigned map, const rbf_linear *linear, const rbf_lanes k[3], rbf_lanes e[3])
{
	for (int n = 0; n < 2; n++) {
		const float *row = linear ? linear->row[n] : NULL;
		e[n] = rbf_map_learned(map) ? row[0]*k[0] + row[1]*k[1] + row[2]*k[2] + row[3] : rbf_map_get(map)->along[n] * k[n];
	}
	e[2] = k[2];
	if (!rbf_map_learned(map) || rbf_map_get(map)->kind != RBF_KIND_TURN)
		return;
	const rbf_lanes r = rbf_lanes_sqrt(e[0]*e[0] + e[1]*e[1]);
	const rbf_lanes s = rbf_lanes_select(r > RBF_TURN_RADIUS, RBF_TURN_RADIUS / rbf_lanes_max(r, rbf_lanes_all(RBF_TURN_RADIUS)), rbf_lanes_all(1));
	e[0] *= s;
	e[1] *= s;
	e[2] = rbf_lanes_sqrt(1 - e[0]*e[0] - e[1]*e[1]);
}

/* What a half map multiplies by at each corner, before rbf_facet_gain(). */
static inline __attribute__((always_inline)) rbf_lanes rbf_half_gain(const rbf_lanes i[3], const rbf_lanes to[3])
{
	return to[2] * (1 / rbf_lanes_max(i[2], rbf_lanes_all(0.01f)));
}

/* As rbf_warp_set(). */
static inline __attribute__((always_inline)) void rbf_fan_set(rbf_fan *fan, unsigned map, const rbf_linear *linear, const rbf_lanes i[3],
	const rbf_lanes to[3])
{
	const rbf_lanes one = rbf_lanes_all(1);
	rbf_lanes a[3], b[3], cosine = one, gain = one, sine = rbf_lanes_all(0), most = one;
	fan->kind = rbf_map_get(map)->kind;
	if (fan->kind == RBF_KIND_TURN) {
		rbf_fan_beam(map, linear, i, a);
		rbf_fan_beam(map, linear, to, b);
		const rbf_lanes x = a[1]*b[2] - a[2]*b[1], y = a[2]*b[0] - a[0]*b[2], z = a[0]*b[1] - a[1]*b[0];
		cosine = a[0]*b[0] + a[1]*b[1] + a[2]*b[2];
		const rbf_lanes t = 1 / rbf_lanes_max(1 + cosine, rbf_lanes_all(1e-6f)), tx = t*x, ty = t*y, tz = t*z;
		rbf_lanes_store(fan->m[0], cosine + tx*x);
		rbf_lanes_store(fan->m[1], tx*y - z);
		rbf_lanes_store(fan->m[2], tx*z + y);
		rbf_lanes_store(fan->m[3], tx*y + z);
		rbf_lanes_store(fan->m[4], cosine + ty*y);
		rbf_lanes_store(fan->m[5], ty*z - x);
		rbf_lanes_store(fan->m[6], tx*z - y);
		rbf_lanes_store(fan->m[7], ty*z + x);
		rbf_lanes_store(fan->m[8], cosine + tz*z);
	} else if (fan->kind == RBF_KIND_SHIFT) {
		rbf_fan_beam(map, linear, i, a);
		rbf_fan_beam(map, linear, to, b);
		rbf_lanes_store(fan->m[0], b[0] - a[0]);
		rbf_lanes_store(fan->m[1], b[1] - a[1]);
	} else if (fan->kind == RBF_KIND_HALF) {
		const rbf_lanes c = i[0]*to[0] + i[1]*to[1] + i[2]*to[2];
		gain = rbf_half_gain(i, to);
		sine = rbf_lanes_sqrt(rbf_lanes_max(1 - c*c, rbf_lanes_all(0)));
		most = 1 + sine * RBF_SLANT_MAX;
	}
	rbf_lanes_store(fan->cosine, cosine);
	rbf_lanes_store(fan->gain, gain);
	rbf_lanes_store(fan->sine, sine);
	rbf_lanes_store(fan->most, most);
}

/* As rbf_warp_forward(): where o goes at each corner; returns the factors. */
static inline __attribute__((always_inline)) rbf_lanes rbf_fan_forward(const rbf_fan *fan, const rbf_lanes i[3], const rbf_lanes to[3],
	const rbf_lanes o[3], rbf_lanes out[3])
{
	const float (*m)[RBF_FAN] = fan->m;
	const rbf_lanes zero = rbf_lanes_all(0), one = rbf_lanes_all(1);
	if (fan->kind == RBF_KIND_TURN) {
		for (int n = 0; n < 3; n++)
			out[n] = rbf_lanes_load(m[3*n])*o[0] + rbf_lanes_load(m[3*n + 1])*o[1] + rbf_lanes_load(m[3*n + 2])*o[2];
		return one;
	}
	if (fan->kind == RBF_KIND_SHIFT) {
		const rbf_lanes x = o[0] + rbf_lanes_load(m[0]), y = o[1] + rbf_lanes_load(m[1]), z2 = 1 - x*x - y*y;
		const rbf_lanes z = rbf_lanes_sqrt(rbf_lanes_max(z2, zero)), scale = 1 / rbf_lanes_max(z, rbf_lanes_all(RBF_SHIFT_MIN_Z)), t = z * scale;
		out[0] = x;
		out[1] = y;
		out[2] = rbf_lanes_select(z2 > 0, z, z2);
		return rbf_lanes_select(z2 > 0, rbf_lanes_min(o[2] * scale, rbf_lanes_all(RBF_SHIFT_MOST)) * (t * t), zero);
	}
	if (fan->kind == RBF_KIND_HALF) {
		const rbf_lanes s[3] = {i[0] + o[0], i[1] + o[1], i[2] + o[2]}, none = rbf_lanes_all(1e-30f), gain = rbf_lanes_load(fan->gain);
		const rbf_lanes q = s[0]*s[0] + s[1]*s[1] + s[2]*s[2], ci = s[0]*i[0] + s[1]*i[1] + s[2]*i[2], rest = 1 / rbf_lanes_max(ci, none);
		const rbf_lanes c = s[0]*to[0] + s[1]*to[1] + s[2]*to[2], t = c * (2 / rbf_lanes_max(q, none));
		const rbf_lanes held = rbf_lanes_load(fan->most) * c * rest;
		const rbf_lane_mask some = (c > 0) & (q > 1e-12f);
		for (int n = 0; n < 3; n++)
			out[n] = rbf_lanes_select(some, t*s[n] - to[n], rbf_lanes_all(n < 2 ? 0 : -1));
		return rbf_lanes_select(some, gain * rbf_lanes_min(held, one), zero);
	}
	for (int n = 0; n < 3; n++)
		out[n] = o[n];
	return one;
}

/* As rbf_warp_inverse() by the warp of one lane, of which only what its kind needs is read. */
static inline __attribute__((always_inline)) float rbf_fan_inverse(const rbf_fan *fan, const float i[3], const float k[3][RBF_FAN],
	uint32_t lane, const float p[3], float out[3])
{
	rbf_warp w;
	switch (fan->kind) {
	case RBF_KIND_TURN:
		for (int n = 0; n < 9; n++)
			w.m[n] = fan->m[n][lane];
		return rbf_turn_inverse(&w, p, out);
	case RBF_KIND_SHIFT:
		w.m[0] = fan->m[0][lane];
		w.m[1] = fan->m[1][lane];
		return rbf_shift_inverse(&w, p, out);
	case RBF_KIND_HALF:
		for (int n = 0; n < 3; n++) {
			w.i[n] = i[n];
			w.k[n] = k[n][lane];
		}
		w.gain = fan->gain[lane];
		w.most = fan->most[lane];
		return rbf_half_inverse(&w, p, out);
	default: return rbf_same(p, out);
	}
}

/* Heights at all corners of what is p at that of one lane, and o at the site. Less than rbf_fan_forward() has to do. */
static inline __attribute__((always_inline)) rbf_lanes rbf_fan_heights(const rbf_fan *fan, const float i[3], const float k[3][RBF_FAN],
	uint32_t lane, const float p[3], const float o[3])
{
	if (fan->kind != RBF_KIND_HALF) {
		const rbf_lanes from[3] = {rbf_lanes_all(i[0]), rbf_lanes_all(i[1]), rbf_lanes_all(i[2])};
		const rbf_lanes to[3] = {rbf_lanes_load(k[0]), rbf_lanes_load(k[1]), rbf_lanes_load(k[2])};
		const rbf_lanes at[3] = {rbf_lanes_all(o[0]), rbf_lanes_all(o[1]), rbf_lanes_all(o[2])};
		rbf_lanes out[3];
		rbf_fan_forward(fan, from, to, at, out);
		return out[2];
	}
	const float s[3] = {k[0][lane] + p[0], k[1][lane] + p[1], k[2][lane] + p[2]}, t = 2 * s[2] / rbf_max(rbf_dot(s, s), 1e-30f);
	const rbf_lanes c = s[0]*rbf_lanes_load(k[0]) + s[1]*rbf_lanes_load(k[1]) + s[2]*rbf_lanes_load(k[2]);
	return rbf_lanes_select(c > 0, t*c - rbf_lanes_load(k[2]), rbf_lanes_all(-1));
}
#endif
