/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Each lobe's energy is put on points of equal share, the points are carried from the corner to the site, and what arrives is
 * added up. Points of all lobes of a set are gathered and carried many at a time, in loops without a branch.
 */
#include "bounds.h"
#include "carry.h"
#include "clones.h"
#include "elementary.h"
#include "integrate.h"
#include "sample.h"

enum { PAIRS_MOST = 128, TURNS = 128, LANES = RBF_CARRY_STEP, SHARES = 32 };

/* Points go where they count: to lobes with much of the energy, most of all those that reach the horizon. */
static const float POINTS_INSIDE = 900, POINTS_HORIZON = 8000;
static const float CLEAR = .0108f; /* rad above the horizon, where nothing is lost */
static const double LITTLE = .3;  /* of the light */
static const float FAINT = 16;     /* a kappa above it leaves nothing at the other end of the sphere */

/* Directions of a golden spiral, in double length: a lobe starts where it likes. */
typedef struct spiral { float cosine[PAIRS_MOST + TURNS + LANES], sine[PAIRS_MOST + TURNS + LANES]; } spiral;

static void set_spiral(spiral *s)
{
	const double step = 2 * RBF_PI * .6180339887, a = cos(step), b = sin(step);
	double c = 1, q = 0;
	for (int i = 0; i < PAIRS_MOST + TURNS + LANES; i++) {
		s->cosine[i] = (float)c;
		s->sine[i] = (float)q;
		const double next = a*c - b*q;
		q = b*c + a*q;
		c = next;
	}
}

/* Points of one corner and frame: directions at the site's side of the mirror, and the energy of each. What is added may write up to
 * LANES behind its own. */
typedef struct batch {
	int count;
	rbf_carry_row p[3], energy[3];
} batch;

/* A lobe's axes and what its points' distances follow from. */
typedef struct spread { float x[3], y[3], z[3], start, share, faint, narrow; } spread;

/* Pairs of opposite points on a spiral over the lobe: what changes evenly across it cancels in each pair. LANES pairs at a time, the
 * points on one side before their opposites. */
RBF_CLONES static void add_pairs(const spread *l, const float *cosine, const float *sine, int pairs, float *px, float *py, float *pz)
{
	for (int first = 0, at = 0; first < pairs; first += LANES) {
		const int used = pairs - first < LANES ? pairs - first : LANES;
		float x[2][LANES], y[2][LANES], z[2][LANES];
		for (int i = 0; i < LANES; i++) {
			const float outside = ((float)(first + i) + l->start) * l->share, rest = outside + (1 - outside) * l->faint + 1e-30f;
			const float w = rbf_min(rbf_minus_log(rest) * l->narrow, 2.f), radius = sqrtf(rbf_max(w * (2 - w), 0.f)), up = 1 - w;
			const float c = radius * cosine[first + i], q = radius * sine[first + i];
			const float x1 = c*l->x[0] + q*l->x[1], y1 = c*l->y[0] + q*l->y[1], z1 = c*l->z[0] + q*l->z[1];
			const float x0 = up * l->x[2], y0 = up * l->y[2], z0 = up * l->z[2];
			x[0][i] = x0 + x1;
			y[0][i] = y0 + y1;
			z[0][i] = z0 + z1;
			x[1][i] = x0 - x1;
			y[1][i] = y0 - y1;
			z[1][i] = z0 - z1;
		}
		for (int side = 0; side < 2; side++, at += used) {
			memcpy(px + at, x[side], sizeof x[side]);
			memcpy(py + at, y[side], sizeof y[side]);
			memcpy(pz + at, z[side], sizeof z[side]);
		}
	}
}

/* share: one of as many sets of points that lie between each other. */
static inline void add_points(const spiral *s, const float centre[3], float kappa, uint32_t turn, int share, int shares, int pairs, unsigned op,
	batch *b)
{
	const float mx = op & 1 ? -1.f : 1.f, my = op & 2 ? -1.f : 1.f;
	float t[3], u[3];
	rbf_basis(centre, t, u);
	const float offset = .56984029f * (float)(turn % 1024) + .5f;
	const spread l = {{mx * t[0], mx * u[0], mx * centre[0]}, {my * t[1], my * u[1], my * centre[1]}, {t[2], u[2], centre[2]},
		((float)share + offset - floorf(offset)) / (float)shares, 1 / (float)pairs, kappa > FAINT ? 0 : expf(-2 * kappa), 1 / kappa};
	const uint32_t from = (turn * 37 + (uint32_t)share * 29) % TURNS;
	add_pairs(&l, s->cosine + from, s->sine + from, pairs, b->p[0] + b->count, b->p[1] + b->count, b->p[2] + b->count);
	b->count += 2 * pairs;
}

/* What is left where corners share a direction, and at the horizon. */
RBF_CLONES static void lessen(const float *restrict share, const float *restrict z, float *restrict carried)
{
	for (int i = 0; i < RBF_CARRY; i++) {
		const float arrives = carried[i] * share[i] * rbf_min(z[i] * (1 / RBF_HORIZON_Z), 1.f);
		carried[i] = z[i] > 0 ? arrives : 0;
	}
}

