/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A mirror plane of a material takes an incidence beside it to an image close by, which is compared with the incidence itself, moved by the small
 * angle between in the way of a frame that makes the least of it. The plane where these differ least is the material's own. If the material is
 * turned, samples and incident directions turn with it. If only incident azimuths were counted from elsewhere, these turn alone, and all light
 * leaves at an angle to where it should.
 */
#include "offset.h"
#include "sample.h"

#include <math.h>
#include <stdlib.h>

#define DEGREE (RBF_PI / 180)
enum { PAIRS = 32, DRAWS = 128 }; /* at most */
static const double BY = 6;       /* degrees of arc between an incidence and the plane */
static const double MOST = 5;     /* degrees that are looked for */
static const double STEPS[] = {1, .25};
static const unsigned MAP[] = {RBF_MAP_FIXED, RBF_MAP_MIRROR, RBF_MAP_RETRO, RBF_MAP_HALF, RBF_MAP_SHIFT};

/* An incidence by a plane, and where it sends light. */
typedef struct pair {
	uint32_t base, draws;
	int op;
	double part; /* of its light, that has lobes */
	float drawn[DRAWS][3], value[DRAWS];
} pair;

typedef struct search {
	const rbf_fitted *fitted;
	uint32_t pairs;
	pair pair[PAIRS];
} search;

static void draw(const rbf_lobes *l, float lambertian, pair *p)
{
	double total = 0;
	for (uint32_t i = 0; i < l->count; i++)
		total += l->mass[i];
	double running = l->count ? l->mass[0] : 0;
	p->part = total > 0 ? total / (total + (double)lambertian) : 0;
	for (uint32_t n = 0, lobe = 0; n < DRAWS && total > 0; n++) {
		float centre[3], *o = p->drawn[p->draws];
		while (lobe + 1 < l->count && running < (n + .5) / DRAWS * total)
			running += l->mass[++lobe];
		rbf_lobe_centre(l, lobe, centre);
		rbf_lobe_draw(centre, rbf_lobe_kappa(l, lobe), fmod(n * .7548776662 + .5, 1), fmod(n * .5698402910, 1), o);
		if (o[2] > 0)
			p->value[p->draws++] = rbf_lobes_luminance(l, o);
	}
}

/* Incidences by the planes; every so many, if there are many. */
static void find_pairs(search *s, rbf_symmetry symmetry, float lambertian)
{
	const rbf_fitted *m = s->fitted;
	int op[4] = {RBF_OP_NONE, RBF_OP_Y}, ops = 2;
	uint64_t all = 0;
	if (symmetry != RBF_ISOTROPIC)
		ops = rbf_symmetry_ops(symmetry, op);
	for (int pass = 0; pass < 2; pass++) {
		uint64_t n = 0;
		for (uint32_t b = 0; b < m->bases; b++)
			for (int i = 1; i < ops; i++) {
				if (op[i] == RBF_OP_XY || fabs(m->direction[3*b + (op[i] == RBF_OP_Y)]) > sin(BY * DEGREE))
					continue;
				if (pass && (all <= PAIRS || n * PAIRS / all == s->pairs)) {
					pair *p = &s->pair[s->pairs++];
					*p = (pair){.base = b, .op = op[i]};
					draw(&m->lobes[b], lambertian, p);
				}
				n++;
			}
		all = n;
	}
}

static void turn(double degrees, const float d[3], float turned[3])
{
	const float c = (float)cos(degrees * DEGREE), s = (float)sin(degrees * DEGREE), x = d[0], y = d[1];
	turned[0] = c * x - s * y;
	turned[1] = s * x + c * y;
	turned[2] = d[2];
}

