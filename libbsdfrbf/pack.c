/* SPDX-License-Identifier: BSD-3-Clause */
#include "pack.h"
#include "arrays.h"

#include <stdlib.h>

static uint32_t bits_of(float f)
{
	uint32_t bits;
	memcpy(&bits, &f, sizeof bits);
	return bits;
}

/* A positive float's upper bits, rounded, in what is counted from `least` on; 0 for what is below, the last one for what is above. */
static uint32_t upper_bits(float f, uint32_t least, uint32_t width)
{
	const uint32_t upper = (bits_of(f) + (1u << (RBF_PACK_DROPPED - 1))) >> RBF_PACK_DROPPED, most = (1u << width) - 1;
	return !(f > 0) || upper <= least ? 0 : upper - least < most ? upper - least : most;
}

/* The header's exponent: the largest amplitude has the last but one. */
static uint32_t exponent_of(const rbf_component *c)
{
	float most = 0;
	for (uint64_t i = 0; i < (uint64_t)c->channels * c->blocks; i++)
		for (int lane = 0; lane < RBF_LANES; lane++)
			most = fmaxf(most, c->amplitude[i].a[lane]);
	const uint32_t exponents = 1u << (RBF_PACK_AMPLITUDE_BITS - RBF_PACK_FRACTION), exponent = bits_of(most) >> 23;
	const uint32_t least = exponent + 2 > exponents ? exponent + 2 - exponents : 0;
	return least < RBF_PACK_EXPONENTS ? least : RBF_PACK_EXPONENTS;
}

static void encode(const rbf_component *c, uint32_t exponent, uint32_t at, rbf_packed_lobe *to)
{
	const rbf_block *b = &c->block[at / RBF_LANES];
	const uint32_t lane = at % RBF_LANES;
	*to = (rbf_packed_lobe){.kappa = upper_bits(b->k[lane], RBF_PACK_KAPPA, RBF_PACK_KAPPA_BITS)};
	const double steps = (double)(1u << rbf_pack_steps(to->kappa)), scale = steps / sqrt(1 + fmax((double)b->z[lane], -.5));
	to->at[0] = (int32_t)lrint(fmin(fmax((double)b->x[lane] * scale, -2 * steps), 2 * steps - 1));
	to->at[1] = (int32_t)lrint(fmin(fmax((double)b->y[lane] * scale, -2 * steps), 2 * steps - 1));
	for (uint32_t n = 0; n < c->channels; n++)
		to->amplitude[n] = upper_bits(c->amplitude[(size_t)n * c->blocks + at / RBF_LANES].a[lane], exponent << RBF_PACK_FRACTION,
			RBF_PACK_AMPLITUDE_BITS);
}

void rbf_pack_round(rbf_component *c)
{
	const uint32_t exponent = exponent_of(c);
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_block *b = (rbf_block *)&c->block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		rbf_packed_lobe l;
		float centre[3], kappa, value[3];
		encode(c, exponent, i, &l);
		if (!l.kappa)
			continue;
		rbf_pack_decode(&l, exponent, c->channels, centre, &kappa, value);
		if (!(fabsf(kappa - b->k[lane]) < 2e-3f * kappa) || !(fabsf(centre[2] - b->z[lane]) < 4e-3f)) /* beyond what codes tell */
			continue;
		b->x[lane] = centre[0];
		b->y[lane] = centre[1];
		b->z[lane] = centre[2];
		b->k[lane] = kappa;
		for (uint32_t n = 0; n < c->channels; n++)
			((rbf_amplitude *)c->amplitude)[(size_t)n * c->blocks + i / RBF_LANES].a[lane] = value[n];
	}
}

void rbf_pack_round_dhr(rbf_component *c)
{
	const size_t count = rbf_pack_inside(c) + rbf_pack_line(c) * 4 * c->dhr_steps * c->mesh.borders;
	for (size_t i = 0; i < count; i++) {
		const uint32_t bits = (bits_of(c->dhr[i]) + (1u << (RBF_PACK_DHR_DROPPED - 1))) >> RBF_PACK_DHR_DROPPED << RBF_PACK_DHR_DROPPED;
		memcpy((float *)c->dhr + i, &bits, sizeof bits);
	}
}

/* Bits that are written one after the other into what is 0 so far; without room for them, they are counted. */
typedef struct bits {
	uint8_t *to;
	uint64_t at;
} bits;

static void put(bits *b, uint32_t value, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++, b->at++)
		if (b->to)
			b->to[b->at / 8] |= (uint8_t)((value >> i & 1) << b->at % 8);
}

/* An Exp-Golomb code of order 1. */
static void put_count(bits *b, uint32_t count)
{
	const uint32_t high = (count >> 1) + 1, length = 31 - (uint32_t)__builtin_clz(high);
	put(b, 1u << length, length + 1);
	put(b, high, length);
	put(b, count, 1);
}

/* Whether a centre needs the larger range. */
static uint32_t beyond(const rbf_component *c)
{
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_packed_lobe l;
		encode(c, 0, i, &l);
		const int32_t most = 1 << rbf_pack_steps(l.kappa);
		if (l.kappa && (l.at[0] < -most || l.at[0] >= most || l.at[1] < -most || l.at[1] >= most))
			return 1;
	}
	return 0;
}

