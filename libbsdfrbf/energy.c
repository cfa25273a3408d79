/* SPDX-License-Identifier: BSD-3-Clause */
#include "energy.h"
#include "status.h"

#define DEGREES (180 / RBF_PI)

static const char *const NAME[4] = {"front reflection (rf)", "back reflection (rb)", "front transmission (tf)", "back transmission (tb)"};

float rbf_energy_total(const bsdfrbf_model *model, int component, uint32_t base)
{
	const rbf_component *other = &model->component[component ^ 2]; /* reflection and transmission of one side */
	const rbf_base_info *info = &model->component[component].base_info[base];
	float value[3] = {0};
	if (!other->present)
		return info->dhr;
	const uint32_t y = rbf_luminance(other->channels);
	rbf_component_dhr(other, info->direction, value);
	return info->dhr + value[y] + other->lambertian[y];
}

int rbf_energy_excess(const bsdfrbf_model *model, int component, float *worst, uint32_t *base)
{
	int count = 0;
	float most = 0;
	for (uint32_t b = 0; b < model->component[component].mesh.bases; b++) {
		const float total = rbf_energy_total(model, component, b);
		count += total > 1 + BSDFRBF_EXCESS;
		if (!(total > most))
			continue;
		most = total;
		if (base)
			*base = b;
	}
	if (worst)
		*worst = most;
	return count;
}

void rbf_energy_warn(bsdfrbf_context *context, const bsdfrbf_model *model)
{
	for (int c = 0; c < 4; c++) {
		float worst;
		uint32_t base = 0;
		const rbf_component *own = &model->component[c];
		const int count = own->present ? rbf_energy_excess(model, c, &worst, &base) : 0;
		if (!count)
			continue;
		const float *d = own->base_info[base].direction;
		rbf_warn(context, "%s: %s exceeds 1 at %d of %u incidences, most at theta %.1f phi %.1f (%.3f); it is kept as measured: "
			"check the measurement's scale", NAME[c], model->component[c ^ 2].present ? "reflected and transmitted light together" : "DHR",
			count, own->mesh.bases, DEGREES * (double)rbf_polar_angle(d), fmod(DEGREES * atan2((double)d[1], (double)d[0]) + 360, 360), (double)worst);
	}
}
