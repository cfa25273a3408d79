/* SPDX-License-Identifier: BSD-3-Clause */
#include "moves.h"
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

uint32_t rbf_pack_kappa(float kappa)
{
	return upper_bits(kappa, RBF_PACK_KAPPA, RBF_PACK_KAPPA_BITS);
}

static void encode(const rbf_component *c, uint32_t exponent, uint32_t at, rbf_packed_lobe *to)
{
	const rbf_block *b = &c->block[at / RBF_LANES];
	const uint32_t lane = at % RBF_LANES;
	*to = (rbf_packed_lobe){.kappa = rbf_pack_kappa(b->k[lane])};
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

/* Bits that are written one after the other into what is 0 so far; without room for them, they are counted. With `cost`, what differences
 * would take in each order is added up instead. */
typedef struct bits {
	uint8_t *to;
	uint64_t at;
	uint32_t order[RBF_PACK_ORDERS];
	uint64_t (*cost)[RBF_PACK_ORDER_MOST + 1];
} bits;

static void put(bits *b, uint32_t value, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++, b->at++)
		if (b->to)
			b->to[b->at / 8] |= (uint8_t)((value >> i & 1) << b->at % 8);
}

/* An Exp-Golomb code of an order. */
static void put_count(bits *b, uint64_t count, uint32_t order)
{
	const uint64_t high = (count >> order) + 1;
	const uint32_t length = 63 - (uint32_t)__builtin_clzll(high);
	put(b, 1u << length, length + 1);
	put(b, (uint32_t)high, length);
	put(b, (uint32_t)count, order);
}

/* 0, -1, 1, -2 ... */
static uint64_t count_of(int64_t difference)
{
	return difference < 0 ? 2 * (uint64_t)~difference + 1 : 2 * (uint64_t)difference;
}

static void put_difference(bits *b, int kind, int64_t difference)
{
	const uint64_t count = count_of(difference);
	for (uint32_t order = 0; order <= RBF_PACK_ORDER_MOST && b->cost; order++) {
		const uint32_t length = 63 - (uint32_t)__builtin_clzll((count >> order) + 1);
		b->cost[kind][order] += length < RBF_PACK_COUNT_MOST ? 2 * length + 1 + order : 1ull << 32;
	}
	if (!b->cost)
		put_count(b, count, b->order[kind]);
}

static void put_cells_of_mesh(bits *b, const rbf_mesh *m)
{
	const uint32_t cells = rbf_mesh_cells(m), elements = rbf_pack_index_bits(m->elements), borders = rbf_pack_index_bits(m->borders);
	for (uint32_t cell = 0; cell < cells; cell++) {
		put_count(b, m->cell_first[cell + 1] - m->cell_first[cell], 1);
		for (uint32_t i = m->cell_first[cell]; i < m->cell_first[cell + 1]; i++) {
			const uint32_t border = m->cell_element[i] / RBF_MESH_BORDER;
			put(b, border, 1);
			put(b, m->cell_element[i] & ~RBF_MESH_BORDER, border ? borders : elements);
		}
	}
}

/* Nodes, each by the one before of the same channel; before[channels]: those of the first. */
static void put_nodes(bits *b, size_t channels, size_t count, const float *before, const float *from)
{
	for (size_t n = 0; n < count; n++)
		put_difference(b, RBF_PACK_ORDER_DHR, (int64_t)(bits_of(from[n]) >> RBF_PACK_DHR_DROPPED)
			- (int64_t)(bits_of(n < channels ? before[n] : from[n - channels]) >> RBF_PACK_DHR_DROPPED));
}

static void put_dhr(bits *b, const rbf_component *c)
{
	static const float nothing[3];
	const size_t inside = rbf_pack_inside(c), lines = 4 * (size_t)c->dhr_steps * c->mesh.borders, line = rbf_pack_line(c);
	const float *from = c->dhr + inside;
	put_nodes(b, c->channels, inside, nothing, c->dhr);
	for (size_t i = 0; i < lines; i++, from += line) {
		const int again = i && !memcmp(from, from - line, line * sizeof *from);
		put(b, (uint32_t)again, 1);
		if (!again)
			put_nodes(b, c->channels, line, i ? from - line : nothing, from);
	}
	put(b, c->trend != NULL, 1);
	for (size_t i = 0; i < lines && c->trend; i++) {
		const int again = i && !memcmp(&c->trend[i], &c->trend[i - 1], sizeof *c->trend);
		put(b, (uint32_t)again, 1);
		if (!again)
			put(b, bits_of(c->trend[i]), 32);
	}
}

