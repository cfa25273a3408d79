/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Reading the indices of a component that may come from a file too large to be checked when it is opened (record.h).
 * Each costs a compare or two, and the answer is always within its array: damage gives wrong values, never a crash.
 * The numbers themselves (bases, vertices, frames, ...) were checked on opening.
 */
#ifndef RBF_BOUNDS_H
#define RBF_BOUNDS_H
#include "mesh_bounds.h"
#include "model.h"

/* Measured incidence of a vertex. */
static inline uint32_t rbf_bound_base(const rbf_component *c, const rbf_vertex *vertex)
{
	return rbf_bound(vertex->base, c->mesh.bases);
}

/* One of the component's sets; an empty one if it does not lie within the blocks. */
static inline const rbf_set *rbf_bound_to(const rbf_component *c, const rbf_set *set)
{
	static const rbf_set empty;
	return (uint64_t)set->first + set->blocks <= c->blocks ? set : &empty;
}

/* Set `s`, s < c->sets. */
static inline const rbf_set *rbf_bound_set(const rbf_component *c, size_t s)
{
	return rbf_bound_to(c, c->set + s);
}

/* Shifts of all sets of `base`, given the entry of shift_of. NULL: no motion, or not within the array. */
static inline const rbf_shift *rbf_bound_shift(const rbf_component *c, uint32_t entry, size_t base)
{
	const rbf_set *set = c->set + base * c->frames;
	if (entry >= c->shifts) /* as RBF_NO_SHIFT is */
		return NULL;
	for (uint32_t f = 0; f < c->frames; f++)
		if (set[f].first < set[0].first
			|| (uint64_t)entry + (set[f].first - set[0].first) + set[f].blocks > c->shifts)
			return NULL;
	return c->shift + entry;
}
#endif
