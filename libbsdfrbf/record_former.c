/* SPDX-License-Identifier: BSD-3-Clause */
/* Records of former versions. Up to 1.2 they had tables for sampling, which are made when they are needed, and shifts that were not packed; in
 * 1.0 the locator had empty cells around the row of an isotropic mesh. */
#include "check.h"
#include "pack.h"
#include "record.h"

#include <stdlib.h>

int rbf_record_former_kind(uint32_t minor, uint32_t kind)
{
	return (minor < 1 && (kind == 28 || kind == 29)) || (minor < 3 && kind == 34); /* "cumulative", "reach"; "draws" */
}

uint64_t rbf_record_former_entries(const rbf_component *c, uint32_t minor, int row)
{
	if (minor < 1 && row == RBF_ARRAY_ROW_16)
		return RBF_MESH_GRID * RBF_MESH_GRID + 1;
	if (minor < 3 && row == RBF_ARRAY_ROW_30) /* beside a stream too */
		return c->residual * 1ull * c->shifts;
	return rbf_array_entries(c, row);
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
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		*made = malloc((rbf_mesh_cells(&c->mesh) + 1) * sizeof *c->mesh.cell_first);
		const char *wrong = *made ? take_row(&c->mesh, *made) : rbf_unpack_memory;
		if (wrong)
			return wrong;
	}
	return rbf_check_arrays(c);
}
