/* SPDX-License-Identifier: BSD-3-Clause */
/* A division of the exitant hemisphere into parts, kept as a table over fine cells of the square (shirley_chiu.h), and the integrals
 * of f over the parts. Where a cell lies in several parts, its values are interpolated: f need not be evaluated any finer. */
#ifndef RBF_DIVISION_H
#define RBF_DIVISION_H
#include "exitant.h"

enum { RBF_DIVISION_LEVEL = 9 };

typedef struct rbf_division {
	int parts;
	double *area;    /* projected solid angle of each part, sr */
	uint16_t *part[RBF_DIVISION_LEVEL + 1]; /* per level and cell: its part, or RBF_DIVISION_MIXED */
} rbf_division;

#define RBF_DIVISION_MIXED 0xffffu

/* find(): part of a direction with z > 0. 0: out of memory. */
int rbf_division_make(rbf_division *division, int parts, int (*find)(const void *user, const float d[3]), const void *user);
void rbf_division_free(rbf_division *division);

/* Adds share times the integrals of f over a leaf to sum[channel * parts + part]. */
void rbf_division_add(const rbf_division *division, const rbf_exitant_leaf *leaf, uint32_t channels, double share, double *sum);
#endif
