/* SPDX-License-Identifier: BSD-3-Clause */
#include "arrays.h"

#include <stdlib.h>
#include <sys/mman.h>

bsdfrbf_model *rbf_model_new(void)
{
	static atomic_uint_fast64_t models;
	bsdfrbf_model *model = calloc(1, sizeof *model);
	if (!model)
		return NULL;
	model->serial = atomic_fetch_add(&models, 1) + 1;
	model->late = calloc(1, sizeof *model->late);
	if (!model->late) {
		free(model);
		return NULL;
	}
	return model;
}

void rbf_component_free(rbf_component *component)
{
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		free((void *)rbf_array_get(component, row));
	memset(component, 0, sizeof *component);
}

static void free_late(rbf_late *late)
{
	for (int side = 0; side < 2; side++) {
		rbf_reciprocal *r = atomic_load_explicit(&late->reciprocal[side], memory_order_acquire);
		for (uint32_t n = 0; r && n < r->grid.first[r->grid.rings]; n++)
			free(atomic_load_explicit(&r->cell[n], memory_order_acquire));
		free(r);
	}
	for (int i = 0; i < 4; i++) {
		rbf_kept_draws *kept = atomic_load_explicit(&late->draws[i], memory_order_acquire);
		for (size_t n = 0; kept && n < kept->items; n++)
			free(atomic_load_explicit(&kept->of[n], memory_order_acquire));
		free(kept);
	}
	free(late);
}

void bsdfrbf_close(bsdfrbf_model *model)
{
	if (!model)
		return;
	if (model->mapping) {
		munmap(model->mapping, model->mapping_bytes);
		for (int i = 0; i < 4; i++)
			free(model->made[i]);
	} else {
		for (int i = 0; i < 4; i++)
			rbf_component_free(model->component + i);
		free(model->text);
	}
	free_late(model->late);
	free(model);
}

int bsdfrbf_has(const bsdfrbf_model *model, bsdfrbf_component component)
{
	return model && (unsigned)component < 4 && model->component[component].present;
}

int bsdfrbf_channels(const bsdfrbf_model *model)
{
	return model ? (int)model->channels : 0;
}

void bsdfrbf_lambertian(const bsdfrbf_model *model, bsdfrbf_component component, float *value)
{
	const int channels = bsdfrbf_channels(model);
	/* A transmission side that was not measured is served from the other one by reciprocity, and a constant f is its
	 * own reciprocal. */
	if (component == BSDFRBF_TF && !bsdfrbf_has(model, BSDFRBF_TF))
		component = BSDFRBF_TB;
	else if (component == BSDFRBF_TB && !bsdfrbf_has(model, BSDFRBF_TB))
		component = BSDFRBF_TF;
	const int has = bsdfrbf_has(model, component);
	for (int i = 0; i < channels; i++)
		value[i] = has ? model->component[component].lambertian[i] : 0;
}
