/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The evaluated density is a sum of terms: corner k, frame f, lobe j. Each is
 *     w_k s_k F  times the lobe,  F <= gain_kf (1 + sin(i,k) T_j),
 * s_k the share of the corner among corners (1, but at most RBF_VALID_GAIN = 2 where it takes over from less valid ones), F the factor of
 * the map, T_j the slope of the half map's change of solid angle. A lobe is drawn by its part of that bound, a direction is drawn
 * from the lobe, carried back through the map, and kept with the probability true term / bound: what is kept is distributed exactly as
 * the sum, whatever the overlaps (thinning). min(s_k, 1) and the excess s_k - 1 are separate terms: only what lies in a band above the
 * horizon can have an excess, and of a lobe that is centred above the band only the tail is drawn for that.
 */
#include "bounds.h"
#include "clones.h"
#include "elementary.h"
#include "sample.h"

#include <string.h>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

enum { TRIES = 1024 };

/* Direction at 1 - cos = w from the centre, at the azimuth whose cosine and sine are given. */
static inline void around(const float centre[3], float w, float cosine, float sine, float out[3])
{
	const float radius = sqrtf(rbf_max(w * (2 - w), 0.f)), x = radius * cosine, y = radius * sine, z = 1 - w;
	float t[3], s[3];
	rbf_basis(centre, t, s);
	for (int n = 0; n < 3; n++)
		out[n] = x*t[n] + y*s[n] + z*centre[n];
}

/* Jakob, Numerically stable sampling of the von Mises-Fisher distribution on S2, 2012. */
void rbf_lobe_draw(const float centre[3], float kappa, double u, double v, float out[3])
{
	const double rest = kappa > RBF_LOBE_SHARP ? u : u + (1 - u) * exp(-2. * kappa), phi = 2 * RBF_PI * v;
	around(centre, (float)(rest > 0 ? fmin(-log(rest) / kappa, 2) : 2), (float)cos(phi), (float)sin(phi), out);
}

/* Cosine and sine of 2 pi v, v in [0, 1], to 3e-7: twice the angle of a = pi (v - 1/2), turned back by half a turn. */
static inline void circle(float v, float *cosine, float *sine)
{
	const float a = (float)RBF_PI * (v - .5f), q = a * a;
	const float s = a * (1 + q * (-1.f/6 + q * (1.f/120 + q * (-1.f/5040 + q * (1.f/362880 + q * (-1.f/39916800))))));
	const float c = 1 + q * (-1.f/2 + q * (1.f/24 + q * (-1.f/720 + q * (1.f/40320 + q * (-1.f/3628800 + q * (1.f/479001600))))));
	*cosine = 2 * s * s - 1;
	*sine = -2 * s * c;
}

/* As rbf_lobe_draw(), quicker and not to the last digit; only at 1 - cos >= gap, which is 0 for broad lobes. far: what is left of the
 * lobe at the other end of the sphere. */
static inline void draw(const float centre[3], float kappa, float far, float gap, float u, float v, float out[3])
{
	float cosine, sine;
	circle(v, &cosine, &sine);
	around(centre, rbf_min(gap + rbf_minus_log(u + (1 - u) * far) * (1 / kappa), 2.f), cosine, sine, out);
}

/* Carries a direction drawn at a corner back to the site. Returns the factor of the map, with the limit at the horizon; 0 if it falls
 * outside. exitant is folded. *share: the corner's. clear: of rbf_sampler. */
static inline float carry(const rbf_site *site, uint32_t corner, uint32_t frame, float clear, const float drawn[3], float exitant[3],
	float *share)
{
	const float p[3] = {drawn[0] * site->flip[0][corner], drawn[1] * site->flip[1][corner], drawn[2]};
	rbf_warp warp;
	rbf_site_warp(site, corner, frame, &warp);
	const float factor = rbf_warp_inverse(&warp, p, exitant);
	*share = 1;
	if (!(factor > 0) || !(exitant[2] > 0))
		return 0;
	if (exitant[2] >= clear)
		return factor;
	float shares[RBF_FAN];
	rbf_site_shares(site, frame, exitant, shares);
	*share = shares[corner];
	return factor * rbf_min(exitant[2] * (1 / RBF_HORIZON_Z), 1.f);
}

/* First number that is above the target, or the last one, of `blocks` blocks of numbers that rise to more than the target. No branch that
 * could be guessed wrong. */
