/* SPDX-License-Identifier: BSD-3-Clause */
#include "carrier.h"
#include "resample.h"

#include <math.h>
#include <omp.h>
#include <string.h>

void bsdfrbf_resample_defaults(bsdfrbf_resample_options *options)
{
	memset(options, 0, sizeof *options);
	options->size = sizeof *options;
	options->error = .03;
}

int rbf_resample_threads(const bsdfrbf_resample_options *options)
{
	return options->threads > 0 ? options->threads : omp_get_max_threads();
}

bsdfrbf_status rbf_resample_check(bsdfrbf_context *context, const bsdfrbf_model *model,
	const bsdfrbf_resample_options *options, const char *who, unsigned *wanted)
{
	*wanted = 0;
	if (!model || !options || options->size != sizeof *options)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: no model or no options (see bsdfrbf_resample_defaults)", who);
	if (!options->path && !options->write)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: no path and no function to write to", who);
	if (options->threads < 0 || options->components > 15 || !(options->error >= 0 && options->error <= 1)
			|| !(options->cull >= 0 && options->cull < 100))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: an option is out of its range", who);
	if (options->embed && options->link)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: either carry the interpolant or point to it, not both", who);
	if ((options->embed || options->link) && !model->mapping)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: a model can be carried, or pointed to, once it was saved and opened", who);
	if (options->link && (!*options->link || strlen(options->link) >= RBF_CARRIER_PATH))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: the path to point to is empty or too long", who);
	for (unsigned n = 0; n < 4; n++)
		if (model->component[n].present && (!options->components || options->components >> n & 1))
			*wanted |= 1u << n;
	if (!*wanted)
		return rbf_fail(context, BSDFRBF_ERR_UNSUPPORTED, "%s: the model has none of the components that are asked for", who);
	return BSDFRBF_OK;
}

void rbf_resample_site(const rbf_component *component, const float incident[3], double share, rbf_site *site,
	double dhr[3], rbf_exitant *exitant)
{
	float value[3] = {0};
	rbf_site_locate(component, incident, site);
	rbf_component_dhr(component, incident, value);
	for (uint32_t n = 0; n < component->channels; n++) {
		dhr[n] = fmax((double)value[n], 0);
		exitant->spread[n] = (float)(share * (dhr[n] + (double)component->lambertian[n]) / RBF_PI);
	}
	exitant->energy = fmax(dhr[rbf_luminance(component->channels)], 1e-9);
}

void rbf_resample_points(int n, double at[], double weight[])
{
	for (int i = 0; i < n; i++) {
		double x = cos(RBF_PI * (i + .75) / (n + .5)), slope = 1;
		for (int step = 0; step < 8; step++) { /* Newton's method on the polynomial of degree n */
			double p = x, below = 1;
			for (int k = 2; k <= n; k++) {
				const double next = ((2*k - 1) * x * p - (k - 1) * below) / k;
				below = p;
				p = next;
			}
			slope = n * (x * p - below) / (x * x - 1);
			x -= p / slope;
		}
		at[i] = .5 - .5 * x;
		weight[i] = 1 / ((1 - x * x) * slope * slope);
	}
}

double rbf_resample_correction(double dhr, double integral)
{
	const double factor = integral > 0 ? dhr / integral : 1;
	return factor > .5 && factor < 2 ? factor : 1;
}
