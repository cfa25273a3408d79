/* SPDX-License-Identifier: BSD-3-Clause */
#include "check.h"
#include "draws.h"
#include "pack.h"

#include <stdlib.h>

enum { ALIGN = 64 };

const char *const rbf_unpack_memory = "memory";

/* Bits that are read one after the other; beyond the last one they are 0. */
typedef struct bits {
	const uint8_t *from;
	uint64_t at, count;
} bits;

/* n bits, at most 32. */
static uint32_t take(bits *b, uint32_t n)
{
	uint64_t word = 0;
	const uint64_t byte = b->at / 8, bytes = b->count / 8;
	if (byte + 8 <= bytes)
		word = rbf_cull_load((const char *)b->from + byte);
	else
		for (uint64_t i = byte; i < bytes; i++)
			word |= (uint64_t)b->from[i] << 8 * (i - byte);
	word >>= b->at % 8;
	b->at += n;
	return (uint32_t)(word & (((uint64_t)1 << n) - 1));
}

static int32_t take_signed(bits *b, uint32_t n)
{
	return (int32_t)(take(b, n) << (32 - n)) >> (32 - n);
}

/* An Exp-Golomb code of order 1. */
static uint32_t take_count(bits *b)
{
	bits ahead = *b;
	const uint32_t zeros = (uint32_t)__builtin_ctz(take(&ahead, 25) | 1u << 24);
	b->at += zeros + 1;
	return ((((1u << zeros) | take(b, zeros)) - 1) << 1) | take(b, 1);
}

static int unpack_cells(bits *b, rbf_mesh *m)
{
	const uint32_t cells = rbf_mesh_cells(m), elements = rbf_pack_index_bits(m->elements), borders = rbf_pack_index_bits(m->borders);
	uint32_t at = 0;
	for (uint32_t cell = 0; cell < cells; cell++) {
		const uint32_t count = take_count(b);
		if (count > m->cell_entries - at)
			return 0;
		m->cell_first[cell] = at;
		for (uint32_t end = at + count; at < end; at++) {
			const uint32_t border = take(b, 1);
			m->cell_element[at] = border * RBF_MESH_BORDER | take(b, border ? borders : elements);
		}
	}
	m->cell_first[cells] = at;
	return at == m->cell_entries;
}

static float take_float(bits *b, uint32_t width, uint32_t dropped)
{
	const uint32_t bits = take(b, width) << dropped;
	float f;
	memcpy(&f, &bits, sizeof f);
	return f;
}

static void unpack_lines(bits *b, float *to, size_t lines, size_t line, uint32_t width, uint32_t dropped)
{
	for (size_t i = 0; i < lines; i++, to += line) {
		const uint32_t again = take(b, 1) && i;
		for (size_t n = 0; n < line; n++)
			to[n] = again ? to[(ptrdiff_t)n - (ptrdiff_t)line] : take_float(b, width, dropped);
	}
}

/* Returns whether there is a trend. */
static int unpack_dhr(bits *b, const rbf_component *c, float *dhr, float *trend)
{
	const size_t inside = rbf_pack_inside(c), lines = 4 * (size_t)c->dhr_steps * c->mesh.borders;
	for (size_t i = 0; i < inside; i++)
		dhr[i] = take_float(b, RBF_PACK_DHR_BITS, RBF_PACK_DHR_DROPPED);
	unpack_lines(b, dhr + inside, lines, rbf_pack_line(c), RBF_PACK_DHR_BITS, RBF_PACK_DHR_DROPPED);
	if (!take(b, 1))
		return 0;
	unpack_lines(b, trend, lines, 1, 32, 0);
	return 1;
}

static void unpack_lobes(bits *b, const rbf_component *c, uint32_t exponent, uint32_t beyond, rbf_block *block, rbf_amplitude *amplitude)
{
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_block *to = &block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		rbf_packed_lobe l = {.kappa = take(b, RBF_PACK_KAPPA_BITS)};
		float centre[3] = {0, 0, 1}, value[3] = {0, 0, 0}, kappa = 0;
		if (l.kappa) {
			for (int n = 0; n < 2; n++)
				l.at[n] = take_signed(b, rbf_pack_steps(l.kappa) + 1 + beyond);
			for (uint32_t n = 0; n < c->channels; n++)
				l.amplitude[n] = take(b, RBF_PACK_AMPLITUDE_BITS);
			rbf_pack_decode(&l, exponent, c->channels, centre, &kappa, value);
		}
		to->x[lane] = centre[0];
		to->y[lane] = centre[1];
		to->z[lane] = centre[2];
		to->k[lane] = kappa;
		for (uint32_t n = 0; n < c->channels; n++)
			amplitude[(size_t)n * c->blocks + i / RBF_LANES].a[lane] = value[n];
	}
}

typedef struct span { uint32_t first, end; } span;

/* Sets a group's bit in the masks of its cells; span[]: of the rows. Returns 0 where there is more than all cells. */
static int unpack_group(bits *b, const span row[RBF_CULL_GRID], uint32_t group, uint64_t mask[RBF_CULL_CELLS])
{
	uint32_t at = 0, next = take_count(b), cells = 0;
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++) {
		const uint32_t end = at + row[y].end - row[y].first;
		for (; next < end; next += 1 + take_count(b))
			cells ^= 1u << (next - at + row[y].first);
		at = end;
		cells = rbf_cull_beside(cells, row[y].first, row[y].end);
		for (uint32_t left = cells; left; left &= left - 1)
			mask[y * RBF_CULL_GRID + (uint32_t)__builtin_ctz(left)] |= (uint64_t)1 << group;
	}
	return next == at;
}

