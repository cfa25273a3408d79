/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Maps ("frames"): how an exitant direction at one incidence corresponds to one at another. A new map joins as a line of the
 * table. All vectors are unit and in the component's half space, z >= 0 for incident and exitant ones alike; mapped exitant
 * ones may sink below.
 *
 * Most follow a beam whose tangential components depend on the incident direction, e(i):
 *   turn   the smallest rotation from e(i) to e(k): a blur that is even in angle
 *   shift  o' = o + e(k) - e(i) in the tangential components, f carried unchanged: a blur that is even in cosine space
 * In the listed maps e(i) = (a i_x, b i_y); in the learned ones it is linear in i, with coefficients found from the data.
 */
#ifndef RBF_MAP_H
#define RBF_MAP_H
#include "model.h"
#include "vector.h"

enum rbf_map_kind { RBF_KIND_FIXED, RBF_KIND_TURN, RBF_KIND_HALF, RBF_KIND_SHIFT };

enum rbf_map {
	RBF_MAP_FIXED = 0,          /* o' = o: diffuse part, fixed exits */
	RBF_MAP_MIRROR = 1,         /* specular, straight through */
	RBF_MAP_XFLIP = 2,          /* mirrored beam with x turned back */
	RBF_MAP_YFLIP = 3,
	RBF_MAP_RETRO = 4,          /* retro-reflection */
	RBF_MAP_HALF = 5,           /* same half vector: facets */
	RBF_MAP_SHIFT = 6,          /* straight through or mirrored, blurred or deflected by a constant in cosine space */
	RBF_MAP_SHIFT_X = 7,        /* what is ruled along y scatters y away, and keeps x */
	RBF_MAP_SHIFT_Y = 8,
	RBF_MAP_SHIFT_XFLIP = 9,    /* a facet inside turns x back */
	RBF_MAP_SHIFT_YFLIP = 10,
	RBF_MAP_SHIFT_RETRO = 11,
	RBF_MAPS_LISTED = 12,
	RBF_MAP_LEARNED_SHIFT = 12,
	RBF_MAP_LEARNED_TURN = 13,
	RBF_MAPS = 14
};

typedef struct rbf_map_row {
	const char *name;
	enum rbf_map_kind kind;
	float along[2];  /* a, b */
	int plane;       /* if all incidences lie in the plane y = 0, maps that differ in y alone are the same: 1 for the first of each kind */
} rbf_map_row;

static inline const rbf_map_row *rbf_map_get(unsigned map)
{
	static const rbf_map_row row[RBF_MAPS] = {
		{"fixed", RBF_KIND_FIXED, {0, 0}, 1},
		{"mirror", RBF_KIND_TURN, {-1, -1}, 1},
		{"x-flip", RBF_KIND_TURN, {1, -1}, 0},
		{"y-flip", RBF_KIND_TURN, {-1, 1}, 0},
		{"retro", RBF_KIND_TURN, {1, 1}, 1},
		{"half", RBF_KIND_HALF, {0, 0}, 1},
		{"shift", RBF_KIND_SHIFT, {-1, -1}, 1},
		{"shift x", RBF_KIND_SHIFT, {-1, 0}, 0},
		{"shift y", RBF_KIND_SHIFT, {0, -1}, 0},
		{"shift x-flip", RBF_KIND_SHIFT, {1, -1}, 0},
		{"shift y-flip", RBF_KIND_SHIFT, {-1, 1}, 0},
		{"shift retro", RBF_KIND_SHIFT, {1, 1}, 1},
		{"learned shift", RBF_KIND_SHIFT, {0, 0}, 1},
		{"learned turn", RBF_KIND_TURN, {0, 0}, 1},
	};
	return &row[map < RBF_MAPS ? map : 0];
}

static inline int rbf_map_learned(unsigned map)
{
	return map >= RBF_MAPS_LISTED && map < RBF_MAPS;
}

/* Coefficients of a component's frame, NULL where none is learned. */
static inline const rbf_linear *rbf_frame_linear(const rbf_component *c, uint32_t frame)
{
	return c->linear ? &c->linear[frame] : NULL;
}

static inline const char *rbf_map_name(unsigned map)
{
	return map < RBF_MAPS ? rbf_map_get(map)->name : "unknown";
}