static inline uint32_t first_above(const uint16_t *rising, uint32_t blocks, uint32_t target)
{
	uint32_t block = 0, lane = 0;
	for (uint32_t n = 8; n < blocks; n += 8) /* compares do not wait for each other */
		block += rising[n * RBF_LANES - 1] <= target ? 8 : 0;
	const uint32_t left = blocks - block;
	uint32_t ways = 0;
	for (uint32_t n = 1; n < 8; n++)
		ways += rising[(block + (n < left ? n : left)) * RBF_LANES - 1] <= target;
	block += ways;
#if defined(__SSE2__)
	const __m128i some = _mm_loadu_si128((const __m128i *)(const void *)(rising + block * RBF_LANES));
	const __m128i beyond = _mm_subs_epu16(some, _mm_set1_epi16((short)target)); /* 0: not above */
	lane = (uint32_t)__builtin_ctz(~(uint32_t)_mm_movemask_epi8(_mm_cmpeq_epi16(beyond, _mm_setzero_si128())) | 0x4000) / 2;
#else
	for (uint32_t n = 0; n < RBF_LANES - 1; n++)
		lane += rising[block * RBF_LANES + n] <= target;
#endif
	return block * RBF_LANES + lane;
}

/* Share of an entry of a set's table. */
static inline uint32_t share_at(const uint16_t *running, uint32_t at)
{
	return (uint16_t)(running[at] - (at ? running[at - 1] : 0));
}

/* Heights from which on no direction, at the site (*clear) or at a corner (*band), has a mapped direction lower than RBF_VALID_Z. No map
 * moves a direction by more than an angle: a half map mirrors both ends of the arc from i to k, a turn is known. Shifts move tangential
 * components. */
static void heights(const rbf_site *site, uint32_t frame, float *clear, float *band)
{
	float cosine = 1, shift2 = 0;
	const rbf_fan *fan = &site->fan[frame];
	if (fan->kind == RBF_KIND_FIXED) { /* valid everywhere; lower than this there is the limit at the horizon */
		*clear = *band = RBF_HORIZON_Z;
		return;
	}
	for (uint32_t k = 0; k < site->corners; k++) {
		const float to[3] = {site->direction[0][k], site->direction[1][k], site->direction[2][k]};
		cosine = rbf_min(fan->kind == RBF_KIND_HALF ? rbf_dot(site->incident, to) : fan->cosine[k], cosine);
		if (fan->kind == RBF_KIND_SHIFT)
			shift2 = rbf_max(fan->m[0][k]*fan->m[0][k] + fan->m[1][k]*fan->m[1][k], shift2);
	}
	*clear = *band = 2;
	if (shift2 > 0) {
		const float s = RBF_VALID_S - sqrtf(shift2), t = s - sqrtf(shift2);
		*clear = s > 0 ? sqrtf(1 - s*s) + 1e-4f : 2;
		*band = t > 0 ? sqrtf(1 - t*t) + 1e-4f : 2;
		return;
	}
	/* the sum of angles, one more each time */
	const float sine = sqrtf(rbf_max(1 - cosine*cosine, 0.f));
	const float up = RBF_VALID_Z * cosine + RBF_VALID_S * sine, along = RBF_VALID_S * cosine - RBF_VALID_Z * sine;
	if (along > 0)
		*clear = up + 1e-4f;
	if (along > 0 && along * cosine > up * sine)
		*band = up * cosine + along * sine + 1e-4f;
}

void rbf_sampler_set(const rbf_site *site, rbf_sampler *sampler)
{
	const rbf_component *c = site->component;
	const uint32_t tables = rbf_draw_tables(c);
	uint32_t parts = 0;
	float total = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		heights(site, f, &sampler->clear[f], &sampler->band[f]);
	for (uint32_t k = 0; k < site->corners; k++) {
		sampler->excess[k] = rbf_min(1.f, 1 / site->weight[k] - 1); /* a share is at most 1 over the weight */
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			const float each = site->weight[k] * site->fan[f].gain[k] * RBF_DRAW_TOTAL;
			const float of[3] = {each * set->unit[0], each * set->unit[1] * sampler->excess[k], each * set->unit[2] * site->fan[f].sine[k]};
			for (uint32_t t = 0; t < tables; t++) {
				const float sum = total + of[t];
				const double share = (double)sum - (double)total;
				sampler->part[parts] = (struct rbf_sampler_part){set, RBF_DRAW_TOTAL / share, (uint8_t)k, (uint8_t)f, (uint8_t)t};
				sampler->running[parts] = (double)sum;
				const int some = (share > 0) & (set->blocks > 0); /* else the next one takes its place */
				total = some ? sum : total;
				parts += (uint32_t)some;
			}
		}
	}
	sampler->parts = parts;
}

