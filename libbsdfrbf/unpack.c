/* SPDX-License-Identifier: BSD-3-Clause */
#include "unpack.h"
#include "check.h"
#include "moves.h"

#include <stdlib.h>

enum { ALIGN = 64 };

const char *const rbf_unpack_memory = "memory";

int rbf_unpack_cells(rbf_bits *b, rbf_mesh *m)
{
	const uint32_t cells = rbf_mesh_cells(m), elements = rbf_pack_index_bits(m->elements), borders = rbf_pack_index_bits(m->borders);
	uint32_t at = 0;
	for (uint32_t cell = 0; cell < cells; cell++) {
		const uint64_t count = rbf_bits_count(b, 1);
		if (count > m->cell_entries - at)
			return 0;
		m->cell_first[cell] = at;
		for (uint32_t end = at + (uint32_t)count; at < end; at++) {
			const uint32_t border = rbf_bits_take(b, 1);
			m->cell_element[at] = border * RBF_MESH_BORDER | rbf_bits_take(b, border ? borders : elements);
		}
	}
	m->cell_first[cells] = at;
	return at == m->cell_entries;
}

int rbf_unpack_trend(rbf_bits *b, const rbf_component *c, float *trend)
{
	const size_t lines = 4 * (size_t)c->dhr_steps * c->mesh.borders;
	const int there = (int)rbf_bits_take(b, 1);
	for (size_t i = 0; i < lines && there; i++) {
		const int again = rbf_bits_take(b, 1) && i;
		const uint32_t bits = again ? 0 : rbf_bits_take(b, 32);
		memcpy(&trend[i], again ? (const void *)&trend[i - 1] : &bits, sizeof bits);
	}
	return there;
}

/* What the header says. */
typedef struct header { uint32_t exponent, masks, order[RBF_PACK_ORDERS]; } header;

static void unpack_header(rbf_bits *b, const rbf_component *c, header *h)
{
	h->exponent = rbf_bits_take(b, 9);
	h->masks = rbf_bits_take(b, 1);
	for (int n = 0; n < rbf_pack_orders(c); n++)
		h->order[n] = rbf_bits_take(b, 4);
}

/* Nodes of a row, from those of the same channel before: before[channels] at first. Returns 0 where one is no such number. */
static int unpack_nodes(rbf_bits *b, uint32_t order, size_t channels, size_t count, const float *before, float *to)
{
	for (size_t n = 0; n < count; n++) {
		const float *from = n < channels ? before + n : to + n - channels;
		uint32_t bits;
		memcpy(&bits, from, sizeof bits);
		const int64_t number = (int64_t)(bits >> RBF_PACK_DHR_DROPPED) + rbf_bits_difference(b, order);
		if (number < 0 || number >> RBF_PACK_DHR_BITS)
			return 0;
		bits = (uint32_t)number << RBF_PACK_DHR_DROPPED;
		memcpy(to + n, &bits, sizeof bits);
	}
	return 1;
}

static int unpack_dhr(rbf_bits *b, const rbf_component *c, uint32_t order, float *to)
{
	static const float nothing[3];
	const size_t inside = rbf_pack_inside(c), lines = 4 * (size_t)c->dhr_steps * c->mesh.borders, line = rbf_pack_line(c);
	int good = unpack_nodes(b, order, c->channels, inside, nothing, to);
	to += inside;
	for (size_t i = 0; i < lines && good; i++, to += line) {
		if (rbf_bits_take(b, 1) && i)
			memcpy(to, to - line, line * sizeof *to);
		else
			good = unpack_nodes(b, order, c->channels, line, i ? to - line : nothing, to);
	}
	return good;
}

void rbf_unpack_lane(const rbf_component *c, const rbf_packed_lobe *from, uint32_t exponent, uint32_t at, const rbf_unpacked *to)
{
	rbf_block *block = &to->block[at / RBF_LANES];
	const uint32_t lane = at % RBF_LANES;
	float centre[3] = {0, 0, 1}, value[3] = {0, 0, 0}, kappa = 0;
	if (from)
		rbf_pack_decode(from, exponent, c->channels, centre, &kappa, value);
	block->x[lane] = centre[0];
	block->y[lane] = centre[1];
	block->z[lane] = centre[2];
	block->k[lane] = kappa;
	for (uint32_t n = 0; n < c->channels; n++)
		to->amplitude[(size_t)n * c->blocks + at / RBF_LANES].a[lane] = value[n];
}

