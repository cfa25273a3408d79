/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Reading the indices of a component that may come from a file too large to be checked when it is opened (record.h).
 * Each costs a compare or two, and the answer is always within its array: damage gives wrong values, never a crash.
 * The numbers themselves (bases, vertices, frames, ...) were checked on opening.
 */
#ifndef RBF_BOUNDS_H
#define RBF_BOUNDS_H
#include "model.h"

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

/* A cell entry: an element or RBF_MESH_BORDER | border that exists; 0 if it does not. */
static inline uint32_t rbf_bound_entry(const rbf_mesh *mesh, uint32_t entry)
{
	if (entry & RBF_MESH_BORDER)
		return (entry & ~RBF_MESH_BORDER) < mesh->borders ? entry : mesh->elements ? 0 : RBF_MESH_BORDER;
	return entry < mesh->elements ? entry : mesh->elements ? 0 : RBF_MESH_BORDER;
}

/* Vertex, and measured incidence of a vertex. */
static inline uint32_t rbf_bound_vertex(const rbf_mesh *mesh, uint32_t vertex)
{
	return rbf_bound(vertex, mesh->vertices);
}

static inline uint32_t rbf_bound_base(const rbf_mesh *mesh, uint32_t vertex)
{
	return rbf_bound(mesh->vertex[vertex].base, mesh->bases);
}

/* Blocks of set `s` (s < sets): returns how many, 0 if the set does not lie within the blocks. */
static inline uint32_t rbf_bound_set(const rbf_component *c, size_t s, uint32_t *first)
{
	const rbf_set *set = c->set + s;
	*first = set->first;
	return set->first <= c->blocks && set->blocks <= c->blocks - set->first ? set->blocks : 0;
}

/* Shifts of a base, given the entry of shift_of. NULL: no motion. */
static inline const rbf_shift *rbf_bound_shift(const rbf_component *c, uint32_t entry)
{
	return entry < c->shifts ? c->shift + entry : NULL; /* RBF_NO_SHIFT is the largest number */
}

/* Of those, the shifts of set `s` of `base`. NULL: no motion, or not within the array. */
static inline const rbf_shift *rbf_bound_set_shift(const rbf_component *c, const rbf_shift *of_base, size_t base, size_t s)
{
	if (!of_base)
		return NULL;
	const uint32_t start = c->set[s].first - c->set[base * c->frames].first;
	const uint64_t at = (uint64_t)(of_base - c->shift) + start;
	return at + c->set[s].blocks <= c->shifts ? c->shift + at : NULL;
}
#endif
