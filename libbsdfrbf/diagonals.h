/* SPDX-License-Identifier: BSD-3-Clause */
/* The mesh once frames are chosen: the data decide what the directions leave open. */
#ifndef RBF_DIAGONALS_H
#define RBF_DIAGONALS_H
#include "left_out.h"
#include "model.h"

/* Takes for the component's mesh, which fitted->mesh is as well, another with open diagonals by how well the frames, without residual motion, tell
 * incidences along them (mesh_diagonals.c). fitted->neighbour is as of the former mesh. Isotropic: nothing. Opens an OpenMP region. Errors: as
 * rbf_mesh_build(). */
bsdfrbf_status rbf_diagonals_choose(bsdfrbf_context *context, const rbf_choice *choice, rbf_fitted *fitted, rbf_component *component);
#endif
