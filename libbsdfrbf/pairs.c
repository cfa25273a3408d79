/* SPDX-License-Identifier: BSD-3-Clause */
#include "pairs.h"
#include "evaluate.h"

_Static_assert(RBF_PAIRS_ABREAST == RBF_KERNEL_SUMS && RBF_PAIRS_MOST % RBF_PAIRS_ABREAST == 0, "whole groups");

/* Whether pairs can be treated that way. Numbers of cell entries are gathered as signed ones. */
static int suits(const rbf_component *c)
{
	return c->cull && !c->residual && c->mesh.elements && c->mesh.cell_entries <= INT32_MAX;
}

/* What rbf_pairs_find_avx512() leaves to be done. */
static void locate(const rbf_component *c, rbf_pair *p)
{
	rbf_spot at = {p->item, {p->weight[0], p->weight[1], p->weight[2]}};
	if (p->item == RBF_MESH_NO_ELEMENT) {
		uint32_t corner[3];
		p->item = at.item = rbf_mesh_search(&c->mesh, p->incident, corner, at.weight);
		memcpy(p->weight, at.weight, sizeof at.weight);
	}
	p->tune = c->tune ? rbf_site_tune(c, &at) : 1;
	p->scale = rbf_site_scale(c, &at, p->incident) / rbf_max(p->exitant[2], RBF_HORIZON_Z);
}

/* A list of pairs, and where their values go. */
typedef struct list {
	const bsdfrbf_model *model;
	const float *incident, *outgoing;
	float *values;
} list;

static void eval_alone(const list *l, uint32_t n)
{
	bsdfrbf_eval(l->model, l->incident + 3*n, l->outgoing + 3*n, l->values + n * l->model->channels);
}

/* Pairs that one component answers; there is room for RBF_PAIRS_MOST. */
static void eval_pairs(const list *l, const rbf_component *c, uint32_t count, rbf_pair *pair)
{
	rbf_kernel_frame frame[RBF_PAIRS_MOST / RBF_PAIRS_ABREAST][RBF_MAX_FRAMES];
	const rbf_kernel_lobes lobes = {c->block, c->amplitude, c->blocks, c->channels, 1};
	const uint32_t groups = (count + RBF_PAIRS_ABREAST - 1) / RBF_PAIRS_ABREAST;
	uint32_t most[RBF_PAIRS_MOST / RBF_PAIRS_ABREAST];
	for (uint32_t n = count; n < RBF_PAIRS_MOST; n++)
		pair[n] = pair[0];
	rbf_pairs_find_avx512(c, pair);
	for (uint32_t n = 0; n < groups * RBF_PAIRS_ABREAST; n++)
		locate(c, &pair[n]);
	for (uint32_t g = 0; g < groups; g++)
		most[g] = rbf_pairs_jobs_avx512(c, pair + g * RBF_PAIRS_ABREAST, frame[g]);
	for (uint32_t g = 0; g < groups; g++) {
		float sum[RBF_PAIRS_ABREAST][3];
		if (most[g] <= RBF_CULL_BITS)
			rbf_kernel_frames_avx512(frame[g], c->frames, &lobes, sum);
		for (uint32_t n = 0; n < RBF_PAIRS_ABREAST && g * RBF_PAIRS_ABREAST + n < count; n++) {
			const rbf_pair *p = &pair[g * RBF_PAIRS_ABREAST + n];
			if (most[g] > RBF_CULL_BITS)
				eval_alone(l, p->index);
			else
				for (uint32_t k = 0; k < c->channels; k++)
					l->values[p->index * c->channels + k] = sum[n][k] * p->scale + (float)(1 / RBF_PI) * c->lambertian[k];
		}
	}
}

void rbf_pairs_eval(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing, float *values)
{
	const list l = {model, incident, outgoing, values};
	rbf_pair pair[4][RBF_PAIRS_MOST];
	uint32_t pairs[4] = {0, 0, 0, 0};
	for (uint32_t n = 0; n < count; n++) {
		rbf_query q;
		if (!rbf_query_pair(model, incident + 3*n, outgoing + 3*n, &q) || !suits(q.component)) {
			eval_alone(&l, n);
			continue;
		}
		const size_t k = (size_t)(q.component - model->component);
		rbf_pair *p = &pair[k][pairs[k]++];
		memcpy(p->incident, q.incident, sizeof q.incident);
		memcpy(p->exitant, q.exitant, sizeof q.exitant);
		p->incident[3] = p->exitant[3] = 0;
		p->index = n;
	}
	for (int k = 0; k < 4; k++)
		if (pairs[k])
			eval_pairs(&l, &model->component[k], pairs[k], pair[k]);
}
