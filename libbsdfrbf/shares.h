/* SPDX-License-Identifier: BSD-3-Clause */
/* How the corners of a site share a direction (map.h). */
#ifndef RBF_SHARES_H
#define RBF_SHARES_H
#include "lanes.h"
#include "map.h"

/* Shares of the corners of these weights whose mapped directions have these z. limited: rbf_frame_limit(). No branch depends on the
 * direction: it could not be foreseen. */
static inline __attribute__((always_inline)) rbf_lanes rbf_shares(float limited, rbf_lanes weight, rbf_lanes z)
{
	if (!(limited > 1)) /* the same for all directions: none takes over */
		return rbf_lanes_all(1);
	/* as rbf_validity() */
	rbf_lanes v = z * (1 / RBF_VALID_Z);
	v = rbf_lanes_min(rbf_lanes_max(v, rbf_lanes_all(RBF_VALID_LEAST)), rbf_lanes_all(1));
	v *= v;
	/* rbf_frame_limit(), all times the sum of validities and the weight of those below: one division. A lane without a corner weighs nothing */
	const rbf_lanes most = rbf_lanes_all(limited);
	const rbf_lanes total = rbf_lanes_sum(v * weight), limit = most * total;
	const rbf_lane_mask below = v < limit;
	const rbf_lanes left = rbf_lanes_sum(weight * rbf_lanes_max(v - limit, rbf_lanes_all(0)));
	const rbf_lanes open = rbf_lanes_max(rbf_lanes_sum((rbf_lanes)((rbf_lane_mask)weight & below)), rbf_lanes_all(RBF_SHARE_OPEN));
	return rbf_lanes_min((v * open + (rbf_lanes)((rbf_lane_mask)left & below)) * (1 / (total * open)), most);
}
#endif
