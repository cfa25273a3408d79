/* SPDX-License-Identifier: BSD-3-Clause */
#include "mirrored.h"
#include "one_plane.h"
#include "seen.h"
#include "vector.h"

#include <stdlib.h>
#include <string.h>

enum { OPS = 3 };
static const double SAME = .25 * RBF_PI / 180; /* as far as devices repeat a direction */

/* Operations that leave an incidence where it is. Returns how many. */
static int own_images(rbf_symmetry symmetry, const double d[3], int op[4])
{
	const double off[4] = {INFINITY, 2 * fabs(d[0]), 2 * fabs(d[1]), 2 * hypot(d[0], d[1])};
	int all[4] = {RBF_OP_NONE, RBF_OP_Y, RBF_OP_X}, count = 0;
	const int ops = symmetry == RBF_ISOTROPIC ? OPS : rbf_symmetry_ops(symmetry, all);
	for (int n = 1; n < ops; n++)
		if (off[all[n]] < SAME)
			op[count++] = all[n];
	return count;
}

static void release(rbf_incidence *in)
{
	free(in->outgoing);
	free(in->dsf);
	in->outgoing = NULL;
	in->dsf = NULL;
	in->count = 0;
}

/* Those samples, mirrored, that fill what was not measured. */
static int mirror(const rbf_incidence *in, const rbf_seen *seen, unsigned op, size_t channels, rbf_incidence *to)
{
	to->outgoing = malloc((in->count + 1) * 3 * sizeof *to->outgoing);
	to->dsf = malloc((in->count + 1) * channels * sizeof *to->dsf);
	for (size_t i = 0; i < in->count && to->outgoing && to->dsf; i++) {
		const double *o = in->outgoing + 3*i, image[3] = {op & RBF_OP_X ? -o[0] : o[0], op & RBF_OP_Y ? -o[1] : o[1], o[2]};
		if (!rbf_seen_lacks(seen, (float[3]){(float)image[0], (float)image[1], (float)image[2]}))
			continue;
		memcpy(to->outgoing + 3 * to->count, image, sizeof image);
		memcpy(to->dsf + channels * to->count++, in->dsf + channels * i, channels * sizeof *to->dsf);
	}
	return to->outgoing && to->dsf ? 0 : -1;
}

/* What one operation adds. *share: of the hemisphere, what was not measured but its image. */
static int look(const rbf_incidence *in, unsigned op, size_t channels, rbf_incidence *more, float *share)
{
	const float image[9] = {op & RBF_OP_X ? -1 : 1, 0, 0, 0, op & RBF_OP_Y ? -1 : 1, 0, 0, 0, 1};
	rbf_seen seen;
	int failed = rbf_seen_make(in, &seen);
	*share = !failed && seen.share > .5f * RBF_SEEN_ONE_SIDED ? rbf_seen_compare(&seen, &seen, image).second : 0;
	if (!failed && *share > RBF_SEEN_ONE_SIDED)
		failed = rbf_seen_refine(&seen) || rbf_seen_band(&seen) || mirror(in, &seen, op, channels, more);
	rbf_seen_free(&seen);
	return failed ? -1 : 0;
}

/* All that its own images add, to an incidence that has its own arrays then. */
static int complete(const rbf_incidence *in, rbf_symmetry symmetry, size_t channels, rbf_incidence *to, float *share)
{
	double normal[3];
	int op[4];
	const int ops = in->count && !in->guessed && !rbf_one_plane_only(in, normal) ? own_images(symmetry, in->direction, op) : 0;
	int failed = 0;
	*share = 0;
	for (int n = 0; n < ops && !failed; n++) {
		rbf_incidence more = {0};
		float told;
		failed = look(to->count ? to : in, (unsigned)op[n], channels, &more, &told);
		if (!failed && more.count) {
			failed = (!to->count && rbf_incidence_append(to, in, channels)) || rbf_incidence_append(to, &more, channels);
			to->mirrored += more.count;
			*share += told;
		}
		release(&more);
	}
	return failed;
}

void rbf_mirrored_drop(rbf_measured *measured)
{
	for (size_t b = 0; b < measured->count; b++) {
		measured->incidence[b].count -= measured->incidence[b].mirrored;
		measured->incidence[b].mirrored = 0;
	}
}

int rbf_mirrored_add(rbf_symmetry symmetry, int channels, int owned, rbf_measured *measured, rbf_measured *own, float *most)
{
	const size_t count = measured->count;
	rbf_incidence *made = calloc(count + 1, sizeof *made), *room = realloc(own->incidence, (own->count + count + 1) * sizeof *room);
	float *share = calloc(count + 1, sizeof *share);
	int failed = !made || !room || !share;
	own->incidence = room ? room : own->incidence;
	*most = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)count; b++)
		if (made && share)
			failed |= complete(&measured->incidence[b], symmetry, (size_t)channels, &made[b], &share[b]) != 0;
	for (size_t b = 0; b < count && made && share; b++) {
		rbf_incidence *in = &measured->incidence[b];
		if (failed || !made[b].count) {
			release(&made[b]);
			continue;
		}
		*most = rbf_max(*most, share[b]);
		if (owned)
			release(in);
		in->outgoing = made[b].outgoing;
		in->dsf = made[b].dsf;
		in->count = made[b].count;
		in->mirrored = made[b].mirrored;
		if (!owned)
			own->incidence[own->count++] = *in;
	}
	free(made);
	free(share);
	return failed ? -1 : 0;
}