/* Into [0, 1). */
static inline double clamped(double u)
{
	return u > 0 ? u < 1 ? u : 1 - 0x1p-53 : 0;
}

/* What a lobe's bounds come to at a site (integral: of the lobe): luminance, the bound of that with the factor of the map, and the bound
 * in the band. */
typedef struct bounds { float mass, whole, band; } bounds;

static inline bounds bounds_at(const rbf_component *c, const struct rbf_sampler_part *part, float sine, uint32_t at, float integral)
{
	const size_t lanes = (size_t)c->blocks * RBF_LANES;
	const rbf_set *set = part->set;
	const uint32_t block = set->first + at / RBF_LANES;
	const uint16_t *running = c->draws + (size_t)set->first * RBF_LANES;
	bounds b = {.mass = integral * c->amplitude[(size_t)rbf_luminance(c->channels) * c->blocks + block].a[at % RBF_LANES],
		.whole = set->unit[RBF_DRAW_MASS] * (float)share_at(running, at)};
	if (sine > 0)
		b.whole += sine * set->unit[RBF_DRAW_SLANT] * (float)share_at(running + RBF_DRAW_SLANT * lanes, at);
	if (part->table == RBF_DRAW_BAND)
		b.band = set->unit[RBF_DRAW_BAND] * (float)share_at(running + RBF_DRAW_BAND * lanes, at);
	return b;
}

RBF_CLONES static int sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3])
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
	for (int attempt = 0; attempt < TRIES; attempt++, u = rbf_uniform(&state)) {
		const double pick = u * total;
		uint32_t p = 0;
		for (uint32_t n = 0; n < last; n++)
			p += pick >= sampler->running[n]; /* they rise */
		const struct rbf_sampler_part *part = &sampler->part[p];
		const uint32_t frame = part->frame, k = part->corner;
		const rbf_fan *fan = &site->fan[frame];
		/* the lobe */
		const uint16_t *running = c->draws + part->table * lanes + (size_t)part->set->first * RBF_LANES;
		const double below = p ? sampler->running[p - 1] : 0, units = part->scale * (pick - below);
		const uint32_t low = first_above(running, part->set->blocks, (uint32_t)units), step = share_at(running, low);
		const uint32_t block = part->set->first + low / RBF_LANES, lane = low % RBF_LANES;
		const float kappa = c->block[block].k[lane];
		if (!(kappa > 0))
			continue;
		float centre[3], drawn[3], folded[3], share, keep, gap = 0, a, b;
		rbf_site_centre(site, k, block, lane, centre);
		const float far = kappa > RBF_LOBE_SHARP ? 0 : rbf_exp_negative(-2 * kappa);
		const bounds bound = bounds_at(c, part, fan->sine[k], low, (float)(2 * RBF_PI) * (1 - far) / kappa);
		keep = bound.mass / (bound.whole * fan->gain[k]);
		if (part->table == RBF_DRAW_BAND) {
			gap = rbf_max(rbf_lobe_gap(c->block[block].z[lane], kappa, part->set->band), rbf_lobe_gap(centre[2], kappa, sampler->band[frame]));
			const float some = expf(-kappa * gap) * bound.whole / bound.band;
			if (some < 1 && rbf_uniform(&state) >= (double)some)
				continue;
			keep *= rbf_max(some, 1.f) / sampler->excess[k];
		}
		rbf_split_number(attempt ? rbf_uniform(&state) : step ? clamped((units - (running[low] - (double)step)) / step) : .5, &a, &b);
		draw(centre, kappa, far, gap, a, b, drawn);
		if (part->table == RBF_DRAW_BAND && drawn[2] >= rbf_min(sampler->band[frame], part->set->band))
			continue;
		keep *= carry(site, k, frame, sampler->clear[frame], drawn, folded, &share);
		keep *= part->table == RBF_DRAW_BAND ? rbf_max(share - 1, 0.f) : rbf_min(share, 1.f);
		if (keep >= 1 || (keep > 0 && rbf_uniform(&state) < (double)keep)) {
			rbf_site_unfold(site, folded, exitant);
			return 1;
		}
	}
	return 0;
}

int rbf_site_sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3])
{
	return sample(site, sampler, u, exitant);
}