static int unpack_masks(bits *b, const rbf_component *c, uint64_t *cull)
{
	span row[RBF_CULL_GRID];
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++)
		rbf_cull_span(y, &row[y].first, &row[y].end);
	for (uint32_t s = 0; s < c->sets; s++) {
		const uint32_t groups = (uint32_t)__builtin_popcountll(rbf_cull_all(c->set[s].blocks));
		uint64_t mask[RBF_CULL_CELLS] = {0};
		for (uint32_t g = 0; g < groups; g++)
			if (!unpack_group(b, row, g, mask) || b->at > b->count)
				return 0;
		for (uint32_t cell = 0; cell < RBF_CULL_CELLS && groups; cell++)
			rbf_cull_write(cull, &c->set[s], cell, mask[cell]);
	}
	return 1;
}

/* Sets of a made component follow each other, and all blocks are theirs: what is read for each of them is then no more than the blocks. */
static int sets_follow(const rbf_component *c)
{
	uint64_t next = 0;
	for (uint32_t s = 0; s < c->sets; s++) {
		if (c->set[s].first != next)
			return 0;
		next += c->set[s].blocks;
	}
	return next == c->blocks;
}

/* What is made, all in one piece. */
typedef struct arrays {
	rbf_set *set;
	uint32_t *cell_first, *cell_element;
	float *dhr, *trend;
	rbf_block *block;
	rbf_amplitude *amplitude;
	uint16_t *draws;
	uint64_t *cull;
} arrays;

/* Room for an array, aligned. */
static void *place(char *made, uint64_t *bytes, uint64_t size)
{
	void *at = made ? made + *bytes : NULL;
	*bytes += (size + ALIGN - 1) / ALIGN * ALIGN;
	return at;
}

/* Returns how many bytes there are in all; made: NULL, or where they are. */
static uint64_t place_all(const rbf_component *c, char *made, arrays *a)
{
	uint64_t bytes = 0;
	const uint64_t lanes = (uint64_t)c->blocks * RBF_LANES, lines = 4ull * c->dhr_steps * c->mesh.borders;
	a->set = place(made, &bytes, c->sets * sizeof *a->set);
	a->cell_first = place(made, &bytes, (rbf_mesh_cells(&c->mesh) + 1) * sizeof *a->cell_first);
	a->cell_element = place(made, &bytes, c->mesh.cell_entries * sizeof *a->cell_element);
	a->dhr = place(made, &bytes, (rbf_pack_inside(c) + lines * rbf_pack_line(c)) * sizeof *a->dhr);
	a->trend = place(made, &bytes, lines * sizeof *a->trend);
	a->block = place(made, &bytes, c->blocks * sizeof *a->block);
	a->amplitude = place(made, &bytes, (uint64_t)c->channels * c->blocks * sizeof *a->amplitude);
	a->draws = place(made, &bytes, lanes * rbf_draw_tables(c) * sizeof *a->draws);
	a->cull = place(made, &bytes, rbf_cull_words(c->blocks) * sizeof *a->cull);
	return bytes;
}

static const char *unpack_all(bits *b, rbf_component *c, const arrays *a)
{
	c->mesh.cell_first = a->cell_first;
	c->mesh.cell_element = a->cell_element;
	if (!unpack_cells(b, &c->mesh))
		return "cells";
	c->trend = unpack_dhr(b, c, a->dhr, a->trend) ? a->trend : NULL;
	c->dhr = a->dhr;
	const uint32_t exponent = take(b, 9), masks = take(b, 1), beyond = take(b, 1);
	if (exponent > RBF_PACK_EXPONENTS)
		return "exponent";
	unpack_lobes(b, c, exponent, beyond, a->block, a->amplitude);
	c->block = c->blocks ? a->block : NULL;
	c->amplitude = c->blocks ? a->amplitude : NULL;
	memcpy(a->set, c->set, c->sets * sizeof *a->set);
	c->set = a->set;
	const char *wrong = rbf_check_arrays(c);
	if (wrong)
		return wrong;
	if (!sets_follow(c))
		return "sets";
	memset(a->cull, 0, rbf_cull_words(c->blocks) * sizeof *a->cull);
	if (masks && !unpack_masks(b, c, a->cull))
		return "culling masks";
	c->cull = masks ? a->cull : NULL;
	if (b->at > b->count || b->count - b->at >= 8)
		return "length";
	c->draws = a->draws;
	return rbf_draws_make(c) ? rbf_unpack_memory : NULL;
}

const char *rbf_unpack(rbf_component *c, void **made)
{
	bits b = {c->pack, 0, 8ull * c->packed};
	arrays a;
	const uint64_t bytes = place_all(c, NULL, &a);
	if (bytes > RBF_PACK_MOST)
		return "size";
	*made = malloc((size_t)bytes + ALIGN);
	if (!*made)
		return rbf_unpack_memory;
	place_all(c, (char *)*made + (ALIGN - (uintptr_t)*made % ALIGN), &a);
	c->packed = 0;
	c->pack = NULL;
	return unpack_all(&b, c, &a);
}
