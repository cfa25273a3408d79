/* SPDX-License-Identifier: BSD-3-Clause */
/* Evens the levels of a site's corners, as model.h has it. */
#ifndef RBF_EVEN_H
#define RBF_EVEN_H
#include "lanes.h"
#include "model.h"

/* Facets without shadows send out as 1/cos of the incidence, real surfaces less so: at most the same everywhere. The corners' weights,
 * whose sum is even for the one, are taken half way to those that are even for the other. gain: of a half map. */
static inline __attribute__((always_inline)) rbf_lanes rbf_facet_gain(rbf_lanes weight, rbf_lanes gain)
{
	const rbf_lanes total = rbf_lanes_sum(weight * gain);
	return gain / rbf_lanes_sqrt(rbf_lanes_max(total, rbf_lanes_all(1e-30f)));
}

/* The point of the mesh that the weights of the corners say. */
static inline __attribute__((always_inline)) void rbf_nearest(rbf_lanes weight, const rbf_lanes direction[3], rbf_lanes at[3])
{
	for (int n = 0; n < 3; n++)
		at[n] = rbf_lanes_sum(weight * direction[n]);
	const rbf_lanes scale = 1 / rbf_lanes_sqrt(rbf_lanes_max(at[0]*at[0] + at[1]*at[1] + at[2]*at[2], rbf_lanes_all(1e-30f)));
	for (int n = 0; n < 3; n++)
		at[n] *= scale;
}

/* From the weight of each corner: what it sends, before shares and maps. Corners that differ in what they send, as where facets reflect
 * the more the lower the incidence, are carried to what is common to them: but for slopes a power mean, close to the geometric one, that
 * is 0 only where all are.
 * level: of each lane, that of another corner where there is none. flip: signs by which corners are mirrored. gain: of the half map's fan,
 * the one kind whose factor changes what is sent, or NULL. incident: the site's incidence, at: the same, or the mesh's nearest point. */
static inline __attribute__((always_inline)) rbf_lanes rbf_even_parts(uint32_t even, const rbf_level *const level[RBF_WIDTH],
	rbf_lanes weight, const rbf_lanes flip[2], const rbf_lanes *gain, const rbf_lanes incident[3], const rbf_lanes at[3])
{
	const rbf_lanes none = rbf_lanes_all(1e-30f);
	const float *row[RBF_WIDTH];
	rbf_lanes of[4]; /* root and slope */
	for (int k = 0; k < RBF_WIDTH; k++)
		row[k] = &level[k]->root;
	rbf_lanes_columns(row, of);
	/* slopes are tangential: along their own direction there is none */
	const rbf_lanes rise = of[1] * (flip[0] * at[0]) + of[2] * (flip[1] * at[1]) + of[3] * at[2];
	const rbf_lanes plain = rbf_lanes_sum(weight * of[0]), sloped = rbf_lanes_sum(weight * (of[0] + .5f * rise));
	const rbf_lanes mean = rbf_lanes_min(rbf_lanes_max(sloped, plain * RBF_LEVEL_SLOPED_LEAST), plain * RBF_LEVEL_SLOPED_MOST);
	const rbf_lanes square = of[0] * of[0], middle = mean * mean;
	rbf_lanes here = square * square;
	if (gain) {
		for (int k = 0; k < RBF_WIDTH; k++)
			row[k] = &level[k]->kept;
		rbf_lanes_columns(row, of);
		const rbf_lanes carried = of[1] * (flip[0] * incident[0]) + of[2] * (flip[1] * incident[1]) + of[3] * incident[2];
		here *= rbf_lanes_max(of[0] + *gain * carried, rbf_lanes_all(RBF_LEVEL_CARRIED_LEAST));
	}
	const rbf_lanes together = middle * middle, ratio = rbf_lanes_min(together / rbf_lanes_max(here, none), rbf_lanes_all(RBF_LEVEL_MOST));
	const rbf_lanes missing = together / rbf_lanes_max(rbf_lanes_sum(weight * here * ratio), together * 1e-3f + none), all = ratio * missing;
	const float share = (float)even * (1.f / RBF_EVEN);
	return weight * (1 - share + share * all);
}
#endif
