/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The evaluated density is a sum of terms: corner k, frame f, lobe j. Each is
 *     w_k s_k F  times the lobe,  F = gain_kf J,
 * s_k the share of the corner among corners (1, but at most rbf_frame_limit() where it takes over from less valid ones), F the factor of
 * the map. A lobe is drawn by a bound of its part (draws.h), a direction is drawn from the lobe, its tail, where the corner may take over,
 * as much more often as its share may be above 1, carried back through the map, and kept with the probability true term / bound: what is kept is
 * distributed exactly as the sum, whatever the overlaps (thinning).
 */
#include "carry.h"
#include "clones.h"
#include "elementary.h"
#include "sample.h"
#include "shares.h"

#include <string.h>

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

/* As rbf_lobe_draw(), quicker and not to the last digit. width: 1 / kappa; far: what is left of the lobe at the other end of the sphere. */
static inline void draw(const float centre[3], float width, float far, float u, float v, float out[3])
{
	float cosine, sine;
	circle(v, &cosine, &sine);
	around(centre, rbf_min(rbf_minus_log(u + (1 - u) * far) * width, 2.f), cosine, sine, out);
}

typedef uint16_t shorts __attribute__((vector_size(2 * RBF_LANES)));

/* First lobe whose running sum is above the target, or the last one. Hardly a branch that could be guessed wrong: nearly all are found in the two blocks
 * that the guide leads to. */
static inline __attribute__((always_inline)) uint32_t first_above(const rbf_draw_set *set, uint32_t table, uint16_t target, uint32_t block)
{
	const shorts most = target - (shorts){0};
	for (;; block += 2) {
		shorts some, more;
		uint64_t sum[2];
		memcpy(&some, rbf_draw_row(set, block, table), sizeof some);
		memcpy(&more, rbf_draw_row(set, block + 1, table), sizeof more);
		const shorts within = -(shorts)(some <= most) - (shorts)(more <= most);
		memcpy(sum, &within, sizeof sum);
		const uint32_t count = (uint32_t)((sum[0] + sum[1]) * 0x0001000100010001u >> 48);
		if (__builtin_expect(count < 2 * RBF_LANES || block + 2 >= set->blocks, 1)) {
			const uint32_t at = block * RBF_LANES + count, last = set->blocks * RBF_LANES - 1;
			return at < last ? at : last;
		}
	}
}

_Static_assert(RBF_DRAW_GUIDES << 10 == RBF_DRAW_TOTAL + 1, "guides are for 1024 each");

/* Sums of lanes up to each. */
static inline __attribute__((always_inline)) rbf_lanes running_sum(rbf_lanes v)
{
	const rbf_lanes pairs = v + (rbf_lanes){0, v[0], 0, v[2]};
	return pairs + (rbf_lanes){0, 0, pairs[1], pairs[1]};
}

/* The weights by which the incidence is the sum of an element's corners, of which this one is first, or the next, or the last. */
static inline __attribute__((always_inline)) void weigh_corners(const rbf_site *site, const float weight[3], const uint32_t at[3], rbf_lanes whole[3])
{
	const rbf_lanes own = rbf_lanes_load(site->weight);
	const rbf_lanes cosine = rbf_lanes_load(site->direction[0]) * site->incident[0] + rbf_lanes_load(site->direction[1]) * site->incident[1]
		+ rbf_lanes_load(site->direction[2]) * site->incident[2];
	const rbf_lanes scale = 1 / rbf_lanes_max(rbf_lanes_sum(own * cosine), rbf_lanes_all(1e-3f));
	whole[0] = own * scale;
	if (site->corners == 3) {
		const rbf_lanes v = whole[0];
		whole[1] = (rbf_lanes){v[1], v[2], v[0], 0};
		whole[2] = (rbf_lanes){v[2], v[0], v[1], 0};
		return;
	}
	for (uint32_t t = 1; t < 3; t++) { /* some of the element's corners are not the site's */
		whole[t] = rbf_lanes_all(0);
		for (uint32_t k = 0; k < site->corners && weight; k++) {
			const float other = weight[at[k] + t < 3 ? at[k] + t : at[k] + t - 3] * scale[0];
			whole[t] += k ? (rbf_lanes){0, other, 0, 0} : (rbf_lanes){other, 0, 0, 0};
		}
	}
}

