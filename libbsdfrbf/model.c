/* SPDX-License-Identifier: BSD-3-Clause */
#include "arrays.h"

#include <stdlib.h>
#include <sys/mman.h>

bsdfrbf_model *rbf_model_new(void)
{
	return calloc(1, sizeof(bsdfrbf_model));
}

void rbf_component_free(rbf_component *component)
{
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		free((void *)rbf_array_get(component, row));
	memset(component, 0, sizeof *component);
}

void bsdfrbf_close(bsdfrbf_model *model)
{
	if (!model)
		return;
	if (model->mapping) {
		munmap(model->mapping, model->mapping_bytes);
	} else {
		for (int i = 0; i < 4; i++)
			rbf_component_free(model->component + i);
		free(model->text);
	}
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
