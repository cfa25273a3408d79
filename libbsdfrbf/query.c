/* SPDX-License-Identifier: BSD-3-Clause */
/* The public questions about one incident direction: DHR, samples, density, resolution. */
#include "bounds.h"
#include "reciprocal.h"
#include "sample.h"

#include <string.h>

/* Component and direction that answer for an incident vector; *swapped as in rbf_query_side(). */
static const rbf_component *side_of(const bsdfrbf_model *model, const float incident[3], int transmit, float local[3], int *swapped)
{
	memcpy(local, incident, 3 * sizeof *local);
	if (!(rbf_normalize(local) > 0))
		return NULL;
	const rbf_component *c = rbf_query_side(model, local, transmit, swapped);
	local[2] = fabsf(local[2]);
	return c;
}

void bsdfrbf_dhr_scatter(const bsdfrbf_model *model, const float incident[3], int transmit, float *value)
{
	float local[3], v[3];
	int swapped;
	const rbf_component *c = side_of(model, incident, transmit, local, &swapped);
	for (uint32_t n = 0; n < model->channels; n++)
		value[n] = 0;
	if (!c)
		return;
	if (swapped)
		rbf_reciprocal_dhr(model, c, local, v);
	else
		rbf_component_dhr(c, local, v);
	memcpy(value, v, model->channels * sizeof *value);
}

void bsdfrbf_dhr(const bsdfrbf_model *model, const float incident[3], int transmit, float *value)
{
	float local[3];
	int swapped;
	const rbf_component *c = side_of(model, incident, transmit, local, &swapped);
	bsdfrbf_dhr_scatter(model, incident, transmit, value);
	for (uint32_t n = 0; c && n < model->channels; n++)
		value[n] += c->lambertian[n];
}

/* What answers for one incident direction: its place in the mesh, or the direction alone where the sides are swapped. */
typedef struct sampler {
	const bsdfrbf_model *model;
	const rbf_component *component;
	int swapped, below; /* below: outgoing vectors have z < 0 */
	float local[3];
	rbf_site site;
	rbf_sampler draws;
} sampler;

static void sampler_find(const bsdfrbf_model *model, const float incident[3], int transmit, sampler *s)
{
	s->model = model;
	s->component = side_of(model, incident, transmit, s->local, &s->swapped);
	s->below = (incident[2] < 0) != (transmit != 0);
	if (s->component && !s->swapped) {
		rbf_site_locate(s->component, s->local, &s->site);
		rbf_sampler_set(&s->site, &s->draws);
	}
}

static int sampler_draw(const sampler *s, double u, float outgoing[3])
{
	outgoing[0] = outgoing[1] = outgoing[2] = 0;
	if (!s->component)
		return 0;
	const int drawn = s->swapped ? rbf_reciprocal_sample(s->model, s->component, s->local, u, outgoing)
		: rbf_site_sample(&s->site, &s->draws, u, outgoing);
	if (s->below)
		outgoing[2] = -outgoing[2];
	return drawn;
}

int bsdfrbf_sample(const bsdfrbf_model *model, const float incident[3], int transmit, double u, float outgoing[3])
{
	sampler s;
	sampler_find(model, incident, transmit, &s);
	return sampler_draw(&s, u, outgoing);
}

/* 1 if vector i of a list is the one before it. */
static int same_as_last(const float *list, size_t i)
{
	return i && !memcmp(list + 3 * i, list + 3 * (i - 1), 3 * sizeof *list);
}

size_t bsdfrbf_sample_many(const bsdfrbf_model *model, size_t count, const float *incident, int transmit, const double *u,
	float *outgoing)
{
	sampler s;
	size_t drawn = 0;
	for (size_t i = 0; i < count; i++) {
		if (!same_as_last(incident, i))
			sampler_find(model, incident + 3 * i, transmit, &s);
		drawn += (size_t)sampler_draw(&s, u[i], outgoing + 3 * i);
	}
	return drawn;
}

