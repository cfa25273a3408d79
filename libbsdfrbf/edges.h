/* SPDX-License-Identifier: BSD-3-Clause */
/* Residual motion along every edge that an element of the mesh uses. */
#ifndef RBF_EDGES_H
#define RBF_EDGES_H
#include "choose.h"
#include "model.h"

/* Fills edges, shifts, shift and shift_of of an assembled component, and the fact residual_deg. Opens OpenMP regions. Errors: MEMORY,
 * UNSUPPORTED (too many entries). */
bsdfrbf_status rbf_edges_move(bsdfrbf_context *context, const rbf_fitted *fitted, const rbf_choice *choice, rbf_component *component);
#endif
