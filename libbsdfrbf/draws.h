/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Tables by which sample.c draws a lobe at sites in one item of the mesh (an element, or a border for what is outside). For each corner and
 * frame: running sums, in 1/65535 of their total, of bounds of every lobe's part at sites in the item. With m the lobe's luminance, sr,
 * b the part of the lobe that may lie where the corner takes over from another one of the item (takeover.h), and E by how much its share
 * may be above 1 there, these are m (1 + E b) times
 *   in elements      1, and what the half map's change of solid angle, J, may be for directions of the lobe at one, and at the other
 *                    corner beside: J is linear in the incidence, and at the corner itself 1
 *   else             1, and T: a bound of the slope of J, which is at most 1 + sin(i,k) T
 * but for other kinds of maps the first one alone. Shares are rounded up, so that they stay bounds.
 * Each item's tables are made when a site in it is first to be sampled, by whichever thread asks, and kept: lobes of items that no ray meets
 * cost nothing.
 */
#ifndef RBF_DRAWS_H
#define RBF_DRAWS_H
#include "map.h"

#define RBF_DRAW_TOTAL 65535
#define RBF_DRAW_GUIDES 64  /* of a table, each for as much of the total */
#define RBF_DRAW_TABLES 3

#define RBF_LOBE_SPREAD 4.f /* sigmas that bounds of J cover: all but 3e-4 of a lobe */
#define RBF_LOBE_SHARP 20.f /* a kappa above it leaves nothing (e^-40) at the other end of the sphere */

/* What the bounds of a lobe depend on, angles in radians. */
typedef struct rbf_reach {
	unsigned map;
	float base[3];       /* measured incidence */
	float lowest;        /* cosine of the angle to what may be lowest, by: */
	float motion;        /* largest residual motion of the lobe */
} rbf_reach;

/* beyond: largest angle from the base to an incident direction that it serves. */
float rbf_reach_lowest(const float base[3], float beyond);

/* T of a lobe: 0 but for half maps. */
float rbf_lobe_slant(const rbf_reach *reach, const float centre[3], float kappa);

/* J, at most, of a lobe at k that is seen from l. */
float rbf_lobe_rise(const rbf_reach *reach, const float l[3], const float centre[3], float kappa);

/* Tables of one corner and frame. */
typedef struct rbf_draw_set {
	uint32_t first, blocks;         /* of the set; at most what the set has */
	float unit[RBF_DRAW_TABLES];    /* what a share stands for, sr; 0: nothing is drawn by that table */
	uint32_t tables;                /* as many have entries */
	uint32_t guide, lobe;           /* bytes from here to the guides of each table, and to entries of lobes */
} rbf_draw_set;

typedef struct rbf_draws {
	uint16_t corners, tables;       /* tables: of all sets, 1 or RBF_DRAW_TABLES */
	uint16_t inside;                /* J is linear between the corners, else T is what is there */
	uint16_t frames;
	uint32_t first;                 /* bytes up to where the lobes begin: what every draw needs */
	rbf_draw_set set[];             /* [corners][frames] */
} rbf_draws;

/* Which block to begin with, for each 1024 of a running sum: 256ths of all. */
static inline const uint8_t *rbf_draw_guide(const rbf_draw_set *set, uint32_t table)
{
	return (const uint8_t *)set + set->guide + table * RBF_DRAW_GUIDES;
}

static inline uint32_t rbf_draw_begin(uint32_t guide, uint32_t blocks)
{
	return guide * blocks >> 8;
}

/* Entries of a block of lobes: running sums of the block's lanes by each table, then their b in 1/65535. Before the first block there is one of 0,
 * behind the last one one with all the total. */
static inline const uint16_t *rbf_draw_row(const rbf_draw_set *set, uint32_t block, uint32_t row)
{
	const uint16_t *lobe = (const uint16_t *)(const void *)((const char *)set + set->lobe);
	return lobe + ((block + 1) * (set->tables + 1) + row) * RBF_LANES;
}

/* The entry of a lane's first table, and by one block for each the others; at: but of the lane before. */
static inline const uint16_t *rbf_draw_before(const rbf_draw_set *set, uint32_t at)
{
	return rbf_draw_row(set, (at + RBF_LANES - 1) / RBF_LANES - 1, 0) + (at + RBF_LANES - 1) % RBF_LANES;
}

/* Asks memory for what every draw needs. */
static inline void rbf_draws_fetch(const rbf_draws *draws)
{
	for (uint32_t at = 0; at < draws->first; at += 64)
		__builtin_prefetch((const char *)draws + at);
}

/* E: by how much shares of a frame of this limit may be above 1. */
static inline float rbf_draw_excess(float limit)
{
	return limit > 1 ? limit - 1 : 0;
}

/* Those of an item, and of corners that are given, without residual motion: to be freed by free(). NULL: out of memory. */
rbf_draws *rbf_draws_of_item(const rbf_component *component, uint32_t item);
rbf_draws *rbf_draws_of_corners(const rbf_component *component, const rbf_vertex vertex[3], const float weight[3]);

/* Those of an item, kept by the model. NULL: out of memory. */
const rbf_draws *rbf_draws_at(const bsdfrbf_model *model, const rbf_component *component, uint32_t item);
#endif
