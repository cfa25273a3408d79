/* SPDX-License-Identifier: BSD-3-Clause */
/* f(a, b) against f(b, a): how far a measurement is from it, and samples that meet half way. */
#include "measure.h"
#include "model.h"

static const double BEYOND = 10 * RBF_PI / 180; /* past the most grazing incidence samples are left to themselves, step by step */
static const double MOST = 2;                   /* times: more is no error of measurement */

/* Directions of a component's half spaces as the public functions take them. */
static void outside(int component, const double in[3], const double out[3], float incident[3], float outgoing[3])
{
	const int back = component & 1, transmit = component >= BSDFRBF_TF;
	for (int n = 0; n < 3; n++) {
		incident[n] = (float)(n == 2 && back ? -in[n] : in[n]);
		outgoing[n] = (float)(n == 2 && back != transmit ? -out[n] : out[n]);
	}
}

/* Whether both directions of a pair were measured. */
static int known(const bsdfrbf_model *model, int component)
{
	const int other = component < BSDFRBF_TF ? component : BSDFRBF_TF + BSDFRBF_TB - component;
	return model->component[component].present && model->component[other].present;
}

/* Largest polar angle of the incidences that a component's exitant directions are asked as. */
static double most_grazing(const bsdfrbf_model *model, int component)
{
	const rbf_component *c = &model->component[component < BSDFRBF_TF ? component : BSDFRBF_TF + BSDFRBF_TB - component];
	float most = 0;
	for (uint32_t b = 0; b < c->mesh.bases; b++)
		most = fmaxf(most, rbf_polar_angle(c->base_info[b].direction));
	return (double)most;
}

float bsdfrbf_get_reciprocity(const bsdfrbf_model *model, bsdfrbf_component component, int index)
{
	enum { DRAWS = 256 };
	if (!bsdfrbf_has(model, component) || index < 0 || (uint32_t)index >= model->component[component].mesh.bases || !known(model, component))
		return -1;
	const rbf_component *c = &model->component[component];
	const uint32_t y = c->channels == 3;
	const int transmit = component >= BSDFRBF_TF;
	const double lowest = cos(most_grazing(model, component) + 2e-4);
	const double up[3] = {0, 0, 1};
	double d[3], difference = 0, mean = 0;
	float in[3], side[3];
	for (int n = 0; n < 3; n++)
		d[n] = (double)c->base_info[index].direction[n];
	outside(component, d, up, in, side);
	/* half of the directions as the lobes scatter, half even over the projected hemisphere, each weighted by the
	 * density of both together (Veach and Guibas 1995, balance heuristic) */
	for (int n = 0; n < 2 * DRAWS; n++) {
		float out[3], there[3], back[3];
		if (n < DRAWS) {
			if (!bsdfrbf_sample(model, in, transmit, (n + .5) / DRAWS, out))
				continue;
		} else {
			const double u = (n - DRAWS + .5) / DRAWS, phi = 2 * RBF_PI * fmod((n - DRAWS) * .6180339887498949, 1);
			out[0] = (float)(sqrt(u) * cos(phi));
			out[1] = (float)(sqrt(u) * sin(phi));
			out[2] = side[2] * (float)sqrt(1 - u);
		}
		const double cosine = fabs((double)out[2]);
		if (cosine < lowest || cosine < 1e-3)
			continue;
		bsdfrbf_eval(model, in, out, there);
		bsdfrbf_eval(model, out, in, back);
		const double a = (double)there[y], b = (double)back[y];
		const double density = .5 * ((double)bsdfrbf_pdf(model, in, out) + cosine / RBF_PI);
		difference += fabs(a - b) * cosine / density;
		mean += .5 * (a + b) * cosine / density;
	}
	return mean > 0 ? (float)(difference / mean) : 0;
}

bsdfrbf_status bsdfrbf_data_symmetrize(bsdfrbf_context *context, bsdfrbf_data *data, const bsdfrbf_model *model)
{
	if (!data || !model)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_symmetrize: data or model is NULL");
	for (int c = 0; c < 4; c++)
		if (data->component[c].ready)
			return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: comes from a .sir file, whose lobes cannot be made reciprocal; leave out the option, "
				"or give the measurements", rbf_component_name(c));
	const int channels = data->channels;
	for (int c = 0; c < 4; c++) {
		if (!known(model, c))
			continue;
		const double limit = most_grazing(model, c);
		const int64_t count = (int64_t)data->component[c].count;
		#pragma omp parallel for schedule(dynamic)
		for (int64_t b = 0; b < count; b++) {
			rbf_incidence *in = &data->component[c].incidence[b];
			for (size_t i = 0; i < in->count; i++) {
				const double *o = in->outgoing + 3*i;
				const double past = (atan2(hypot(o[0], o[1]), o[2]) - limit) / BEYOND, weight = fmin(fmax(1 - past, 0), 1);
				float incident[3], outgoing[3], there[3], back[3];
				outside(c, in->direction, o, incident, outgoing);
				bsdfrbf_eval(model, incident, outgoing, there);
				bsdfrbf_eval(model, outgoing, incident, back);
				for (int n = 0; n < channels && weight > 0; n++)
					if (there[n] > 0) {
						const double ratio = fmin(fmax((double)back[n] / (double)there[n], 1 / MOST), MOST);
						in->dsf[i * (size_t)channels + (size_t)n] *= (float)(1 + .5 * weight * (ratio - 1));
					}
			}
		}
	}
	return BSDFRBF_OK;
}
