/* SPDX-License-Identifier: BSD-3-Clause */
/* Non-negative least squares from normal equations. */
#ifndef RBF_NONNEGATIVE_H
#define RBF_NONNEGATIVE_H
#include <stddef.h>

/* Minimises x'Gx/2 - b'x over x >= 0. gram: m x m, symmetric, positive definite, row by row. Exact up to rounding.
 * Returns 0, or -1 when out of memory. */
int rbf_nonnegative_solve(size_t m, const double *gram, const double *right, double *x);
#endif