#define RBF_VALID_S 0.9539392f /* the sine that belongs to RBF_VALID_Z */
#define RBF_VALID_LEAST .01f /* of the part of it that is left */
#define RBF_VALID_Z 0.3f     /* mapped directions lower than this lose weight: lobes are less certain there */
#define RBF_SHIFT_MIN_Z 0.02f
#define RBF_SHIFT_MOST 20.f  /* of the cosines' ratio */
#define RBF_TURN_RADIUS 0.99f /* a learned beam is held above the horizon: |e| at most this */
#define RBF_SLANT_MAX 11.43f /* tan 85 degrees: beyond, the half map's change of solid angle is held, so that it has a bound */

/* The beam's direction e(i) under a map: tangential components. linear: of a learned map, else ignored. */
static inline void rbf_map_beam(unsigned map, const rbf_linear *linear, const float i[3], float e[2])
{
	for (int n = 0; n < 2; n++) {
		const rbf_linear *l = linear;
		e[n] = rbf_map_learned(map) ? l->row[n][0]*i[0] + l->row[n][1]*i[1] + l->row[n][2]*i[2] + l->row[n][3]
		                            : rbf_map_get(map)->along[n] * i[n];
	}
}

/* The beam as a unit vector, for turns. */
static inline void rbf_map_turned(unsigned map, const rbf_linear *linear, const float i[3], float e[3])
{
	rbf_map_beam(map, linear, i, e);
	if (!rbf_map_learned(map)) {
		e[2] = i[2];
		return;
	}
	const float r = sqrtf(e[0]*e[0] + e[1]*e[1]), s = r > RBF_TURN_RADIUS ? RBF_TURN_RADIUS / r : 1;
	e[0] *= s;
	e[1] *= s;
	e[2] = sqrtf(1 - e[0]*e[0] - e[1]*e[1]);
}

/* The angle between incidences at which mirror would turn, or shift shift, as much as this map can within `margin` of incidence k. */
static inline float rbf_map_margin(unsigned map, const rbf_linear *linear, const float k[3], float margin)
{
	if (!rbf_map_learned(map))
		return margin;
	float norm = 0, e[2];
	for (int n = 0; n < 6; n++)
		norm += linear->row[n / 3][n % 3] * linear->row[n / 3][n % 3];
	const float d = sqrtf(norm) * 2 * sinf(.5f * fminf(margin, (float)RBF_PI));
	if (rbf_map_get(map)->kind == RBF_KIND_SHIFT)
		return 2 * asinf(fminf(.5f * d, 1.f));
	rbf_map_beam(map, linear, k, e);
	const float r = fminf(hypotf(e[0], e[1]), RBF_TURN_RADIUS), lo = fmaxf(r - d, 0.f), hi = fminf(r + d, RBF_TURN_RADIUS);
	const float z = sqrtf(1 - r*r), rise = fmaxf(sqrtf(1 - lo*lo) - z, z - sqrtf(1 - hi*hi));
	return 2 * asinf(fminf(.5f * sqrtf(d*d + rise*rise), 1.f));
}

/* A map made ready for incident direction i and a corner's measured direction k. fan.h does the same for all corners of a site. */
typedef struct rbf_warp {
	enum rbf_map_kind kind;
	float i[3], k[3];
	float m[9];      /* turn: the rotation; shift: the first two, by how much; else 0 */
	float cosine;    /* turn: of its angle; else 1 */
	float gain;      /* half: cos k / cos i; a site then evens those of its corners */
	float sine;      /* sine of the angle between i and k */
	float most;      /* half: limit of the change of solid angle */
} rbf_warp;

/* What the kinds of maps make ready, without a branch: the rotation from beam a to beam b; the shift; the change from incidence i to k. */
static inline void rbf_turn_set(rbf_warp *w, const float a[3], const float b[3])
{
	float v[3];
	rbf_cross(a, b, v);
	const float c = rbf_dot(a, b), t = 1 / rbf_max(1 + c, 1e-6f);
	w->m[0] = c + t*v[0]*v[0];    w->m[1] = t*v[0]*v[1] - v[2]; w->m[2] = t*v[0]*v[2] + v[1];
	w->m[3] = t*v[0]*v[1] + v[2]; w->m[4] = c + t*v[1]*v[1];    w->m[5] = t*v[1]*v[2] - v[0];
	w->m[6] = t*v[0]*v[2] - v[1]; w->m[7] = t*v[1]*v[2] + v[0]; w->m[8] = c + t*v[2]*v[2];
	w->cosine = c;
}