/* What was told of the lobes of an incidence by itself. */
typedef struct told {
	rbf_packed_lobe *lobe;
	uint32_t count, next;  /* next: after the one that was meant last */
	uint32_t others;       /* those of other frames: they may be meant */
} told;

static void put_amplitudes(bits *b, uint32_t channels, const rbf_packed_lobe *before, const rbf_packed_lobe *l)
{
	put_difference(b, RBF_PACK_ORDER_AMPLITUDE, (int64_t)l->amplitude[0] - (int64_t)before->amplitude[0]);
	for (uint32_t n = 1; n < channels; n++)
		put_difference(b, RBF_PACK_ORDER_CHANNEL, (int64_t)l->amplitude[n] - (int64_t)l->amplitude[n - 1]);
}

static void put_lobe(bits *b, uint32_t channels, told *t, const rbf_packed_lobe *before, const rbf_packed_lobe *l)
{
	uint32_t same = 0;
	while (same < t->others && (t->lobe[same].kappa != l->kappa || t->lobe[same].at[0] != l->at[0] || t->lobe[same].at[1] != l->at[1]))
		same++;
	if (t->others)
		put(b, same < t->others, 1);
	if (same < t->others) {
		put_difference(b, RBF_PACK_ORDER_PLACE, (int64_t)same - (int64_t)t->next);
		t->next = same + 1;
	} else {
		const uint32_t had = rbf_pack_steps(before->kappa), steps = rbf_pack_steps(l->kappa);
		put_difference(b, RBF_PACK_ORDER_KAPPA, (int64_t)l->kappa - (int64_t)before->kappa);
		for (int n = 0; n < 2; n++)
			put_difference(b, RBF_PACK_ORDER_CENTRE, l->at[n] - rbf_pack_scaled(before->at[n], had, steps));
		t->lobe[t->count++] = *l;
	}
	put_amplitudes(b, channels, before, l);
}

static void put_block(bits *b, const rbf_component *c, uint32_t exponent, uint32_t block, told *t, rbf_packed_lobe *before)
{
	rbf_packed_lobe l[RBF_LANES];
	uint32_t used = 0;
	for (uint32_t lane = 0; lane < RBF_LANES; lane++) {
		encode(c, exponent, block * RBF_LANES + lane, &l[lane]);
		used |= (uint32_t)(l[lane].kappa > 0) << lane;
	}
	put(b, used == (1u << RBF_LANES) - 1, 1);
	if (used != (1u << RBF_LANES) - 1)
		put(b, used, RBF_LANES);
	for (uint32_t lane = 0; lane < RBF_LANES; lane++)
		if (used >> lane & 1) {
			put_lobe(b, c->channels, t, before, &l[lane]);
			*before = l[lane];
		}
}

/* lobe: room for those of an incidence. */
static void put_lobes(bits *b, const rbf_component *c, uint32_t exponent, rbf_packed_lobe *lobe)
{
	rbf_packed_lobe before = {0};
	told t = {.lobe = lobe};
	for (uint32_t s = 0; s < c->sets; s++) {
		const uint32_t twins = rbf_pack_twins(c, &c->set[s]);
		if (s % c->frames == 0)
			t.count = 0;
		t.others = t.count;
		t.next = 0;
		if (c->mesh.symmetry == RBF_ISOTROPIC)
			put_count(b, twins, 1);
		for (uint32_t n = 0; n < c->set[s].blocks; n++)
			if (n < twins || n >= 2 * twins)
				put_block(b, c, exponent, c->set[s].first + n, &t, &before);
	}
}

/* Whether shifts of images are images. */
static int shifts_reflect(const rbf_component *c, const rbf_moves *m)
{
	for (uint32_t i = 0; i < c->shifts; i++) {
		rbf_shift image;
		if (m->block[i] == RBF_MOVES_NONE || rbf_moves_source(m, i) == i)
			continue;
		rbf_moves_reflect(&c->shift[rbf_moves_source(m, i)], &image);
		if (memcmp(&image, &c->shift[i], sizeof image) != 0)
			return 0;
	}
	return 1;
}

