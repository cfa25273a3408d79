/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The larger arrays of a component in a sixth to a quarter of their bytes, for records that are read as a whole when they are opened anyway.
 * What is packed is unpacked then, so that nothing that evaluates or samples knows of it.
 *
 * A stream of bits, the lowest of each byte first:
 *   header   9 bits: smallest exponent of amplitudes; 1 bit: whether there are masks; 4 bits each: orders of the counts of RBF_PACK_ORDERS,
 *            the last one only with residual transport
 *   cells    of the mesh's locator, one after the other: a count of entries; for each of them, 1 bit: whether it is a border, and its
 *            index, in as many bits as the number of elements or borders has
 *   dhr      nodes of elements, as numbers of 20 bits: those of a float without its sign and the last 11; of each, the difference from the
 *            one before of the same channel. Lines of borders: 1 bit, whether it is the line before once more, else its nodes. Likewise the
 *            trend, if there is one (1 bit), as it is, 32 bits a number
 *   lobes    set by set; of an isotropic component first a count of twins, T: T blocks, whose images about y = 0 are the next T, last one
 *            first, and not recorded. Block by block: 1 bit, whether all lanes are used, else 8, which are. Lane by lane, if other frames
 *            of the incidence had lobes before, 1 bit: whether one of these has the same kappa and centre. Then which: the difference of its
 *            place among those told by themselves from the one after the last so meant, at first the first. Else, as differences from the
 *            lobe before: kappa in [2^-6, 2^26), 10 bits of its fraction; centre over the equal-area disc of the sphere
 *            (x, y) = d (1 + z)^(-1/2), two numbers, in steps of at most 1/1024 of the lobe's spread (but not below 2^-22). Amplitude, in any
 *            case so: 10 bits of its fraction, 0: none; of other channels the difference from the channel before.
 *   moves    of a component with residual transport: 1 bit, whether shifts of images are images, and not recorded. Of each shift, and each
 *            lane in use: two numbers along the basis of its centre, in steps 32 times as long as the centre's; of each the difference from that
 *            of a lobe nearby, towards the same vertex, that was told before (moves.h)
 *   masks    set by set; of one with twins, and a group for each block, 1 bit: whether masks of images are images, and not recorded. Of
 *            each group: 1 bit, whether the cells of all its rows are intervals; 5 bits: the first row that has cells; 5 bits: how many rows
 *            there are from it to the last. Row by row: if not all are, 1 bit, whether it is an interval; of an interval the differences of
 *            its first and last cell from those of the row before (at first RBF_CULL_GRID / 2), moved into the row's span; of another each
 *            cell of the span, 1 bit.
 * Counts are Exp-Golomb codes, of order 1 where nothing else is said, for differences 0, -1, 1, -2 ... (of ends of intervals of order 0).
 * unpack_former.c tells the streams of version 1.2.
 *
 * Lobes are rounded to that when a model is made (rbf_pack_round()), by half a thousandth of their amplitude and a thousandth of their
 * spread at most, DHR by an eighth of a thousandth, and shifts by 1/64 of the lobe's spread along each of two axes
 * (rbf_moves_round()); what would not come back bit by bit is not packed.
 */
#ifndef RBF_PACK_H
#define RBF_PACK_H
#include "cull.h"
#include "dhr.h"

#define RBF_PACK_MOST (16u << 20) /* bytes of arrays that may come out of a stream */
#define RBF_PACK_DHR_DROPPED 11
#define RBF_PACK_DHR_BITS 20
#define RBF_PACK_FRACTION 10 /* bits of kappas and amplitudes */
#define RBF_PACK_STEPS 10
#define RBF_PACK_DROPPED (23 - RBF_PACK_FRACTION)
#define RBF_PACK_KAPPA (121u << RBF_PACK_FRACTION) /* what is subtracted from a float's upper bits */
#define RBF_PACK_KAPPA_BITS (5 + RBF_PACK_FRACTION)
#define RBF_PACK_AMPLITUDE_BITS (6 + RBF_PACK_FRACTION)
#define RBF_PACK_EXPONENTS (255 - (1 << (RBF_PACK_AMPLITUDE_BITS - RBF_PACK_FRACTION))) /* the header's is at most this: all are finite */

#define RBF_PACK_COUNT_MOST 20 /* zeros before a count: with what follows it is in 57 bits */
#define RBF_PACK_ORDER_MOST 15

/* Orders of counts: what is coded with each. */
enum {
	RBF_PACK_ORDER_DHR, RBF_PACK_ORDER_KAPPA, RBF_PACK_ORDER_CENTRE, RBF_PACK_ORDER_AMPLITUDE, RBF_PACK_ORDER_CHANNEL, RBF_PACK_ORDER_PLACE,
	RBF_PACK_ORDER_MOVE, RBF_PACK_ORDERS
};

/* Codes of one lobe. */
typedef struct rbf_packed_lobe {
	uint32_t kappa, amplitude[3];
	int32_t at[2];
} rbf_packed_lobe;

/* Numbers of a centre count in 2 to the minus this, of a lobe with some kappa. */
static inline uint32_t rbf_pack_steps(uint32_t kappa)
{
	const uint32_t octave = kappa >> RBF_PACK_FRACTION; /* spread above 2^-((octave - 5) / 2) */
	const uint32_t steps = octave > 5 ? RBF_PACK_STEPS + (octave - 4) / 2 : RBF_PACK_STEPS;
	return steps < 22 ? steps : 22;
}

/* A number of a centre, had with so many steps, with others. */
static inline int64_t rbf_pack_scaled(int32_t at, uint32_t had, uint32_t steps)
{
	return steps >= had ? (int64_t)at * ((int64_t)1 << (steps - had)) : at >> (had - steps);
}

