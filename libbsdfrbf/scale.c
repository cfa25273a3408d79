/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The light of such an incidence stands apart from that of all around it, and from how it goes on to it from beyond each of them. A beam that is only
 * seen from few incidences, as between slats, does that as well, but then it is unlike those around. At the border of what was measured a
 * material may do anything.
 */
#include "scale.h"
#include "moved.h"

#include <stdlib.h>

static const double CLEAR = 2.5;     /* times; a forgotten pi is 3.1 */
static const float LIKE = .9f;       /* of 2: what it differs by from one around it, but for its scale */
static const float LIKE_MOST = 1.3f; /* and where all differ by more than that */
static const float STRAIGHT = .7f;   /* cosine to what lies beyond another incidence */
static const double DARK = 1e-9;     /* as measured, none */

static void direction_of(const rbf_fitted *m, uint32_t base, float d[3])
{
	for (int n = 0; n < 3; n++)
		d[n] = (float)m->direction[3*base + (uint32_t)n];
}

static int on_border(const rbf_mesh *mesh, uint32_t base)
{
	for (uint32_t i = 0; i < mesh->borders; i++)
		for (int k = 0; k < 2; k++)
			if (mesh->vertex[mesh->border[i][k]].base == base)
				return 1;
	return 0;
}

/* ln of the light at a base, at direction d, as it goes on from beyond a vertex next to it; as it is there, if nothing lies beyond. */
static double trend(const rbf_fitted *m, const double light[], uint32_t base, const float d[3], const rbf_vertex *next)
{
	float step[3], most = STRAIGHT;
	double told = light[next->base];
	for (int n = 0; n < 3; n++)
		step[n] = d[n] - next->direction[n];
	const float length = rbf_normalize(step);
	for (uint32_t i = m->neighbour_first[next->base]; i < m->neighbour_first[next->base + 1]; i++) {
		const rbf_vertex *v = &m->neighbour[i];
		float back[3];
		rbf_mirror(next->op, v->direction, back);
		for (int n = 0; n < 3; n++)
			back[n] = next->direction[n] - back[n];
		const float far = rbf_normalize(back), straight = rbf_dot(back, step);
		if (v->base == base || !(straight > most))
			continue;
		most = straight;
		told = light[next->base] + (light[next->base] - light[v->base]) * (double)(length / far);
	}
	return told;
}

/* ln of the scale of one, 0: it is not clear. light: ln of that of all. */
static double stands_apart(const rbf_fitted *m, const double light[], uint32_t base)
{
	double low = INFINITY, high = -INFINITY, mean = 0;
	int around = 0;
	float d[3];
	direction_of(m, base, d);
	for (uint32_t i = m->neighbour_first[base]; i < m->neighbour_first[base + 1]; i++) {
		const rbf_vertex *v = &m->neighbour[i];
		if (v->base == base)
			continue;
		const double is = light[v->base], goes_on = trend(m, light, base, d, v);
		low = fmin(low, fmin(is, goes_on));
		high = fmax(high, fmax(is, goes_on));
		mean += (is - mean) / ++around;
	}
	return around && (light[base] - high > log(CLEAR) || low - light[base] > log(CLEAR)) && !on_border(&m->mesh, base) ? light[base] - mean : 0;
}

/* What a vertex, an image of its base, differs by from another base's light, the lobes of which were divided by its scale. */
static float difference(const rbf_fitted *m, float lambertian, const rbf_vertex *vertex, uint32_t base, float scale)
{
	float from[3], to[3];
	direction_of(m, vertex->base, from);
	direction_of(m, base, to);
	const float own = lambertian / scale;
	return rbf_moved_mirrored(&m->lobes[vertex->base], from, vertex->op, &m->lobes[base], to, rbf_min(own, lambertian), own - lambertian, NULL);
}

/* The least that a base differs by from one around it, but for base `without`. */
static float least_difference(const rbf_fitted *m, float lambertian, uint32_t base, uint32_t without)
{
	float least = INFINITY;
	for (uint32_t i = m->neighbour_first[base]; i < m->neighbour_first[base + 1]; i++) {
		const rbf_vertex *v = &m->neighbour[i];
		if (v->base != base && v->base != without)
			least = rbf_min(least, difference(m, lambertian, v, base, 1));
	}
	return least;
}

/* Whether an incidence, its lobes divided by its scale, is like one around it, or no less so than that is like others. */
static int alike(const rbf_fitted *m, float lambertian, uint32_t base, float scale)
{
	int found = 0;
	for (uint32_t i = m->neighbour_first[base]; i < m->neighbour_first[base + 1] && !found; i++) {
		const rbf_vertex *v = &m->neighbour[i];
		const float apart = v->base == base ? INFINITY : difference(m, lambertian, v, base, scale);
		found = apart < LIKE || (apart < LIKE_MOST && apart <= least_difference(m, lambertian, v->base, base));
	}
	return found;
}

void rbf_scale_lobes(const rbf_fitted *m, const float scale[], int back)
{
	for (uint32_t b = 0; b < m->bases; b++) {
		const rbf_lobes *l = &m->lobes[b];
		const float by = back ? scale[b] : 1 / scale[b];
		for (uint32_t i = 0; i < l->channels * l->blocks; i++)
			for (int n = 0; n < RBF_LANES; n++)
				l->amplitude[i].a[n] *= by;
		for (uint32_t i = 0; i < l->count; i++)
			l->mass[i] *= (double)by;
	}
}

int rbf_scale_find(const rbf_fitted *m, float lambertian, float scale[])
{
	int found = 0;
	double *light = malloc(((size_t)m->bases + 1) * sizeof *light);
	if (!light)
		return -1;
	for (uint32_t b = 0; b < m->bases; b++) {
		double sum = (double)lambertian + DARK;
		for (uint32_t i = 0; i < m->lobes[b].count; i++)
			sum += m->lobes[b].mass[i];
		light[b] = log(sum);
	}
	for (uint32_t b = 0; b < m->bases; b++)
		scale[b] = (float)exp(stands_apart(m, light, b));
	rbf_scale_lobes(m, scale, 0);
	for (uint32_t b = 0; b < m->bases; b++)
		light[b] = scale[b] < 1 || scale[b] > 1 ? alike(m, lambertian, b, scale[b]) : 0;
	rbf_scale_lobes(m, scale, 1);
	for (uint32_t b = 0; b < m->bases; b++) {
		scale[b] = light[b] > 0 ? scale[b] : 1;
		found += light[b] > 0;
	}
	free(light);
	return found;
}
