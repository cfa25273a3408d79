/* SPDX-License-Identifier: BSD-3-Clause */
#include "both_seen.h"
#include "vector.h"

static const float MUCH = .2f; /* of the hemisphere */

static int both_seen(const void *user, const float of_a[3], const float of_b[3])
{
	const rbf_both_seen *s = user;
	return rbf_seen_is(s->a, of_a) && rbf_seen_is(s->b, of_b);
}

const rbf_compared *rbf_both_seen_of(const rbf_seen *a, const rbf_seen *b, const float image[9], rbf_both_seen *both)
{
	*both = (rbf_both_seen){.a = a};
	if (!(rbf_max(a->share, b->share) > .5f * RBF_SEEN_ONE_SIDED))
		return NULL;
	const rbf_seen_shares share = rbf_seen_compare(a, b, image);
	*both = (rbf_both_seen){.a = a, .b = b, .where = {both_seen, both, share.both}};
	both->some = share.first > RBF_SEEN_ONE_SIDED || share.second > RBF_SEEN_ONE_SIDED;
	both->few = both->some && share.both < MUCH;
	return both->some ? &both->where : NULL;
}
