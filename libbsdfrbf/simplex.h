/* SPDX-License-Identifier: BSD-3-Clause */
/* Search for the least value of a function of a few variables that has no derivative (Nelder and Mead, Computer Journal 7, 1965). */
#ifndef RBF_SIMPLEX_H
#define RBF_SIMPLEX_H
#include <stdint.h>

enum { RBF_SIMPLEX_MAX = 8 }; /* variables */

typedef double rbf_simplex_function(void *data, const double x[]); /* may be INFINITY */

/* x[variables]: start, then the best place found; its value is returned. step: along each axis, at the start. Ends after `rounds`, or
 * when the values at the corners differ by less than tolerance times the least. The function is called twice a round at most, but
 * for a round that shrinks the simplex, and never after the search has ended. */
double rbf_simplex(rbf_simplex_function *function, void *data, uint32_t variables, double x[], double step, uint32_t rounds, double tolerance);
#endif
