/* SPDX-License-Identifier: BSD-3-Clause */
#include "check.h"
#include "arrays.h"
#include "dhr.h"
#include "dhr_grid.h"
#include "map.h"

#define BLOCKS_MAX (1u << 28) /* lobes are counted in 32 bits */

/* Exponent bits all set: infinity or not a number. On the bits, as compilers may assume floats to be finite. */
static int all_finite(const void *floats, uint64_t count)
{
	const char *at = floats;
	uint32_t bad = 0;
	for (uint64_t i = 0; i < count; i++) {
		uint32_t bits;
		memcpy(&bits, at + 4 * i, 4);
		bad |= (bits & 0x7f800000u) == 0x7f800000u;
	}
	return !bad;
}

static int known_symmetry(uint32_t symmetry)
{
	switch (symmetry) {
	case RBF_ANISOTROPIC: case RBF_BILATERAL_X: case RBF_BILATERAL_Y: case RBF_UP: case RBF_QUADRILATERAL:
	case RBF_ISOTROPIC:
		return 1;
	}
	return 0;
}

const char *rbf_check_numbers(const rbf_component *c)
{
	if (c->channels != 1 && c->channels != 3)
		return "number of channels";
	if (!known_symmetry((uint32_t)c->mesh.symmetry))
		return "symmetry";
	if (c->mesh.bases < 1 || c->mesh.vertices < 1)
		return "number of incidences";
	if (c->mesh.borders < 1)
		return "mesh without border";
	if (c->frames < 1 || c->frames > RBF_MAX_FRAMES)
		return "number of frames";
	for (uint32_t f = 0; f < RBF_MAX_FRAMES; f++)
		if (c->frame[f] >= RBF_MAPS)
			return "unknown frame";
	uint32_t learned = 0;
	for (uint32_t f = 0; f < c->frames; f++)
		learned |= (uint32_t)rbf_map_learned(c->frame[f]);
	if (c->learned != learned)
		return "learned frames";
	if (c->limited > 1)
		return "limits of shares";
	if (c->tuned > 1)
		return "tuned light";
	if (c->filled > 1000)
		return "filled directions";
	if (c->even > RBF_EVEN)
		return "evened levels";
	if (c->sets != (uint64_t)c->mesh.bases * c->frames)
		return "number of sets";
	if (c->blocks > BLOCKS_MAX || c->shifts > BLOCKS_MAX)
		return "number of lobes";
	if (c->residual > 1 || (!c->residual && c->shifts))
		return "residual transport";
	if (c->dhr_steps < 2 || c->dhr_steps > RBF_DHR_STEPS_MAX || c->dhr_steps % 2)
		return "size of the reflectance table";
	if (c->dhr_cells > RBF_DHR_CELLS_MAX || !all_finite(c->dhr_unit, 3))
		return "grid of the reflectance table";
	if (!all_finite(c->lambertian, 3))
		return "Lambertian part";
	for (int i = 0; i < 3; i++)
		if (c->lambertian[i] < 0)
			return "Lambertian part";
	if (!all_finite(&c->facts, offsetof(rbf_facts, symmetry_text) / sizeof(float))
		|| !memchr(c->facts.symmetry_text, 0, sizeof c->facts.symmetry_text))
		return "facts";
	return NULL;
}

