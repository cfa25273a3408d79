/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "incidence.h"

#include <string.h>

enum { MANY = 4 }; /* samples that are quicker drawn together */

_Static_assert(sizeof(rbf_incidence) <= sizeof(bsdfrbf_incidence), "the public type has too little room");
_Static_assert(_Alignof(rbf_incidence) <= _Alignof(bsdfrbf_incidence), "the public type is not aligned");

void rbf_side_set(const bsdfrbf_model *model, const float incident[3], int transmit, rbf_side *s)
{
	s->model = model;
	s->located = s->limited = s->ready = s->known = s->measured = 0;
	s->below = (incident[2] < 0) != (transmit != 0);
	s->component = rbf_query_incident(model, incident, transmit, s->local, &s->swapped);
}

/* The site without its scale. */
static const rbf_site *place_of(rbf_side *s)
{
	if (!s->located) {
		rbf_site_turn(s->component, s->local, &s->site);
		rbf_site_find(&s->site, &s->spot);
		rbf_site_settle(&s->site, &s->spot);
	}
	s->located = 1;
	return &s->site;
}

static const rbf_site *site_of(rbf_side *s)
{
	place_of(s);
	if (!s->limited)
		rbf_site_limit(&s->site, &s->spot);
	s->limited = 1;
	return &s->site;
}

void rbf_side_eval(rbf_side *s, const float outgoing[3], float *value)
{
	const float exitant[3] = {outgoing[0], outgoing[1], fabsf(outgoing[2])};
	float v[3] = {0, 0, 0};
	if (s->component && exitant[2] > 0) {
		if (s->swapped) {
			rbf_site reverse;
			rbf_site_locate(s->component, exitant, &reverse);
			rbf_site_eval(&reverse, s->local, v);
		} else
			rbf_site_eval(site_of(s), exitant, v);
	}
	memcpy(value, v, s->model->channels * sizeof *value);
}

void rbf_side_eval_width(rbf_side *s, const float outgoing[3], float *value)
{
	const float exitant[3] = {outgoing[0], outgoing[1], fabsf(outgoing[2])};
	if (!s->component || s->swapped || s->model->channels != 1 || !(exitant[2] > 0)) {
		rbf_side_eval(s, outgoing, value);
		return;
	}
	*value = rbf_site_eval_width(site_of(s), exitant, s->width);
	memcpy(s->exitant, exitant, sizeof exitant);
	s->measured = 1;
}

void rbf_side_dhr(rbf_side *s, float *value)
{
	if (!s->known) {
		memset(s->dhr, 0, sizeof s->dhr);
		if (s->component && s->swapped)
			rbf_reciprocal_dhr(s->model, s->component, s->local, s->dhr);
		else if (s->component)
			rbf_component_dhr_quick(s->component, s->local, s->dhr);
		s->known = 1;
	}
	memcpy(value, s->dhr, s->model->channels * sizeof *value);
}

static const rbf_sampler *sampler_of(rbf_side *s)
{
	if (!s->ready)
		rbf_sides_prepare(1, s);
	return &s->sampler;
}

void rbf_sides_prepare(uint32_t sides, rbf_side side[])
{
	int wanted[RBF_SIDES], open[RBF_SIDES];
	const rbf_draws *draws[RBF_SIDES];
	for (uint32_t n = 0; n < sides; n++) {
		wanted[n] = side[n].component && !side[n].swapped;
		open[n] = wanted[n] && !side[n].located;
		if (open[n])
			rbf_site_turn(side[n].component, side[n].local, &side[n].site);
	}
	for (uint32_t n = 0; n < sides; n++) {
		if (open[n])
			rbf_site_find(&side[n].site, &side[n].spot);
		if (wanted[n])
			draws[n] = rbf_draws_at(side[n].model, side[n].component, side[n].spot.item);
		if (wanted[n] && draws[n])
			rbf_draws_fetch(draws[n]);
	}
	for (uint32_t n = 0; n < sides; n++)
		if (open[n])
			rbf_site_settle(&side[n].site, &side[n].spot);
	for (uint32_t n = 0; n < sides; n++)
		if (wanted[n]) {
			rbf_sampler_set(&side[n].site, draws[n], side[n].spot.weight, &side[n].sampler);
			side[n].located = side[n].ready = 1;
		}
}

int rbf_side_sample(rbf_side *s, double u, float outgoing[3])
{
	int drawn = 0;
	if (!s->component) {
		outgoing[0] = outgoing[1] = outgoing[2] = 0;
		return 0;
	}
	if (s->swapped)
		drawn = rbf_reciprocal_sample(s->model, s->component, s->local, u, outgoing);
	else {
		const rbf_sampler *sampler = sampler_of(s);
		drawn = rbf_site_sample(&s->site, sampler, u, outgoing);
	}
	if (s->below)
		outgoing[2] = -outgoing[2];
	return drawn;
}

size_t rbf_side_sample_many(rbf_side *s, size_t count, const double *u, float outgoing[][3])
{
	size_t drawn = 0;
	if (count < MANY || !s->component || s->swapped) {
		for (size_t i = 0; i < count; i++)
			drawn += (size_t)rbf_side_sample(s, u[i], outgoing[i]);
		return drawn;
	}
	const rbf_sampler *sampler = sampler_of(s);
	drawn = rbf_site_sample_many(&s->site, sampler, count, u, outgoing);
	for (size_t i = 0; i < count && s->below; i++)
		outgoing[i][2] = -outgoing[i][2];
	return drawn;
}

void rbf_side_add_lambertian(const rbf_side *s, float scale, float *value)
{
	for (uint32_t n = 0; s->component && n < s->model->channels; n++)
		value[n] += scale * s->component->lambertian[n];
}

