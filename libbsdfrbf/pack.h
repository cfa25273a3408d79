/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The larger arrays of a component in a fifth to a third of their bytes, for records that are read as a whole when they are opened anyway.
 * What is packed is unpacked then, so that nothing that evaluates or samples knows of it; tables of draws are made anew.
 *
 * A stream of bits, the lowest of each byte first:
 *   cells    of the mesh's locator, one after the other: a count of entries; for each of them, 1 bit: whether it is a border, and its
 *            index, in as many bits as the number of elements or borders has
 *   dhr      nodes of elements, 20 bits each: those of a float without its sign and the last 11. Lines of borders: 1 bit, whether it is the
 *            line before once more, else its nodes. Likewise numbers of the trend, if there is one (1 bit), of 32 bits
 *   header   9 bits: smallest exponent of amplitudes; 1 bit: whether there are masks; 1 bit: whether a centre is beyond 1 along an axis
 *   lobes    lane by lane, block by block. 15 bits: kappa in [2^-6, 2^26), 10 bits of its fraction; 0: an unused lane, that ends
 *            here.
 *            Centre over the equal-area disc of the sphere (x, y) = d (1 + z)^(-1/2), two numbers, in steps of at most 1/1024 of the
 *            lobe's spread (but not below 2^-22), with a sign. 16 bits for each channel: amplitude, 10 bits of its fraction; 0: none.
 *   masks    set by set, for each group of blocks its cells (RBF_CULL_GRID rows; those that reach into the disc), exclusive or with
 *            the row above: counts of those that are 0 before the next 1, and in the end before the last cell is past
 * Counts are Exp-Golomb codes of order 1.
 *
 * Lobes are rounded to that when a model is made (rbf_pack_round()), by half a thousandth of their amplitude and a thousandth of their
 * spread at most, and DHR by an eighth of a thousandth; what would not come back bit by bit is not packed.
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

/* Codes of one lobe. */
typedef struct rbf_packed_lobe {
	uint32_t kappa, amplitude[3];
	int32_t at[2];
} rbf_packed_lobe;

/* Numbers of a centre count in 2 to the minus this, of a lobe with some kappa; a sign comes before them, and another bit where some are
 * beyond 1. */
static inline uint32_t rbf_pack_steps(uint32_t kappa)
{
	const uint32_t octave = kappa >> RBF_PACK_FRACTION; /* spread above 2^-((octave - 5) / 2) */
	const uint32_t steps = octave > 5 ? RBF_PACK_STEPS + (octave - 4) / 2 : RBF_PACK_STEPS;
	return steps < 22 ? steps : 22;
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

/* Floats of all elements, and of each line of each border. */
static inline size_t rbf_pack_inside(const rbf_component *c)
{
	return (size_t)c->channels * c->mesh.elements * rbf_dhr_element_nodes(c);
}

static inline size_t rbf_pack_line(const rbf_component *c)
{
	return (size_t)c->channels * (c->dhr_steps + 1);
}

/* Rounds the lobes of a component to what can be packed, and its table of DHR. */
void rbf_pack_round(rbf_component *component);
void rbf_pack_round_dhr(rbf_component *component);

/* The stream of a component whose arrays are there, to be freed: *packed, or NULL where something would not come back as it is. Returns
 * 0, or -1 when out of memory. */
int rbf_pack(const rbf_component *component, uint8_t **packed, uint32_t *bytes);

/* A component as it was recorded, with its stream, made into one with all arrays: *made takes them, to be freed. Returns NULL, or what is
 * wrong; rbf_unpack_memory: there is none. */
extern const char *const rbf_unpack_memory;
const char *rbf_unpack(rbf_component *component, void **made);
#endif