static const char *check_mesh(const rbf_mesh *m)
{
	const uint32_t cells = rbf_mesh_cells(m);
	for (uint32_t i = 0; i < m->vertices; i++)
		if (m->vertex[i].base >= m->bases || m->vertex[i].op > RBF_OP_XY || !all_finite(m->vertex[i].direction, 3))
			return "vertex";
	for (uint32_t i = 0; i < m->elements; i++) {
		for (int k = 0; k < 3; k++)
			if (m->element[i].v[k] >= m->vertices)
				return "element";
		if (!all_finite(m->element[i].inverse, 9))
			return "element";
	}
	for (uint32_t i = 0; i < m->borders; i++)
		if (m->border[i][0] >= m->vertices || m->border[i][1] >= m->vertices
			|| (m->border[i][2] != RBF_MESH_NO_ELEMENT && m->border[i][2] >= m->elements))
			return "border";
	if (m->cell_first[0] != 0 || m->cell_first[cells] != m->cell_entries)
		return "cell";
	for (uint32_t i = 0; i < cells; i++) {
		const uint32_t first = m->cell_first[i], last = m->cell_first[i + 1];
		if (first > last || last > m->cell_entries)
			return "cell";
		for (uint32_t k = first; k < last; k++) {
			const uint32_t e = m->cell_element[k];
			if (e & RBF_MESH_BORDER ? (e & ~RBF_MESH_BORDER) >= m->borders : e >= m->elements)
				return "cell entry";
			if (k > first && m->cell_element[k - 1] & ~e & RBF_MESH_BORDER) /* borders come behind elements */
				return "order of a cell";
		}
	}
	return NULL;
}

/* Sets lie within the blocks, and those of one base follow each other. */
static const char *check_sets(const rbf_component *c)
{
	for (uint32_t s = 0; s < c->sets; s++) {
		const rbf_set *set = c->set + s;
		if (set->first > c->blocks || set->blocks > c->blocks - set->first)
			return "set";
		if (s % c->frames && set->first != set[-1].first + set[-1].blocks)
			return "set";
	}
	return NULL;
}

#define LINEAR_MAX 16.f /* far more than any beam moves; such vectors stay finite */

static const char *check_learned(const rbf_component *c)
{
	for (uint32_t f = 0; c->learned && f < c->frames; f++)
		for (int n = 0; n < 8; n++) {
			const float v = c->linear[f].row[n / 4][n % 4];
			if (!all_finite(&v, 1) || fabsf(v) > LINEAR_MAX)
				return "learned frame";
		}
	return NULL;
}

static const char *check_limits(const rbf_component *c)
{
	for (uint32_t f = 0; c->limited && f < c->frames; f++)
		if (!(c->limit[f] >= 1 && c->limit[f] <= RBF_LIMIT_MOST))
			return "limits";
	return NULL;
}

/* A shift runs beside all the blocks of the base it moves. */
static const char *check_shifts(const rbf_component *c)
{
	if (!c->residual)
		return NULL;
	for (uint32_t e = 0; e < c->mesh.elements; e++)
		for (uint32_t k = 0; k < 6; k++) {
			const uint32_t at = c->shift_of[6 * (size_t)e + k];
			if (at == RBF_NO_SHIFT)
				continue;
			const size_t base = c->mesh.vertex[c->mesh.element[e].v[k / 2]].base;
			const rbf_set *set = c->set + base * c->frames, *last = set + c->frames - 1;
			const uint32_t blocks = last->first + last->blocks - set->first;
			if (at > c->shifts || blocks > c->shifts - at)
				return "shift";
		}
	return NULL;
}

const char *rbf_check_arrays(const rbf_component *c)
{
	const char *wrong = check_mesh(&c->mesh);
	if (!wrong)
		wrong = check_sets(c);
	if (!wrong)
		wrong = check_shifts(c);
	if (!wrong)
		wrong = check_learned(c);
	if (!wrong)
		wrong = check_limits(c);
	for (uint32_t i = 0; i < c->mesh.bases && !wrong; i++) {
		const rbf_base_info *info = c->base_info + i;
		if (!all_finite(info->direction, 3) || !all_finite(&info->dhr, 4))
			wrong = "incidence";
	}
	for (int row = 0; row < RBF_ARRAY_ROWS && !wrong; row++)
		if (rbf_array_row[row].holds & RBF_ARRAY_FLOAT && rbf_array_get(c, row)
			&& !all_finite(rbf_array_get(c, row), rbf_array_entries(c, row) * (rbf_array_row[row].entry / 4)))
			wrong = rbf_array_row[row].name;
	return wrong;
}