/* tables: of each set, a constant where it is inlined. */
static inline __attribute__((always_inline)) void add_frames(const rbf_site *site, const rbf_draws *draws, const float weight[3], uint32_t tables,
	rbf_sampler *sampler)
{
	const uint32_t frames = site->component->frames, parts = frames * tables * RBF_FAN;
	const rbf_lanes part = rbf_lanes_load(site->part), weights = rbf_lanes_load(site->weight);
	float over[RBF_FAN];
	rbf_lanes whole[3] = {{0}}, sum = rbf_lanes_all(0);
	uint32_t at[3] = {0, 1, 2}, k = 0; /* places of the site's corners among those of the draws */
	if (site->corners < 3 && weight)
		for (uint32_t n = 0; n < 3; n++)
			if (weight[n] > 0)
				at[k++] = n;
	if (tables > 1 && draws->inside)
		weigh_corners(site, weight, at, whole);
	sampler->tables = tables;
	sampler->parts = parts;
	sampler->luminance = site->component->amplitude + (size_t)rbf_luminance(site->component->channels) * site->component->blocks;
	for (uint32_t f = 0; f < frames; f++) {
		const rbf_fan *fan = &site->fan[f];
		const int half = tables > 1 && fan->kind == RBF_KIND_HALF;
		const rbf_lanes gain = half ? rbf_lanes_load(fan->gain) : rbf_lanes_all(1);
		rbf_lanes of[4];
		of[3] = rbf_lanes_all(0);
		for (uint32_t n = 0; n < 3; n++) {
			const rbf_draw_set *set = &draws->set[at[n < site->corners ? n : 0] * frames + f];
			of[n] = n < site->corners ? rbf_lanes_load(set->unit) : rbf_lanes_all(0); /* and something that does not matter */
			sampler->set[n][f].set = set;
		}
		rbf_lanes_transpose(of);
		for (uint32_t t = 0; t < RBF_DRAW_TABLES; t++) {
			const rbf_lanes share = half && draws->inside ? whole[t] : t && half ? t > 1 ? rbf_lanes_all(0) : rbf_lanes_load(fan->sine)
				: rbf_lanes_all(!t);
			of[t] *= gain * share;
			if (t >= tables)
				continue;
			const rbf_lanes until = running_sum(part * of[t] * (float)RBF_DRAW_TOTAL) + sum, before = {sum[0], until[0], until[1], until[2]};
			const uint32_t p = (f * tables + t) * RBF_FAN;
			rbf_lanes_store(sampler->before + p, before);
			rbf_lanes_store(sampler->scale + p, RBF_DRAW_TOTAL * 0x1p32f / (until - before));
			sum = rbf_lanes_all(until[3]);
		}
		const float excess = rbf_draw_excess(fan->limit);
		/* weights times shares come to 1 */
		rbf_lanes_store(over, rbf_lanes_min(rbf_lanes_all(excess), 1 / rbf_lanes_max(weights, rbf_lanes_all(1e-30f)) - 1));
		of[3] = rbf_lanes_all(excess);
		rbf_lanes_transpose(of);
		for (uint32_t n = 0; n < 3; n++) {
			rbf_lanes_store(sampler->set[n][f].bound, of[n]);
			sampler->set[n][f].excess = over[n];
		}
	}
	sampler->total = sum[0];
	/* what is behind the last one is not reached, whatever is rounded */
	for (uint32_t p = 0; p < parts; p += RBF_FAN) {
		const rbf_lanes before = rbf_lanes_load(sampler->before + p);
		rbf_lanes_store(sampler->before + p, rbf_lanes_select(before < sum, before, rbf_lanes_all(INFINITY)));
	}
	for (uint32_t p = parts; p < RBF_SAMPLER_FEW; p += RBF_FAN)
		rbf_lanes_store(sampler->before + p, rbf_lanes_all(INFINITY));
}

