/* SPDX-License-Identifier: BSD-3-Clause */
/* Which samples a fit is kept from, to be judged by. */
#ifndef RBF_HELD_OUT_H
#define RBF_HELD_OUT_H
#include "lobes.h"
#include "measure.h"
#include "neighbours.h"

/* One of each so many that follow each other is held out, by chance which; others in each fold. Every so many are whole columns of many tables. */
#define RBF_HOLD_BY_CHANCE(of, fold) (0x80000000u | (uint32_t)(fold) << 16 | (uint32_t)(of))

/* hold: every hold-th sample, or by chance; 0 or 1: none. */
static inline int rbf_held_out(uint32_t hold, size_t i)
{
	const uint32_t of = hold & 0xffffu, fold = hold >> 16;
	if (of < 2)
		return 0;
	if (!fold)
		return i % of == of / 2;
	uint32_t chance = ((uint32_t)(i / of) + (fold - 0x8000u) * 0x3c6ef372u) * 0x9e3779b1u;
	chance = (chance ^ chance >> 15) * 0x85ebca6bu;
	return i % of == (chance ^ chance >> 13) % of;
}

/* Of the samples held out, one after the other: the solid angle each stands for, up to a common factor, as those in use tell, which are
 * folded to y >= 0 or not. To be freed; NULL when out of memory. */
float *rbf_held_out_areas(const rbf_incidence *incidence, uint32_t hold, int folded, const rbf_tree *used);

/* Relative L1 of lobes and the Lambertian part against them, channels weighted by mix. -1: none held out. */
float rbf_held_out_error(const rbf_incidence *incidence, int channels, uint32_t hold, const float lambertian[3], const float mix[3],
	const float *area, const rbf_lobes *lobes);

/* How much of that is noise (noise.h), by luminance. -1: out of memory. */
float rbf_held_out_noise(const rbf_incidence *incidence, int channels, uint32_t hold, const float lambertian[3], const float *area,
	const rbf_lobes *lobes);
#endif