/* What was told of the lobes of an incidence by itself. */
typedef struct told {
	rbf_packed_lobe *lobe;
	uint32_t count, others, next; /* of other frames: they may be meant; after the one that was meant last */
} told;

/* A lobe's kappa and centre in place of those of the one before. Returns 0 where there is no such lobe. */
static int unpack_shape(rbf_bits *b, const header *h, rbf_packed_lobe *l)
{
	const int64_t kappa = (int64_t)l->kappa + rbf_bits_difference(b, h->order[RBF_PACK_ORDER_KAPPA]);
	if (kappa < 1 || kappa >> RBF_PACK_KAPPA_BITS)
		return 0;
	const uint32_t had = rbf_pack_steps(l->kappa), steps = rbf_pack_steps((uint32_t)kappa);
	l->kappa = (uint32_t)kappa;
	for (int n = 0; n < 2; n++) {
		const int64_t at = rbf_pack_scaled(l->at[n], had, steps) + rbf_bits_difference(b, h->order[RBF_PACK_ORDER_CENTRE]);
		if (at < -(2ll << steps) || at >= 2ll << steps)
			return 0;
		l->at[n] = (int32_t)at;
	}
	return 1;
}

/* The same, of a lobe of another frame. */
static int take_shape(rbf_bits *b, const header *h, told *t, rbf_packed_lobe *l)
{
	const int64_t at = (int64_t)t->next + rbf_bits_difference(b, h->order[RBF_PACK_ORDER_PLACE]);
	if (at < 0 || at >= (int64_t)t->others)
		return 0;
	t->next = (uint32_t)at + 1;
	l->kappa = t->lobe[at].kappa;
	memcpy(l->at, t->lobe[at].at, sizeof l->at);
	return 1;
}

static int unpack_lobe(rbf_bits *b, const header *h, uint32_t channels, told *t, rbf_packed_lobe *l)
{
	int64_t value = (int64_t)l->amplitude[0];
	if (t->others && rbf_bits_take(b, 1)) {
		if (!take_shape(b, h, t, l))
			return 0;
	} else {
		if (!unpack_shape(b, h, l))
			return 0;
		t->lobe[t->count++] = *l;
	}
	for (uint32_t n = 0; n < channels; n++) {
		value += rbf_bits_difference(b, h->order[n ? RBF_PACK_ORDER_CHANNEL : RBF_PACK_ORDER_AMPLITUDE]);
		if (value < 0 || value >> RBF_PACK_AMPLITUDE_BITS)
			return 0;
		l->amplitude[n] = (uint32_t)value;
	}
	return 1;
}

static int unpack_block(rbf_bits *b, const rbf_component *c, const header *h, uint32_t block, told *t, rbf_packed_lobe *l,
	const rbf_unpacked *to)
{
	const uint32_t used = rbf_bits_take(b, 1) ? (1u << RBF_LANES) - 1 : rbf_bits_take(b, RBF_LANES);
	for (uint32_t lane = 0; lane < RBF_LANES; lane++) {
		const int is = (int)(used >> lane & 1);
		if (is && !unpack_lobe(b, h, c->channels, t, l))
			return 0;
		rbf_unpack_lane(c, is ? l : NULL, h->exponent, block * RBF_LANES + lane, to);
	}
	return 1;
}

/* The image of a block. */
static void reflect(const rbf_component *c, uint32_t from, uint32_t block, const rbf_unpacked *to)
{
	to->block[block] = to->block[from];
	for (int lane = 0; lane < RBF_LANES; lane++)
		to->block[block].y[lane] *= -1;
	for (size_t n = 0; n < c->channels; n++)
		to->amplitude[n * c->blocks + block] = to->amplitude[n * c->blocks + from];
}

