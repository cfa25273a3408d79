/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Where a culling mask is. A set has one for each cell of a grid over its exitant hemisphere; bit b: group b of its blocks matters there.
 *
 * They are packed, little-endian: each as wide as its set has blocks, cell by cell, and those of a set begin at bit RBF_CULL_STRIDE x its
 * first block. So nothing else need be recorded, and whatever lies within the blocks has its masks within the array. Files had masks of
 * 64 bits each before that ("wide"), which are still read.
 */
#ifndef RBF_CULL_H
#define RBF_CULL_H
#include "model.h"

#include <string.h>

#define RBF_CULL_CELLS (1ull * RBF_CULL_GRID * RBF_CULL_GRID)
#define RBF_CULL_BITS 64u    /* of a mask, at most */
#define RBF_CULL_STRIDE 824u /* bits for each block of a set: whole bytes, and room for masks that are wider than their set has blocks */

/* Bits of a mask of a set of as many blocks: such that all of them lie within the eight bytes from the one where it begins. */
static inline uint32_t rbf_cull_width(uint32_t blocks)
{
	return blocks <= 58 ? blocks : blocks <= 60 ? 60 : RBF_CULL_BITS;
}

_Static_assert(61 * RBF_CULL_STRIDE >= RBF_CULL_BITS * RBF_CULL_CELLS && 59 * RBF_CULL_STRIDE >= 60 * RBF_CULL_CELLS
	&& RBF_CULL_STRIDE % 8 == 0, "room for masks");

/* Words of the packed masks of as many blocks: eight bytes can be read from where any of them begins. */
static inline uint64_t rbf_cull_words(uint64_t blocks)
{
	return blocks ? (RBF_CULL_STRIDE * blocks + 63) / 64 + 1 : 0;
}

/* Blocks in a group, of a set of as many. */
static inline uint32_t rbf_cull_group(uint32_t blocks)
{
	return (blocks + RBF_CULL_BITS - 1) / RBF_CULL_BITS;
}

/* The mask of all groups of as many blocks. */
static inline uint64_t rbf_cull_all(uint32_t blocks)
{
	const uint32_t groups = blocks <= RBF_CULL_BITS ? blocks : (blocks + rbf_cull_group(blocks) - 1) / rbf_cull_group(blocks);
	return groups < RBF_CULL_BITS ? ((uint64_t)1 << groups) - 1 : ~(uint64_t)0;
}

/* A mask that is still to be read. */
typedef struct rbf_cull_mask {
	const char *at;
	uint32_t shift;     /* its first bit */
} rbf_cull_mask;

/* For cell `cell` of a set that lies within the blocks and has some. */
static inline rbf_cull_mask rbf_cull_packed(const uint64_t *packed, const rbf_set *set, uint32_t cell)
{
	const uint32_t bit = rbf_cull_width(set->blocks) * cell;
	return (rbf_cull_mask){(const char *)packed + (size_t)set->first * (RBF_CULL_STRIDE / 8) + bit / 8, bit % 8};
}

/* The same for the set with index s, of a component of which one of `packed` and `wide` is not NULL. */
static inline rbf_cull_mask rbf_cull_at(const uint64_t *packed, const uint64_t *wide, size_t s, const rbf_set *set, uint32_t cell)
{
	return packed ? rbf_cull_packed(packed, set, cell) : (rbf_cull_mask){(const char *)(wide + RBF_CULL_CELLS * s + cell), 0};
}

static inline uint64_t rbf_cull_load(const char *at)
{
	uint64_t bits;
	memcpy(&bits, at, sizeof bits);
	return __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? __builtin_bswap64(bits) : bits;
}

/* Bits beyond the set's groups may be any. */
static inline uint64_t rbf_cull_read(rbf_cull_mask m)
{
	return rbf_cull_load(m.at) >> m.shift;
}

/* Writes one of packed masks that are 0 so far. */
static inline void rbf_cull_write(uint64_t *packed, const rbf_set *set, uint32_t cell, uint64_t mask)
{
	const rbf_cull_mask m = rbf_cull_packed(packed, set, cell);
	char *at = (char *)packed + (m.at - (const char *)packed);
	uint64_t bits = rbf_cull_load(at) | mask << m.shift;
	bits = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? __builtin_bswap64(bits) : bits;
	memcpy(at, &bits, sizeof bits);
}
#endif
