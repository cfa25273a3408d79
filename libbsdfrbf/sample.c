/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The evaluated density is a sum of terms: corner k, frame f, lobe j. Each is
 *     w_k s_k F  times the lobe,  F <= gain_kf (1 + sin(i,k) T_j),
 * s_k the share of the corner among corners (1, but at most rbf_frame_limit() where it takes over from less valid ones), F the factor of
 * the map, T_j the slope of the half map's change of solid angle. A lobe is drawn by its part of that bound, a direction is drawn
 * from the lobe, carried back through the map, and kept with the probability true term / bound: what is kept is distributed exactly as
 * the sum, whatever the overlaps (thinning). min(s_k, 1) and the excess s_k - 1 are separate terms: only what lies in a band above the
 * horizon can have an excess, and of a lobe that is centred above the band only the tail is drawn for that.
 */
#include "bounds.h"
#include "carry.h"
#include "clones.h"
#include "elementary.h"
#include "sample.h"
#include "shares.h"

#include <string.h>

enum { WINDOW = 8 }; /* blocks that are searched at once */

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

/* Cosine and sine of 2 pi v, v in [0, 1], to 1e-6: twice the angle of a = pi (v - 1/2), turned back by half a turn. Both polynomials fitted to
 * the smallest largest error, 5e-9 and 5e-8. */
static inline void circle(float v, float *cosine, float *sine)
{
	const float a = (float)RBF_PI * (v - .5f), q = a * a;
	const float s = a * (1 + q * (-0.1666666f + q * (0.0083330881f + q * (-0.00019811107f + q * 2.6089176e-06f))));
	const float c = 1 + q * (-0.49999932f + q * (0.041663989f + q * (-0.001385592f + q * 2.3194223e-05f)));
	*cosine = 2 * s * s - 1;
	*sine = -2 * s * c;
}

/* As rbf_lobe_draw(), quicker and not to the last digit; only at 1 - cos >= gap, which is 0 for broad lobes. width: 1 / kappa; far: what is
 * left of the lobe at the other end of the sphere. */
static inline void draw(const float centre[3], float width, float far, float gap, float u, float v, float out[3])
{
	float cosine, sine;
	circle(v, &cosine, &sine);
	around(centre, rbf_min(gap + rbf_minus_log(u + (1 - u) * far) * width, 2.f), cosine, sine, out);
}

/* What the band's table stands for of a share, or the others. What is above 1 by rounding is not. */
static inline float of_share(float share, int band)
{
	return band ? share > 1 + 1e-6f ? share - 1 : 0 : rbf_min(share, 1.f);
}

/* Carries a direction drawn at a corner back to the site. Returns the factor of the map, with the limit at the horizon, times what the
 * corner's share has of the excess, or of what is not; 0 if it falls outside. exitant is folded. */
static inline __attribute__((always_inline)) float carry(const rbf_site *site, uint32_t corner, uint32_t frame, int band,
	const float drawn[3], float exitant[3])
{
	const rbf_fan *fan = &site->fan[frame];
	const float (*k)[RBF_FAN] = (const float (*)[RBF_FAN])site->direction;
	const float p[3] = {drawn[0] * site->flip[0][corner], drawn[1] * site->flip[1][corner], drawn[2]};
	const float factor = rbf_fan_inverse(fan, site->incident, k, corner, p, exitant) * rbf_min(exitant[2] * (1 / RBF_HORIZON_Z), 1.f);
	if (!(factor > 0))
		return 0;
	if (!band && p[2] >= RBF_VALID_Z) /* this corner leaves nothing to others */
		return factor;
	float share[RBF_FAN];
	rbf_lanes_store(share, rbf_shares_at(site, frame, rbf_fan_heights(fan, site->incident, k, corner, p, exitant)));
	return factor * of_share(share[corner], band);
}

typedef uint16_t shorts __attribute__((vector_size(2 * RBF_LANES)));

/* How many numbers of so many blocks are not above the target. */
static inline __attribute__((always_inline)) uint32_t count_within(const uint16_t *rising, uint32_t blocks, uint16_t target)
{
	const shorts most = target - (shorts){0};
	shorts within = {0};
	for (uint32_t n = 0; n < blocks; n++) {
		shorts some;
		memcpy(&some, rising + n * RBF_LANES, sizeof some);
		within -= (shorts)(some <= most);
	}
	uint64_t sum[2];
	memcpy(sum, &within, sizeof sum);
	return (uint32_t)((sum[0] + sum[1]) * 0x0001000100010001u >> 48);
}

