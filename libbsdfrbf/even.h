/* SPDX-License-Identifier: BSD-3-Clause */
/* Evens the levels of a site's corners: what each sends, part[], as model.h has it. */
#ifndef RBF_EVEN_H
#define RBF_EVEN_H
#include "evaluate.h"

/* The fan of a half map, the one kind whose factor changes what is sent, or NULL. */
static inline __attribute__((always_inline)) const rbf_fan *rbf_half_fan(const rbf_site *site)
{
	const rbf_fan *half = NULL;
	for (uint32_t f = 0; f < site->component->frames; f++)
		half = site->fan[f].kind == RBF_KIND_HALF ? &site->fan[f] : half;
	return half;
}

/* Corners that differ in what they send, as where facets reflect the more the lower the incidence, are carried to what is common to them: but
 * for slopes a power mean, close to the geometric one, that is 0 only where all are.
 * level: of each corner, the last one's again where there is none. at: the site's incidence, or the mesh's nearest point. The site's fans
 * are set. */
static inline __attribute__((always_inline)) void rbf_even_levels(rbf_site *site, uint32_t even, const rbf_level *const level[3], const float at[3])
{
	const rbf_lanes weight = rbf_lanes_load(site->weight), none = rbf_lanes_all(1e-30f);
	const rbf_lanes flip[2] = {rbf_lanes_load(site->flip[0]), rbf_lanes_load(site->flip[1])};
	const rbf_fan *half = rbf_half_fan(site);
	rbf_lanes of[4]; /* root and slope */
	for (int k = 0; k < 4; k++)
		of[k] = rbf_lanes_load(&level[k < 3 ? k : 2]->root);
	rbf_lanes_transpose(of);
	/* slopes are tangential: along their own direction there is none */
	const rbf_lanes rise = of[1] * (flip[0] * at[0]) + of[2] * (flip[1] * at[1]) + of[3] * at[2];
	const rbf_lanes plain = rbf_lanes_sum(weight * of[0]), sloped = rbf_lanes_sum(weight * (of[0] + .5f * rise));
	const rbf_lanes mean = rbf_lanes_min(rbf_lanes_max(sloped, plain * RBF_LEVEL_SLOPED_LEAST), plain * RBF_LEVEL_SLOPED_MOST), square = of[0] * of[0], middle = mean * mean;
	rbf_lanes here = square * square;
	if (half) {
		for (int k = 0; k < 4; k++)
			of[k] = rbf_lanes_load(&level[k < 3 ? k : 2]->kept);
		rbf_lanes_transpose(of);
		const rbf_lanes carried = of[1] * (flip[0] * site->incident[0]) + of[2] * (flip[1] * site->incident[1]) + of[3] * site->incident[2];
		here *= rbf_lanes_max(of[0] + rbf_lanes_load(half->gain) * carried, rbf_lanes_all(RBF_LEVEL_CARRIED_LEAST));
	}
	const rbf_lanes together = middle * middle, ratio = rbf_lanes_min(together / rbf_lanes_max(here, none), rbf_lanes_all(RBF_LEVEL_MOST));
	const rbf_lanes missing = together / rbf_lanes_max(rbf_lanes_sum(weight * here * ratio), together * 1e-3f + none), all = ratio * missing;
	const float share = (float)even * (1.f / RBF_EVEN);
	rbf_lanes_store(site->part, weight * (1 - share + share * all));
}
#endif
