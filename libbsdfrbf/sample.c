/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The evaluated density is a sum of terms: corner k, frame f, lobe j. Each term is at most
 *     w_k gain_kf H_j (1 + sin(i,k) T_j)  times the lobe,
 * H_j bounding the share that a corner takes over from less valid ones (1 where a lobe keeps away from the horizon) and T_j
 * the slope of the half map's change of solid angle. A lobe is drawn by that bound (two tables of running sums: H m and H T m),
 * a direction is drawn from the lobe, carried back through the map, and kept with the probability true term / bound: what is
 * kept is distributed exactly as the sum, whatever the overlaps (thinning).
 */
#include "bounds.h"
#include "elementary.h"
#include "sample.h"

#include <string.h>

enum { TRIES = 1024 };
static const float TWIST = .05f;        /* what two rotations one after the other can add to the angle between the corners */

void rbf_lobe_reach(const rbf_reach *r, const float centre[3], float kappa, float *gain, float *slant)
{
	const float spread = (kappa > 0 ? RBF_LOBE_SPREAD / sqrtf(kappa) : 4) + r->motion;
	const float lobe = acosf(rbf_min(rbf_max(centre[2], -1.f), 1.f)) + spread;
	float lowest = cosf(rbf_min(lobe + r->margin + TWIST, (float)(RBF_PI / 2))); /* z at another corner */
	if (rbf_map_get(r->map)->kind == RBF_KIND_SHIFT) {
		const float s = sinf(rbf_min(lobe, (float)(RBF_PI / 2))) + 2 * sinf(.5f * r->margin);
		lowest = s < 1 ? sqrtf(1 - s*s) : 0;
	}
	const float v = lowest * (1 / RBF_VALID_Z);
	*gain = r->map == RBF_MAP_FIXED || v >= 1 ? 1 : v * v > 1 / RBF_VALID_GAIN ? 1 / (v * v) : RBF_VALID_GAIN;
	*slant = 0;
	if (r->map == RBF_MAP_HALF) {
		/* exitant directions above the horizon map to at most `beyond` below it */
		const float theta = acosf(rbf_min(rbf_max(r->base[2], -1.f), 1.f)) + (float)(RBF_PI / 2) + r->beyond;
		const float half = .5f * rbf_min(rbf_angle(r->base, centre) + spread, theta);
		*slant = half < 1.55f ? rbf_min(tanf(half), RBF_SLANT_MAX) : RBF_SLANT_MAX;
	}
}

void rbf_site_centre(const rbf_site *site, uint32_t corner, uint32_t block, uint32_t lane, float centre[3])
{
	const rbf_component *c = site->component;
	const rbf_block *b = &c->block[block];
	centre[0] = b->x[lane];
	centre[1] = b->y[lane];
	centre[2] = b->z[lane];
	const uint32_t at = block - c->set[site->base[corner] * c->frames].first;
	int moved = 0;
	for (int n = 0; n < 2; n++)
		if (site->shift[corner][n]) {
			const rbf_shift *s = &site->shift[corner][n][at];
			const float w = site->shift_weight[corner][n];
			centre[0] += w * s->x[lane];
			centre[1] += w * s->y[lane];
			centre[2] += w * s->z[lane];
			moved = 1;
		}
	if (moved)
		rbf_normalize(centre);
}

/* Direction at 1 - cos = w from the centre, at the azimuth whose cosine and sine are given. */
static inline void around(const float centre[3], double w, double cosine, double sine, float out[3])
{
	const double square = w * (2 - w), radius = square > 0 ? sqrt(square) : 0;
	float t[3], s[3];
	rbf_basis(centre, t, s);
	const float x = (float)(radius * cosine), y = (float)(radius * sine), z = (float)(1 - w);
	for (int n = 0; n < 3; n++)
		out[n] = x*t[n] + y*s[n] + z*centre[n];
}

/* Jakob, Numerically stable sampling of the von Mises-Fisher distribution on S2, 2012. */
void rbf_lobe_draw(const float centre[3], float kappa, double u, double v, float out[3])
{
	const double rest = kappa > 20 ? u : u + (1 - u) * exp(-2. * kappa), phi = 2 * RBF_PI * v;
	around(centre, rest > 0 ? fmin(-log(rest) / kappa, 2) : 2, cos(phi), sin(phi), out);
}