/* First number that is above the target, or the last one, of `blocks` blocks of numbers that rise. No branch that could be guessed wrong. */
static inline __attribute__((always_inline)) uint32_t first_above(const uint16_t *rising, uint32_t blocks, uint16_t target)
{
	const uint32_t last = blocks * RBF_LANES - 1;
	uint32_t block = 0, at;
	if (blocks < WINDOW)
		at = count_within(rising, blocks, target);
	else {
		for (uint32_t n = WINDOW; n < blocks; n += WINDOW) /* compares do not wait for each other */
			block += rising[n * RBF_LANES - 1] <= target ? WINDOW : 0;
		block = block < blocks - WINDOW ? block : blocks - WINDOW;
		at = block * RBF_LANES + count_within(rising + block * RBF_LANES, WINDOW, target);
	}
	return at < last ? at : last;
}

/* Share of an entry of a set's table. */
static inline uint32_t share_at(const uint16_t *running, uint32_t at)
{
	return (uint16_t)(running[at] - (at ? running[at - 1] : 0));
}

/* The parts of all corners in one frame, after so many and the sum `total`. What a part without light leaves, the next one takes. */
static inline __attribute__((always_inline)) uint32_t add_parts(const rbf_site *site, uint32_t frame, uint32_t tables, uint32_t parts,
	float *total, rbf_sampler *sampler)
{
	const rbf_component *c = site->component;
	const rbf_fan *fan = &site->fan[frame];
	const rbf_lanes each = rbf_lanes_load(site->part) * rbf_lanes_load(fan->gain) * (float)RBF_DRAW_TOTAL;
	const rbf_lanes least = rbf_lanes_max(rbf_lanes_load(site->weight), rbf_lanes_all(1e-30f));
	/* weights times shares come to 1 */
	const rbf_lanes excess = rbf_lanes_min(rbf_lanes_all(fan->limit), 1 / least) - 1, band = each * excess;
	const rbf_lanes slant = each * rbf_lanes_load(fan->sine);
	float sum = *total;
	for (uint32_t k = 0; k < site->corners; k++) {
		const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + frame);
		const float of[3] = {each[k] * set->unit[0], band[k] * set->unit[1], slant[k] * set->unit[2]};
		for (uint32_t t = 0; t < tables; t++) {
			const float next = sum + of[t];
			sampler->part[parts] = (struct rbf_sampler_part){set, excess[k], (uint8_t)k, (uint8_t)frame, (uint8_t)t};
			sampler->before[parts + 1] = next;
			const int some = (next > sum) & (set->blocks > 0);
			sum = some ? next : sum;
			parts += (uint32_t)some;
		}
	}
	*total = sum;
	return parts;
}

/* tables: as rbf_draw_tables(), a constant where it is inlined. */
static inline __attribute__((always_inline)) void add_frames(const rbf_site *site, uint32_t tables, rbf_sampler *sampler)
{
	const rbf_component *c = site->component;
	const size_t lanes = (size_t)c->blocks * RBF_LANES;
	float total = 0;
	for (int t = 0; t < 3; t++)
		sampler->draws[t] = c->draws + (size_t)t * lanes;
	sampler->luminance = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
	sampler->parts = 0;
	sampler->before[0] = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		sampler->parts = add_parts(site, f, tables, sampler->parts, &total, sampler);
	float *end = sampler->before + sampler->parts;
	sampler->total = *end;
	rbf_lanes_store(end + 1, rbf_lanes_all(INFINITY));
	for (uint32_t p = 0; p < sampler->parts; p += RBF_FAN)
		rbf_lanes_store(sampler->scale + p, RBF_DRAW_TOTAL / (rbf_lanes_load(sampler->before + p + 1) - rbf_lanes_load(sampler->before + p)));
	*end = INFINITY;
}

RBF_CLONES static void set_sampler(const rbf_site *site, uint32_t tables, rbf_sampler *sampler)
{
	switch (tables) {
	case 1: add_frames(site, 1, sampler); break;
	case 2: add_frames(site, 2, sampler); break;
	default: add_frames(site, 3, sampler);
	}
}

void rbf_sampler_set(const rbf_site *site, rbf_sampler *sampler)
{
	set_sampler(site, rbf_draw_tables(site->component), sampler);
}

