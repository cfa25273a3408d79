/* SPDX-License-Identifier: BSD-3-Clause */
/* Components with arbitrary but valid content, for tests of what carries them. */
#ifndef TEST_SYNTHETIC_H
#define TEST_SYNTHETIC_H
#include "arrays.h"
#include "draws.h"

#include <stdlib.h>

typedef struct synthetic {
	uint32_t channels, symmetry, bases, vertices, elements, borders, cell_entries;
	uint32_t frames, residual, blocks_per_set, dhr_steps;
	int optional;   /* arrays: 0: none of them, 1: as written now, 2: with culling masks as in files before */
} synthetic;

static const synthetic synthetic_small = {1, RBF_BILATERAL_Y, 2, 3, 1, 2, 5, 1, 1, 1, 2, 0};

static inline uint32_t synthetic_random(uint64_t *state)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (uint32_t)(*state >> 33);
}

static inline float synthetic_unit(uint64_t *state)
{
	return (float)synthetic_random(state) / 2147483648.f;
}

/* Numbers only, arrays NULL. */
static inline void synthetic_numbers(const synthetic *want, rbf_component *c)
{
	memset(c, 0, sizeof *c);
	c->present = 1;
	c->channels = want->channels;
	c->mesh.symmetry = (rbf_symmetry)want->symmetry;
	c->mesh.bases = want->bases;
	c->mesh.vertices = want->vertices;
	c->mesh.elements = want->elements;
	c->mesh.borders = want->borders;
	c->mesh.cell_entries = want->cell_entries;
	c->frames = want->frames;
	for (uint32_t f = 0; f < want->frames; f++)
		c->frame[f] = f == 1 ? RBF_MAP_LEARNED_TURN : (f + 1) % 7;
	c->learned = want->frames > 1;
	c->even = want->frames > 1 ? 2 : 0;
	c->tuned = c->limited = want->frames > 1;
	c->residual = want->residual;
	c->sets = want->bases * want->frames;
	c->blocks = c->sets * want->blocks_per_set;
	c->shifts = want->residual ? want->frames * want->blocks_per_set * 3 : 0;
	c->edges = want->residual ? 3 : 0;
	c->dhr_steps = want->dhr_steps;
	c->dhr_cells = want->optional ? 5 : 0;
	c->lambertian[0] = .125f;
	c->facts.loo_error = -1;
	c->facts.frame_share[0] = 1;
	strcpy(c->facts.symmetry_text, "made up");
}

/* Fills the arrays that hold indices; they must have been allocated. */
static inline void synthetic_indices(const synthetic *want, rbf_component *c, uint64_t *state)
{
	const uint32_t cells = rbf_mesh_cells(&c->mesh), per_base = want->frames * want->blocks_per_set;
	rbf_set *set = (rbf_set *)c->set;
	rbf_base_info *info = (rbf_base_info *)c->base_info;
	uint32_t *shift_of = (uint32_t *)c->shift_of;
	for (uint32_t i = 0; i < c->mesh.vertices; i++) {
		rbf_vertex *v = c->mesh.vertex + i;
		v->base = i % c->mesh.bases;
		v->op = i % 4;
		v->direction[0] = synthetic_unit(state);
		v->direction[2] = 1;
		rbf_normalize(v->direction);
	}
	for (uint32_t i = 0; i < c->mesh.elements; i++)
		for (int k = 0; k < 3; k++) {
			c->mesh.element[i].v[k] = synthetic_random(state) % c->mesh.vertices;
			for (int n = 0; n < 3; n++)
				c->mesh.element[i].inverse[k][n] = synthetic_unit(state);
		}
	for (uint32_t i = 0; i < c->mesh.borders; i++) {
		c->mesh.border[i][0] = synthetic_random(state) % c->mesh.vertices;
		c->mesh.border[i][1] = synthetic_random(state) % c->mesh.vertices;
		c->mesh.border[i][2] = c->mesh.elements ? synthetic_random(state) % c->mesh.elements : RBF_MESH_NO_ELEMENT;
	}
	for (uint32_t i = 0; i <= cells; i++)
		c->mesh.cell_first[i] = (uint32_t)((uint64_t)c->mesh.cell_entries * i / cells);
	for (uint32_t i = 0; i < cells; i++)
		for (uint32_t first = c->mesh.cell_first[i], n = first, last = c->mesh.cell_first[i + 1]; n < last; n++) {
			/* ascending: elements, then borders */
			const uint32_t half = first + (last - first + 1) / 2;
			c->mesh.cell_element[n] = n < half && c->mesh.elements
				? (uint32_t)((uint64_t)(n - first) * c->mesh.elements / (half - first))
				: RBF_MESH_BORDER | (n < half ? 0 : (uint32_t)((uint64_t)(n - half) * c->mesh.borders / (last - half)));
		}
	for (uint32_t i = 0; i < c->sets; i++) {
		set[i].first = i * want->blocks_per_set;
		set[i].blocks = want->blocks_per_set;
		set[i].sent = set[i].band = .5f;
	}
	for (uint32_t i = 0; i < c->mesh.bases; i++) {
		info[i].direction[2] = 1;
		info[i].lobes = per_base * RBF_LANES;
		info[i].dhr = .25f;
		info[i].fit_error = info[i].loo_error = -1;
	}
	if (c->residual)
		for (uint32_t i = 0; i < 6 * c->mesh.elements; i++)
			shift_of[i] = i % 4 == 3 ? RBF_NO_SHIFT : i % 3 * per_base;
}

/* A whole component, to be released with rbf_component_free(). */
static inline void synthetic_component(const synthetic *want, uint64_t seed, rbf_component *c)
{
	synthetic_numbers(want, c);
	for (int row = 0; row < RBF_ARRAY_ROWS; row++) {
		const uint64_t entries = rbf_array_entries(c, row);
		const size_t bytes = (size_t)(entries * rbf_array_row[row].entry);
		if (!entries || (rbf_array_row[row].holds & RBF_ARRAY_OPTIONAL && !want->optional)
				|| row == (want->optional == 2 ? RBF_ARRAY_ROW_33 : RBF_ARRAY_ROW_25))
			continue;
		float *array = calloc(1, bytes);
		for (size_t i = 0; i < bytes / 4 && rbf_array_row[row].holds & (RBF_ARRAY_FLOAT | RBF_ARRAY_BITS); i++)
			array[i] = synthetic_unit(&seed) + (row == RBF_ARRAY_ROW_37);
		rbf_array_set(c, row, array);
	}
	synthetic_indices(want, c, &seed);
}
#endif
