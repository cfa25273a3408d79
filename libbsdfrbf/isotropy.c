/* SPDX-License-Identifier: BSD-3-Clause */
#include "isotropy.h"
#include "moved.h"

#include <stdlib.h>

#define DEGREE ((float)RBF_PI / 180)
enum { LEAST_TOLD = 3 };
enum { SURE = 16 };                          /* pairs after which a mean so many times enough is sure to stay above it: */
static const float CLEAR = 4;
enum { OTHERS = 4 }; /* incidences that one is compared with, at most: of a ring those spread over it */
static const float NEAR_NORMAL = 5 * DEGREE; /* azimuths mean little there */
static const float LIKE = 2 * DEGREE;        /* polar angles, at most */
static const float RING = .25f * DEGREE;     /* that are one */
static const float TURNED = 10 * DEGREE;     /* azimuths, at least */

typedef struct spot { float theta, phi; } spot;

/* How far incidence o is from b, turned about the normal to o's azimuth. */
static void turned_difference(const rbf_fitted *m, const spot *at, uint32_t b, uint32_t o, float lambertian, float difference[RBF_MOVED])
{
	const float c = cosf(at[o].phi - at[b].phi), s = sinf(at[o].phi - at[b].phi), z[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
	float from[3], to[3];
	for (int n = 0; n < 3; n++) {
		to[n] = (float)m->direction[3*o + (uint32_t)n];
		from[n] = 0;
		for (int k = 0; k < 3; k++)
			from[n] += z[3*n + k] * (float)m->direction[3*b + (uint32_t)k];
	}
	rbf_moved_difference(&m->lobes[b], &m->lobes[o], z, from, to, lambertian, 0, NULL, difference);
}

/* Those that incidence b is compared with. */
static uint32_t find_others(const rbf_fitted *m, const spot *at, uint32_t b, uint32_t *ring, uint32_t other[OTHERS])
{
	float near = LIKE;
	uint32_t count = 0;
	for (int pass = 0; pass < 2; pass++)
		for (uint32_t o = 0; o < m->bases; o++) {
			const float apart = fabsf(at[o].theta - at[b].theta), turned = fabsf(remainderf(at[o].phi - at[b].phi, 2 * (float)RBF_PI));
			if (o == b || turned < TURNED || at[o].theta < NEAR_NORMAL)
				continue;
			if (!pass)
				near = fminf(near, apart);
			else if (apart <= LIKE && apart <= near + RING)
				ring[count++] = o;
		}
	const uint32_t some = count < OTHERS ? count : OTHERS;
	for (uint32_t n = 0; n < some; n++)
		other[n] = ring[(2*n + 1) * count / (2*some)];
	return some;
}

int rbf_isotropy_of(const rbf_fitted *m, float lambertian, float enough, float *error)
{
	spot *at = malloc((m->bases + 1) * sizeof *at);
	uint32_t *ring = malloc((m->bases + 1) * sizeof *ring), asked = 0, pairs = 0, told = 0;
	double sum[RBF_MOVED] = {0};
	float least = INFINITY;
	const int failed = !at || !ring;
	for (uint32_t b = 0; b < m->bases && !failed; b++) {
		const double *d = m->direction + 3*b;
		at[b] = (spot){(float)atan2(hypot(d[0], d[1]), d[2]), (float)atan2(d[1], d[0])};
		asked += at[b].theta >= NEAR_NORMAL;
	}
	for (uint32_t b = 0; b < m->bases && !failed && !(pairs >= SURE && least > CLEAR * enough); b++) {
		uint32_t other[OTHERS];
		const uint32_t count = at[b].theta < NEAR_NORMAL ? 0 : find_others(m, at, b, ring, other);
		for (uint32_t n = 0; n < count; n++, pairs++) {
			float difference[RBF_MOVED];
			turned_difference(m, at, b, other[n], lambertian, difference);
			for (int k = 0; k < RBF_MOVED; k++)
				sum[k] += (double)difference[k];
		}
		told += count > 0;
		least = INFINITY;
		for (int k = 0; k < RBF_MOVED && pairs; k++)
			least = fminf(least, (float)(sum[k] / pairs));
	}
	free(at);
	free(ring);
	*error = least < INFINITY && told >= LEAST_TOLD && (least > enough || 2 * told >= asked) ? least : -1;
	return failed ? -1 : 0;
}
