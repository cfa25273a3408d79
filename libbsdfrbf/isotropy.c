/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Fits of what is the same, measured twice, differ by the errors of both: sqrt(s^2 + s'^2) on average where these are s and s'. What differs by no more,
 * turned about the normal, is isotropic as far as the data can tell. Where no other incidence has the same polar angle, one above and one below tell
 * together: a difference of two degrees in the polar angle would hide what is looked for.
 */
#include "isotropy.h"
#include "both_seen.h"
#include "difference.h"
#include "map.h"

#include <stdlib.h>
#include <string.h>

#define DEGREE ((float)RBF_PI / 180)
enum { LEAST_TOLD = 3 };
enum { SURE = 16 };                          /* comparisons after which a mean so many times enough is sure to stay above it: */
static const double CLEAR = 4;
enum { OTHERS = 4 };                         /* incidences of a ring that one is compared with, at most: those spread over it */
static const float NEAR_NORMAL = 5 * DEGREE; /* azimuths mean little there */
static const float NORMAL = .5f * DEGREE;    /* and nothing here */
static const float APART = 4 * DEGREE;       /* polar angles of two that tell together, at most */
static const float RING = .25f * DEGREE;     /* that are one */
static const float TURNED = 10 * DEGREE;     /* azimuths, at least */
enum { FOLDS = 8 };                          /* times that a material may repeat in a turn */
static const float REPEATED = 1 * DEGREE;
static const float GOLDEN = 137.5078f * DEGREE; /* its multiples are none of a period */
static const double ROUND = 1.5;             /* times what fits differ by, that a few of them may */

typedef struct spot { float theta, phi; } spot;

/* What is compared with an incidence: one other, or two that tell of it together, or itself. */
typedef struct partner {
	uint32_t count, other[2];
	float weight[2];
	float turn; /* of itself */
	int mirrored; /* itself, at the plane of incidence */
} partner;

/* Sums of comparisons. */
typedef struct tally {
	uint32_t count;
	double difference[3]; /* by ways in which a beam moves with the incident direction */
	double noise;
} tally;

/* Rotation about the normal from o's azimuth to b's, or what an incidence is compared with itself by. */
static void turn_of(const spot *at, uint32_t b, uint32_t o, const partner *p, float z[9])
{
	const float angle = p->mirrored ? 2 * at[b].phi : at[b].phi - at[o].phi + p->turn, c = cosf(angle), s = sinf(angle), to = p->mirrored ? -1 : 1;
	memcpy(z, (float[9]){c, -to * s, 0, s, to * c, 0, 0, 0, 1}, 9 * sizeof *z);
}

static void apply(const float m[9], const float from[3], float to[3])
{
	for (int n = 0; n < 3; n++)
		to[n] = m[3*n]*from[0] + m[3*n + 1]*from[1] + m[3*n + 2]*from[2];
}

/* What is told of b, as lobes in its place. */
static int tell(const rbf_fitted *m, const spot *at, uint32_t b, const partner *p, unsigned map, rbf_lobes *told)
{
	uint32_t count = 0, place = 0;
	for (uint32_t n = 0; n < p->count; n++)
		count += m->lobes[p->other[n]].count;
	if (rbf_lobes_new(told, count, m->channels))
		return -1;
	for (uint32_t n = 0; n < p->count; n++) {
		const double *is = m->direction + 3*b, *was = m->direction + 3*p->other[n];
		const float to[3] = {(float)is[0], (float)is[1], (float)is[2]}, other[3] = {(float)was[0], (float)was[1], (float)was[2]};
		const rbf_lobes *l = &m->lobes[p->other[n]];
		float z[9], from[3];
		rbf_warp warp;
		turn_of(at, b, p->other[n], p, z);
		apply(z, other, from);
		rbf_warp_set(&warp, map, NULL, from, to);
		for (uint32_t i = 0; i < l->count; i++, place++) {
			float centre[3], moved[3];
			rbf_lobe_centre(l, i, centre);
			apply(z, centre, moved);
			if (p->other[n] != b && warp.kind == RBF_KIND_TURN) {
				memcpy(centre, moved, sizeof centre);
				apply(warp.m, centre, moved);
			}
			rbf_lobe_set(told, place, moved, rbf_lobe_kappa(l, i));
			told->mass[place] = (double)p->weight[n] * l->mass[i];
			for (uint32_t y = 0; y < m->channels; y++)
				told->amplitude[y * told->blocks + place / RBF_LANES].a[place % RBF_LANES] = p->weight[n] * rbf_lobe_amplitude(l, y, i);
		}
	}
	return rbf_lobes_finish(told);
}

/* Where b and one that tells of it were both measured; back: from b's place to the other's. */
typedef struct sight { const rbf_seen *b, *other; float back[9]; } sight;

static int both_seen(const void *user, const float of_b[3], const float of_told[3])
{
	const sight *s = user;
	float there[3];
	(void)of_told; /* in b's place, too */
	apply(s->back, of_b, there);
	return rbf_seen_is(s->b, of_b) && rbf_seen_is(s->other, there);
}

/* What is to be asked where b is compared, NULL: everything counts. *few: too little counts; more than one other is not asked then. */
static const rbf_compared *seen_by(const spot *at, uint32_t b, const partner *p, const rbf_seen *seen, sight *s, rbf_compared *where, int *few)
{
	*few = 0;
	for (uint32_t n = 0; n < p->count && seen; n++) {
		rbf_both_seen both;
		float z[9];
		turn_of(at, b, p->other[n], p, z);
		*s = (sight){&seen[b], &seen[p->other[n]], {z[0], z[3], z[6], z[1], z[4], z[7], z[2], z[5], z[8]}};
		if (!rbf_both_seen_of(s->b, s->other, s->back, &both))
			continue;
		*few = both.few || p->count > 1;
		*where = (rbf_compared){both_seen, s, both.where.share};
		return where;
	}
	return NULL;
}

/* seen: as in isotropy.h. Returns 0, or -1 when out of memory. */
static int compare(const rbf_fitted *m, const spot *at, uint32_t b, const partner *p, float lambertian, const float *scatter, const rbf_seen *seen, tally *t)
{
	static const unsigned map[3] = {RBF_MAP_FIXED, RBF_MAP_MIRROR, RBF_MAP_RETRO};
	double square = scatter ? pow((double)scatter[b], 2) : 0, same = 0;
	sight s;
	rbf_compared some;
	int few;
	const rbf_compared *where = seen_by(at, b, p, seen, &s, &some, &few);
	if (few)
		return 0;
	for (uint32_t n = 0; n < p->count && scatter; n++)
		square += pow((double)(p->weight[n] * scatter[p->other[n]]), 2);
	for (int way = 0; way < 3; way++) {
		rbf_lobes told;
		if (!way || p->count > 1) { /* at the same polar angle all ways are one */
			const int failed = tell(m, at, b, p, map[way], &told);
			same = failed ? 0 : (double)rbf_difference_where(&m->lobes[b], &told, NULL, lambertian, 0, where);
			rbf_lobes_free(&told);
			if (failed)
				return -1;
		}
		t->difference[way] += same;
	}
	t->noise += sqrt(square);
	t->count++;
	return 0;
}

static double least(const tally *t)
{
	return fmin(fmin(t->difference[0], t->difference[1]), t->difference[2]);
}

static float beyond_noise(const tally *t)
{
	const double square = least(t) * least(t) - t->noise * t->noise;
	return t->count ? (float)(sqrt(fmax(square, 0)) / t->count) : 0;
}

/* What is compared with b: others of its ring, one by one; or those above and below it together. Returns how many. */
static uint32_t find_partners(const rbf_fitted *m, const spot *at, uint32_t b, uint32_t *ring, partner found[OTHERS])
{
	float below = APART, above = APART;
	uint32_t count = 0, pair[2] = {b, b};
	for (uint32_t o = 0; o < m->bases; o++) {
		const float higher = at[o].theta - at[b].theta, turned = fabsf(remainderf(at[o].phi - at[b].phi, 2 * (float)RBF_PI));
		if (o == b || turned < TURNED || at[o].theta < NEAR_NORMAL)
			continue;
		if (fabsf(higher) <= RING)
			ring[count++] = o;
		else if (higher < 0 && -higher < below) {
			below = -higher;
			pair[0] = o;
		} else if (higher > 0 && higher < above) {
			above = higher;
			pair[1] = o;
		}
	}
	const uint32_t some = count < OTHERS ? count : OTHERS;
	for (uint32_t n = 0; n < some; n++)
		found[n] = (partner){.count = 1, .other = {ring[(2*n + 1) * count / (2*some)]}, .weight = {1}};
	if (some || pair[0] == b || pair[1] == b)
		return some;
	found[0] = (partner){.count = 2, .other = {pair[0], pair[1]}, .weight = {above / (above + below), below / (above + below)}};
	return 1;
}

/* In how many parts of a turn all azimuths are the same; 0: in none. */
static uint32_t folds(uint32_t bases, const spot *at)
{
	for (uint32_t n = 2; n <= FOLDS; n++) {
		const float period = 2 * (float)RBF_PI / (float)n;
		const spot *first = NULL;
		int all = 1;
		for (uint32_t b = 0; b < bases; b++) {
			if (at[b].theta < NEAR_NORMAL)
				continue;
			first = first ? first : &at[b];
			all &= fabsf(remainderf(at[b].phi - first->phi, period)) < REPEATED;
		}
		if (all)
			return n;
	}
	return 0;
}

/* Incidences compared with themselves: along the normal, turned; or else mirrored. */
static int ask_each(const rbf_fitted *m, const spot *at, float lambertian, const float *scatter, const rbf_seen *seen, tally *t)
{
	int failed = 0;
	for (uint32_t b = 0; b < m->bases && !failed; b++)
		for (int n = 1; n <= OTHERS && at[b].theta < NORMAL && !failed; n++)
			failed = compare(m, at, b, &(partner){.count = 1, .other = {b}, .weight = {1}, .turn = (float)n * GOLDEN}, lambertian, scatter, seen, t);
	const int normal = t->count > 0;
	for (uint32_t b = 0; b < m->bases && !normal && !failed; b++)
		failed = compare(m, at, b, &(partner){.count = 1, .other = {b}, .weight = {1}, .mirrored = 1}, lambertian, scatter, seen, t);
	return failed;
}

int rbf_isotropy_of(const rbf_fitted *m, float lambertian, const float *scatter, const rbf_seen *seen, float enough, rbf_isotropy *found)
{
	spot *at = malloc((m->bases + 1) * sizeof *at);
	uint32_t *ring = malloc((m->bases + 1) * sizeof *ring), asked = 0, told = 0;
	tally others = {0}, each = {0};
	int failed = !at || !ring, sure = 0;
	*found = (rbf_isotropy){.error = -1};
	for (uint32_t b = 0; b < m->bases && !failed; b++) {
		const double *d = m->direction + 3*b;
		at[b] = (spot){(float)atan2(hypot(d[0], d[1]), d[2]), (float)atan2(d[1], d[0])};
		asked += at[b].theta >= NEAR_NORMAL;
	}
	for (uint32_t b = 0; b < m->bases && !failed && !sure; b++) {
		partner with[OTHERS];
		const uint32_t count = at[b].theta < NEAR_NORMAL ? 0 : find_partners(m, at, b, ring, with);
		const uint32_t before = others.count;
		for (uint32_t n = 0; n < count && !failed; n++)
			failed = compare(m, at, b, &with[n], lambertian, scatter, seen, &others);
		told += others.count > before;
		sure = others.count >= SURE && least(&others) > CLEAR * fmax(others.noise, others.count * (double)enough);
	}
	if (!failed && told >= LEAST_TOLD && (sure || 2 * told >= asked)) {
		const double most = fmax(others.noise, others.count * (double)enough);
		found->error = (float)(least(&others) / others.count);
		found->beyond = beyond_noise(&others);
		found->isotropic = least(&others) <= most;
		found->folds = folds(m->bases, at);
		if (!sure && found->folds) {
			failed = ask_each(m, at, lambertian, scatter, seen, &each);
			found->isotropic = found->isotropic && least(&each) <= fmax(ROUND * each.noise, each.count * (double)enough);
			found->beyond = fmaxf(found->beyond, beyond_noise(&each));
		}
	}
	free(at);
	free(ring);
	return failed ? -1 : 0;
}
