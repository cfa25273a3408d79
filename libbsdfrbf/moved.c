/* SPDX-License-Identifier: BSD-3-Clause */
#include "moved.h"
#include "map.h"

static const unsigned MAP[RBF_MOVED] = {RBF_MAP_FIXED, RBF_MAP_MIRROR, RBF_MAP_RETRO};

void rbf_moved_difference(const rbf_lobes *a, const rbf_lobes *b, const float image[9], const float from[3], const float to[3], float lambertian,
	float more, const rbf_compared *where, float difference[RBF_MOVED])
{
	for (int way = 0; way < RBF_MOVED; way++) {
		rbf_warp warp;
		float turn[9];
		rbf_warp_set(&warp, MAP[way], NULL, from, to);
		for (int n = 0; n < 3; n++)
			for (int k = 0; k < 3; k++)
				turn[3*n + k] = warp.kind == RBF_KIND_TURN ? warp.m[3*n]*image[k] + warp.m[3*n + 1]*image[3 + k] + warp.m[3*n + 2]*image[6 + k]
					: image[3*n + k];
		difference[way] = rbf_difference_where(a, b, turn, lambertian, more, where);
	}
}

float rbf_moved_mirrored(const rbf_lobes *a, const float d[3], unsigned op, const rbf_lobes *b, const float to[3], float lambertian,
	float more, const rbf_compared *where)
{
	float image[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, from[3], difference[RBF_MOVED];
	rbf_mirror(op, image, image);
	rbf_mirror(op, image + 3, image + 3);
	rbf_mirror(op, d, from);
	rbf_moved_difference(a, b, image, from, to, lambertian, more, where, difference);
	return rbf_min(rbf_min(difference[0], difference[1]), difference[2]);
}
