/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Tables by which sample.c draws a lobe: for each set, running sums of a bound of every lobe's part, in 1/65535 of their total.
 *
 *   MASS   m, the lobe's luminance, sr
 *   BAND   m b (1 + S T): b, the part of the lobe that may lie where its corner takes over from another (takeover.h), in the band above
 *          the horizon (set.band); S, the largest sine between the measured incidence and one that it serves
 *   SLANT  m T: T bounds the slope of the half map's change of solid angle for directions of the lobe
 *
 * Shares are rounded up, so that they stay bounds. A lobe of share q in a table has the bound q unit, unit = set.unit[table].
 */
#ifndef RBF_DRAWS_H
#define RBF_DRAWS_H
#include "map.h"

enum { RBF_DRAW_MASS, RBF_DRAW_BAND, RBF_DRAW_SLANT };
#define RBF_DRAW_TOTAL 65535

#define RBF_LOBE_SPREAD 4.f /* sigmas that T covers: all but 3e-4 of a lobe */
#define RBF_LOBE_SHARP 20.f /* a kappa above it leaves nothing (e^-40) at the other end of the sphere */

/* What the bounds of a lobe depend on, angles in radians. */
typedef struct rbf_reach {
	unsigned map;
	const rbf_linear *linear; /* of a learned one */
	float base[3];       /* measured incidence */
	float limit;         /* rbf_frame_limit() */
	float margin;        /* largest angle to a neighbouring vertex, as rbf_map_margin() */
	float beyond;        /* largest angle to an incident direction that the base serves */
	float motion;        /* largest residual motion of the lobes */
} rbf_reach;

/* Tables that a component has: of masses; of bands, unless no corner takes over; of slants, where it has a half map. */
static inline uint32_t rbf_draw_tables(const rbf_component *c)
{
	uint32_t tables = 1;
	for (uint32_t f = 0; f < c->frames; f++) {
		const enum rbf_map_kind kind = rbf_map_get(c->frame[f])->kind;
		const uint32_t needs = kind == RBF_KIND_HALF ? 3 : rbf_frame_limit(c, f) > 1 ? 2 : 1;
		tables = needs > tables ? needs : tables;
	}
	return tables;
}

/* T of a lobe: 0 but for half maps. */
float rbf_lobe_slant(const rbf_reach *reach, const float centre[3], float kappa);

/* z of the band's upper edge for lobes that move by reach->motion at most; 1: everywhere. */
float rbf_draw_band(const rbf_reach *reach);

/* 1 - cos of the angle between a lobe at height z and a band: what is nearer is not in the band. 0 for broad lobes. */
static inline float rbf_lobe_gap(float z, float kappa, float band)
{
	if (kappa <= RBF_LOBE_SHARP || z <= band)
		return 0;
	const float up = z - band, along = sqrtf(rbf_max(1 - z*z, 0.f)) - sqrtf(rbf_max(1 - band*band, 0.f));
	return .5f * (up*up + along*along);
}

/* Fills in set.unit, set.band and the tables of a component whose arrays are there. Returns 0, or -1 when out of memory. */
int rbf_draws_make(rbf_component *component);
#endif
