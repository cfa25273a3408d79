/* SPDX-License-Identifier: BSD-3-Clause */
/* Measurements of a symmetric material that are one incidence, or images of each other. */
#ifndef RBF_FOLDED_H
#define RBF_FOLDED_H
#include "measure.h"
#include "mesh.h"

/* What an incidence became part of. */
typedef struct rbf_fold {
	uint32_t place;  /* of the incidence that has its samples now */
	uint32_t op;     /* operation that took them there */
} rbf_fold;

/* Joins the samples of incidences, mirrored, that the symmetry maps onto each other; direction: count x 3, follows; fold: of each that there was. What was
 * joined has its own samples, in `own`, to be freed by rbf_folded_free(). Returns 0, or -1 when out of memory; rbf_folded_free() in either case. */
int rbf_folded_join(rbf_symmetry symmetry, int channels, rbf_measured *measured, double *direction, rbf_fold *fold, rbf_measured *own);
void rbf_folded_free(rbf_measured *own);

/* Takes over what is more. Returns 0, or -1 when out of memory. */
int rbf_folded_merge(rbf_measured *own, rbf_measured *more);
#endif