static inline void rbf_shift_set(rbf_warp *w, const float a[2], const float b[2])
{
	w->m[0] = b[0] - a[0];
	w->m[1] = b[1] - a[1];
}

static inline void rbf_half_set(rbf_warp *w)
{
	const float c = rbf_dot(w->i, w->k);
	w->gain = w->k[2] / rbf_max(w->i[2], 0.01f);
	w->sine = sqrtf(rbf_max(1 - c*c, 0.f));
	w->most = 1 + w->sine * RBF_SLANT_MAX;
}

/* The beam of incident direction i as a map needs it. */
static inline void rbf_map_source(unsigned map, const rbf_linear *linear, const float i[3], float a[3])
{
	if (rbf_map_get(map)->kind == RBF_KIND_TURN)
		rbf_map_turned(map, linear, i, a);
	else {
		a[2] = 0;
		rbf_map_beam(map, linear, i, a);
	}
}

/* All that a kind leaves alone. */
static inline void rbf_warp_clear(rbf_warp *w, enum rbf_map_kind kind, const float i[3], const float k[3])
{
	*w = (rbf_warp){.kind = kind, .i = {i[0], i[1], i[2]}, .k = {k[0], k[1], k[2]}, .gain = 1, .cosine = 1, .most = 1};
}

static inline void rbf_warp_set(rbf_warp *w, unsigned map, const rbf_linear *linear, const float i[3], const float k[3])
{
	float a[3], b[3];
	rbf_warp_clear(w, rbf_map_get(map)->kind, i, k);
	rbf_map_source(map, linear, i, a);
	rbf_map_source(map, linear, k, b);
	switch (w->kind) {
	case RBF_KIND_TURN: rbf_turn_set(w, a, b); break;
	case RBF_KIND_SHIFT: rbf_shift_set(w, a, b); break;
	case RBF_KIND_HALF: rbf_half_set(w); break;
	default: break;
	}
}

/* Of the shift maps: f is carried unchanged, so DSF as the cosines. Lobes do not end at the horizon, where DSF must: lower than
 * RBF_SHIFT_MIN_Z the factor falls to 0 there (as z squared, which is even in the directions), and nothing jumps. */
static inline float rbf_shift_factor(float z, float mapped_z)
{
	const float low = rbf_max(mapped_z, RBF_SHIFT_MIN_Z), t = mapped_z / low;
	return rbf_min(z / low, RBF_SHIFT_MOST) * (t * t);
}

/* One function for each kind and way, without a branch, so that many directions can be carried at once. */
static inline float rbf_turn_forward(const rbf_warp *w, const float o[3], float out[3])
{
	out[0] = w->m[0]*o[0] + w->m[1]*o[1] + w->m[2]*o[2];
	out[1] = w->m[3]*o[0] + w->m[4]*o[1] + w->m[5]*o[2];
	out[2] = w->m[6]*o[0] + w->m[7]*o[1] + w->m[8]*o[2];
	return 1;
}

static inline float rbf_half_forward(const rbf_warp *w, const float o[3], float out[3])
{
	const float s[3] = {w->i[0] + o[0], w->i[1] + o[1], w->i[2] + o[2]};
	const float q = rbf_dot(s, s), c = rbf_dot(s, w->k), ci = rbf_dot(s, w->i), t = 2 * c / q, held = w->most * c / ci;
	const int some = (c > 0) & (q > 1e-12f);
	out[0] = some ? t*s[0] - w->k[0] : 0;
	out[1] = some ? t*s[1] - w->k[1] : 0;
	out[2] = some ? t*s[2] - w->k[2] : -1;
	return some ? w->gain * (ci <= w->most * c ? 1 : held) : 0;
}

static inline float rbf_shift_forward(const rbf_warp *w, const float o[3], float out[3])
{
	const float x = o[0] + w->m[0], y = o[1] + w->m[1], z2 = 1 - x*x - y*y, z = sqrtf(rbf_max(z2, 0.f)), factor = rbf_shift_factor(o[2], z);
	out[0] = x;
	out[1] = y;
	out[2] = z2 > 0 ? z : z2;
	return z2 > 0 ? factor : 0;
}

static inline float rbf_same(const float o[3], float out[3])
{
	out[0] = o[0];
	out[1] = o[1];
	out[2] = o[2];
	return 1;
}

