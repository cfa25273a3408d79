/* SPDX-License-Identifier: BSD-3-Clause */
/* Records of version 1.0: their sets ended with numbers of other tables for sampling, and their locator had empty cells around the row
 * of an isotropic mesh. */
#include "check.h"
#include "draws.h"
#include "pack.h"
#include "record.h"

#include <stdlib.h>

int rbf_record_former_kind(uint32_t kind)
{
	return kind == 28 || kind == 29; /* "cumulative", "reach" */
}

uint64_t rbf_record_former_entries(const rbf_component *c, int row)
{
	if (rbf_array_row[row].kind == 34) /* "draws" */
		return 0;
	return rbf_array_row[row].kind == 16 ? RBF_MESH_GRID * RBF_MESH_GRID + 1 : rbf_array_entries(c, row);
}

/* The locator of an isotropic mesh: the one row that is used, from its own first entry on. */
static const char *take_row(rbf_mesh *m, uint32_t *row)
{
	const uint32_t cells = rbf_mesh_cells(m), *old = m->cell_first + RBF_MESH_GRID / 2 * RBF_MESH_GRID + RBF_MESH_GRID / 2;
	if (old[0] > old[cells] || old[cells] > m->cell_entries)
		return "cell";
	for (uint32_t i = 0; i <= cells; i++)
		row[i] = old[i] - old[0];
	m->cell_first = row;
	m->cell_element += old[0];
	m->cell_entries = row[cells];
	return NULL;
}

const char *rbf_record_former(rbf_component *c, void **made)
{
	const size_t row = rbf_mesh_cells(&c->mesh) + 1, lanes = (size_t)c->blocks * RBF_LANES * rbf_draw_tables(c);
	rbf_set *set = malloc(c->sets * sizeof *set + row * sizeof *c->mesh.cell_first + (lanes + 1) * sizeof *c->draws);
	if (!set)
		return rbf_unpack_memory;
	*made = set;
	for (uint32_t s = 0; s < c->sets; s++)
		set[s] = (rbf_set){.first = c->set[s].first, .blocks = c->set[s].blocks};
	uint32_t *first = (uint32_t *)(set + c->sets);
	const char *wrong = c->mesh.symmetry == RBF_ISOTROPIC ? take_row(&c->mesh, first) : NULL;
	c->set = set;
	c->draws = (const uint16_t *)(first + row);
	if (!wrong)
		wrong = rbf_check_arrays(c);
	return wrong ? wrong : rbf_draws_make(c) ? rbf_unpack_memory : NULL;
}
