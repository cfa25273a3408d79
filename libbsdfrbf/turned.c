/* SPDX-License-Identifier: BSD-3-Clause */
#include "turned.h"
#include "vector.h"
#include "vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SAME = .05 * RBF_PI / 180; /* polar angles: a plan's at other azimuths, as far as devices repeat them */

/* By an azimuth with that cosine and sine, back. */
static void turn(double d[3], double c, double q)
{
	const double x = d[0], y = d[1];
	d[0] = c * x + q * y;
	d[1] = c * y - q * x;
}

int rbf_turned_copy(rbf_measured *measured, int channels)
{
	int failed = 0;
	for (size_t b = 0; b < measured->count; b++) {
		rbf_incidence *in = &measured->incidence[b];
		const size_t values = in->count * (size_t)channels;
		double *outgoing = malloc((in->count + 1) * 3 * sizeof *outgoing);
		float *dsf = malloc((values + 1) * sizeof *dsf);
		rbf_ready_lobe *lobe = malloc((in->lobes + 1) * sizeof *lobe);
		failed |= !outgoing || !dsf || !lobe;
		if (in->count && !failed)
			memcpy(outgoing, in->outgoing, 3 * in->count * sizeof *outgoing);
		if (values && !failed)
			memcpy(dsf, in->dsf, values * sizeof *dsf);
		if (in->lobes && !failed)
			memcpy(lobe, in->lobe, in->lobes * sizeof *lobe);
		in->outgoing = outgoing;
		in->dsf = dsf;
		in->lobe = lobe;
	}
	return failed ? -1 : 0;
}

int rbf_turn(rbf_measured *measured, int channels, double *direction)
{
	if (rbf_turned_copy(measured, channels))
		return -1;
	for (size_t b = 0; b < measured->count; b++) {
		rbf_incidence *in = &measured->incidence[b];
		const double s = hypot(in->direction[0], in->direction[1]);
		const double c = s > 0 ? in->direction[0] / s : 1, q = s > 0 ? in->direction[1] / s : 0;
		for (size_t i = 0; i < in->count; i++)
			turn(in->outgoing + 3*i, c, q);
		for (size_t i = 0; i < in->lobes; i++)
			turn(in->lobe[i].centre, c, q);
		in->direction[0] = direction[3*b] = s;
		in->direction[1] = direction[3*b + 1] = 0;
	}
	return 0;
}

static void release(rbf_incidence *in)
{
	free(in->outgoing);
	free(in->dsf);
	free(in->lobe);
}

void rbf_turned_free(rbf_measured *measured)
{
	for (size_t b = 0; b < measured->count; b++)
		release(&measured->incidence[b]);
}

/* Appends the measured samples of another incidence, and frees it. */
static int append(rbf_incidence *to, rbf_incidence *other, size_t channels)
{
	to->count -= to->guessed;
	other->count -= other->guessed;
	to->guessed = other->guessed = 0;
	if (rbf_incidence_append(to, other, channels))
		return -1;
	release(other);
	return 0;
}

int rbf_turned_join(rbf_measured *turned, int channels, double *direction)
{
	rbf_incidence *all = turned->incidence;
	const size_t count = turned->count;
	size_t kept = 0;
	int failed = 0;
	for (size_t b = 0; b < count; b++) {
		size_t same = 0;
		while (same < kept && (failed || fabs(rbf_theta3(all[same].direction) - rbf_theta3(all[b].direction)) > SAME))
			same++;
		if (same < kept && !(failed = append(&all[same], &all[b], (size_t)channels)))
			continue;
		memcpy(direction + 3 * kept, direction + 3 * b, 3 * sizeof *direction);
		all[kept++] = all[b];
	}
	turned->count = kept;
	return failed ? -1 : (int)(count - kept);
}
