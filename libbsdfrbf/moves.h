/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Residual shifts as pack.h records them: each as two whole numbers along rbf_basis() of the lobe's centre, in steps of at most 1/32 of its
 * spread. What a shift has along the centre is left out, and the rest made longer, so that it leads to the same direction.
 */
#ifndef RBF_MOVES_H
#define RBF_MOVES_H
#include "unpack.h"

#define RBF_MOVES_COARSER 5 /* steps than those of a centre, log2 */
#define RBF_MOVES_NONE 0xffffffffu

/* What is known of shifts by the lobes they move. */
typedef struct rbf_moves {
	uint32_t *block;   /* [shifts]: which each of them moves; RBF_MOVES_NONE: none */
	uint32_t *image;   /* [blocks]: the one whose image it is, or itself */
	uint32_t *before;  /* [lanes]: a lane of the same set, told earlier, whose lobe is near; itself: there is none */
	uint8_t *steps;    /* [lanes]: log2 of steps a radian; 0: no lobe */
} rbf_moves;

/* Returns NULL, or what is wrong with the component's arrays; rbf_unpack_memory: there is none. To be released in any case. */
const char *rbf_moves_find(const rbf_component *component, rbf_moves *moves);
void rbf_moves_release(rbf_moves *moves);

/* Numbers of the shift of a lane, and back. */
void rbf_moves_encode(const rbf_component *component, const rbf_moves *moves, const rbf_shift *shift, uint32_t block, uint32_t lane,
	int32_t at[2]);
void rbf_moves_decode(const rbf_component *component, const rbf_moves *moves, const int32_t at[2], uint32_t block, uint32_t lane,
	rbf_shift *shift);

/* The shift of an image of a block. */
void rbf_moves_reflect(const rbf_shift *from, rbf_shift *to);

/* Where the shift is of which this one, shift `i` of the component, is the image by its place. */
static inline uint32_t rbf_moves_source(const rbf_moves *m, uint32_t i)
{
	return i - (m->block[i] - m->image[m->block[i]]);
}

/* Rounds a component's lobes, puts them into blocks, and their shifts with them, and rounds these; images get images. Opens OpenMP regions.
 * Returns 0, or -1 when out of memory. */
int rbf_moves_round(rbf_component *component);

/* The part of a stream; NULL, or what is wrong. `to`: the component's. */
const char *rbf_moves_unpack(rbf_bits *bits, const rbf_component *component, uint32_t order, rbf_shift *to);
#endif
