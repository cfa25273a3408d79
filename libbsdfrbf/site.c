/* SPDX-License-Identifier: BSD-3-Clause */
/* What evaluation and sampling at an incident direction have in common: where it lies in the mesh, and the maps from there. */
#include "bounds.h"
#include "clones.h"
#include "dhr.h"
#include "dhr_grid.h"
#include "evaluate.h"
#include "even.h"

#include <string.h>

/* One component of the corners' directions, in lanes; those without a corner are as the last one. */
#define IN_LANES(member) (rbf_lanes){corner[0]->member, corner[1]->member, corner[2]->member, corner[2]->member}

/* One of a site's vectors, alike in all lanes; or of its corners. */
#define ALIKE(v) {rbf_lanes_all((v)[0]), rbf_lanes_all((v)[1]), rbf_lanes_all((v)[2])}
#define LOADED(v) {rbf_lanes_load((v)[0]), rbf_lanes_load((v)[1]), rbf_lanes_load((v)[2])}

/* The site's fans are set. level: of each corner, the last one's again where there is none. */
static inline __attribute__((always_inline)) void even_parts(rbf_site *site, uint32_t even, const rbf_level *const level[3], int outside)
{
	const rbf_level *const of[RBF_WIDTH] = {level[0], level[1], level[2], level[2]};
	const rbf_lanes weight = rbf_lanes_load(site->weight), flip[2] = {rbf_lanes_load(site->flip[0]), rbf_lanes_load(site->flip[1])};
	const rbf_lanes direction[3] = LOADED(site->direction), incident[3] = ALIKE(site->incident);
	rbf_lanes at[3], gain = rbf_lanes_all(0);
	int half = 0;
	for (uint32_t f = 0; f < site->component->frames; f++)
		if (site->fan[f].kind == RBF_KIND_HALF) {
			half = 1;
			gain = rbf_lanes_load(site->fan[f].gain);
		}
	if (outside)
		rbf_nearest(weight, direction, at);
	rbf_lanes_store(site->part, rbf_even_parts(even, of, weight, flip, half ? &gain : NULL, incident, outside ? at : incident));
}

RBF_CLONES static void even_alone(rbf_site *site, uint32_t even, const rbf_level *const level[3])
{
	even_parts(site, even, level, 1);
}

void rbf_site_even(rbf_site *site, uint32_t even, const rbf_level level[3])
{
	if (!site->corners)
		return;
	const uint32_t last = site->corners - 1;
	const rbf_level *const of[3] = {&level[0], &level[last < 1 ? last : 1], &level[last]};
	even_alone(site, even, of);
}

RBF_CLONES static void set_corners(rbf_site *site, const rbf_vertex *const vertex[3], const float weight[3], int outside)
{
	const rbf_component *c = site->component;
	const rbf_vertex *corner[3] = {NULL, NULL, NULL};
	uint32_t k = 0;
	for (int n = 0; n < RBF_FAN; n++)
		site->weight[n] = 0;
	for (uint32_t n = 0; n < 3; n++)
		if (weight[n] > 0) {
			corner[k] = vertex[n];
			site->base[k] = rbf_bound_base(c, vertex[n]);
			site->vertex_op[k] = vertex[n]->op;
			site->weight[k] = weight[n];
			site->motion[k] = (rbf_motion){{NULL, NULL}, {0, 0}};
			k++;
		}
	site->corners = k;
	site->moves = 0;
	if (!k)
		return;
	for (uint32_t n = k; n < 3; n++)
		corner[n] = corner[k - 1];
	for (int i = 0; i < 3; i++)
		rbf_lanes_store(site->direction[i], IN_LANES(direction[i]));
	const rbf_lane_mask op = {(int32_t)corner[0]->op, (int32_t)corner[1]->op, (int32_t)corner[2]->op, (int32_t)corner[2]->op};
	rbf_lanes_store(site->flip[0], __builtin_convertvector(1 - 2 * (op & 1), rbf_lanes));
	rbf_lanes_store(site->flip[1], __builtin_convertvector(1 - (op & 2), rbf_lanes));
	const rbf_lanes from[3] = ALIKE(site->incident), to[3] = LOADED(site->direction);
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_fan *fan = &site->fan[f];
		rbf_fan_set(fan, c->frame[f], rbf_frame_linear(c, f), from, to);
		fan->limit = rbf_frame_limit(c, f);
		if (fan->kind == RBF_KIND_HALF)
			rbf_lanes_store(fan->gain, rbf_facet_gain(rbf_lanes_load(site->weight), rbf_lanes_load(fan->gain)));
	}
	if (!c->level) {
		rbf_lanes_store(site->part, rbf_lanes_load(site->weight));
		return;
	}
	const rbf_level *const level[3] = {&c->level[site->base[0]], &c->level[site->base[k > 1]], &c->level[site->base[k - 1]]};
	even_parts(site, c->even, level, outside);
}