static inline float rbf_turn_inverse(const rbf_warp *w, const float p[3], float out[3])
{
	out[0] = w->m[0]*p[0] + w->m[3]*p[1] + w->m[6]*p[2];
	out[1] = w->m[1]*p[0] + w->m[4]*p[1] + w->m[7]*p[2];
	out[2] = w->m[2]*p[0] + w->m[5]*p[1] + w->m[8]*p[2];
	return 1;
}

static inline float rbf_half_inverse(const rbf_warp *w, const float p[3], float out[3])
{
	const float s[3] = {w->k[0] + p[0], w->k[1] + p[1], w->k[2] + p[2]};
	const float q = rbf_dot(s, s), ci = rbf_dot(s, w->i), ck = rbf_dot(s, w->k), t = 2 * ci / q;
	const float factor = w->gain * rbf_min(ci / ck, w->most); /* Walter et al. 2007, eq. 14: d(o) = 4 (o.h) d(h) */
	out[0] = t*s[0] - w->i[0];
	out[1] = t*s[1] - w->i[1];
	out[2] = t*s[2] - w->i[2];
	return (ci > 0) & (q > 1e-12f) & (ck > 0) ? factor : 0;
}

static inline float rbf_shift_inverse(const rbf_warp *w, const float p[3], float out[3])
{
	const float x = p[0] - w->m[0], y = p[1] - w->m[1], z2 = 1 - x*x - y*y;
	out[0] = x;
	out[1] = y;
	out[2] = sqrtf(rbf_max(z2, 0.f));
	const float factor = rbf_shift_factor(out[2], p[2]) * p[2] / rbf_max(out[2], 1e-12f);
	return (z2 > 0) & (p[2] > 0) ? factor : 0;
}

/* Takes exitant o at i to out at k. Returns the factor g in DSF_i(o) = g DSF_k(out), 0 if nothing corresponds. */
static inline float rbf_warp_forward(const rbf_warp *w, const float o[3], float out[3])
{
	switch (w->kind) {
	case RBF_KIND_TURN: return rbf_turn_forward(w, o, out);
	case RBF_KIND_HALF: return rbf_half_forward(w, o, out);
	case RBF_KIND_SHIFT: return rbf_shift_forward(w, o, out);
	default: return rbf_same(o, out);
	}
}

/* How far a mapped direction may be trusted, unless nothing moves: weight of a corner among corners, in (0, 1]. */
static inline float rbf_validity(float mapped_z)
{
	const float v = rbf_min(rbf_max(mapped_z * (1 / RBF_VALID_Z), RBF_VALID_LEAST), 1.f);
	return v * v;
}

/* Corners share a direction by their validity v, as v_k / sum w_l v_l, but at most so much, where one takes over from others; what is then left
 * of 1 goes to those below that alike. Turned, what comes from below the horizon is less certain; shifted or from facets, it is none. */
static inline float rbf_share_most(enum rbf_map_kind kind)
{
	return kind == RBF_KIND_TURN ? 1.5f : 2.f;
}

/* The same of a component's frame; 1: corners count by their weights alone. */
static inline float rbf_frame_limit(const rbf_component *c, uint32_t frame)
{
	const enum rbf_map_kind kind = rbf_map_get(c->frame[frame])->kind;
	return kind == RBF_KIND_FIXED ? 1 : c->limit ? c->limit[frame] : rbf_share_most(kind);
}
#define RBF_SHARE_OPEN 1e-6f /* weight of those below, at least */

/* Takes exitant p at k back to out at i. Returns g times the change of solid angle d(out)/d(p), the factor by which
 * the map changes a lobe's energy here; 0 if nothing corresponds. Never above rbf_warp_bound(). */
static inline float rbf_warp_inverse(const rbf_warp *w, const float p[3], float out[3])
{
	switch (w->kind) {
	case RBF_KIND_TURN: return rbf_turn_inverse(w, p, out);
	case RBF_KIND_HALF: return rbf_half_inverse(w, p, out);
	case RBF_KIND_SHIFT: return rbf_shift_inverse(w, p, out);
	default: return rbf_same(p, out);
	}
}

/* Bound of what rbf_warp_inverse() returns for a lobe of slant t = tan(half the largest angle between k and the lobe):
 * for the half map i.h / k.h <= cos a + sin a tan b, a between i and k, b between h and k. */
static inline float rbf_warp_bound(const rbf_warp *w, float t)
{
	return w->kind == RBF_KIND_HALF ? w->gain * (1 + w->sine * rbf_min(t, RBF_SLANT_MAX)) : 1.f;
}
#endif
