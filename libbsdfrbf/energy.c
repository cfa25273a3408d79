/* SPDX-License-Identifier: BSD-3-Clause */
#include "energy.h"
#include "coarse_peak.h"

#include <stdio.h>

#define DEGREES (180 / RBF_PI)

static const float MANIFOLD = 5; /* times too much: another unit, not a bad calibration */

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

/* Whether so much light stands on single samples, of a component or of the other that is lit from the same side. *apart: degrees between them.
 * -1 when out of memory. */
static int is_guess(const bsdfrbf_model *model, const bsdfrbf_data *data, int component, const float direction[3], float excess, float *apart)
{
	float sum = 0;
	for (int c = component;; c ^= 2) {
		float gap;
		const float light = rbf_coarse_peak(&data->component[c], data->channels, direction,
			model->component[c].mesh.symmetry == RBF_ISOTROPIC, &gap);
		if (light < 0)
			return -1;
		if (light > sum)
			*apart = gap;
		sum += light;
		if (c != component)
			return sum > excess;
	}
}

bsdfrbf_status rbf_energy_warn(bsdfrbf_context *context, const bsdfrbf_model *model, const bsdfrbf_data *data)
{
	for (int c = 0; c < 4; c++) {
		float worst;
		uint32_t base = 0;
		const rbf_component *own = &model->component[c];
		const int count = own->present ? rbf_energy_excess(model, c, &worst, &base) : 0;
		if (!count)
			continue;
		const float *d = own->base_info[base].direction;
		float apart = 0;
		char remedy[160] = "it is kept as measured: check the measurement's scale";
		if (worst > MANIFOLD)
			snprintf(remedy, sizeof remedy, "it is kept as measured: are the values per cent, or counts of the device? BSDF is per sr, a perfect "
				"diffuser's 1/pi");
		const int guess = is_guess(model, data, c, d, worst - 1, &apart);
		if (guess < 0)
			return rbf_out_of_memory(context);
		if (guess)
			snprintf(remedy, sizeof remedy, "a peak there is narrower than the samples are apart (%.1f degrees), which makes its light a guess: "
				"measure finer at the peak", (double)apart);
		rbf_warn(context, "%s: %s exceeds 1 at %d of %u incidences, most at theta %.1f phi %.1f (%.3f); %s", NAME[c], model->component[c ^ 2].present ? "reflected and transmitted light together" : "DHR",
			count, own->mesh.bases, DEGREES * (double)rbf_polar_angle(d), fmod(DEGREES * atan2((double)d[1], (double)d[0]) + 360, 360), (double)worst, remedy);
	}
	return BSDFRBF_OK;
}
