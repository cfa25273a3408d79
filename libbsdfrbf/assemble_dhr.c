/* SPDX-License-Identifier: BSD-3-Clause */
#include "assemble.h"
#include "dhr.h"
#include "integrate.h"

#include <stdlib.h>
#include <string.h>

static const double SPACING = 1.6 * RBF_PI / 180; /* of the lattice's nodes */
enum { STEPS_LEAST = 4, STEPS_MOST = 16 };

/* Even, and the same for the whole mesh, so that what elements share has the same nodes on both sides. */
static uint32_t steps_of(const rbf_mesh *mesh)
{
	double sum = 0;
	for (uint32_t e = 0; e < mesh->elements; e++)
		for (int k = 0; k < 3; k++)
			sum += (double)rbf_angle(mesh->vertex[mesh->element[e].v[k]].direction, mesh->vertex[mesh->element[e].v[(k + 1) % 3]].direction);
	if (mesh->symmetry == RBF_ISOTROPIC || !mesh->elements)
		return STEPS_MOST; /* few */
	const uint32_t steps = 2 * (uint32_t)ceil(.5 * sum / (3. * mesh->elements) / SPACING);
	return steps < STEPS_LEAST ? STEPS_LEAST : steps > STEPS_MOST ? STEPS_MOST : steps;
}

static void set_node(const rbf_component *c, uint32_t item, const float weight[3], float d[3], float *node)
{
	rbf_site site;
	double value[3];
	d[2] = fmaxf(d[2], 1e-3f);
	rbf_normalize(d);
	rbf_site_place(c, item, weight, d, &site);
	rbf_site_dhr(&site, value);
	for (uint32_t n = 0; n < c->channels; n++)
		node[n] = (float)value[n] * fmaxf(d[2], RBF_DHR_Z);
}

static void fill_element(const rbf_component *c, uint32_t e, float *node)
{
	const uint32_t steps = c->dhr_steps;
	const int isotropic = c->mesh.symmetry == RBF_ISOTROPIC;
	const uint32_t *v = c->mesh.element[e].v;
	for (uint32_t q = 0; q <= (isotropic ? 0 : steps); q++)
		for (uint32_t p = 0; p + q <= steps; p++, node += c->channels) {
			const float weight[3] = {(float)(steps - p - q) / (float)steps, (float)p / (float)steps, (float)q / (float)steps};
			float d[3];
			if (isotropic) { /* weights are shares of theta */
				const float theta = c->mesh.element[e].inverse[0][0] + weight[1] / c->mesh.element[e].inverse[0][1];
				d[0] = sinf(theta);
				d[1] = 0;
				d[2] = cosf(theta);
			} else
				for (int n = 0; n < 3; n++) {
					d[n] = 0;
					for (int k = 0; k < 3; k++)
						d[n] += weight[k] * c->mesh.vertex[v[k]].direction[n];
				}
			set_node(c, e, weight, d, node);
		}
}

/* Whether a line of nodes ever answers for a direction outside the mesh. Those along the arc always do. */
static int line_counts(const rbf_component *c, uint32_t border, uint32_t line)
{
	const uint32_t steps = c->dhr_steps;
	if (line <= steps)
		return 1;
	for (uint32_t k = 1; k <= steps; k++) {
		const rbf_dhr_polar point = {(float)line / (float)steps, (float)k / (float)steps};
		float weight[3], d[3];
		uint32_t corner[3];
		rbf_dhr_beyond_direction(&c->mesh, border, point, weight, d);
		d[2] = fmaxf(d[2], 0);
		rbf_normalize(d);
		if (rbf_mesh_locate(&c->mesh, d, corner, weight) & RBF_MESH_BORDER)
			return 1;
	}
	return 0;
}

/* Lines that never count repeat the end of the arc that they are nearer to. */
static void fill_border(const rbf_component *c, uint32_t border, float *node)
{
	const uint32_t steps = c->dhr_steps, lines = 4 * steps;
	const size_t line_size = (size_t)(steps + 1) * c->channels;
	char counts[4 * RBF_DHR_STEPS_MAX], piece[4 * RBF_DHR_STEPS_MAX];
	for (uint32_t i = 0; i < lines; i++)
		counts[i] = (char)line_counts(c, border, i);
	for (uint32_t i = 0; i < lines; i++) { /* all of a quadratic piece, if one of its three lines does */
		const uint32_t first = i & ~1u, before = (first + lines - 2) % lines;
		piece[i] = counts[first] || counts[first + 1] || counts[(first + 2) % lines];
		if (i % 2 == 0 && (counts[before] || counts[before + 1]))
			piece[i] = 1;
	}
	for (uint32_t i = 0; i < lines; i++) {
		float *line = node + i * line_size;
		if (!piece[i]) {
			memcpy(line, node + (i < 5 * steps / 2 ? steps * line_size : 0), line_size * sizeof *line);
			continue;
		}
		for (uint32_t k = 0; k <= steps; k++) {
			const rbf_dhr_polar point = {(float)i / (float)steps, (float)k / (float)steps};
			float weight[3] = {0, 0, 0}, d[3];
			rbf_dhr_beyond_direction(&c->mesh, border, point, weight, d);
			set_node(c, RBF_MESH_BORDER | border, weight, d, line + k * c->channels);
		}
	}
}

int rbf_assemble_dhr(const rbf_team *team, rbf_component *c)
{
	c->dhr_steps = steps_of(&c->mesh);
	const size_t inside = rbf_dhr_element_nodes(c), outside = rbf_dhr_border_nodes(c);
	float *table = calloc((c->mesh.elements * inside + c->mesh.borders * outside) * c->channels, sizeof *table);
	if (!table)
		return -1;
	float *borders = table + c->mesh.elements * inside * c->channels;
	#pragma omp parallel for schedule(dynamic)
	for (int64_t i = 0; i < (int64_t)c->mesh.elements + c->mesh.borders; i++) {
		const uint32_t n = (uint32_t)i, border = n - c->mesh.elements;
		if (n < c->mesh.elements && rbf_team_mine(team, n))
			fill_element(c, n, table + n * inside * c->channels);
		if (n >= c->mesh.elements && rbf_team_mine(team, border))
			fill_border(c, border, borders + border * outside * c->channels);
	}
	c->dhr = table;
	const size_t node = c->channels * sizeof *table;
	return rbf_team_share_rows(team, c->mesh.elements, inside * node, table)
		|| rbf_team_share_rows(team, c->mesh.borders, outside * node, borders) ? -1 : 0;
}