/* Into [0, 1). */
static inline double clamped(double u)
{
	return u > 0 ? u < 1 ? u : 1 - 0x1p-53 : 0;
}

/* What a lobe's bounds come to at a site (integral: of the lobe): luminance; the bound of that with the factor of the map, and what it would
 * be if shares were not rounded up, at least; and the bound in the band. */
typedef struct bounds { float mass, whole, band, least; } bounds;

static inline bounds bounds_at(const rbf_sampler *sampler, const struct rbf_sampler_part *part, float sine, uint32_t at, float integral)
{
	const rbf_set *set = part->set;
	const size_t first = (size_t)set->first * RBF_LANES;
	bounds b = {.mass = integral * sampler->luminance[set->first + at / RBF_LANES].a[at % RBF_LANES],
		.whole = set->unit[RBF_DRAW_MASS] * (float)share_at(sampler->draws[RBF_DRAW_MASS] + first, at)};
	b.least = b.mass;
	if (sine > 0) {
		const uint32_t share = share_at(sampler->draws[RBF_DRAW_SLANT] + first, at);
		b.whole += sine * set->unit[RBF_DRAW_SLANT] * (float)share;
		b.least += sine * set->unit[RBF_DRAW_SLANT] * (float)(share ? share - 1 : 0);
	}
	if (part->table == RBF_DRAW_BAND)
		b.band = set->unit[RBF_DRAW_BAND] * (float)share_at(sampler->draws[RBF_DRAW_BAND] + first, at);
	return b;
}

/* A lobe, and the numbers by which a direction is drawn from it. */
typedef struct lobe {
	float centre[3], width, far, gap, a, b; /* width: 1 / kappa */
	float keep;     /* with this, times factor and share, the direction is kept */
} lobe;

/* Where in the sum of the parts a number points to. */
static inline __attribute__((always_inline)) uint32_t part_at(const rbf_sampler *sampler, float pick)
{
	uint64_t below = 0;
	for (uint32_t n = 0; n < sampler->parts; n += RBF_FAN)
		below |= (uint64_t)rbf_lanes_bits(rbf_lanes_load(sampler->before + n) <= pick) << n;
	return (uint32_t)__builtin_ctzll(~below) - 1; /* they rise from 0 */
}

/* What a number that points to part p is in units of its table, times 2^32; it was rounded when the part was found. */
static inline uint64_t units_at(const rbf_sampler *sampler, uint32_t p, double pick)
{
	const double units = (double)sampler->scale[p] * 0x1p32 * (pick - (double)sampler->before[p]), most = RBF_DRAW_TOTAL * 0x1p32 - 1;
	return (uint64_t)(int64_t)(units > 0 ? units < most ? units : most : 0);
}

/* The lobe of part p that a number points to. state: of random numbers. Returns 0 if none is drawn, at once if `early` (a constant). */
static inline __attribute__((always_inline)) int choose(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, double pick, int first,
	int early, uint64_t *state, lobe *l)
{
	int taken = 1;
	const struct rbf_sampler_part *part = &sampler->part[p];
	const rbf_set *set = part->set;
	const uint32_t frame = part->frame, k = part->corner;
	const rbf_fan *fan = &site->fan[frame];
	const uint16_t *running = sampler->draws[part->table] + (size_t)set->first * RBF_LANES;
	const uint64_t units = units_at(sampler, p, pick);
	const uint32_t low = first_above(running, set->blocks, (uint16_t)(units >> 32)), step = share_at(running, low);
	const uint32_t block = set->first + low / RBF_LANES, lane = low % RBF_LANES;
	const float kappa = site->component->block[block].k[lane];
	if (!(kappa > 0))
		return 0;
	if (first)
		rbf_split_number((uint32_t)((units - ((uint64_t)(running[low] - step) << 32)) / (step | !step)), &l->a, &l->b);
	else
		rbf_two_uniforms(state, &l->a, &l->b);
	l->width = 1 / kappa;
	rbf_site_centre(site, k, block, lane, l->centre);
	l->far = kappa > RBF_LOBE_SHARP ? 0 : rbf_exp_negative(-2 * kappa);
	l->gap = 0;
	const bounds bound = bounds_at(sampler, part, fan->sine[k], low, (float)(2 * RBF_PI) * (1 - l->far) * l->width);
	l->keep = bound.mass / (bound.whole * fan->gain[k]);
	if (part->table == RBF_DRAW_BAND) {
		const float inside = bound.band < bound.least && !(l->far > 0) ? rbf_minus_log(bound.band / bound.least) * l->width * .999f : 0;
		l->gap = rbf_max(inside, rbf_lobe_gap(l->centre[2], kappa, set->band));
		const float some = rbf_exp_negative(-kappa * l->gap) * bound.whole / bound.band;
		taken = rbf_uniform(state) < (double)some;
		if (early && !taken)
			return 0;
		l->keep *= rbf_max(some, 1.f) / part->excess;
	}
	return taken;
}