RBF_CLONES static void set_sampler(const rbf_site *site, const rbf_draws *draws, const float weight[3], rbf_sampler *sampler)
{
	if (draws->tables == 1)
		add_frames(site, draws, weight, 1, sampler);
	else
		add_frames(site, draws, weight, RBF_DRAW_TABLES, sampler);
}

void rbf_sampler_set(const rbf_site *site, const rbf_draws *draws, const float weight[3], rbf_sampler *sampler)
{
	if (draws)
		set_sampler(site, draws, weight, sampler);
	else {
		sampler->parts = 0;
		sampler->total = 0;
	}
}

/* Into [0, 1). */
static inline double clamped(double u)
{
	return u > 0 ? u < 1 ? u : 1 - 0x1p-53 : 0;
}

/* A lobe, and the numbers by which a direction is drawn from it. */
typedef struct lobe {
	float centre[3], width, far, a, b; /* width: 1 / kappa */
	float keep;     /* with this, times factor and share, the direction is kept */
	float number;   /* of [0, 1), to decide that */
	int extra;      /* drawn for what the share is above 1 */
} lobe;

/* What the parts are, in the order that they have. */
static inline __attribute__((always_inline)) rbf_sampler_part part_of(const rbf_sampler *sampler, uint32_t p)
{
	const uint32_t row = p / RBF_FAN, frame = sampler->tables > 1 ? row / RBF_DRAW_TABLES : row;
	return (rbf_sampler_part){p % RBF_FAN, frame, sampler->tables > 1 ? row % RBF_DRAW_TABLES : 0};
}

/* What is drawn for of a corner's share: what is above 1, over what that may be, or the rest. */
static inline __attribute__((always_inline)) float of_share(float share, float excess, int extra)
{
	return extra ? rbf_max(share - 1, 0) / excess : rbf_min(share, 1);
}

/* Whether a direction that was drawn from a lobe at a corner is kept, and where it is at the site, folded. extra: the lobe's, a constant. */
static inline __attribute__((always_inline)) int kept(const rbf_site *site, const rbf_sampler *sampler, rbf_sampler_part part, const lobe *l, int extra,
	const float drawn[3], float exitant[3])
{
	const uint32_t corner = part.corner;
	const rbf_fan *fan = &site->fan[part.frame];
	const float (*k)[RBF_FAN] = (const float (*)[RBF_FAN])site->direction;
	const float p[3] = {drawn[0] * site->flip[0][corner], drawn[1] * site->flip[1][corner], drawn[2]};
	const float factor = rbf_fan_inverse(fan, site->incident, k, corner, p, exitant) * rbf_min(exitant[2] * (1 / RBF_HORIZON_Z), 1.f);
	const float keep = factor > 0 ? factor * l->keep : 0;
	/* without a look at the other corners: shares are no less than the validity, as the sum of all is at most 1 */
	if (!extra && l->number < keep * (fan->limit > 1 ? rbf_validity(p[2]) : 1))
		return 1;
	if (!(l->number < keep) || (!extra && p[2] >= RBF_VALID_Z))
		return 0;
	float share[RBF_FAN];
	rbf_lanes_store(share, rbf_shares_at(site, part.frame, rbf_fan_heights(fan, site->incident, k, corner, p, exitant)));
	return l->number < keep * of_share(share[corner], sampler->set[corner][part.frame].excess, extra);
}

/* Where in the sum of the parts a number points to. */
static inline __attribute__((always_inline)) uint32_t part_at(const rbf_sampler *sampler, float pick)
{
	const float *before = sampler->before;
	uint64_t below = 0;
	for (uint32_t n = 0; n < RBF_SAMPLER_FEW; n += RBF_FAN)
		below |= (uint64_t)rbf_lanes_bits(rbf_lanes_load(before + n) <= pick) << n;
	for (uint32_t n = RBF_SAMPLER_FEW; n < sampler->parts; n += RBF_FAN)
		below |= (uint64_t)rbf_lanes_bits(rbf_lanes_load(before + n) <= pick) << n;
	return (uint32_t)__builtin_ctzll(~below) - 1; /* they rise from 0 */
}