void bsdfrbf_dhr_many(const bsdfrbf_model *model, size_t count, const float *incident, int transmit, float *values)
{
	const size_t n = model->channels;
	for (size_t i = 0; i < count; i++)
		if (same_as_last(incident, i))
			memcpy(values + n * i, values + n * (i - 1), n * sizeof *values);
		else
			bsdfrbf_dhr(model, incident + 3 * i, transmit, values + n * i);
}

/* total: DHR of the incident direction by side, < 0 where not yet known. */
static float density(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float total[2])
{
	float value[3], dhr[3], o[3] = {outgoing[0], outgoing[1], outgoing[2]};
	const uint32_t y = rbf_luminance(model->channels);
	if (!(rbf_normalize(o) > 0))
		return 0;
	const int transmit = (incident[2] < 0) != (o[2] < 0);
	bsdfrbf_eval_scatter(model, incident, o, value);
	if (total[transmit] < 0) {
		bsdfrbf_dhr_scatter(model, incident, transmit, dhr);
		total[transmit] = dhr[y];
	}
	return total[transmit] > 0 ? value[y] * fabsf(o[2]) / total[transmit] : 0;
}

float bsdfrbf_pdf(const bsdfrbf_model *model, const float incident[3], const float outgoing[3])
{
	float total[2] = {-1, -1};
	return density(model, incident, outgoing, total);
}

void bsdfrbf_pdf_many(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *densities)
{
	float total[2] = {-1, -1};
	for (size_t i = 0; i < count; i++) {
		if (!same_as_last(incident, i))
			total[0] = total[1] = -1;
		densities[i] = density(model, incident + 3 * i, outgoing + 3 * i, total);
	}
}

/* Width of what is seen: lobes weighted by their contribution in one direction, or by their energy over all. */
typedef struct width { double weight, kappa; } width;

static void collect_all(const rbf_site *site, width *w)
{
	const rbf_component *c = site->component;
	const rbf_amplitude *luminance = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
	for (uint32_t k = 0; k < site->corners; k++)
		for (uint32_t f = 0; f < c->frames; f++) {
			const rbf_set *set = rbf_bound_set(c, site->base[k] * c->frames + f);
			for (uint32_t b = set->first; b < set->first + set->blocks; b++)
				for (int i = 0; i < RBF_LANES; i++) {
					const float amplitude = site->weight[k] * luminance[b].a[i], kappa = c->block[b].k[i];
					if (!(amplitude > 0) || !(kappa > 0))
						continue;
					w->weight += (double)(amplitude / kappa);
					w->kappa += (double)amplitude;
				}
		}
}

/* A Gaussian lobe of concentration kappa is nearly constant over a disc of half its sigma, and gone beyond 1.5 sigma. */
void bsdfrbf_resolution(const bsdfrbf_model *model, const float incident[3], const float *outgoing, int transmit,
	float *smallest, float *largest)
{
	width w = {0, 0};
	double cosine = 1;
	if (outgoing) {
		rbf_query q;
		if (rbf_query_pair(model, incident, outgoing, &q)) {
			rbf_site site;
			float folded[3];
			rbf_site_locate(q.component, q.incident, &site);
			rbf_site_fold(&site, q.exitant, folded);
			float sum[2];
			rbf_site_width(&site, folded, sum);
			w.weight = (double)sum[0];
			w.kappa = (double)sum[1];
			cosine = fmax((double)q.exitant[2], .05);
		}
	} else {
		float local[3];
		int swapped;
		const rbf_component *c = side_of(model, incident, transmit, local, &swapped);
		if (c) {
			rbf_site site;
			rbf_site_locate(c, local, &site);
			collect_all(&site, &w);
		}
	}
	const double kappa = w.weight > 0 ? fmax(w.kappa / w.weight, .5) : .5;
	*smallest = (float)fmin(cosine * RBF_PI * .25 / kappa, RBF_PI);
	*largest = (float)fmin(cosine * RBF_PI * 2.25 / kappa, RBF_PI);
}
