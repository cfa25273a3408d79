/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "disagreement.h"
#include "sample.h"

#include <stdlib.h>

enum { DRAWS = 192 };

/* The middle of an element, and its weights. */
static void middle_of(const rbf_component *c, uint32_t e, float weight[3], float d[3])
{
	const int corners = c->mesh.symmetry == RBF_ISOTROPIC ? 2 : 3;
	d[0] = d[1] = d[2] = 0;
	for (int k = 0; k < 3; k++) {
		const rbf_vertex *vertex = &c->mesh.vertex[rbf_bound(c->mesh.element[e].v[k], c->mesh.vertices)];
		weight[k] = k < corners ? 1.f / (float)corners : 0;
		for (int n = 0; n < 3; n++)
			d[n] += weight[k] * vertex->direction[n];
	}
	rbf_normalize(d);
}

/* One corner of a site alone, as it is carried there. */
static void single_out(const rbf_site *site, uint32_t k, rbf_site *one)
{
	*one = *site;
	for (uint32_t n = 0; n < site->corners; n++) {
		one->weight[n] = n == k;
		one->part[n] = n == k ? site->part[n] / site->weight[n] : 0;
	}
}

/* Directions are drawn from what the corners say together; each corner alone is compared with that. */
float rbf_disagreement(const rbf_component *c, uint32_t element)
{
	const uint32_t y = rbf_luminance(c->channels);
	rbf_site all, one[3];
	rbf_sampler sampler;
	float weight[3], d[3], most = 0;
	double sum[3] = {0, 0, 0};
	int drawn = 0;
	middle_of(c, element, weight, d);
	rbf_site_place(c, element, weight, d, &all);
	rbf_draws *draws = rbf_draws_of_item(c, element);
	rbf_sampler_set(&all, draws, weight, &sampler);
	for (uint32_t k = 0; k < all.corners; k++)
		single_out(&all, k, &one[k]);
	for (int i = 0; i < DRAWS; i++) {
		float o[3], folded[3], together[3], own[3];
		if (!rbf_site_sample(&all, &sampler, (i + .5) / DRAWS, o))
			continue;
		rbf_site_fold(&all, o, folded);
		rbf_site_dsf(&all, folded, together);
		if (!(together[y] > 0))
			continue;
		drawn++;
		for (uint32_t k = 0; k < all.corners; k++) {
			rbf_site_dsf(&one[k], folded, own);
			sum[k] += fabs((double)own[y] / (double)together[y] - 1);
		}
	}
	free(draws);
	for (uint32_t k = 0; k < all.corners && drawn; k++)
		most = rbf_max(most, (float)(sum[k] / drawn));
	return most;
}