/* The shift of a lane, by that of one before. */
static void put_move(bits *b, const rbf_component *c, const rbf_moves *m, uint32_t i, uint32_t lane)
{
	const uint32_t block = m->block[i], own = block * RBF_LANES + lane, near = m->before[own], other = near / RBF_LANES;
	int32_t at[2], before[2] = {0, 0};
	rbf_moves_encode(c, m, &c->shift[i], block, lane, at);
	if (near != own)
		rbf_moves_encode(c, m, &c->shift[i - (block - other)], other, near % RBF_LANES, before);
	for (int n = 0; n < 2; n++)
		put_difference(b, RBF_PACK_ORDER_MOVE, at[n] - rbf_pack_scaled(before[n], m->steps[near], m->steps[own]));
}

static void put_moves(bits *b, const rbf_component *c, const rbf_moves *m)
{
	const int images = shifts_reflect(c, m);
	put(b, (uint32_t)images, 1);
	for (uint32_t i = 0; i < c->shifts; i++) {
		if (m->block[i] == RBF_MOVES_NONE || (images && rbf_moves_source(m, i) != i))
			continue;
		for (uint32_t lane = 0; lane < RBF_LANES; lane++)
			if (m->steps[m->block[i] * RBF_LANES + lane])
				put_move(b, c, m, i, lane);
	}
}

/* Cells of a row that have a group, within the span. */
static uint32_t row_of(const uint64_t mask[RBF_CULL_CELLS], uint32_t group, uint32_t y)
{
	uint32_t first, end, row = 0;
	rbf_cull_span(y, &first, &end);
	for (uint32_t x = first; x < end; x++)
		row |= (uint32_t)(mask[y * RBF_CULL_GRID + x] >> group & 1) << x;
	return row;
}

static int is_interval(uint32_t row)
{
	return row && !((row + (row & -row)) & row);
}

/* Which cells have a group. */
static void put_group(bits *b, const uint64_t mask[RBF_CULL_CELLS], uint32_t group)
{
	uint32_t row[RBF_CULL_GRID], top = RBF_CULL_GRID, end = 0, plain = 1;
	int64_t left = RBF_CULL_GRID / 2, right = left;
	for (uint32_t y = 0; y < RBF_CULL_GRID; y++) {
		row[y] = row_of(mask, group, y);
		if (row[y] && top == RBF_CULL_GRID)
			top = y;
		if (row[y])
			end = y + 1;
	}
	top = end ? top : 0;
	for (uint32_t y = top; y < end; y++)
		plain &= (uint32_t)is_interval(row[y]);
	put(b, plain, 1);
	put(b, top, 5);
	put(b, end - top, 5);
	for (uint32_t y = top; y < end; y++) {
		uint32_t first, past;
		rbf_cull_span(y, &first, &past);
		if (!plain)
			put(b, (uint32_t)is_interval(row[y]), 1);
		const int64_t from = row[y] ? __builtin_ctz(row[y]) : left, to = row[y] ? 31 - __builtin_clz(row[y]) : right;
		if (is_interval(row[y])) {
			put_count(b, count_of(from - rbf_pack_within(left, first, past - 1)), 0);
			put_count(b, count_of(to - rbf_pack_within(right, first, past - 1)), 0);
		} else
			put(b, row[y] >> first, past - first);
		left = from;
		right = to;
	}
}

/* Whether masks of twins are images. */
static int are_images(const uint64_t mask[RBF_CULL_CELLS], uint32_t twins)
{
	for (uint32_t g = 0; g < twins; g++)
		for (uint32_t y = 0; y < RBF_CULL_GRID; y++)
			if (row_of(mask, g, y) != row_of(mask, 2 * twins - 1 - g, RBF_CULL_GRID - 1 - y))
				return 0;
	return 1;
}

