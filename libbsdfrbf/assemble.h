/* SPDX-License-Identifier: BSD-3-Clause */
/* Puts fits, labels and residual motion together into the arrays of a component. */
#ifndef RBF_ASSEMBLE_H
#define RBF_ASSEMBLE_H
#include "label.h"

/* Lobe sets, with their sampling tables, for `frames` frames (indices of candidates), the labels of rbf_label(), and
 * the limits of the frames' shares (model.h; NULL or 0: those of the maps). Arrays of a former assembly in
 * `component` are not freed. The mesh is borrowed from fitted->mesh. Returns 0, or -1 when out of memory. */
int rbf_assemble_sets(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], const float *label, const float limit[],
	rbf_component *component);

/* Frees what rbf_assemble_sets() allocated. */
void rbf_assemble_release(rbf_component *component);

/* Packs the motion of a base's lobes (count x 3, order of the fit) into the order of its sets' blocks. */
void rbf_assemble_shift(const rbf_fitted *fitted, const rbf_component *component, const float *label, uint32_t base,
	const float (*motion)[3], rbf_shift *shift);

/* Blocks of all sets of a base: the length of such an array. */
uint32_t rbf_assemble_blocks(const rbf_component *component, uint32_t base);

/* Lobes rounded to what can be packed (pack.h), culling masks of every set, and tables for sampling that allow for residual motion. reach: how far it can carry a lobe (0: none).
 * Opens OpenMP regions. Returns 0, or -1 when out of memory or a process gave up; so does the next. */
int rbf_assemble_cull(const rbf_team *team, rbf_component *component, float reach);

/* Table of DHR (dhr.h). Opens OpenMP regions. */
int rbf_assemble_dhr(const rbf_team *team, rbf_component *component);

/* The grid over it (dhr_grid.h), when everything else is there; none where it would be of no use. Opens OpenMP regions. */
int rbf_assemble_dhr_grid(rbf_component *component);
#endif