/* Cosine and sine of 2 pi v, v in [0, 1], to 1e-7: twice the angle of a = pi (v - 1/2), turned back by half a turn. */
static inline void circle(double v, double *cosine, double *sine)
{
	const double a = RBF_PI * (v - .5), q = a * a;
	const double s = a * (1 + q * (-1./6 + q * (1./120 + q * (-1./5040 + q * (1./362880 + q * (-1./39916800))))));
	const double c = 1 + q * (-1./2 + q * (1./24 + q * (-1./720 + q * (1./40320 + q * (-1./3628800 + q * (1./479001600))))));
	*cosine = 2 * s * s - 1;
	*sine = -2 * s * c;
}

/* As rbf_lobe_draw(), quicker and not to the last digit. */
static inline void draw(const float centre[3], double kappa, double u, double v, float out[3])
{
	const double rest = kappa > 20 ? u : u + (1 - u) * exp(-2 * kappa);
	double w = rest > 0 ? (double)rbf_minus_log((float)rest) / kappa : 2, cosine, sine;
	w = w < 2 ? w : 2;
	circle(v, &cosine, &sine);
	around(centre, w, cosine, sine, out);
}

/* Carries a direction drawn at a corner back to the site. Returns the term's value over the lobe's: the factor of the map, the
 * corner's share and the limit at the horizon; 0 if it falls outside. exitant is folded. clear: of rbf_sampler. */
static inline float carry(const rbf_site *site, uint32_t corner, uint32_t frame, float clear, const float drawn[3], float exitant[3])
{
	float p[3];
	rbf_mirror(site->vertex_op[corner], drawn, p);
	const float factor = rbf_warp_inverse(&site->warp[corner][frame], p, exitant);
	if (!(factor > 0) || !(exitant[2] > 0))
		return 0;
	if (exitant[2] >= clear)
		return factor;
	float share[3], gain[3], mapped[3][3];
	rbf_site_map(site, frame, exitant, share, gain, mapped);
	return factor * share[corner] * rbf_min(exitant[2] * (1 / RBF_HORIZON_Z), 1.f);
}

static uint64_t scramble(uint64_t *state) /* SplitMix64: Steele et al., Fast splittable pseudorandom number generators, 2014 */
{
	uint64_t z = *state += 0x9e3779b97f4a7c15u;
	z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
	z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
	return z ^ (z >> 31);
}

double rbf_uniform(uint64_t *state)
{
	return (double)(scramble(state) >> 11) * 0x1p-53;
}

/* The even bits of x, moved together. */
static uint64_t even_bits(uint64_t x)
{
	x &= 0x5555555555555555u;
	x = (x | x >> 1) & 0x3333333333333333u;
	x = (x | x >> 2) & 0x0f0f0f0f0f0f0f0fu;
	x = (x | x >> 4) & 0x00ff00ff00ff00ffu;
	x = (x | x >> 8) & 0x0000ffff0000ffffu;
	return (x | x >> 16) & 0xffffffffu;
}

void rbf_split_number(double u, double *a, double *b)
{
	const uint64_t bits = (uint64_t)(u * 0x1p40);
	*a = ((double)even_bits(bits) + .5) * 0x1p-20;
	*b = ((double)even_bits(bits >> 1) + .5) * 0x1p-20;
}

/* First number that is above the target, or the last one, of `blocks` blocks of numbers that rise. By compares that do not wait for each
 * other, and no branch that could be guessed wrong. */
static inline uint32_t first_above(const float *rising, uint32_t blocks, float target)
{
	uint32_t block = 0, ways = 0, lane = 0;
	for (uint32_t n = 8; n < blocks; n += 8)
		block += rising[n * RBF_LANES - 1] <= target ? 8 : 0;
	const uint32_t left = blocks - block;
	for (uint32_t n = 1; n < 8; n++)
		ways += rising[(block + (n < left ? n : left)) * RBF_LANES - 1] <= target;
	block += ways < left ? ways : left - 1;
	for (uint32_t n = 0; n < RBF_LANES - 1; n++)
		lane += rising[block * RBF_LANES + n] <= target;
	return block * RBF_LANES + lane;
}

/* No map of a site moves an exitant direction by more than the angle given here: a half map mirrors both ends of the arc from i to k,
 * a turn is known. A shift moves its tangential components. */