static inline int64_t rbf_pack_within(int64_t value, int64_t least, int64_t most)
{
	return value < least ? least : value > most ? most : value;
}

static inline float rbf_pack_float(uint32_t upper)
{
	const uint32_t bits = upper << RBF_PACK_DROPPED;
	float f;
	memcpy(&f, &bits, sizeof f);
	return f;
}

/* A lobe from its codes; exponent: the header's. */
static inline void rbf_pack_decode(const rbf_packed_lobe *from, uint32_t exponent, uint32_t channels, float centre[3], float *kappa,
	float amplitude[3])
{
	const double step = 1. / (double)(1u << rbf_pack_steps(from->kappa)), u = from->at[0] * step, v = from->at[1] * step;
	const double r2 = u*u + v*v, along = sqrt(r2 < 2 ? 2 - r2 : 0);
	centre[0] = (float)(u * along);
	centre[1] = (float)(v * along);
	centre[2] = (float)(r2 < 2 ? 1 - r2 : -1);
	*kappa = rbf_pack_float(from->kappa + RBF_PACK_KAPPA);
	for (uint32_t n = 0; n < channels; n++)
		amplitude[n] = from->amplitude[n] ? rbf_pack_float(from->amplitude[n] + (exponent << RBF_PACK_FRACTION)) : 0;
}

/* Cells of a row that reach into the disc: from *first up to before *end. Those beside them have the masks of the nearest one. */
static inline void rbf_cull_span(uint32_t row, uint32_t *first, uint32_t *end)
{
	const int half = RBF_CULL_GRID / 2, low = (int)row < half ? half - (int)row - 1 : (int)row - half; /* from the middle to the nearer side */
	int reach = 1;
	while (reach < half && reach*reach + low*low < half*half)
		reach++;
	*first = (uint32_t)(half - reach);
	*end = (uint32_t)(half + reach);
}

/* The row's cells as bits, with those beside the span like the nearest one in it. */
static inline uint32_t rbf_cull_beside(uint32_t bits, uint32_t first, uint32_t end)
{
	const uint32_t low = (1u << first) - 1, high = ~((1u << end) - 1) & ((1u << RBF_CULL_GRID) - 1);
	bits &= ~(low | high);
	return bits | (bits >> first & 1 ? low : 0) | (bits >> (end - 1) & 1 ? high : 0);
}

_Static_assert(RBF_CULL_GRID < 32 && RBF_CULL_GRID % 2 == 0, "a row of cells is a word");

/* Bits of an index below `count`. */
static inline uint32_t rbf_pack_index_bits(uint32_t count)
{
	return count > 1 ? 32 - (uint32_t)__builtin_clz(count - 1) : 0;
}

/* Orders that the header of a component's stream has. */
static inline int rbf_pack_orders(const rbf_component *c)
{
	return c->residual ? RBF_PACK_ORDERS : RBF_PACK_ORDER_MOVE;
}

/* Floats of all elements, and of each line of each border. */
static inline size_t rbf_pack_inside(const rbf_component *c)
{
	return (size_t)c->channels * c->mesh.elements * rbf_dhr_element_nodes(c);
}

static inline size_t rbf_pack_line(const rbf_component *c)
{
	return (size_t)c->channels * (c->dhr_steps + 1);
}

/* T of a set: its first T blocks have their images about y = 0 in the next T, last one first, all lanes in use and none with y = 0. 0 but for
 * isotropic components. */
static inline uint32_t rbf_pack_twins(const rbf_component *c, const rbf_set *set)
{
	uint32_t twins = c->mesh.symmetry == RBF_ISOTROPIC ? set->blocks / 2 : 0;
	for (uint32_t n = 0; n < twins;) {
		const size_t one = set->first + (size_t)n, other = set->first + (size_t)(2 * twins - 1 - n);
		const rbf_block *a = &c->block[one], *b = &c->block[other];
		int are = 1;
		for (int lane = 0; lane < RBF_LANES; lane++)
			are &= a->k[lane] > 0 && a->y[lane] > 0 && a->x[lane] == b->x[lane] && a->y[lane] == -b->y[lane] && a->z[lane] == b->z[lane]
				&& a->k[lane] == b->k[lane];
		for (size_t channel = 0; channel < c->channels; channel++)
			are &= !memcmp(&c->amplitude[channel * c->blocks + one], &c->amplitude[channel * c->blocks + other], sizeof(rbf_amplitude));
		if (are)
			n++;
		else {
			twins--;
			n = 0;
		}
	}
	return twins;
}

/* Lanes of the incidence that has most. */
static inline size_t rbf_pack_most_lanes(const rbf_component *c)
{
	size_t most = 0;
	for (uint32_t s = 0; s < c->sets; s += c->frames) {
		size_t blocks = 0;
		for (uint32_t f = 0; f < c->frames; f++)
			blocks += c->set[s + f].blocks;
		most = blocks > most ? blocks : most;
	}
	return most * RBF_LANES;
}

/* The code of a lobe's kappa; 0: no lobe. */
uint32_t rbf_pack_kappa(float kappa);

/* Rounds the lobes of a component to what can be packed, and its table of DHR. */
void rbf_pack_round(rbf_component *component);
void rbf_pack_round_dhr(rbf_component *component);

/* The stream of a component whose arrays are there, to be freed: *packed, or NULL where something would not come back as it is. Returns
 * 0, or -1 when out of memory. */
int rbf_pack(const rbf_component *component, uint8_t **packed, uint32_t *bytes);

/* A component as it was recorded, with its stream (former: of version 1.2), made into one with all arrays: *made takes them, to be freed.
 * Returns NULL, or what is wrong; rbf_unpack_memory: there is none. */
extern const char *const rbf_unpack_memory;
const char *rbf_unpack(rbf_component *component, int former, void **made);
#endif