static inline uint64_t random_state(double u)
{
	uint64_t state;
	memcpy(&state, &u, sizeof state);
	return state;
}

RBF_CLONES static int sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3])
{
	const double total = (double)sampler->total;
	u = clamped(u);
	uint64_t state = random_state(u);
	for (int attempt = 0; attempt < RBF_SAMPLE_TRIES && total > 0; attempt++, u = rbf_uniform(&state)) {
		const double pick = u * total;
		const uint32_t p = part_at(sampler, (float)pick);
		const struct rbf_sampler_part *part = &sampler->part[p];
		lobe l;
		float drawn[3], folded[3];
		if (!choose(site, sampler, p, pick, !attempt, 1, &state, &l))
			continue;
		draw(l.centre, l.width, l.far, l.gap, l.a, l.b, drawn);
		if (part->table == RBF_DRAW_BAND && drawn[2] >= part->set->band)
			continue;
		l.keep *= carry(site, part->corner, part->frame, part->table == RBF_DRAW_BAND, drawn, folded);
		if (l.keep > 0 && rbf_uniform(&state) < (double)l.keep) {
			rbf_site_unfold(site, folded, exitant);
			return 1;
		}
	}
	exitant[0] = exitant[1] = exitant[2] = 0;
	return 0;
}

int rbf_site_sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3])
{
	return sample(site, sampler, u, exitant);
}

/* Many samples at one site: those that are still to be drawn are sorted by part, so that what the part makes of them, draw, map and
 * shares, is the same for all and done for many at once. */
typedef struct crowd {
	uint32_t count;
	uint16_t which[RBF_CARRY];      /* sample */
	double pick[RBF_CARRY];         /* as for part_at() */
	uint64_t state[RBF_CARRY];
} crowd;

/* part_at() of all. */
RBF_CLONES static void parts_of(const rbf_sampler *sampler, const crowd *c, uint8_t part[RBF_CARRY])
{
	int32_t at[RBF_CARRY];
	float pick[RBF_CARRY];
	for (uint32_t i = 0; i < c->count; i++) {
		at[i] = 0;
		pick[i] = (float)c->pick[i];
	}
	for (uint32_t n = 1; n < sampler->parts; n++)
		for (uint32_t i = 0; i < c->count; i++)
			at[i] += sampler->before[n] <= pick[i];
	for (uint32_t i = 0; i < c->count; i++)
		part[i] = (uint8_t)at[i];
}

/* Lobes of one part, and what is drawn from them. */
typedef struct draft {
	int count;
	uint16_t of[RBF_CARRY];         /* place in the crowd */
	rbf_carry_row x, y, z, width, far, gap, a, b, keep, factor, share, p[3], e[3];
} draft;

RBF_CLONES static void choose_all(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, int first, crowd *c, const uint16_t order[],
	uint32_t count, draft *d)
{
	int n = 0;
	for (uint32_t i = 0; i < count; i++) {
		const uint16_t at = order[i];
		lobe l = {.keep = 0};
		const int some = choose(site, sampler, p, c->pick[at], first, 0, &c->state[at], &l);
		d->of[n] = at;
		d->x[n] = l.centre[0];
		d->y[n] = l.centre[1];
		d->z[n] = l.centre[2];
		d->width[n] = l.width;
		d->far[n] = l.far;
		d->gap[n] = l.gap;
		d->a[n] = l.a;
		d->b[n] = l.b;
		d->keep[n] = l.keep;
		n += some;
	}
	d->count = n;
	for (; n % RBF_CARRY_STEP; n++) { /* as the first one */
		d->x[n] = d->x[0];
		d->y[n] = d->y[0];
		d->z[n] = d->z[0];
		d->width[n] = d->width[0];
		d->far[n] = d->gap[n] = 0;
		d->a[n] = d->b[n] = .5f;
	}
}

