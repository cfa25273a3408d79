/* SPDX-License-Identifier: BSD-3-Clause */
/* The mesh's part of bounds.h. */
#ifndef RBF_MESH_BOUNDS_H
#define RBF_MESH_BOUNDS_H
#include "mesh.h"

#include <stddef.h>

static inline uint32_t rbf_bound(uint32_t index, uint32_t count)
{
	return index < count ? index : 0;
}

/* Entries of locator cell `cell`: [*first, *last), within cell_entries. */
static inline void rbf_bound_cell(const rbf_mesh *mesh, uint32_t cell, uint32_t *first, uint32_t *last)
{
	const uint32_t a = mesh->cell_first[cell], b = mesh->cell_first[cell + 1];
	*last = b < mesh->cell_entries ? b : mesh->cell_entries;
	*first = a < *last ? a : *last;
}

/* A cell entry: an element or RBF_MESH_BORDER | border that exists; border 0, which every mesh has, if it does not. */
static inline uint32_t rbf_bound_entry(const rbf_mesh *mesh, uint32_t entry)
{
	if (entry & RBF_MESH_BORDER)
		return RBF_MESH_BORDER | rbf_bound(entry & ~RBF_MESH_BORDER, mesh->borders);
	return entry < mesh->elements ? entry : RBF_MESH_BORDER;
}

static inline uint32_t rbf_bound_vertex(const rbf_mesh *mesh, uint32_t vertex)
{
	return rbf_bound(vertex, mesh->vertices);
}

/* Corners of an element, or of a border with RBF_MESH_BORDER: its second end twice. */
static inline void rbf_bound_corners(const rbf_mesh *mesh, uint32_t item, uint32_t corner[3])
{
	const uint32_t *border = item & RBF_MESH_BORDER ? mesh->border[item & ~RBF_MESH_BORDER] : NULL;
	for (int k = 0; k < 3; k++)
		corner[k] = rbf_bound_vertex(mesh, border ? border[k ? 1 : 0] : mesh->element[item].v[k]);
}
#endif
