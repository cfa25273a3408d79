/* SPDX-License-Identifier: BSD-3-Clause */
/* Sampling of what evaluate.h evaluates: the same terms, drawn instead of summed. */
#ifndef RBF_SAMPLE_H
#define RBF_SAMPLE_H
#include "draws.h"
#include "evaluate.h"

#define RBF_SAMPLER_PARTS (RBF_DRAW_TABLES * RBF_MAX_FRAMES * RBF_FAN)
#define RBF_SAMPLER_FEW 12 /* parts that are looked at in any case */

/* What all draws at one site have in common. A part is one table of one frame and corner (or lane without one), in this order. */
typedef struct rbf_sampler {
	uint32_t parts, tables;            /* tables: of a frame and corner */
	float total;                       /* sum of the bounds of all parts */
	float before[RBF_SAMPLER_PARTS];   /* of those before each; INFINITY behind the last one that has any */
	float scale[RBF_SAMPLER_PARTS];    /* units of each part's table, times 2^32, in what these count */
	const rbf_amplitude *luminance;    /* of all blocks */
	struct rbf_sampler_set {
		const rbf_draw_set *set;
		float bound[RBF_FAN];          /* what a share of each table stands for, over the corner's part; behind them E of the tables */
		float excess;                  /* by how much the corner's share can be above 1 here */
	} set[3][RBF_MAX_FRAMES];
} rbf_sampler;

typedef struct rbf_sampler_part { uint32_t corner, frame, table; } rbf_sampler_part;

/* draws: of the site's item of the mesh, NULL: nothing is drawn; weight: of the item's corners. Or of the site's corners, and NULL. */
void rbf_sampler_set(const rbf_site *site, const rbf_draws *draws, const float weight[3], rbf_sampler *sampler);

_Static_assert(RBF_SAMPLER_PARTS < 64 && RBF_SAMPLER_FEW % RBF_FAN == 0, "parts are searched as bits of a word");

#define RBF_SAMPLE_TRIES 1024 /* then there is nothing to draw */

/* Draws an exitant direction in the component's half space (not folded), density proportional to the
 * luminance of DSF without the Lambertian part. Returns 1, or 0 if there is nothing to draw. */
int rbf_site_sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3]);

/* The same for many numbers: from the same number the same direction, but for rounding. Returns how many were drawn; others are 0. */
size_t rbf_site_sample_many(const rbf_site *site, const rbf_sampler *sampler, size_t count, const double *u, float exitant[][3]);

/* A number of [0, 1), times 2^32, into two of (0, 1), by its odd and even bits, 16 of each: what was stratified stays so in both. */
static inline void rbf_split_number(uint32_t number, float *a, float *b)
{
	const uint64_t bits = number;
	uint64_t x = (bits & 0x55555555u) | (bits >> 1 & 0x55555555u) << 32; /* even ones below, odd ones above; each moved together: */
	x = (x | x >> 1) & 0x3333333333333333u;
	x = (x | x >> 2) & 0x0f0f0f0f0f0f0f0fu;
	x = (x | x >> 4) & 0x00ff00ff00ff00ffu;
	x = (x | x >> 8) & 0x0000ffff0000ffffu;
	*a = ((float)(int32_t)(uint32_t)x + .5f) * 0x1p-16f;
	*b = ((float)(int32_t)(x >> 32) + .5f) * 0x1p-16f;
}

/* Random bits from a state that any number may start. SplitMix64: Steele et al., Fast splittable pseudorandom number generators, 2014. */
static inline uint64_t rbf_random_bits(uint64_t *state)
{
	uint64_t z = *state += 0x9e3779b97f4a7c15u;
	z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
	z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
	return z ^ (z >> 31);
}

/* A number of [0, 1). */
static inline double rbf_uniform(uint64_t *state)
{
	return (double)(rbf_random_bits(state) >> 11) * 0x1p-53;
}

/* Two numbers of (0, 1). */
static inline void rbf_two_uniforms(uint64_t *state, float *a, float *b)
{
	const uint64_t z = rbf_random_bits(state);
	*a = ((float)(int32_t)(z >> 41) + .5f) * 0x1p-23f;
	*b = ((float)(int32_t)((uint32_t)z >> 9) + .5f) * 0x1p-23f;
}

/* Centre of a corner's lobe with the site's residual motion, in the base's coordinates. */
static inline void rbf_site_centre(const rbf_site *site, uint32_t corner, uint32_t block, uint32_t lane, float centre[3])
{
	const rbf_component *c = site->component;
	const rbf_block *b = &c->block[block];
	centre[0] = b->x[lane];
	centre[1] = b->y[lane];
	centre[2] = b->z[lane];
	if (!site->moves)
		return;
	const uint32_t at = block - c->set[site->base[corner] * c->frames].first;
	int moved = 0;
	const rbf_motion *motion = &site->motion[corner];
	for (int n = 0; n < 2; n++)
		if (motion->shift[n]) {
			const rbf_shift *s = &motion->shift[n][at];
			const float w = motion->weight[n];
			centre[0] += w * s->x[lane];
			centre[1] += w * s->y[lane];
			centre[2] += w * s->z[lane];
			moved = 1;
		}
	if (moved)
		rbf_normalize(centre);
}

/* Direction from a lobe exp(kappa (cos - 1)), kappa > 0, by two numbers of [0, 1); may lie below the horizon. */
void rbf_lobe_draw(const float centre[3], float kappa, double u, double v, float out[3]);
#endif