/* What a number that points to part p is in units of its table, times 2^32; it was rounded when the part was found. */
static inline __attribute__((always_inline)) uint64_t units_at(const rbf_sampler *sampler, uint32_t p, double pick)
{
	const double units = (double)sampler->scale[p] * (pick - (double)sampler->before[p]), most = RBF_DRAW_TOTAL * 0x1p32 - 1;
	return (uint64_t)(int64_t)(units > 0 ? units < most ? units : most : 0);
}

/* The lobe of part p that a number points to. state: of random numbers. Returns 0 if none is drawn. */
static inline __attribute__((always_inline)) int choose(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, rbf_sampler_part part,
	double pick, int first, uint64_t *state, lobe *l)
{
	float extra;
	rbf_two_uniforms(state, &l->number, &extra);
	const struct rbf_sampler_set *of = &sampler->set[part.corner][part.frame];
	const rbf_draw_set *set = of->set;
	const float *bound = of->bound;
	const uint64_t units = units_at(sampler, p, pick);
	const uint16_t target = (uint16_t)(units >> 32);
	const rbf_block *block = site->component->block + set->first;
	const rbf_amplitude *luminance = sampler->luminance + set->first;
	const uint32_t begin = rbf_draw_begin(rbf_draw_guide(set, part.table)[target >> 10], set->blocks);
	/* ahead, should they not be at hand */
	__builtin_prefetch(block + begin);
	__builtin_prefetch(block[begin].z);
	__builtin_prefetch(luminance + begin);
	const uint32_t low = first_above(set, part.table, target, begin), lane = low % RBF_LANES;
	block += low / RBF_LANES;
	const float kappa = block->k[lane];
	float number;
	const uint16_t *until = rbf_draw_row(set, low / RBF_LANES, 0) + lane, *ahead = rbf_draw_before(set, low);
	const uint32_t before = ahead[part.table * RBF_LANES], share = until[part.table * RBF_LANES] - before;
	if (!(kappa > 0))
		return 0;
	if (first)
		rbf_split_number((uint32_t)((units - ((uint64_t)before << 32)) / (share | !share)), &number, &l->b);
	else
		rbf_two_uniforms(state, &number, &l->b);
	l->width = 1 / kappa;
	rbf_site_centre(site, part.corner, set->first + low / RBF_LANES, lane, l->centre);
	l->far = kappa > RBF_LOBE_SHARP ? 0 : rbf_exp_negative(-2 * kappa);
	/* and the tail alone as often as its share may be above 1 */
	const float tail = (float)(int32_t)until[set->tables * RBF_LANES] * (1 / 65535.f);
	const float more = bound[RBF_DRAW_TABLES] * tail;
	extra *= 1 + more;
	l->extra = extra < of->excess * tail;
	if (!l->extra && extra < more) /* as much is for sites where the share may be higher */
		return 0;
	l->a = l->extra ? number * tail : number;
	float all = bound[0] * (float)(int32_t)(until[0] - ahead[0]);
	for (uint32_t t = 1; t < RBF_DRAW_TABLES && sampler->tables > 1; t++)
		all += bound[t] * (float)(int32_t)(set->tables > 1 ? until[t * RBF_LANES] - ahead[t * RBF_LANES] : 0);
	l->keep = luminance[low / RBF_LANES].a[lane] * (float)(2 * RBF_PI) * (1 - l->far) * (1 + more) / (kappa * all);
	return 1;
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
		lobe l;
		float drawn[3], folded[3];
		const rbf_sampler_part part = part_of(sampler, p);
		if (!choose(site, sampler, p, part, pick, !attempt, &state, &l))
			continue;
		draw(l.centre, l.width, l.far, l.a, l.b, drawn);
		/* two places, so that it can be foreseen: what is extra is hardly ever kept */
		if (l.extra ? kept(site, sampler, part, &l, 1, drawn, folded) : kept(site, sampler, part, &l, 0, drawn, folded)) {
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
	rbf_carry_row x, y, z, width, far, a, b, extra, number, keep, factor, share, p[3], e[3];
} draft;

RBF_CLONES static void choose_all(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, int first, crowd *c, const uint16_t order[],
	uint32_t count, draft *d)
{
	const rbf_sampler_part part = part_of(sampler, p);
	int n = 0;
	for (uint32_t i = 0; i < count; i++) {
		const uint16_t at = order[i];
		lobe l = {.keep = 0};
		const int some = choose(site, sampler, p, part, c->pick[at], first, &c->state[at], &l);
		d->of[n] = at;
		d->x[n] = l.centre[0];
		d->y[n] = l.centre[1];
		d->z[n] = l.centre[2];
		d->width[n] = l.width;
		d->far[n] = l.far;
		d->a[n] = l.a;
		d->b[n] = l.b;
		d->extra[n] = (float)l.extra;
		d->number[n] = l.number;
		d->keep[n] = l.keep;
		n += some;
	}
	d->count = n;
	for (; n % RBF_CARRY_STEP; n++) { /* as the first one */
		d->x[n] = d->x[0];
		d->y[n] = d->y[0];
		d->z[n] = d->z[0];
		d->width[n] = d->width[0];
		d->far[n] = 0;
		d->a[n] = d->b[n] = .5f;
	}
}

/* Directions, mirrored as the corner's vertex is. */
RBF_CLONES static void draw_all(draft *d, float flip_x, float flip_y)
{
	for (int i = 0; i < d->count; i++) {
		const float centre[3] = {d->x[i], d->y[i], d->z[i]};
		float out[3];
		draw(centre, d->width[i], d->far[i], d->a[i], d->b[i], out);
		d->p[0][i] = out[0] * flip_x;
		d->p[1][i] = out[1] * flip_y;
		d->p[2][i] = out[2];
	}
	for (int i = d->count; i % RBF_CARRY_STEP; i++) {
		d->p[0][i] = d->p[1][i] = 0;
		d->p[2][i] = 1;
	}
}

RBF_CLONES static void weigh_all(draft *d, float excess)
{
	const float over = 1 / rbf_max(excess, 1e-30f);
	for (int i = 0; i < d->count; i++) {
		const float share = d->extra[i] > 0 ? rbf_max(d->share[i] - 1, 0) * over : rbf_min(d->share[i], 1);
		const float keep = d->keep[i] * d->factor[i] * share * rbf_min(d->e[2][i] * (1 / RBF_HORIZON_Z), 1.f);
		d->keep[i] = d->e[2][i] > 0 ? keep : 0;
	}
}

/* Draws for one part, and takes what is kept out of the crowd: which[] is then RBF_CARRY. Returns how many. */
static uint32_t draw_part(const rbf_site *site, const rbf_sampler *sampler, uint32_t p, int first, crowd *c, const uint16_t order[],
	uint32_t count, draft *d, float exitant[][3])
{
	const rbf_sampler_part part = part_of(sampler, p);
	const uint32_t k = part.corner, f = part.frame;
	uint32_t kept = 0;
	choose_all(site, sampler, p, first, c, order, count, d);
	draw_all(d, site->flip[0][k], site->flip[1][k]);
	rbf_carry_back(site, k, f, d->count, (const rbf_carry_row *)d->p, d->e, d->factor);
	rbf_carry_shares(site, k, f, d->count, (const rbf_carry_row *)d->e, d->share);
	weigh_all(d, sampler->set[k][f].excess);
	for (int i = 0; i < d->count; i++) {
		const uint16_t at = d->of[i];
		if (!(d->number[i] < d->keep[i]))
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
			uint32_t first[RBF_SAMPLER_PARTS + 1] = {0}, left = 0;
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
