/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * What rbf_component_dhr() answers at most directions, once more, for who asks at many: nodes over the equal-area disc
 * (rbf_disc_from_direction()), which need neither the mesh nor an angle. A cell whose corners do not tell what is inside of it well
 * enough (DHR has kinks along the mesh's edges) is marked at its first node: there, the mesh's own table answers.
 *
 * `dhr_cells` cells run from the centre to the horizon. An axis across which the symmetry mirrors has that many, another one twice as many
 * (half a turn folds y). An isotropic component has one row, over the disc's radius.
 * Values: [row][column][channel], in units of dhr_unit; RBF_DHR_MARK is no part of them. Beyond the horizon they are as on it.
 */
#ifndef RBF_DHR_GRID_H
#define RBF_DHR_GRID_H
#include "model.h"

#define RBF_DHR_CELLS_MAX 1024
#define RBF_DHR_MARK 0x8000u

/* Cells before the centre, which are as many again if the axis is not folded. */
static inline uint32_t rbf_dhr_before_x(const rbf_component *c)
{
	const rbf_symmetry s = c->mesh.symmetry;
	return (s == RBF_ISOTROPIC) | (s == RBF_BILATERAL_X) | (s == RBF_QUADRILATERAL) ? 0 : c->dhr_cells;
}

static inline uint32_t rbf_dhr_before_y(const rbf_component *c)
{
	const rbf_symmetry s = c->mesh.symmetry;
	return (s == RBF_ANISOTROPIC) | (s == RBF_BILATERAL_X) ? c->dhr_cells : 0;
}

static inline uint32_t rbf_dhr_columns(const rbf_component *c)
{
	return rbf_dhr_before_x(c) + c->dhr_cells;
}

static inline uint32_t rbf_dhr_rows(const rbf_component *c)
{
	return c->mesh.symmetry == RBF_ISOTROPIC ? 0 : rbf_dhr_before_y(c) + c->dhr_cells;
}

/* 0 without cells. */
static inline uint64_t rbf_dhr_nodes(const rbf_component *c)
{
	return c->dhr_cells ? (rbf_dhr_columns(c) + 1ull) * (rbf_dhr_rows(c) + 1ull) : 0;
}

/* DHR of the scattered part at an incident direction (unit, z > 0, not folded), of a component with a grid; 0: its cell is marked. */
int rbf_dhr_from_grid(const rbf_component *component, const float incident[3], float value[3]);
#endif