/* Directions, mirrored as the corner's vertex is. */
RBF_CLONES static void draw_all(draft *d, float flip_x, float flip_y)
{
	for (int i = 0; i < d->count; i++) {
		const float centre[3] = {d->x[i], d->y[i], d->z[i]};
		float out[3];
		draw(centre, d->width[i], d->far[i], d->gap[i], d->a[i], d->b[i], out);
		d->p[0][i] = out[0] * flip_x;
		d->p[1][i] = out[1] * flip_y;
		d->p[2][i] = out[2];
	}
	for (int i = d->count; i % RBF_CARRY_STEP; i++) {
		d->p[0][i] = d->p[1][i] = 0;
		d->p[2][i] = 1;
	}
}

/* below: of directions that a band holds; 2: no band, so that shares above 1 count as 1. */
RBF_CLONES static void weigh_all(draft *d, float below)
{
	for (int i = 0; i < d->count; i++) {
		const float keep = d->keep[i] * d->factor[i] * of_share(d->share[i], below < 2) * rbf_min(d->e[2][i] * (1 / RBF_HORIZON_Z), 1.f);
		d->keep[i] = (d->e[2][i] > 0) & (d->p[2][i] < below) ? keep : 0;
	}
}

/* Draws for one part, and takes what is kept out of the crowd: which[] is then RBF_CARRY. Returns how many. */
static uint32_t draw_part(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, int first, crowd *c, const uint16_t order[],
	uint32_t count, draft *d, float exitant[][3])
{
	const struct rbf_sampler_part *part = &sampler->part[p];
	const uint32_t k = part->corner, f = part->frame;
	uint32_t kept = 0;
	choose_all(site, sampler, p, first, c, order, count, d);
	draw_all(d, site->flip[0][k], site->flip[1][k]);
	rbf_carry_back(site, k, f, d->count, (const rbf_carry_row *)d->p, d->e, d->factor);
	rbf_carry_shares(site, k, f, d->count, (const rbf_carry_row *)d->e, d->share);
	weigh_all(d, part->table == RBF_DRAW_BAND ? part->set->band : 2);
	for (int i = 0; i < d->count; i++) {
		const uint16_t at = d->of[i];
		if (!(d->keep[i] > 0) || !(rbf_uniform(&c->state[at]) < (double)d->keep[i]))
			continue;
		const float folded[3] = {d->e[0][i], d->e[1][i], d->e[2][i]};
		rbf_site_unfold(site, folded, exitant[c->which[at]]);
		c->which[at] = RBF_CARRY;
		kept++;
	}
	return kept;
}

size_t rbf_site_sample_many(const rbf_site *site, const rbf_sampler *sampler, size_t count, const double *u, float exitant[][3])
{
	const double total = (double)sampler->total;
	size_t drawn = 0;
	crowd c;
	draft d;
	memset(exitant, 0, count * sizeof *exitant);
	for (size_t from = 0; from < count && total > 0; from += RBF_CARRY) {
		c.count = count - from < RBF_CARRY ? (uint32_t)(count - from) : RBF_CARRY;
		for (uint32_t i = 0; i < c.count; i++) {
			c.which[i] = (uint16_t)i;
			const double number = clamped(u[from + i]);
			c.pick[i] = number * total;
			c.state[i] = random_state(number);
		}
		for (int attempt = 0; attempt < RBF_SAMPLE_TRIES && c.count; attempt++) {
			uint32_t first[3 * RBF_SITE_JOBS + 1] = {0}, left = 0;
			uint16_t order[RBF_CARRY];
			uint8_t part[RBF_CARRY];
			parts_of(sampler, &c, part);
			for (uint32_t i = 0; i < c.count; i++)
				first[part[i] + 1]++;
			for (uint32_t p = 0; p < sampler->parts; p++)
				first[p + 1] += first[p];
			for (uint32_t i = 0; i < c.count; i++)
				order[first[part[i]]++] = (uint16_t)i; /* each then ends where the next began */
			for (uint32_t p = 0, start = 0; p < sampler->parts; start = first[p++])
				if (first[p] > start)
					drawn += draw_part(site, sampler, p, !attempt, &c, order + start, first[p] - start, &d, exitant + from);
			for (uint32_t i = 0; i < c.count; i++) {
				c.which[left] = c.which[i];
				c.state[left] = c.state[i];
				c.pick[left] = rbf_uniform(&c.state[left]) * total;
				left += c.which[i] < RBF_CARRY;
			}
			c.count = left;
		}
	}
	return drawn;
}