/* An incident direction that is folded already. */
static void set_folded(const rbf_component *c, const float incident[3], rbf_site *site)
{
	site->component = c;
	site->scale = site->tune = 1;
	site->op = RBF_OP_NONE;
	site->cosine = 1;
	site->sine = 0;
	memcpy(site->incident, incident, sizeof site->incident);
}

void rbf_site_turn(const rbf_component *c, const float incident[3], rbf_site *site)
{
	set_folded(c, incident, site);
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		const float s = sqrtf(incident[0]*incident[0] + incident[1]*incident[1]);
		if (s > 0) {
			site->cosine = incident[0] / s;
			site->sine = incident[1] / s;
		}
		site->incident[0] = s;
		site->incident[1] = 0;
	} else {
		site->op = (unsigned)rbf_symmetry_fold(c->mesh.symmetry, incident);
		rbf_mirror(site->op, incident, site->incident);
	}
}

#define OUTSIDE_GAIN 2.f /* at most */

/* Beyond the last measured incidence lobes are carried on as from its edge, and DHR follows its trend: facets without shadows would
 * gain energy there (1/cos), and lobes that sink below the horizon would lose it. Returns the factor that does so; value: DHR with that
 * factor. */
static float scale_outside(const rbf_component *c, uint32_t border, const float weight[3], const float incident[3], float value[3])
{
	const uint32_t y = rbf_luminance(c->channels);
	rbf_dhr_edge at;
	rbf_dhr_outside(c, border, weight, incident, &at);
	const float wanted = at.edge[y] * rbf_max(incident[2], RBF_DHR_Z) * expf(at.trend), here = at.value[y] * rbf_max(at.z, RBF_DHR_Z);
	const float scale = here > 0 ? rbf_min(wanted / here, OUTSIDE_GAIN) : 1;
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] = at.value[n] * scale;
	return scale;
}

void rbf_site_corners(const rbf_component *component, const float incident[3], const rbf_vertex vertex[3], const float weight[3],
	rbf_site *site)
{
	const rbf_vertex *const corner[3] = {&vertex[0], &vertex[1], &vertex[2]};
	rbf_site_turn(component, incident, site);
	set_corners(site, corner, weight, 0);
}

/* Residual motion of the site's corners in element e. */
static void set_shifts(rbf_site *site, uint32_t e, const uint32_t corner[3], const float weight[3])
{
	const rbf_component *component = site->component;
	if (e >= component->mesh.elements)
		return;
	/* the element's corners, where a border or a weight of 0 may have left some out */
	const uint32_t *v = component->mesh.element[e].v;
	uint32_t k = 0;
	for (int n = 0; n < 3; n++) {
		if (!(weight[n] > 0))
			continue;
		int own = 0;
		while (own < 2 && v[own] != corner[n])
			own++;
		for (int m = 0; m < 2; m++) {
			const int other = (own + 1 + m) % 3;
			const uint32_t at = component->shift_of[e * 6 + (uint32_t)own * 2 + (uint32_t)m];
			float w = 0;
			for (int l = 0; l < 3; l++)
				if (l != n && corner[l] == v[other] && corner[l] != corner[n])
					w += weight[l];
			if (at != RBF_NO_SHIFT && w > 0) {
				site->motion[k].shift[m] = rbf_bound_shift(component, at, site->base[k]);
				site->motion[k].weight[m] = w;
				site->moves = 1;
			}
		}
		k++;
	}
}

