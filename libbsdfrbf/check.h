/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Checks of a component against itself, so that neither a damaged file nor a defect of the builder leads the evaluator
 * out of an array. Answers are NULL if all is well, else a short text that says what is not.
 */
#ifndef RBF_CHECK_H
#define RBF_CHECK_H
#include "model.h"

/* The numbers alone; cheap. Must come before rbf_array_entries() is relied on: it bounds the products. */
const char *rbf_check_numbers(const rbf_component *component);

/* All arrays, entry by entry: every index within its array, every float finite. The arrays must be as long as the
 * numbers say. */
const char *rbf_check_arrays(const rbf_component *component);
#endif
