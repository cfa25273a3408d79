/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The list of a component's numbers and arrays, for all code that treats them alike: recording, reading, checking,
 * freeing and listing. A new number or array of struct rbf_component is one line here. Kind numbers are pinned: they
 * are what a recorded file says. Take the next free one, and never reuse one.
 */
#ifndef RBF_ARRAYS_H
#define RBF_ARRAYS_H
#include "model.h"

#include <stddef.h>
#include <string.h>

/* Numbers, in the order of the recorded component header; new ones join at the end (at most RBF_NUMBERS_MAX). */
#define RBF_NUMBERS(X) \
	X(channels) X(mesh.symmetry) X(mesh.bases) X(mesh.vertices) X(mesh.elements) X(mesh.borders) X(mesh.cell_entries) \
	X(frames) X(frame[0]) X(frame[1]) X(frame[2]) X(frame[3]) X(residual) X(sets) X(blocks) X(shifts) X(edges) \
	X(dhr_steps) X(learned) X(even) X(tuned) X(filled) X(limited) X(dhr_cells) \
	X(dhr_unit[0]) X(dhr_unit[1]) X(dhr_unit[2]) X(mirrored) X(packed)
#define RBF_NUMBERS_MAX 48

/* Arrays: kind, name, member, entries, what they hold (enum rbf_array_holds). `c` is the component. With
 * RBF_ARRAY_OPTIONAL the array may be absent, and its pointer is then NULL. Arrays with 0 entries are not recorded.
 * The order is that of the file: what every query needs comes first, and close together. */
#define RBF_ARRAYS(X) \
	X(37, "limits",         limit,             c->limited * 1ull * c->frames,    RBF_ARRAY_FLOAT) \
	X(16, "cell first",     mesh.cell_first,   !c->packed * (rbf_mesh_cells(&c->mesh) + 1ull), RBF_ARRAY_INDEX) \
	X(17, "cell elements",  mesh.cell_element, !c->packed * 1ull * c->mesh.cell_entries, RBF_ARRAY_INDEX) \
	X(18, "elements",       mesh.element,      c->mesh.elements,                 RBF_ARRAY_INDEX) \
	X(19, "borders",        mesh.border,       c->mesh.borders,                  RBF_ARRAY_INDEX) \
	X(20, "vertices",       mesh.vertex,       c->mesh.vertices,                 RBF_ARRAY_INDEX) \
	X(21, "sets",           set,               c->sets,                          RBF_ARRAY_INDEX) \
	X(22, "shift of",       shift_of,          c->residual * 6ull * c->mesh.elements, RBF_ARRAY_INDEX) \
	X(38, "dhr grid",       dhr_grid,          c->channels * rbf_dhr_nodes(c),   RBF_ARRAY_BITS | RBF_ARRAY_OPTIONAL) \
	X(23, "dhr",            dhr,               !c->packed * DHR_ENTRIES,         RBF_ARRAY_FLOAT) \
	X(24, "incidences",     base_info,         c->mesh.bases,                    RBF_ARRAY_INDEX) \
	X(25, "wide cull",      cull_wide,         RBF_CULL_CELLS * c->sets,         RBF_ARRAY_BITS | RBF_ARRAY_OPTIONAL) \
	X(33, "cull",           cull,              !c->packed * rbf_cull_words(c->blocks), RBF_ARRAY_BITS | RBF_ARRAY_OPTIONAL) \
	X(26, "lobes",          block,             !c->packed * 1ull * c->blocks,     RBF_ARRAY_FLOAT) \
	X(27, "amplitudes",     amplitude,         !c->packed * 1ull * c->channels * c->blocks, RBF_ARRAY_FLOAT) \
	X(40, "packed",         pack,              c->packed,                        RBF_ARRAY_BITS) \
	X(30, "shifts",         shift,             !c->packed * c->residual * 1ull * c->shifts, RBF_ARRAY_FLOAT) \
	X(31, "learned",        linear,            c->learned * 1ull * c->frames,    RBF_ARRAY_FLOAT) \
	X(35, "levels",         level,            (c->even > 0) * 1ull * c->mesh.bases, RBF_ARRAY_FLOAT) \
	X(36, "tuning",         tune,             c->tuned * 1ull * RBF_TUNE * (c->mesh.elements + (uint64_t)c->mesh.borders), RBF_ARRAY_FLOAT) \
	X(32, "trend",          trend,             !c->packed * 4ull * c->dhr_steps * c->mesh.borders, RBF_ARRAY_FLOAT | RBF_ARRAY_OPTIONAL)

enum rbf_array_holds {
	RBF_ARRAY_FLOAT = 1,    /* nothing but floats: all must be finite */
	RBF_ARRAY_INDEX = 2,    /* holds indices: has a check of its own in check.c */
	RBF_ARRAY_BITS = 4,     /* any content is harmless */
	RBF_ARRAY_OPTIONAL = 8
};

enum {
#define X(kind, name, member, entries, holds) RBF_ARRAY_ROW_##kind,
	RBF_ARRAYS(X)
#undef X
	RBF_ARRAY_ROWS
};

typedef struct rbf_array {
	uint32_t kind;
	const char *name;
	size_t offset;  /* of the pointer in rbf_component */
	uint32_t entry; /* bytes an entry */
	unsigned holds;
} rbf_array;

extern const rbf_array rbf_array_row[RBF_ARRAY_ROWS];

/* Entries that the component's numbers call for. */
uint64_t rbf_array_entries(const rbf_component *component, int row);

/* Row of a kind, or -1. */
int rbf_array_find(uint32_t kind);

static inline const void *rbf_array_get(const rbf_component *component, int row)
{
	const void *array;
	memcpy(&array, (const char *)component + rbf_array_row[row].offset, sizeof array);
	return array;
}

static inline void rbf_array_set(rbf_component *component, int row, const void *array)
{
	memcpy((char *)component + rbf_array_row[row].offset, &array, sizeof array);
}

/* Those not in use are 0. */
void rbf_numbers_get(const rbf_component *component, uint32_t number[RBF_NUMBERS_MAX]);
void rbf_numbers_set(rbf_component *component, const uint32_t number[RBF_NUMBERS_MAX]);
#endif