void rbf_incidence_set(const bsdfrbf_model *model, const float incident[3], rbf_incidence *at)
{
	at->model = model;
	memcpy(at->incident, incident, sizeof at->incident);
	at->set[0] = at->set[1] = 0;
}

static rbf_side *side_at(rbf_incidence *at, int transmit)
{
	rbf_side *s = &at->side[transmit != 0];
	if (!at->set[transmit != 0])
		rbf_side_set(at->model, at->incident, transmit, s);
	at->set[transmit != 0] = 1;
	return s;
}

/* The side that an outgoing vector is on, and that vector made unit; NULL: the vector has no length or lies in the surface. */
static rbf_side *side_towards(rbf_incidence *at, const float outgoing[3], float unit[3])
{
	memcpy(unit, outgoing, 3 * sizeof *unit);
	if (!(rbf_normalize(unit) > 0) || unit[2] == 0)
		return NULL;
	return side_at(at, (at->incident[2] < 0) != (unit[2] < 0));
}

static rbf_side *scatter(rbf_incidence *at, const float outgoing[3], int width, float *value)
{
	float unit[3];
	rbf_side *s = side_towards(at, outgoing, unit);
	for (uint32_t n = 0; n < at->model->channels; n++)
		value[n] = 0;
	if (s && width)
		rbf_side_eval_width(s, unit, value);
	else if (s)
		rbf_side_eval(s, unit, value);
	return s;
}

float rbf_incidence_pdf(rbf_incidence *at, const float outgoing[3])
{
	const uint32_t y = rbf_luminance(at->model->channels);
	float value[3], dhr[3], unit[3];
	rbf_side *s = side_towards(at, outgoing, unit);
	if (!s)
		return 0;
	rbf_side_eval(s, unit, value);
	rbf_side_dhr(s, dhr);
	return dhr[y] > 0 ? value[y] * fabsf(unit[2]) / dhr[y] : 0;
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
					const float amplitude = site->part[k] * luminance[b].a[i], kappa = c->block[b].k[i];
					if (!(amplitude > 0) || !(kappa > 0))
						continue;
					w->weight += (double)(amplitude / kappa);
					w->kappa += (double)amplitude;
				}
		}
}

/* A Gaussian lobe of concentration kappa is nearly constant over a disc of half its sigma, and gone beyond 1.5 sigma. */
void rbf_incidence_resolution(rbf_incidence *at, const float *outgoing, int transmit, float *smallest, float *largest)
{
	width w = {0, 0};
	float exitant[3], folded[3], sum[2];
	double cosine = 1;
	rbf_side *s = outgoing ? side_towards(at, outgoing, exitant) : side_at(at, transmit);
	if (s && s->component && outgoing) {
		rbf_site reverse;
		const rbf_site *site = &reverse;
		exitant[2] = fabsf(exitant[2]);
		if (s->swapped)
			rbf_site_locate(s->component, exitant, &reverse);
		else
			site = place_of(s);
		if (s->measured && !memcmp(exitant, s->exitant, sizeof exitant))
			memcpy(sum, s->width, sizeof sum);
		else {
			rbf_site_fold(site, s->swapped ? s->local : exitant, folded);
			rbf_site_width(site, folded, sum);
		}
		w.weight = (double)sum[0];
		w.kappa = (double)sum[1];
		cosine = fmax((double)(s->swapped ? s->local[2] : exitant[2]), .05);
	} else if (s && s->component)
		collect_all(place_of(s), &w);
	const double kappa = w.weight > 0 ? fmax(w.kappa / w.weight, .5) : .5;
	*smallest = (float)fmin(cosine * RBF_PI * .25 / kappa, RBF_PI);
	*largest = (float)fmin(cosine * RBF_PI * 2.25 / kappa, RBF_PI);
}

static rbf_incidence *inside(bsdfrbf_incidence *at)
{
	return (rbf_incidence *)(void *)at;
}

void bsdfrbf_prepare(const bsdfrbf_model *model, const float incident[3], bsdfrbf_incidence *at)
{
	rbf_incidence_set(model, incident, inside(at));
}

void bsdfrbf_incidence_eval(bsdfrbf_incidence *at, const float outgoing[3], float *value)
{
	const rbf_side *s = scatter(inside(at), outgoing, 0, value);
	if (s)
		rbf_side_add_lambertian(s, (float)(1 / RBF_PI), value);
}

void bsdfrbf_incidence_eval_scatter(bsdfrbf_incidence *at, const float outgoing[3], float *value)
{
	scatter(inside(at), outgoing, 1, value);
}

void bsdfrbf_incidence_dhr(bsdfrbf_incidence *at, int transmit, float *value)
{
	rbf_side *s = side_at(inside(at), transmit);
	rbf_side_dhr(s, value);
	rbf_side_add_lambertian(s, 1, value);
}

void bsdfrbf_incidence_dhr_scatter(bsdfrbf_incidence *at, int transmit, float *value)
{
	rbf_side_dhr(side_at(inside(at), transmit), value);
}

int bsdfrbf_incidence_sample(bsdfrbf_incidence *at, int transmit, double u, float outgoing[3])
{
	return rbf_side_sample(side_at(inside(at), transmit), u, outgoing);
}

float bsdfrbf_incidence_pdf(bsdfrbf_incidence *at, const float outgoing[3])
{
	return rbf_incidence_pdf(inside(at), outgoing);
}

void bsdfrbf_incidence_resolution(bsdfrbf_incidence *at, const float *outgoing, int transmit, float *smallest, float *largest)
{
	rbf_incidence_resolution(inside(at), outgoing, transmit, smallest, largest);
}
