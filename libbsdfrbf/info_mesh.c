/* SPDX-License-Identifier: BSD-3-Clause */
/* The mesh of incident directions and the lobes that move along its edges, for people and their tools. */
#include "bounds.h"
#include "disagreement.h"
#include "map.h"

#include <string.h>

static const rbf_component *component_of(const bsdfrbf_model *model, bsdfrbf_component component)
{
	return bsdfrbf_has(model, component) ? model->component + component : NULL;
}

bsdfrbf_status bsdfrbf_get_vertex_info(const bsdfrbf_model *model, bsdfrbf_component component, int index,
	bsdfrbf_vertex_info *info)
{
	const rbf_component *c = component_of(model, component);
	if (!c || !info || index < 0 || (uint32_t)index >= c->mesh.vertices)
		return BSDFRBF_ERR_ARGUMENT;
	const rbf_vertex *vertex = c->mesh.vertex + index;
	memcpy(info->direction, vertex->direction, sizeof info->direction);
	info->incidence = (int)rbf_bound_base(c, vertex);
	info->mirrored = vertex->op != RBF_OP_NONE;
	return BSDFRBF_OK;
}

bsdfrbf_status bsdfrbf_get_triangle(const bsdfrbf_model *model, bsdfrbf_component component, int index, int corner[3])
{
	const rbf_component *c = component_of(model, component);
	if (!c || !corner || index < 0 || (uint32_t)index >= c->mesh.elements)
		return BSDFRBF_ERR_ARGUMENT;
	for (int n = 0; n < 3; n++)
		corner[n] = (int)rbf_bound(c->mesh.element[index].v[n], c->mesh.vertices);
	return BSDFRBF_OK;
}

float bsdfrbf_get_disagreement(const bsdfrbf_model *model, bsdfrbf_component component, int index)
{
	const rbf_component *c = component_of(model, component);
	return c && index >= 0 && (uint32_t)index < c->mesh.elements ? rbf_disagreement(c, (uint32_t)index) : -1;
}

/* Residual motion of all lobes of vertex `from` as the incident direction goes to vertex `to`, or NULL. */
static const rbf_shift *find_shift(const rbf_component *c, uint32_t from, uint32_t to)
{
	if (!c->residual || from == to)
		return NULL;
	for (uint32_t e = 0; e < c->mesh.elements; e++) {
		const uint32_t *v = c->mesh.element[e].v;
		for (uint32_t own = 0; own < 3; own++)
			for (uint32_t n = 0; n < 2 && v[own] == from; n++)
				if (v[(own + 1 + n) % 3] == to) {
					const rbf_shift *shift = rbf_bound_shift(c, c->shift_of[e * 6 + own * 2 + n],
						rbf_bound_base(c, c->mesh.vertex + from));
					if (shift)
						return shift;
				}
	}
	return NULL;
}

static void describe(const rbf_component *c, const rbf_warp *warp, uint32_t op, uint32_t block, uint32_t lane,
	const rbf_shift *shift, bsdfrbf_lobe_info *info)
{
	const rbf_block *b = c->block + block;
	const float centre[3] = {b->x[lane], b->y[lane], b->z[lane]};
	float there[3] = {centre[0], centre[1], centre[2]}, turned[3];
	if (shift) {
		there[0] += shift->x[lane];
		there[1] += shift->y[lane];
		there[2] += shift->z[lane];
		rbf_normalize(there);
	}
	rbf_mirror(op, centre, info->direction);
	rbf_mirror(op, there, turned);
	if (!(rbf_warp_inverse(warp, turned, info->moved) > 0))
		memset(info->moved, 0, sizeof info->moved);
	info->sigma = 1 / sqrtf(b->k[lane]);
	info->energy = c->amplitude[(size_t)rbf_luminance(c->channels) * c->blocks + block].a[lane] * (float)(2 * RBF_PI) / b->k[lane];
}

size_t bsdfrbf_get_lobes(const bsdfrbf_model *model, bsdfrbf_component component, int from, int to, size_t capacity,
	bsdfrbf_lobe_info *lobes)
{
	const rbf_component *c = component_of(model, component);
	if (!c || from < 0 || to < 0 || (uint32_t)from >= c->mesh.vertices || (uint32_t)to >= c->mesh.vertices
		|| (capacity && !lobes))
		return 0;
	const rbf_vertex *vertex = c->mesh.vertex + from;
	const uint32_t base = rbf_bound_base(c, vertex), first = c->set[(size_t)base * c->frames].first;
	const rbf_shift *shift = find_shift(c, (uint32_t)from, (uint32_t)to);
	size_t count = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		const rbf_set *set = rbf_bound_set(c, (size_t)base * c->frames + f);
		rbf_warp warp;
		rbf_warp_set(&warp, c->frame[f], rbf_frame_linear(c, f), c->mesh.vertex[to].direction, vertex->direction);
		for (uint32_t n = 0; n < set->blocks; n++)
			for (uint32_t lane = 0; lane < RBF_LANES; lane++) {
				if (!(c->block[set->first + n].k[lane] > 0))
					continue;
				if (count < capacity) {
					describe(c, &warp, vertex->op, set->first + n, lane, shift ? shift + (set->first - first) + n : NULL,
						lobes + count);
					lobes[count].frame = (int)f;
				}
				count++;
			}
	}
	return count;
}