float rbf_site_tune(const rbf_component *c, const rbf_spot *at)
{
	const uint32_t border = at->item & RBF_MESH_BORDER;
	const float *t = c->tune + RBF_TUNE * (border ? c->mesh.elements + (size_t)(at->item & ~RBF_MESH_BORDER) : at->item), *w = at->weight;
	float tune = 1 + 4 * w[0] * w[1] * t[0];
	if (!border)
		tune += 4 * (w[1] * w[2] * t[1] + w[2] * w[0] * t[2]) + w[0] * w[1] * w[2] * t[3];
	return rbf_max(tune, 0);
}

/* Corners and motion of a site whose incident direction is set. */
static void set_place(rbf_site *site, const rbf_spot *at)
{
	const uint32_t item = at->item;
	const float *weight = at->weight;
	const rbf_component *component = site->component;
	const rbf_mesh *mesh = &component->mesh;
	uint32_t corner[3];
	rbf_bound_corners(mesh, item, corner);
	const rbf_vertex *const vertex[3] = {&mesh->vertex[corner[0]], &mesh->vertex[corner[1]], &mesh->vertex[corner[2]]};
	set_corners(site, vertex, weight, (item & RBF_MESH_BORDER) != 0);
	if (component->tune) {
		site->tune = rbf_site_tune(component, at);
		rbf_lanes_store(site->part, rbf_lanes_load(site->part) * site->tune);
	}
	if (component->residual)
		set_shifts(site, item & RBF_MESH_BORDER ? mesh->border[item & ~RBF_MESH_BORDER][2] : item, corner, weight);
}

void rbf_site_place(const rbf_component *component, uint32_t item, const float weight[3], const float incident[3], rbf_site *site)
{
	const rbf_spot at = {item, {weight[0], weight[1], weight[2]}};
	set_folded(component, incident, site);
	set_place(site, &at);
}

void rbf_site_find(const rbf_site *site, rbf_spot *at)
{
	uint32_t corner[3];
	at->item = rbf_mesh_locate(&site->component->mesh, site->incident, corner, at->weight);
}

void rbf_site_settle(rbf_site *site, const rbf_spot *at)
{
	set_place(site, at);
}

float rbf_site_scale(const rbf_component *c, const rbf_spot *at, const float incident[3])
{
	float dhr[3];
	return at->item & RBF_MESH_BORDER && c->dhr ? scale_outside(c, at->item & ~RBF_MESH_BORDER, at->weight, incident, dhr) : 1;
}

void rbf_site_limit(rbf_site *site, const rbf_spot *at)
{
	site->scale = rbf_site_scale(site->component, at, site->incident);
}

void rbf_site_locate(const rbf_component *component, const float incident[3], rbf_site *site)
{
	rbf_spot at;
	rbf_site_turn(component, incident, site);
	rbf_site_find(site, &at);
	rbf_site_settle(site, &at);
	rbf_site_limit(site, &at);
}

void rbf_site_fold(const rbf_site *site, const float exitant[3], float folded[3])
{
	if (site->component->mesh.symmetry == RBF_ISOTROPIC) {
		folded[0] = site->cosine*exitant[0] + site->sine*exitant[1];
		folded[1] = site->cosine*exitant[1] - site->sine*exitant[0];
		folded[2] = exitant[2];
	} else
		rbf_mirror(site->op, exitant, folded);
}

void rbf_component_dhr(const rbf_component *c, const float incident[3], float value[3])
{
	rbf_site site;
	uint32_t corner[3];
	float weight[3];
	if (rbf_dhr_quick(c, incident, value))
		return;
	rbf_site_turn(c, incident, &site);
	const uint32_t item = rbf_mesh_search(&c->mesh, site.incident, corner, weight);
	if (item & RBF_MESH_BORDER)
		scale_outside(c, item & ~RBF_MESH_BORDER, weight, site.incident, value);
	else
		rbf_dhr_inside(c, item, weight, value);
	for (uint32_t n = 0; n < c->channels; n++)
		value[n] /= rbf_max(site.incident[2], RBF_DHR_Z);
}

void rbf_component_dhr_quick(const rbf_component *c, const float incident[3], float value[3])
{
	if (!c->dhr_grid || !rbf_dhr_from_grid(c, incident, value))
		rbf_component_dhr(c, incident, value);
}
