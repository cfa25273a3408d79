/* SPDX-License-Identifier: BSD-3-Clause */
/* An incidence that several files measure. */
#ifndef RBF_OVERLAP_H
#define RBF_OVERLAP_H
#include "gather.h"

/* Warns if samples that are to join an incidence of `data` differ from what it has there by some factor. path: file that they are from, or NULL. */
void rbf_overlap_warn(bsdfrbf_context *context, const bsdfrbf_data *data, int component, size_t incidence, const rbf_batch *more, const char *path);
#endif