/* lobe: room for those of an incidence. */
static int unpack_lobes(rbf_bits *b, const rbf_component *c, const header *h, rbf_packed_lobe *lobe, const rbf_unpacked *to)
{
	rbf_packed_lobe l = {0};
	told t = {.lobe = lobe};
	for (uint32_t s = 0; s < c->sets; s++) {
		const uint32_t first = c->set[s].first, blocks = c->set[s].blocks;
		const uint64_t given = c->mesh.symmetry == RBF_ISOTROPIC ? rbf_bits_count(b, 1) : 0;
		if (given > blocks / 2)
			return 0;
		const uint32_t twins = (uint32_t)given;
		if (s % c->frames == 0)
			t.count = 0;
		t.others = t.count;
		t.next = 0;
		for (uint32_t n = 0; n < blocks; n++)
			if (n >= twins && n < 2 * twins)
				reflect(c, first + 2 * twins - 1 - n, first + n, to);
			else if (!unpack_block(b, c, h, first + n, &t, &l, to) || b->at > b->count)
				return 0;
	}
	return 1;
}

/* Sets a bit in the masks of a group's cells, and another in those of their images. Returns 0 where cells are none. */
static int unpack_group(rbf_bits *b, const rbf_cull_rows *rows, uint64_t bit, uint64_t twin, uint64_t mask[RBF_CULL_CELLS])
{
	const uint32_t plain = rbf_bits_take(b, 1), top = rbf_bits_take(b, 5), count = rbf_bits_take(b, 5);
	int64_t left = RBF_CULL_GRID / 2, right = left;
	if (top + count > RBF_CULL_GRID)
		return 0;
	for (uint32_t y = top; y < top + count; y++) {
		const uint32_t first = rows->row[y].first, end = rows->row[y].end;
		uint32_t cells;
		if (plain || rbf_bits_take(b, 1)) {
			left = rbf_pack_within(left, first, end - 1) + rbf_bits_difference(b, 0);
			right = rbf_pack_within(right, first, end - 1) + rbf_bits_difference(b, 0);
			if (left < (int64_t)first || right < left || right >= (int64_t)end)
				return 0;
			cells = (2u << right) - (1u << left);
		} else if ((cells = rbf_bits_take(b, end - first) << first)) {
			left = __builtin_ctz(cells);
			right = 31 - __builtin_clz(cells);
		}
		for (uint32_t all = rbf_cull_beside(cells, first, end); all; all &= all - 1) {
			const uint32_t x = (uint32_t)__builtin_ctz(all);
			mask[y * RBF_CULL_GRID + x] |= bit;
			mask[(RBF_CULL_GRID - 1 - y) * RBF_CULL_GRID + x] |= twin;
		}
	}
	return 1;
}

static int unpack_masks(rbf_bits *b, const rbf_component *c, int former, uint64_t *cull)
{
	rbf_cull_rows rows;
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++)
		rbf_cull_span(y, &rows.row[y].first, &rows.row[y].end);
	for (uint32_t s = 0; s < c->sets; s++) {
		const uint32_t groups = (uint32_t)__builtin_popcountll(rbf_cull_all(c->set[s].blocks));
		const uint32_t twins = former || groups < c->set[s].blocks ? 0 : rbf_pack_twins(c, &c->set[s]), images = twins && rbf_bits_take(b, 1);
		uint64_t mask[RBF_CULL_CELLS] = {0};
		for (uint32_t g = 0; g < groups; g = images && g + 1 == twins ? 2 * twins : g + 1) {
			const uint64_t bit = (uint64_t)1 << g, twin = images && g < twins ? (uint64_t)1 << (2 * twins - 1 - g) : 0;
			if (!(former ? rbf_unpack_former_group(b, &rows, g, mask) : unpack_group(b, &rows, bit, twin, mask)) || b->at > b->count)
				return 0;
		}
		for (uint32_t cell = 0; cell < RBF_CULL_CELLS && groups; cell++)
			rbf_cull_write(cull, &c->set[s], cell, mask[cell]);
	}
	return 1;
}

