/* SPDX-License-Identifier: BSD-3-Clause */
/* Records of version 1.0: their sets ended with numbers of other tables for sampling, and their locator had empty cells around the row
 * of an isotropic mesh. */
#include "check.h"
#include "draws.h"
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

const char *rbf_record_former(rbf_component *c, void **made)
{
	const size_t lanes = (size_t)c->blocks * RBF_LANES * rbf_draw_tables(c);
	rbf_set *set = malloc(c->sets * sizeof *set + (lanes + 1) * sizeof *c->draws);
	if (!set)
		return "memory";
	*made = set;
	for (uint32_t s = 0; s < c->sets; s++)
		set[s] = (rbf_set){.first = c->set[s].first, .blocks = c->set[s].blocks};
	c->set = set;
	c->draws = (const uint16_t *)(set + c->sets);
	if (c->mesh.symmetry == RBF_ISOTROPIC)
		c->mesh.cell_first += RBF_MESH_GRID / 2 * RBF_MESH_GRID + RBF_MESH_GRID / 2;
	const char *wrong = rbf_check_arrays(c);
	return wrong ? wrong : rbf_draws_make(c) ? "memory" : NULL;
}
