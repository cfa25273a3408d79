/* SPDX-License-Identifier: BSD-3-Clause */
/* The public questions about one incident direction: DHR, samples, density, resolution. */
#include "incidence.h"

#include <string.h>

/* DHR plus `share` of the Lambertian part. */
static void dhr(const bsdfrbf_model *model, const float incident[3], int transmit, float share, float *value)
{
	float local[3], v[3];
	int swapped;
	const rbf_component *c = rbf_query_incident(model, incident, transmit, local, &swapped);
	if (!c)
		v[0] = v[1] = v[2] = 0;
	else if (swapped)
		rbf_reciprocal_dhr(model, c, local, v);
	else
		rbf_component_dhr_quick(c, local, v);
	value[0] = v[0] + (c ? share * c->lambertian[0] : 0);
	for (uint32_t n = 1; n < model->channels; n++)
		value[n] = v[n] + (c ? share * c->lambertian[n] : 0);
}

void bsdfrbf_dhr_scatter(const bsdfrbf_model *model, const float incident[3], int transmit, float *value)
{
	dhr(model, incident, transmit, 0, value);
}

void bsdfrbf_dhr(const bsdfrbf_model *model, const float incident[3], int transmit, float *value)
{
	dhr(model, incident, transmit, 1, value);
}

/* The side that a thread asked last for samples: many are asked for at one incidence, one by one. */
typedef struct last_side {
	uint64_t model;
	float incident[3];
	int transmit;
	int plain;          /* whether its sampler is ready, and answers */
	float sign;         /* of z of what is drawn */
	rbf_side side;
} last_side;

static int sample_other(const bsdfrbf_model *model, const float incident[3], int transmit, double u, last_side *last, float outgoing[3])
{
	rbf_side *s = &last->side;
	if (last->model != model->serial || last->transmit != transmit || memcmp(last->incident, incident, sizeof last->incident) != 0) {
		rbf_side_set(model, incident, transmit, s);
		memcpy(last->incident, incident, sizeof last->incident);
		last->transmit = transmit;
		last->model = model->serial;
	}
	const int drawn = rbf_side_sample(s, u, outgoing);
	last->plain = s->component && !s->swapped && s->ready;
	last->sign = s->below ? -1 : 1;
	return drawn;
}

int bsdfrbf_sample(const bsdfrbf_model *model, const float incident[3], int transmit, double u, float outgoing[3])
{
	static _Thread_local last_side last;
	uint64_t is[2] = {0, 0}, was[2] = {0, 0};
	memcpy(is, incident, sizeof last.incident);
	memcpy(was, last.incident, sizeof last.incident);
	if ((is[0] ^ was[0]) | (is[1] ^ was[1]) | (last.model ^ model->serial) | (uint64_t)(last.transmit ^ transmit) | !last.plain)
		return sample_other(model, incident, transmit, u, &last, outgoing);
	const int drawn = rbf_site_sample(&last.side.site, &last.side.sampler, u, outgoing);
	outgoing[2] *= last.sign;
	return drawn;
}

/* 1 if vector i of a list is the one before it. */
static int same_as_last(const float *list, size_t i)
{
	return i && !memcmp(list + 3 * i, list + 3 * (i - 1), 3 * sizeof *list);
}

size_t bsdfrbf_sample_many(const bsdfrbf_model *model, size_t count, const float *incident, int transmit, const double *u,
	float *outgoing)
{
	rbf_side side[RBF_SIDES];
	size_t first[RBF_SIDES + 1] = {0}, drawn = 0;
	while (first[0] < count) {
		uint32_t sides = 0;
		for (size_t i = first[0]; i < count && sides < RBF_SIDES; i = first[sides]) {
			rbf_side_set(model, incident + 3 * i, transmit, &side[sides]);
			for (i++; i < count && same_as_last(incident, i); i++)
				;
			first[++sides] = i;
		}
		rbf_sides_prepare(sides, side);
		for (uint32_t n = 0; n < sides; n++)
			drawn += rbf_side_sample_many(&side[n], first[n + 1] - first[n], u + first[n], (float (*)[3])(outgoing + 3 * first[n]));
		first[0] = first[sides];
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

float bsdfrbf_pdf(const bsdfrbf_model *model, const float incident[3], const float outgoing[3])
{
	rbf_incidence at;
	rbf_incidence_set(model, incident, &at);
	return rbf_incidence_pdf(&at, outgoing);
}

void bsdfrbf_pdf_many(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *densities)
{
	rbf_incidence at;
	for (size_t i = 0; i < count; i++) {
		if (!same_as_last(incident, i))
			rbf_incidence_set(model, incident + 3 * i, &at);
		densities[i] = rbf_incidence_pdf(&at, outgoing + 3 * i);
	}
}

void bsdfrbf_resolution(const bsdfrbf_model *model, const float incident[3], const float *outgoing, int transmit,
	float *smallest, float *largest)
{
	rbf_incidence at;
	rbf_incidence_set(model, incident, &at);
	rbf_incidence_resolution(&at, outgoing, transmit, smallest, largest);
}
