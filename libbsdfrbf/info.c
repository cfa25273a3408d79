/* SPDX-License-Identifier: BSD-3-Clause */
/* Facts about a model, for people and their tools. */
#include "energy.h"
#include "expect.h"
#include "map.h"

#include <stdlib.h>
#include <string.h>

#define TEXT_MAX 65535
#define ALL_TEXT_MAX (1u << 20) /* as the record allows */

static const char *symmetry_text(const rbf_component *c)
{
	if (c->facts.symmetry_text[0])
		return c->facts.symmetry_text;
	switch (c->mesh.symmetry) {
	case RBF_ISOTROPIC: return "isotropic";
	case RBF_QUADRILATERAL: return "quadrilateral";
	case RBF_BILATERAL_X: return "bilateral, mirror x";
	case RBF_BILATERAL_Y: return "bilateral, mirror y";
	case RBF_UP: return "repeats after 180 degrees";
	case RBF_ANISOTROPIC: return "anisotropic";
	}
	return "unknown";
}

bsdfrbf_status bsdfrbf_get_component_info(const bsdfrbf_model *model, bsdfrbf_component component,
	bsdfrbf_component_info *info)
{
	if (!info || !bsdfrbf_has(model, component))
		return BSDFRBF_ERR_ARGUMENT;
	const rbf_component *c = model->component + component;
	memset(info, 0, sizeof *info);
	info->excess = rbf_energy_excess(model, (int)component, NULL, NULL);
	info->expected_error = rbf_expected_mean(c);
	info->symmetry = c->mesh.symmetry == RBF_BILATERAL_X || c->mesh.symmetry == RBF_BILATERAL_Y ? 'B'
		: (char)c->mesh.symmetry;
	info->symmetry_text = symmetry_text(c);
	info->incidences = (int)c->mesh.bases;
	info->vertices = (int)c->mesh.vertices;
	info->triangles = (int)c->mesh.elements;
	info->edges = (int)c->edges;
	info->frames = (int)c->frames;
	for (uint32_t f = 0; f < c->frames; f++) {
		info->frame_name[f] = rbf_map_name(c->frame[f]);
		info->frame_share[f] = c->facts.frame_share[f];
		info->frame_learned[f] = rbf_map_learned(c->frame[f]);
		info->frame_limit[f] = c->limited && c->frame[f] != RBF_MAP_FIXED ? c->limit[f] : 0;
		if (info->frame_learned[f])
			memcpy(info->frame_beam[f], c->linear[f].row, sizeof info->frame_beam[f]);
	}
	info->even = .5f * (float)c->even;
	info->tuned = (int)c->tuned;
	info->filled = .001f * (float)c->filled;
	info->mirrored = .001f * (float)c->mirrored;
	info->residual = (int)c->residual;
	info->residual_deg = c->facts.residual_deg;
	info->fit_error = c->facts.fit_error;
	info->loo_error = c->facts.loo_error;
	info->asymmetry = c->facts.asymmetry;
	int op[4];
	const int ops = rbf_symmetry_ops(c->mesh.symmetry, op);
	info->mirror_x = info->mirror_y = info->half_turn = c->mesh.symmetry == RBF_ISOTROPIC;
	for (int n = 0; n < ops; n++) {
		info->mirror_x |= op[n] == RBF_OP_X;
		info->mirror_y |= op[n] == RBF_OP_Y;
		info->half_turn |= op[n] == RBF_OP_XY;
	}
	for (uint32_t i = 0; i < c->mesh.bases; i++) {
		const rbf_base_info *base = c->base_info + i;
		const float theta = atan2f(hypotf(base->direction[0], base->direction[1]), base->direction[2]);
		info->lobes += base->lobes;
		info->theta_max_deg = fmaxf(info->theta_max_deg, theta * (float)(180 / RBF_PI));
	}
	return BSDFRBF_OK;
}

bsdfrbf_status bsdfrbf_get_incidence_info(const bsdfrbf_model *model, bsdfrbf_component component, int index,
	bsdfrbf_incidence_info *info)
{
	if (!info || !bsdfrbf_has(model, component))
		return BSDFRBF_ERR_ARGUMENT;
	const rbf_component *c = model->component + component;
	if (index < 0 || (uint32_t)index >= c->mesh.bases)
		return BSDFRBF_ERR_ARGUMENT;
	const rbf_base_info *base = c->base_info + index;
	memcpy(info->direction, base->direction, sizeof info->direction);
	info->lobes = (int)base->lobes;
	info->dhr = base->dhr;
	info->fit_error = base->fit_error;
	info->loo_error = base->loo_error;
	info->expected_error = base->expected > 0 ? base->expected : -1;
	info->total = rbf_energy_total(model, (int)component, (uint32_t)index);
	return BSDFRBF_OK;
}

/* The text of `key` within "key\0value\0key\0value\0...", or NULL. */
static char *find_text(const bsdfrbf_model *model, const char *key)
{
	char *at = model->text, *const end = at ? at + model->text_bytes : NULL;
	while (at < end) {
		char *value = at + strlen(at) + 1;
		if (strcmp(at, key) == 0)
			return value;
		at = value + strlen(value) + 1;
	}
	return NULL;
}

const char *bsdfrbf_get_text(const bsdfrbf_model *model, const char *key)
{
	const char *text = model && key ? find_text(model, key) : NULL;
	return text ? text : "";
}

bsdfrbf_status bsdfrbf_set_text(bsdfrbf_context *context, bsdfrbf_model *model, const char *key, const char *text)
{
	if (!model || !key || !*key || !text)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_set_text: no model, key or text");
	if (model->mapping)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_set_text: a model that was opened cannot be changed");
	const size_t key_bytes = strlen(key) + 1, text_bytes = strlen(text) + 1;
	if (key_bytes > TEXT_MAX || text_bytes > TEXT_MAX + 1 || key_bytes + text_bytes > ALL_TEXT_MAX - model->text_bytes)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_set_text: the text \"%.40s\" is too long", key);
	char *all = malloc(model->text_bytes + key_bytes + text_bytes);
	if (!all)
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "bsdfrbf_set_text: out of memory");
	/* Everything but the old text of this key, then the new one. */
	size_t bytes = 0;
	for (const char *at = model->text, *end = at ? at + model->text_bytes : NULL; at < end;) {
		const size_t one = strlen(at) + 1, pair = one + strlen(at + one) + 1;
		if (strcmp(at, key) != 0) {
			memcpy(all + bytes, at, pair);
			bytes += pair;
		}
		at += pair;
	}
	memcpy(all + bytes, key, key_bytes);
	memcpy(all + bytes + key_bytes, text, text_bytes);
	free(model->text);
	model->text = all;
	model->text_bytes = (uint32_t)(bytes + key_bytes + text_bytes);
	return BSDFRBF_OK;
}