/* Relative difference between an incidence and its image, at `from`, moved to it. image: of exitant directions, its own inverse. */
static double difference_of(const search *s, const pair *p, const float own[3], const float from[3], const float image[9])
{
	double least = INFINITY;
	for (size_t way = 0; way < sizeof MAP / sizeof *MAP; way++) {
		rbf_warp warp;
		double sum = 0;
		rbf_warp_set(&warp, MAP[way], NULL, own, from);
		for (uint32_t n = 0; n < p->draws; n++) {
			float mapped[3], o[3];
			const float gain = rbf_warp_forward(&warp, p->drawn[n], mapped);
			for (int k = 0; k < 3; k++)
				o[k] = image[3*k]*mapped[0] + image[3*k + 1]*mapped[1] + image[3*k + 2]*mapped[2];
			const double here = p->value[n], there = gain > 0 ? (double)(gain * rbf_lobes_luminance(&s->fitted->lobes[p->base], o)) : 0;
			sum += fabs(here - there) / fmax(here + there, 1e-30);
		}
		least = fmin(least, sum);
	}
	return p->draws ? 2 * p->part * least / p->draws : 0;
}

/* Mean difference after a turn of all, or of incident directions alone. */
static double difference_at(const search *s, double degrees, int incident_alone)
{
	double sum = 0;
	for (uint32_t n = 0; n < s->pairs; n++) {
		const double *d = s->fitted->direction + 3 * s->pair[n].base;
		float image[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, own[3] = {(float)d[0], (float)d[1], (float)d[2]}, from[3];
		/* the mirror operation as data see it that are not turned: a matrix that is its own transpose */
		for (int k = 0; k < 3; k++) {
			turn(incident_alone ? 0 : degrees, image + 3*k, image + 3*k);
			rbf_mirror((unsigned)s->pair[n].op, image + 3*k, image + 3*k);
			turn(incident_alone ? 0 : -degrees, image + 3*k, image + 3*k);
		}
		if (incident_alone)
			turn(degrees, own, own);
		for (int k = 0; k < 3; k++)
			from[k] = image[3*k]*own[0] + image[3*k + 1]*own[1] + image[3*k + 2]*own[2];
		sum += difference_of(s, &s->pair[n], own, from, image);
	}
	return sum / s->pairs;
}

/* The least within MOST of none, ever finer; then the bottom of a parabola. Returns the difference there. */
static double search_turn(const search *s, int incident_alone, double *degrees)
{
	double at = 0, least = difference_at(s, 0, incident_alone), beside[2] = {0, 0};
	for (size_t n = 0; n < sizeof STEPS / sizeof *STEPS; n++) {
		const double middle = at, reach = n ? STEPS[n - 1] : MOST;
		for (int k = (int)(-reach / STEPS[n]); k <= (int)(reach / STEPS[n]); k++) {
			const double here = k ? difference_at(s, middle + k * STEPS[n], incident_alone) : least;
			if (here < least) {
				least = here;
				at = middle + k * STEPS[n];
			}
		}
	}
	const double step = STEPS[sizeof STEPS / sizeof *STEPS - 1];
	for (int side = 0; side < 2; side++)
		beside[side] = difference_at(s, at + (side ? step : -step), incident_alone);
	const double bend = beside[0] + beside[1] - 2 * least;
	*degrees = at + (bend > 0 ? .5 * step * (beside[0] - beside[1]) / bend : 0);
	return least;
}

int rbf_offset_find(const rbf_fitted *m, rbf_symmetry symmetry, float lambertian, rbf_offset *found)
{
	search *s = malloc(sizeof *s);
	*found = (rbf_offset){.before = -1, .after = -1};
	if (!s)
		return -1;
	s->fitted = m;
	s->pairs = 0;
	find_pairs(s, symmetry, lambertian);
	if (s->pairs)
		found->before = found->after = (float)difference_at(s, 0, 0);
	for (int alone = symmetry == RBF_ISOTROPIC; alone < 2 && s->pairs; alone++) {
		double degrees;
		const float after = (float)search_turn(s, alone, &degrees);
		if (after < found->after)
			*found = (rbf_offset){degrees, alone, found->before, after};
	}
	free(s);
	return 0;
}