/* Adds what the points bring, and empties the batch. whole: all of it arrives where the map takes it, with even shares. */
static void deliver(const rbf_site *site, uint32_t k, uint32_t f, int whole, batch *b, double value[3])
{
	const uint32_t channels = site->component->channels;
	rbf_carry_row e[3], carried, share;
	if (!b->count)
		return;
	for (int i = b->count; i < RBF_CARRY; i++) {
		b->p[0][i] = b->p[1][i] = 0;
		b->p[2][i] = 1;
	}
	rbf_carry_back(site, k, f, RBF_CARRY, (const rbf_carry_row *)b->p, e, carried);
	if (!whole) {
		rbf_carry_shares(site, k, f, RBF_CARRY, (const rbf_carry_row *)e, share);
		lessen(share, e[2], carried);
	}
	for (uint32_t n = 0; n < channels; n++) {
		float sum = 0;
		for (int i = 0; i < b->count; i++)
			sum += carried[i] * b->energy[n][i];
		value[n] += (double)sum;
	}
	b->count = 0;
}

/* Whether a lobe that reaches this far lies above height `low`: over the sine of the sum of both angles, which series bound from above. */
static int above(float low, const float centre[3], float reach)
{
	const float s = reach * reach, along = sqrtf(rbf_max(1 - low*low, 0.f));
	return reach < 1.5f && along * (1 - .5f * s) > low * reach
		&& centre[2] > low * (1 - s * (1 / 2.f - s * (1 / 24.f))) + along * reach * (1 - s * (1 / 6.f - s * (1 / 120.f)));
}

/* finer: so many times the points. Returns the luminance that is sent, before maps and horizon. */
static float add_up(const rbf_site *site, int finer, double value[3])
{
	const rbf_component *c = site->component;
	const uint32_t y = rbf_luminance(c->channels);
	float all = 0;
	spiral s;
	batch inside, horizon;
	set_spiral(&s);
	value[0] = value[1] = value[2] = 0;
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++)
			all += site->part[k] * rbf_bound_set(c, site->base[k] * c->frames + f)->sent;
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			rbf_warp warp;
			rbf_site_warp(site, k, f, &warp);
			const int fixed = warp.kind == RBF_KIND_FIXED, turns = fixed || warp.kind == RBF_KIND_TURN;
			const float turn = fixed ? 0 : acosf(rbf_min(turns ? warp.cosine : rbf_dot(warp.i, warp.k), 1.f));
			inside.count = horizon.count = 0;
			for (uint32_t i = 0; i < set->blocks * RBF_LANES; i++) {
				const uint32_t block = set->first + i / RBF_LANES, lane = i % RBF_LANES;
				const float kappa = c->block[block].k[lane];
				if (!(kappa > 0))
					continue;
				float centre[3];
				rbf_site_centre(site, k, block, lane, centre);
				const float spread = RBF_LOBE_SPREAD / sqrtf(kappa);
				const int whole = (fixed || above(set->band, centre, spread)) && above(0, centre, spread + turn + CLEAR);
				const float energy = site->part[k] * (kappa > FAINT ? (float)(2 * RBF_PI) / kappa : (float)rbf_lobe_integral((double)kappa));
				if (turns && whole) { /* a rotation keeps the energy */
					for (uint32_t n = 0; n < c->channels; n++)
						value[n] += (double)(energy * c->amplitude[(size_t)n * c->blocks + block].a[lane]);
					continue;
				}
				batch *b = whole ? &inside : &horizon;
				const float part = energy * c->amplitude[(size_t)y * c->blocks + block].a[lane] / all;
				const float wanted = ceilf(part * .5f * (whole ? POINTS_INSIDE : POINTS_HORIZON));
				const int pairs = wanted < PAIRS_MOST ? wanted > 1 ? (int)wanted : 1 : PAIRS_MOST, shares = finer * (1 + (int)wanted / (PAIRS_MOST + 1));
				for (int share = 0; share < shares; share++) {
					if (b->count + 2 * pairs > RBF_CARRY)
						deliver(site, k, f, whole, b, value);
					for (uint32_t n = 0; n < c->channels; n++) {
						const float each = energy * c->amplitude[(size_t)n * c->blocks + block].a[lane] / (float)(2 * pairs * shares);
						for (int p = 0; p < 2 * pairs; p++)
							b->energy[n][b->count + p] = each;
					}
					add_points(&s, centre, kappa, i, share, shares, pairs, site->vertex_op[k], b);
				}
			}
			deliver(site, k, f, 1, &inside, value);
			deliver(site, k, f, 0, &horizon, value);
		}
	return all;
}

void rbf_site_dhr(const rbf_site *site, double value[3])
{
	const double sent = (double)add_up(site, 1, value), arrives = value[rbf_luminance(site->component->channels)];
	/* points go where light is sent; where little of it arrives, their error is large beside that */
	if (arrives < LITTLE * sent)
		add_up(site, arrives > sent / SHARES ? (int)(sent / arrives) : SHARES, value);
}
