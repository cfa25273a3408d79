/* SPDX-License-Identifier: BSD-3-Clause */
/* Maps and shares of corners change how much light arrives. In the middle of each edge and of each triangle, DHR is compared with what the
 * measured incidences' own expect there. */
#include "tune.h"
#include "bounds.h"
#include "integrate.h"
#include "levels.h"

#include <stdlib.h>
#include <string.h>

static const double LEAST = .5, MOST = 2;

/* What light is tuned to, of all bases. */
typedef struct target {
	const rbf_level *level;
	const rbf_knot *knot; /* or NULL */
} target;

double rbf_tune_expected(uint32_t corners, const rbf_level level[], const rbf_knot knot[], const rbf_vertex vertex[], const float weight[])
{
	if (knot)
		return (double)rbf_max(rbf_network_between(corners, knot, vertex, weight), 0);
	const double root = (double)rbf_level_between(corners, level, vertex, weight);
	return root * root * root * root;
}

double rbf_tune_ratio(double expected, double is)
{
	return is > 0 ? fmin(fmax(expected / is, LEAST), MOST) : 1;
}

float *rbf_tune_arrived(uint32_t bases, const float root[])
{
	float *value = malloc(((size_t)bases + 1) * sizeof *value);
	for (uint32_t b = 0; b < bases && value; b++)
		value[b] = root[b] * root[b] * root[b] * root[b];
	return value;
}

/* The ratio less 1 in the middle of some corners of an item; corner: which of its own. */
static float rise_at(const rbf_component *c, const target *to, uint32_t item, uint32_t corners, const uint32_t corner[])
{
	uint32_t v[3];
	rbf_level level[3];
	rbf_knot knot[3];
	rbf_vertex vertex[3];
	float weight[3] = {0, 0, 0}, d[3] = {0, 0, 0};
	const float each[3] = {1 / (float)corners, 1 / (float)corners, 1 / (float)corners};
	rbf_bound_corners(&c->mesh, item, v);
	for (uint32_t k = 0; k < corners; k++) {
		vertex[k] = c->mesh.vertex[v[corner[k]]];
		level[k] = to->level[vertex[k].base];
		if (to->knot)
			knot[k] = to->knot[vertex[k].base];
		weight[corner[k]] = each[k];
		for (int n = 0; n < 3; n++)
			d[n] += vertex[k].direction[n];
	}
	rbf_normalize(d);
	rbf_site site;
	double value[3];
	rbf_site_place(c, item, weight, d, &site);
	rbf_site_dhr(&site, value);
	return (float)(rbf_tune_ratio(rbf_tune_expected(corners, level, to->knot ? knot : NULL, vertex, each), value[rbf_luminance(c->channels)]) - 1);
}

int rbf_tune_make(const rbf_fitted *m, int how, rbf_component *c)
{
	const uint32_t elements = c->mesh.elements, items = elements + c->mesh.borders;
	float *root = rbf_levels_arrived(m), *value = root ? rbf_tune_arrived(m->bases, root) : NULL;
	float (*tune)[RBF_TUNE] = calloc((size_t)items + 1, sizeof *tune);
	rbf_level *level = rbf_levels_all(m, root, how > 1);
	for (uint32_t b = 0; b < m->bases && value && m->scale; b++)
		value[b] *= m->scale[b]; /* as measured, as levels are */
	rbf_knot *knot = value && how > 2 ? rbf_network_make(&c->mesh, value) : NULL;
	const target to = {level, knot};
	const int failed = !level || !tune || !value || (how > 2 && !knot);
	#pragma omp parallel for schedule(dynamic)
	for (int64_t i = 0; i < (failed ? 0 : (int64_t)items); i++) {
		static const uint32_t all[5] = {0, 1, 2, 0, 1};
		const int border = i >= (int64_t)elements, edge = border || c->mesh.symmetry == RBF_ISOTROPIC;
		const uint32_t item = border ? RBF_MESH_BORDER | ((uint32_t)i - elements) : (uint32_t)i;
		for (uint32_t k = 0; k < (edge ? 1 : 3); k++)
			tune[i][k] = rise_at(c, &to, item, 2, all + k);
		/* beside what the edges make of the middle, 4 w_k w_l for each */
		if (!edge)
			tune[i][3] = 27 * (rise_at(c, &to, item, 3, all) - 4 / 9.f * (tune[i][0] + tune[i][1] + tune[i][2]));
	}
	free(knot);
	free(level);
	free(value);
	free(root);
	if (failed) {
		free(tune);
		return -1;
	}
	c->tuned = 1;
	c->tune = (const float *)tune;
	return 0;
}
