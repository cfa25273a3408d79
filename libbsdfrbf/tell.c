/* SPDX-License-Identifier: BSD-3-Clause */
#include "tell.h"
#include "coarse_peak.h"
#include "uneven.h"

#include <stdlib.h>

bsdfrbf_status rbf_tell_coarse(bsdfrbf_context *context, rbf_job *j, const rbf_base_info *info)
{
	static const float MUCH = .3f, MOST = .5f; /* that fits miss; of an incidence's light */
	const uint32_t bases = j->fitted.bases;
	uint32_t count = 0, first = 0;
	float apart = 0;
	double theta, phi;
	j->coarse = calloc((size_t)bases + 1, 1);
	if (!j->coarse)
		return rbf_out_of_memory(context);
	for (uint32_t b = 0; b < bases && !j->measured.ready; b++) {
		float gap;
		if (!(j->missed[b] > MUCH))
			continue;
		const float light = rbf_coarse_peak(&j->measured, j->channels, info[b].direction, j->symmetry.symmetry == RBF_ISOTROPIC, &gap);
		if (light < 0)
			return rbf_out_of_memory(context);
		if (!(light > MOST * info[b].dhr))
			continue;
		j->coarse[b] = 1;
		j->missed[b] = fmaxf(j->missed[b], fminf(light / info[b].dhr, 1));
		first = count++ ? first : b;
		apart = fmaxf(apart, gap);
	}
	if (!count)
		return BSDFRBF_OK;
	rbf_job_angles(j->direction + 3*first, &theta, &phi);
	rbf_warn(context, "%s: at %u of %u incidences, the first at theta %.1f phi %.1f, most light stands on a single sample: a peak is narrower than samples are "
		"apart (%.1f degrees), and how much light it has is a guess: measure around it in steps of a third of its width", j->name, count, bases, theta, phi,
		(double)apart);
	return BSDFRBF_OK;
}

static void tell_scale(bsdfrbf_context *context, const rbf_job *j)
{
	for (uint32_t b = 0; b < j->fitted.bases && j->scale; b++) {
		const double times = (double)j->scale[b];
		double theta, phi;
		if (j->coarse[b] || !(times < 1 || times > 1))
			continue;
		rbf_job_angles(j->direction + 3*b, &theta, &phi);
		rbf_warn(context, "%s: incidence theta %.1f phi %.1f sends %.*f times the light that those around it tell; it is kept as measured: check "
			"its scale, measure it again, or leave it out", j->name, theta, phi, times < .095 ? 3 : times < 9.5 ? 1 + (times < .95) : 0, times);
	}
}

/* Frames that turn back x or y, or both, for nearly all that moves at all, are rare materials, and a common mistake. */
static void tell_turned_back(bsdfrbf_context *context, const rbf_job *j)
{
	static const float NEARLY = .9f, SOME = .1f;
	float back = 0, flipped = 0, all = 0;
	for (uint32_t f = 0; f < j->choice.frames; f++) {
		const unsigned map = j->fitted.candidate[j->choice.frame[f]].map;
		const float *along = rbf_map_get(map)->along, share = j->choice.share[f];
		const int turns = !rbf_map_learned(map) && rbf_map_get(map)->kind != RBF_KIND_HALF;
		all += map == RBF_MAP_FIXED ? 0 : share;
		back += turns && along[0] > 0 && along[1] > 0 ? share : 0;
		flipped += turns && along[0] * along[1] < 0 ? share : 0;
	}
	if (j->measured.ready || !(all > SOME))
		return;
	if (back > NEARLY * all)
		rbf_warn(context, "%s: nearly all light that moves with the source goes back towards it: if the material is no retro-reflector, "
			"azimuths of incidence were counted from the other side: add 180 to #inphi", j->name);
	else if (flipped > NEARLY * all)
		rbf_warn(context, "%s: nearly all light turns about the normal the other way round than the source: if no facets of the material send "
			"back x or y, azimuths of incidence were counted the other way round in #inphi", j->name);
}

/* Segments of which both sides tell otherwise, by more than fits miss there. */
static bsdfrbf_status tell_uneven(bsdfrbf_context *context, const rbf_job *j, const rbf_component *c)
{
	static const float MUCH = .1f;
	const rbf_mesh *mesh = &c->mesh;
	float *light = malloc(((size_t)mesh->bases + 1) * sizeof *light), *unknown = malloc(((size_t)mesh->elements + 1) * sizeof *unknown);
	const rbf_vertex *from = NULL, *to = NULL;
	float most = 0;
	int count = 0;
	for (uint32_t b = 0; b < mesh->bases && light; b++)
		light[b] = c->base_info[b].dhr;
	if (light && unknown)
		rbf_uneven(mesh, light, unknown);
	for (uint32_t e = 0; e < mesh->elements && light && unknown && !j->measured.ready; e++) {
		const rbf_vertex *ends[2] = {&mesh->vertex[mesh->element[e].v[0]], &mesh->vertex[mesh->element[e].v[1]]};
		const uint32_t a = ends[0]->base, b = ends[1]->base;
		const float open = fminf(unknown[e], fmaxf(j->choice.base_error[a], j->choice.base_error[b]));
		if (!(open > fmaxf(MUCH, fmaxf(j->missed[a], j->missed[b]))))
			continue;
		count++;
		if (!(open > most))
			continue;
		most = open;
		from = ends[0];
		to = ends[1];
	}
	if (count)
		rbf_warn(context, "%s: light changes unevenly: DHR is %.3f at theta %.1f and %.3f at %.1f, and goes on otherwise on both sides: between these it may be off by "
			"%.0f %%; measure more incidences there (%d of the %u segments are like that)", j->name, (double)light[from->base],
			(double)rbf_polar_angle(from->direction) * 180 / RBF_PI, (double)light[to->base], (double)rbf_polar_angle(to->direction) * 180 / RBF_PI,
			100 * (double)most, count, mesh->elements);
	const int failed = !light || !unknown;
	free(light);
	free(unknown);
	return failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
}

bsdfrbf_status rbf_tell(bsdfrbf_context *context, const rbf_job *j, const rbf_component *c)
{
	uint32_t coarse = 0;
	for (uint32_t b = 0; b < j->fitted.bases; b++)
		coarse += j->coarse[b];
	tell_scale(context, j);
	if (2 * coarse < j->fitted.bases) /* else frames are a guess, too */
		tell_turned_back(context, j);
	return tell_uneven(context, j, c);
}
