/* SPDX-License-Identifier: BSD-3-Clause */
/* What reads streams of pack.h, today's and those of version 1.2. Whatever they hold, nothing is read or written beside what is there. */
#ifndef RBF_UNPACK_H
#define RBF_UNPACK_H
#include "pack.h"

/* Bits that are read one after the other; beyond the last one they are 0. */
typedef struct rbf_bits {
	const uint8_t *from;
	uint64_t at, count;
} rbf_bits;

/* Those that come, 57 at least. */
static inline uint64_t rbf_bits_ahead(const rbf_bits *b)
{
	uint64_t word = 0;
	const uint64_t byte = b->at / 8, bytes = b->count / 8;
	if (byte + 8 <= bytes)
		word = rbf_cull_load((const char *)b->from + byte);
	else
		for (uint64_t i = byte; i < bytes; i++)
			word |= (uint64_t)b->from[i] << 8 * (i - byte);
	return word >> b->at % 8;
}

/* n bits, at most 32. */
static inline uint32_t rbf_bits_take(rbf_bits *b, uint32_t n)
{
	const uint64_t word = rbf_bits_ahead(b);
	b->at += n;
	return (uint32_t)(word & (((uint64_t)1 << n) - 1));
}

/* An Exp-Golomb code of an order, at most RBF_PACK_ORDER_MOST. */
static inline uint64_t rbf_bits_count(rbf_bits *b, uint32_t order)
{
	const uint64_t word = rbf_bits_ahead(b);
	const uint32_t zeros = (uint32_t)__builtin_ctzll(word | (uint64_t)1 << RBF_PACK_COUNT_MOST);
	const uint64_t length = (uint64_t)1 << zeros, high = length | ((word >> (zeros + 1)) & (length - 1));
	b->at += 2 * zeros + 1 + order;
	return (high - 1) << order | ((word >> (2 * zeros + 1)) & (((uint64_t)1 << order) - 1));
}

static inline int64_t rbf_bits_difference(rbf_bits *b, uint32_t order)
{
	const uint64_t count = rbf_bits_count(b, order);
	return (int64_t)(count >> 1) ^ -(int64_t)(count & 1);
}

/* What is made, all in one piece. */
typedef struct rbf_unpacked {
	rbf_set *set;
	uint32_t *cell_first, *cell_element;
	float *dhr, *trend;
	rbf_block *block;
	rbf_amplitude *amplitude;
	uint64_t *cull;
	rbf_shift *shift; /* not in streams of version 1.2 */
} rbf_unpacked;

/* Cells of rows that reach into the disc. */
typedef struct rbf_cull_rows { struct { uint32_t first, end; } row[RBF_CULL_GRID]; } rbf_cull_rows;

int rbf_unpack_cells(rbf_bits *bits, rbf_mesh *mesh);
int rbf_unpack_trend(rbf_bits *bits, const rbf_component *component, float *trend); /* returns whether there is one */

/* A lobe, or an unused lane if `from` is NULL. */
void rbf_unpack_lane(const rbf_component *component, const rbf_packed_lobe *from, uint32_t exponent, uint32_t at, const rbf_unpacked *to);

/* As they were in version 1.2, before masks, and one group of these; NULL, or what is wrong; whether it is sound. */
const char *rbf_unpack_former(rbf_bits *bits, rbf_component *component, const rbf_unpacked *to, uint32_t *masks);
int rbf_unpack_former_group(rbf_bits *bits, const rbf_cull_rows *rows, uint32_t group, uint64_t mask[RBF_CULL_CELLS]);
#endif