/* What comes before the masks. Returns NULL, or what is wrong. */
static const char *unpack_arrays(rbf_bits *b, rbf_component *c, const rbf_unpacked *to, uint32_t *masks)
{
	header h;
	unpack_header(b, c, &h);
	*masks = h.masks;
	if (h.exponent > RBF_PACK_EXPONENTS)
		return "exponent";
	if (!rbf_unpack_cells(b, &c->mesh))
		return "cells";
	if (!unpack_dhr(b, c, h.order[RBF_PACK_ORDER_DHR], to->dhr))
		return "dhr";
	c->trend = rbf_unpack_trend(b, c, to->trend) ? to->trend : NULL;
	rbf_packed_lobe *room = malloc((rbf_pack_most_lanes(c) + 1) * sizeof *room);
	const char *wrong = !room ? rbf_unpack_memory : unpack_lobes(b, c, &h, room, to) ? NULL : "lobes";
	free(room);
	if (!wrong && c->residual)
		wrong = rbf_moves_unpack(b, c, h.order[RBF_PACK_ORDER_MOVE], to->shift);
	return wrong;
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

/* Room for an array, aligned. */
static void *place(char *made, uint64_t *bytes, uint64_t size)
{
	void *at = made ? made + *bytes : NULL;
	*bytes += (size + ALIGN - 1) / ALIGN * ALIGN;
	return at;
}

/* Returns how many bytes there are in all; made: NULL, or where they are. */
static uint64_t place_all(const rbf_component *c, int former, char *made, rbf_unpacked *a)
{
	uint64_t bytes = 0;
	const uint64_t lines = 4ull * c->dhr_steps * c->mesh.borders;
	a->set = place(made, &bytes, c->sets * sizeof *a->set);
	a->cell_first = place(made, &bytes, (rbf_mesh_cells(&c->mesh) + 1) * sizeof *a->cell_first);
	a->cell_element = place(made, &bytes, c->mesh.cell_entries * sizeof *a->cell_element);
	a->dhr = place(made, &bytes, (rbf_pack_inside(c) + lines * rbf_pack_line(c)) * sizeof *a->dhr);
	a->trend = place(made, &bytes, lines * sizeof *a->trend);
	a->block = place(made, &bytes, c->blocks * sizeof *a->block);
	a->amplitude = place(made, &bytes, (uint64_t)c->channels * c->blocks * sizeof *a->amplitude);
	a->cull = place(made, &bytes, rbf_cull_words(c->blocks) * sizeof *a->cull);
	a->shift = place(made, &bytes, former ? 0 : c->shifts * sizeof *a->shift);
	return bytes;
}

static const char *unpack_all(rbf_bits *b, int former, rbf_component *c, const rbf_unpacked *a)
{
	uint32_t masks = 0;
	c->mesh.cell_first = a->cell_first;
	c->mesh.cell_element = a->cell_element;
	memcpy(a->set, c->set, c->sets * sizeof *a->set);
	c->set = a->set;
	if (!sets_follow(c))
		return "sets";
	c->dhr = a->dhr;
	c->block = c->blocks ? a->block : NULL;
	c->amplitude = c->blocks ? a->amplitude : NULL;
	if (!former)
		c->shift = c->shifts ? a->shift : NULL;
	const char *wrong = (former ? rbf_unpack_former : unpack_arrays)(b, c, a, &masks);
	if (!wrong)
		wrong = rbf_check_arrays(c);
	if (wrong)
		return wrong;
	memset(a->cull, 0, rbf_cull_words(c->blocks) * sizeof *a->cull);
	if (masks && !unpack_masks(b, c, former, a->cull))
		return "culling masks";
	c->cull = masks ? a->cull : NULL;
	if (b->at > b->count || b->count - b->at >= 8)
		return "length";
	return NULL;
}

const char *rbf_unpack(rbf_component *c, int former, void **made)
{
	rbf_bits b = {c->pack, 0, 8ull * c->packed};
	rbf_unpacked a;
	const uint64_t bytes = place_all(c, former, NULL, &a);
	if (bytes > RBF_PACK_MOST)
		return "size";
	*made = malloc((size_t)bytes + ALIGN);
	if (!*made)
		return rbf_unpack_memory;
	place_all(c, former, (char *)*made + (ALIGN - (uintptr_t)*made % ALIGN), &a);
	c->packed = 0;
	c->pack = NULL;
	return unpack_all(&b, former, c, &a);
}