static float clear_of(const rbf_site *site, uint32_t frame)
{
	static const float VALID_S = .9539392f; /* the sine that belongs to RBF_VALID_Z */
	float cosine = 1, shift2 = 0;
	for (uint32_t k = 0; k < site->corners; k++) {
		const rbf_warp *w = &site->warp[k][frame];
		cosine = rbf_min(w->kind == RBF_KIND_HALF ? rbf_dot(w->i, w->k) : w->cosine, cosine);
		if (w->kind == RBF_KIND_SHIFT)
			shift2 = rbf_max(w->m[0]*w->m[0] + w->m[1]*w->m[1], shift2);
	}
	if (shift2 > 0) {
		const float s = VALID_S - sqrtf(shift2);
		return s > 0 ? sqrtf(1 - s*s) + 1e-4f : 2;
	}
	return cosine > RBF_VALID_Z ? RBF_VALID_Z * cosine + VALID_S * sqrtf(rbf_max(1 - cosine*cosine, 0)) + 1e-4f : 2;
}

void rbf_sampler_set(const rbf_site *site, rbf_sampler *sampler)
{
	const rbf_component *c = site->component;
	double total = 0;
	sampler->parts = 0;
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			const rbf_warp *warp = &site->warp[k][f];
			const double bound = (double)(site->weight[k] * warp->gain);
			for (uint32_t t = 0; t < 2; t++) {
				const double slant = t ? (double)warp->sine : 1;
				if (!(slant > 0) || !set->blocks)
					continue;
				struct rbf_sampler_part *part = &sampler->part[sampler->parts];
				part->cumulative = c->cumulative + ((size_t)t * c->blocks + set->first) * RBF_LANES;
				part->mass = set->mass[t];
				part->first = set->first;
				part->blocks = set->blocks;
				part->corner = (uint8_t)k;
				part->frame = (uint8_t)f;
				part->below = total;
				sampler->running[sampler->parts++] = total += bound * slant * part->mass;
				part->scale = total > part->below ? part->mass / (total - part->below) : 0;
			}
		}
	for (uint32_t f = 0; f < c->frames; f++)
		sampler->clear[f] = clear_of(site, f);
}

/* Into [0, 1). */
static inline double clamped(double u)
{
	return u > 0 ? u < 1 ? u : 1 - 0x1p-53 : 0;
}

int rbf_site_sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3])
{
	const rbf_component *c = site->component;
	const size_t lanes = (size_t)c->blocks * RBF_LANES;
	const uint32_t last = sampler->parts - 1;
	const double total = sampler->parts ? sampler->running[last] : 0;
	exitant[0] = exitant[1] = exitant[2] = 0;
	if (!(total > 0))
		return 0;
	u = clamped(u);
	uint64_t state;
	memcpy(&state, &u, sizeof state);
	for (int attempt = 0; attempt < TRIES; attempt++) {
		const double pick = u * total;
		uint32_t p = 0;
		for (uint32_t n = 0; n < last; n++)
			p += pick >= sampler->running[n]; /* they rise */
		const struct rbf_sampler_part *part = &sampler->part[p];
		const uint32_t frame = part->frame, k = part->corner;
		/* the lobe */
		const double mass = (pick - part->below) * part->scale;
		const uint32_t low = first_above(part->cumulative, part->blocks, (float)mass);
		const double from = low ? (double)part->cumulative[low - 1] : 0, step = (double)part->cumulative[low] - from;
		const uint32_t block = part->first + low / RBF_LANES, lane = low % RBF_LANES;
		const float kappa = c->block[block].k[lane];
		double a, b;
		if (attempt)
			a = rbf_uniform(&state), b = rbf_uniform(&state);
		else
			rbf_split_number(step > 0 ? clamped((mass - from) / step) : .5, &a, &b);
		if (kappa > 0) {
			float centre[3], drawn[3], folded[3];
			rbf_site_centre(site, k, block, lane, centre);
			draw(centre, (double)kappa, a, b, drawn);
			const float value = carry(site, k, frame, sampler->clear[frame], drawn, folded);
			const float *reach = c->reach + (size_t)block * RBF_LANES + lane;
			const float bound = rbf_warp_bound(&site->warp[k][frame], reach[lanes]) * reach[0];
			if (value > 0 && (value >= bound || rbf_uniform(&state) * (double)bound < (double)value)) {
				rbf_site_unfold(site, folded, exitant);
				return 1;
			}
		}
		u = rbf_uniform(&state);
	}
	return 0;
}
