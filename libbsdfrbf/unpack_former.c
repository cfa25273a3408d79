/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Streams of version 1.2:
 *   cells    as today
 *   dhr      nodes of elements, 20 bits each, as they are; lines of borders: 1 bit, whether it is the line before once more, else its nodes;
 *            the trend as today
 *   header   9 bits: smallest exponent of amplitudes; 1 bit: whether there are masks; 1 bit: whether a centre is beyond 1 along an axis
 *   lobes    lane by lane, block by block: 15 bits of kappa, 0: an unused lane; two numbers of the centre, each of as many bits as its steps
 *            need, with a sign; 16 bits for each channel
 *   masks    set by set, of each group of blocks its cells, exclusive or with the row above: counts of those that are 0 before the next 1,
 *            and in the end before the last cell is past
 */
#include "unpack.h"

static float take_float(rbf_bits *b)
{
	const uint32_t bits = rbf_bits_take(b, RBF_PACK_DHR_BITS) << RBF_PACK_DHR_DROPPED;
	float f;
	memcpy(&f, &bits, sizeof f);
	return f;
}

static int32_t take_signed(rbf_bits *b, uint32_t n)
{
	return (int32_t)(rbf_bits_take(b, n) << (32 - n)) >> (32 - n);
}

static void unpack_dhr(rbf_bits *b, const rbf_component *c, float *to)
{
	const size_t inside = rbf_pack_inside(c), lines = 4 * (size_t)c->dhr_steps * c->mesh.borders, line = rbf_pack_line(c);
	for (size_t i = 0; i < inside; i++)
		to[i] = take_float(b);
	to += inside;
	for (size_t i = 0; i < lines; i++, to += line) {
		const uint32_t again = rbf_bits_take(b, 1) && i;
		for (size_t n = 0; n < line; n++)
			to[n] = again ? to[(ptrdiff_t)n - (ptrdiff_t)line] : take_float(b);
	}
}

static void unpack_lobe(rbf_bits *b, uint32_t channels, uint32_t beyond, rbf_packed_lobe *l)
{
	for (int n = 0; n < 2; n++)
		l->at[n] = take_signed(b, rbf_pack_steps(l->kappa) + 1 + beyond);
	for (uint32_t n = 0; n < channels; n++)
		l->amplitude[n] = rbf_bits_take(b, RBF_PACK_AMPLITUDE_BITS);
}

const char *rbf_unpack_former(rbf_bits *b, rbf_component *c, const rbf_unpacked *to, uint32_t *masks)
{
	if (!rbf_unpack_cells(b, &c->mesh))
		return "cells";
	unpack_dhr(b, c, to->dhr);
	c->trend = rbf_unpack_trend(b, c, to->trend) ? to->trend : NULL;
	const uint32_t exponent = rbf_bits_take(b, 9);
	*masks = rbf_bits_take(b, 1);
	const uint32_t beyond = rbf_bits_take(b, 1);
	if (exponent > RBF_PACK_EXPONENTS)
		return "exponent";
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_packed_lobe l = {.kappa = rbf_bits_take(b, RBF_PACK_KAPPA_BITS)};
		if (l.kappa)
			unpack_lobe(b, c->channels, beyond, &l);
		rbf_unpack_lane(c, l.kappa ? &l : NULL, exponent, i, to);
	}
	return NULL;
}

int rbf_unpack_former_group(rbf_bits *b, const rbf_cull_rows *rows, uint32_t group, uint64_t mask[RBF_CULL_CELLS])
{
	uint32_t at = 0, cells = 0;
	uint64_t next = rbf_bits_count(b, 1);
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++) {
		const uint32_t first = rows->row[y].first, end = at + rows->row[y].end - first;
		for (; next < end; next += 1 + rbf_bits_count(b, 1))
			cells ^= 1u << ((uint32_t)next - at + first);
		at = end;
		cells = rbf_cull_beside(cells, first, rows->row[y].end);
		for (uint32_t left = cells; left; left &= left - 1)
			mask[y * RBF_CULL_GRID + (uint32_t)__builtin_ctz(left)] |= (uint64_t)1 << group;
	}
	return next == at;
}