static void put_cells_of_mesh(bits *b, const rbf_mesh *m)
{
	const uint32_t cells = rbf_mesh_cells(m), elements = rbf_pack_index_bits(m->elements), borders = rbf_pack_index_bits(m->borders);
	for (uint32_t cell = 0; cell < cells; cell++) {
		put_count(b, m->cell_first[cell + 1] - m->cell_first[cell]);
		for (uint32_t i = m->cell_first[cell]; i < m->cell_first[cell + 1]; i++) {
			const uint32_t border = m->cell_element[i] / RBF_MESH_BORDER;
			put(b, border, 1);
			put(b, m->cell_element[i] & ~RBF_MESH_BORDER, border ? borders : elements);
		}
	}
}

/* Floats that may be those before once more, `line` at a time; width: bits of each, without the last `dropped`. */
static void put_lines(bits *b, const float *from, size_t lines, size_t line, uint32_t width, uint32_t dropped)
{
	for (size_t i = 0; i < lines; i++, from += line) {
		const int again = i && !memcmp(from, from - line, line * sizeof *from);
		put(b, (uint32_t)again, 1);
		for (size_t n = 0; n < line && !again; n++)
			put(b, bits_of(from[n]) >> dropped, width);
	}
}

static void put_dhr(bits *b, const rbf_component *c)
{
	const size_t inside = rbf_pack_inside(c), lines = 4 * (size_t)c->dhr_steps * c->mesh.borders;
	for (size_t i = 0; i < inside; i++)
		put(b, bits_of(c->dhr[i]) >> RBF_PACK_DHR_DROPPED, RBF_PACK_DHR_BITS);
	put_lines(b, c->dhr + inside, lines, rbf_pack_line(c), RBF_PACK_DHR_BITS, RBF_PACK_DHR_DROPPED);
	put(b, c->trend != NULL, 1);
	if (c->trend)
		put_lines(b, c->trend, lines, 1, 32, 0);
}

static void put_lobes(bits *b, const rbf_component *c, uint32_t exponent, uint32_t range)
{
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_packed_lobe l;
		encode(c, exponent, i, &l);
		put(b, l.kappa, RBF_PACK_KAPPA_BITS);
		for (int n = 0; n < 2 && l.kappa; n++)
			put(b, (uint32_t)l.at[n], rbf_pack_steps(l.kappa) + 1 + range);
		for (uint32_t n = 0; n < c->channels && l.kappa; n++)
			put(b, l.amplitude[n], RBF_PACK_AMPLITUDE_BITS);
	}
}

/* Which cells have a group. */
static void put_cells(bits *b, const uint64_t mask[RBF_CULL_CELLS], uint32_t group)
{
	uint32_t above = 0, zeros = 0;
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++) {
		uint32_t first, end, row = 0;
		rbf_cull_span(y, &first, &end);
		for (uint32_t x = 0; x < RBF_CULL_GRID; x++)
			row |= (uint32_t)(mask[y * RBF_CULL_GRID + x] >> group & 1) << x;
		for (uint32_t x = first; x < end; x++)
			if ((row ^ above) >> x & 1) {
				put_count(b, zeros);
				zeros = 0;
			} else
				zeros++;
		above = row;
	}
	put_count(b, zeros);
}

static void put_masks(bits *b, const rbf_component *c)
{
	for (uint32_t s = 0; s < c->sets && c->cull; s++) {
		uint64_t mask[RBF_CULL_CELLS];
		const uint32_t groups = (uint32_t)__builtin_popcountll(rbf_cull_all(c->set[s].blocks));
		for (uint32_t cell = 0; cell < RBF_CULL_CELLS && groups; cell++)
			mask[cell] = rbf_cull_read(rbf_cull_packed(c->cull, &c->set[s], cell));
		for (uint32_t g = 0; g < groups; g++)
			put_cells(b, mask, g);
	}
}

static void put_all(bits *b, const rbf_component *c)
{
	const uint32_t exponent = exponent_of(c), range = beyond(c);
	put_cells_of_mesh(b, &c->mesh);
	put_dhr(b, c);
	put(b, exponent, 9);
	put(b, c->cull != NULL, 1);
	put(b, range, 1);
	put_lobes(b, c, exponent, range);
	put_masks(b, c);
}

/* Whether the stream gives the component's arrays; -1: out of memory. */
static int comes_back(const rbf_component *c, const uint8_t *packed, uint32_t bytes)
{
	rbf_component back = *c;
	void *made = NULL;
	back.packed = bytes;
	back.pack = packed;
	const char *wrong = rbf_unpack(&back, &made);
	int good = wrong == rbf_unpack_memory ? -1 : !wrong;
	for (int row = 0; row < RBF_ARRAY_ROWS && good > 0; row++) {
		const void *x = rbf_array_get(c, row), *y = rbf_array_get(&back, row);
		const size_t size = (size_t)(rbf_array_entries(&back, row) * rbf_array_row[row].entry);
		good = x == y || !size || (x && y && !memcmp(x, y, size));
	}
	free(made);
	return good;
}

int rbf_pack(const rbf_component *c, uint8_t **packed, uint32_t *bytes)
{
	bits b = {NULL, 0};
	*packed = NULL;
	*bytes = 0;
	if (c->cull_wide)
		return 0;
	put_all(&b, c);
	if (b.at > 8ull * UINT32_MAX)
		return 0;
	*bytes = (uint32_t)((b.at + 7) / 8);
	b = (bits){calloc(*bytes, 1), 0};
	if (!b.to)
		return -1;
	put_all(&b, c);
	const int good = comes_back(c, b.to, *bytes);
	if (good > 0)
		*packed = b.to;
	else
		free(b.to);
	return good < 0 ? -1 : 0;
}
