/* SPDX-License-Identifier: BSD-3-Clause */
#include "arrays.h"
#include "cull.h"
#include "dhr.h"
#include "dhr_grid.h"

#define DHR_ENTRIES (c->channels * ((uint64_t)c->mesh.elements * rbf_dhr_element_nodes(c) + (uint64_t)c->mesh.borders * rbf_dhr_border_nodes(c)))

const rbf_array rbf_array_row[RBF_ARRAY_ROWS] = {
#define X(kind, name, member, entries, holds) \
	{kind, name, offsetof(rbf_component, member), sizeof *((rbf_component *)0)->member, holds},
	RBF_ARRAYS(X)
#undef X
};

uint64_t rbf_array_entries(const rbf_component *c, int row)
{
	switch (row) {
#define X(kind, name, member, entries, holds) case RBF_ARRAY_ROW_##kind: return entries;
	RBF_ARRAYS(X)
#undef X
	default: return 0;
	}
}

int rbf_array_find(uint32_t kind)
{
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		if (rbf_array_row[row].kind == kind)
			return row;
	return -1;
}

#define X(member) +1
_Static_assert(0 RBF_NUMBERS(X) <= RBF_NUMBERS_MAX, "the recorded component header is too small");
#undef X

void rbf_numbers_get(const rbf_component *component, uint32_t number[RBF_NUMBERS_MAX])
{
	int i = 0;
	memset(number, 0, RBF_NUMBERS_MAX * sizeof *number);
#define X(member) number[i++] = (uint32_t)component->member;
	RBF_NUMBERS(X)
#undef X
}

void rbf_numbers_set(rbf_component *component, const uint32_t number[RBF_NUMBERS_MAX])
{
	int i = 0;
#define X(member) component->member = number[i++];
	RBF_NUMBERS(X)
#undef X
}