static void put_masks(bits *b, const rbf_component *c)
{
	for (uint32_t s = 0; s < c->sets && c->cull; s++) {
		uint64_t mask[RBF_CULL_CELLS];
		const uint32_t groups = (uint32_t)__builtin_popcountll(rbf_cull_all(c->set[s].blocks));
		const uint32_t twins = groups < c->set[s].blocks ? 0 : rbf_pack_twins(c, &c->set[s]);
		for (uint32_t cell = 0; cell < RBF_CULL_CELLS && groups; cell++)
			mask[cell] = rbf_cull_read(rbf_cull_packed(c->cull, &c->set[s], cell));
		const int images = twins && are_images(mask, twins);
		if (twins)
			put(b, (uint32_t)images, 1);
		for (uint32_t g = 0; g < groups; g = images && g + 1 == twins ? 2 * twins : g + 1)
			put_group(b, mask, g);
	}
}

static void put_all(bits *b, const rbf_component *c, const rbf_moves *moves, rbf_packed_lobe *room)
{
	const uint32_t exponent = exponent_of(c);
	put(b, exponent, 9);
	put(b, c->cull != NULL, 1);
	for (int n = 0; n < rbf_pack_orders(c); n++)
		put(b, b->order[n], 4);
	put_cells_of_mesh(b, &c->mesh);
	put_dhr(b, c);
	put_lobes(b, c, exponent, room);
	if (c->residual)
		put_moves(b, c, moves);
	if (!b->cost)
		put_masks(b, c);
}

/* The orders that take least. */
static void find_orders(bits *b, const rbf_component *c, const rbf_moves *moves, rbf_packed_lobe *room)
{
	uint64_t cost[RBF_PACK_ORDERS][RBF_PACK_ORDER_MOST + 1] = {{0}};
	*b = (bits){.cost = cost};
	put_all(b, c, moves, room);
	*b = (bits){0};
	for (int n = 0; n < RBF_PACK_ORDERS; n++)
		for (uint32_t order = 1; order <= RBF_PACK_ORDER_MOST; order++)
			if (cost[n][order] < cost[n][b->order[n]])
				b->order[n] = order;
}

/* Whether the stream gives the component's arrays; -1: out of memory. */
static int comes_back(const rbf_component *c, const uint8_t *packed, uint32_t bytes)
{
	rbf_component back = *c;
	void *made = NULL;
	back.packed = bytes;
	back.pack = packed;
	const char *wrong = rbf_unpack(&back, 0, &made);
	int good = wrong == rbf_unpack_memory ? -1 : !wrong;
	for (int row = 0; row < RBF_ARRAY_ROWS && good > 0; row++) {
		const void *x = rbf_array_get(c, row), *y = rbf_array_get(&back, row);
		const size_t size = (size_t)(rbf_array_entries(&back, row) * rbf_array_row[row].entry);
		good = x == y || !size || (x && y && !memcmp(x, y, size));
	}
	free(made);
	return good;
}

/* The stream, or NULL: it is too long, or (*failed) memory is out. */
static uint8_t *make(const rbf_component *c, const rbf_moves *moves, uint32_t *bytes, int *failed)
{
	bits b;
	rbf_packed_lobe *room = malloc((rbf_pack_most_lanes(c) + 1) * sizeof *room);
	*failed = !room;
	if (!room)
		return NULL;
	find_orders(&b, c, moves, room);
	put_all(&b, c, moves, room);
	const uint64_t whole = (b.at + 7) / 8;
	b.to = whole <= UINT32_MAX ? calloc(whole, 1) : NULL;
	b.at = 0;
	if (b.to)
		put_all(&b, c, moves, room);
	*failed = !b.to && whole <= UINT32_MAX;
	*bytes = (uint32_t)whole;
	free(room);
	return b.to;
}

int rbf_pack(const rbf_component *c, uint8_t **packed, uint32_t *bytes)
{
	rbf_moves moves = {0};
	*packed = NULL;
	*bytes = 0;
	if (c->cull_wide)
		return 0;
	const char *wrong = c->residual ? rbf_moves_find(c, &moves) : NULL;
	int failed = wrong == rbf_unpack_memory;
	uint8_t *stream = wrong ? NULL : make(c, &moves, bytes, &failed);
	rbf_moves_release(&moves);
	const int good = stream ? comes_back(c, stream, *bytes) : 0;
	if (good > 0)
		*packed = stream;
	else
		free(stream);
	return failed || good < 0 ? -1 : 0;
}
