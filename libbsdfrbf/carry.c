/* SPDX-License-Identifier: BSD-3-Clause */
#include "carry.h"
#include "clones.h"

#include <string.h>

#define EACH for (int i = 0; i < steps * RBF_CARRY_STEP; i++)

#define CARRY_BACK(name, inverse) \
	RBF_CLONES static void name(const rbf_warp *warp, int steps, const rbf_carry_row p[3], rbf_carry_row *restrict e, float *restrict factor) \
	{ \
		EACH { \
			const float from[3] = {p[0][i], p[1][i], p[2][i]}; \
			float out[3]; \
			factor[i] = inverse(warp, from, out); \
			e[0][i] = out[0]; \
			e[1][i] = out[1]; \
			e[2][i] = out[2]; \
		} \
	}
CARRY_BACK(back_turn, rbf_turn_inverse)
CARRY_BACK(back_half, rbf_half_inverse)
CARRY_BACK(back_shift, rbf_shift_inverse)

static int steps_of(int count)
{
	return (count + RBF_CARRY_STEP - 1) / RBF_CARRY_STEP;
}

void rbf_carry_back(const rbf_site *site, uint32_t corner, uint32_t frame, int count, const rbf_carry_row p[3], rbf_carry_row e[3],
	rbf_carry_row factor)
{
	const int steps = steps_of(count);
	rbf_warp warp;
	rbf_site_warp(site, corner, frame, &warp);
	switch (warp.kind) {
	case RBF_KIND_TURN: back_turn(&warp, steps, p, e, factor); return;
	case RBF_KIND_HALF: back_half(&warp, steps, p, e, factor); return;
	case RBF_KIND_SHIFT: back_shift(&warp, steps, p, e, factor); return;
	default:
		memcpy(e, p, 3 * sizeof *e);
		EACH
			factor[i] = 1;
	}
}

/* How valid each direction is at a corner (map.h); adds weight times that to the total. */
#define VALIDITY(name, forward) \
	RBF_CLONES static void name(const rbf_warp *warp, int steps, const rbf_carry_row e[3], float weight, float *restrict total, \
		float *restrict valid) \
	{ \
		EACH { \
			const float o[3] = {e[0][i], e[1][i], e[2][i]}; \
			float out[3]; \
			forward(warp, o, out); \
			valid[i] = rbf_validity(out[2]); \
			total[i] += weight * valid[i]; \
		} \
	}
VALIDITY(valid_turn, rbf_turn_forward)
VALIDITY(valid_half, rbf_half_forward)
VALIDITY(valid_shift, rbf_shift_forward)

/* As rbf_shares_at(): what a corner leaves to those below rbf_frame_limit(), or its weight if it is one of them; and the share. */
RBF_CLONES static void leave(int steps, const float *restrict valid, const float *restrict total, float weight, float most,
	float *restrict left, float *restrict open)
{
	EACH {
		const float limit = most * total[i];
		left[i] += weight * rbf_max(valid[i] - limit, 0);
		open[i] += valid[i] < limit ? weight : 0;
	}
}

RBF_CLONES static void take(int steps, const float *restrict valid, const float *restrict total, float most, const float *restrict left,
	const float *restrict open, float *restrict share)
{
	EACH {
		const float below = rbf_max(open[i], RBF_SHARE_OPEN), more = valid[i] < most * total[i] ? left[i] : 0;
		share[i] = rbf_min((valid[i] * below + more) / (total[i] * below), most);
	}
}

void rbf_carry_shares(const rbf_site *site, uint32_t corner, uint32_t frame, int count, const rbf_carry_row e[3], rbf_carry_row share)
{
	const int steps = steps_of(count);
	const enum rbf_map_kind kind = site->fan[frame].kind;
	const float most = site->fan[frame].limit;
	rbf_carry_row total, valid[3], left, open;
	EACH
		total[i] = left[i] = open[i] = 0;
	for (uint32_t k = 0; k < site->corners; k++) {
		rbf_warp warp;
		rbf_site_warp(site, k, frame, &warp);
		switch (most > 1 ? kind : RBF_KIND_FIXED) {
		case RBF_KIND_TURN: valid_turn(&warp, steps, e, site->weight[k], total, valid[k]); break;
		case RBF_KIND_HALF: valid_half(&warp, steps, e, site->weight[k], total, valid[k]); break;
		case RBF_KIND_SHIFT: valid_shift(&warp, steps, e, site->weight[k], total, valid[k]); break;
		default:
			EACH {
				valid[k][i] = 1;
				total[i] += site->weight[k];
			}
		}
	}
	for (uint32_t k = 0; k < site->corners; k++)
		leave(steps, valid[k], total, site->weight[k], most, left, open);
	take(steps, valid[corner], total, most, left, open, share);
}
