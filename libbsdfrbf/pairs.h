/* SPDX-License-Identifier: BSD-3-Clause */
/* Pairs of directions, each at another incidence, several at a time: what is done for one in four lanes (evaluate.h) is done for four in
 * sixteen, and nothing is waited for before it is asked for for all. Where rbf_kernel_has_avx512(). */
#ifndef RBF_PAIRS_H
#define RBF_PAIRS_H
#include "kernel.h"

#define RBF_PAIRS_MOST 16   /* in one go */
#define RBF_PAIRS_ABREAST 4

/* As bsdfrbf_eval() of each, but for rounding; at most RBF_PAIRS_MOST pairs. */
void rbf_pairs_eval(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *values);

/* One of them. Four numbers of each vector, so that they are read at once. */
typedef struct rbf_pair {
	float incident[4], exitant[4];  /* the component's half space; folded, once it is located */
	float weight[4];                /* of the corners */
	uint32_t item;                  /* of the mesh, as by rbf_mesh_locate() */
	float tune, scale;              /* as in rbf_site, the scale of f over DSF */
	uint32_t index;                 /* in the list */
} rbf_pair;

/* Folds pairs, and finds those that are in one of the first two elements of their cell (mesh_inside.h); item of the others:
 * RBF_MESH_NO_ELEMENT. */
void rbf_pairs_find_avx512(const rbf_component *component, rbf_pair pair[RBF_PAIRS_MOST]);

/* What is to be summed for pairs that are located, of a component without residual motion whose masks are packed. Returns the blocks of the
 * largest set: more than RBF_CULL_BITS cannot be summed that way. */
uint32_t rbf_pairs_jobs_avx512(const rbf_component *component, const rbf_pair pair[RBF_PAIRS_ABREAST],
	rbf_kernel_frame frame[RBF_MAX_FRAMES]);
#endif
