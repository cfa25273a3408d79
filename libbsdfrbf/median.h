/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef RBF_MEDIAN_H
#define RBF_MEDIAN_H
#include <stddef.h>

/* Sorts the list. 0 if it is empty. */
double rbf_median(double *list, size_t count);
#endif
