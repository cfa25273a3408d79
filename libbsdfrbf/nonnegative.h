/* SPDX-License-Identifier: BSD-3-Clause */
/* Non-negative least squares from normal equations. */
#ifndef RBF_NONNEGATIVE_H
#define RBF_NONNEGATIVE_H
#include <stddef.h>

/* Minimises x'Gx/2 - b'x over x >= 0. gram: m x m, symmetric, positive definite, row by row. squares: sum of the squares of the
 * `count` values that Gx = b is the least-squares problem of; variables that lower what is left of it by less than a fraction of
 * its mean stay 0. With squares 0 it is exact up to rounding. x: zeros, or the solution of a problem much like this one.
 * Returns 0, or -1 when out of memory. */
int rbf_nonnegative_solve(size_t m, const double *gram, const double *right, double squares, double count, double *x);
#endif
