/* SPDX-License-Identifier: BSD-3-Clause */
#include "assemble.h"
#include "dhr.h"
#include "integrate.h"
#include "pack.h"

#include <stdlib.h>
#include <string.h>

static const double SPACING = 2.4 * RBF_PI / 180; /* of the lattice's nodes, at first */
enum { STEPS_LEAST = 4, STEPS_MOST = 16, STEPS_FINE = 24 }; /* multiples of 4, half a lattice is one again: at first, and in the end */
static const float SMOOTH = 3e-4f; /* of DHR: what half a lattice may miss at the other nodes */
static const float COARSE = .02f;  /* if it misses more than that, the whole one, which misses an eighth to a quarter of it, is not fine enough */

/* Even, and the same for the whole mesh, so that what elements share has the same nodes on both sides. */
static uint32_t steps_of(const rbf_mesh *mesh)
{
	if (mesh->symmetry == RBF_ISOTROPIC || !mesh->elements)
		return STEPS_MOST; /* few */
	const uint32_t steps = 4 * (uint32_t)ceil(.25 * rbf_mesh_spacing(mesh) / SPACING);
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

/* Weights of a node, and the direction there. */
static void node_at(const rbf_component *c, uint32_t e, uint32_t p, uint32_t q, float weight[3], float d[3])
{
	const float steps = (float)c->dhr_steps;
	const rbf_element *element = &c->mesh.element[e];
	weight[0] = (steps - (float)p - (float)q) / steps;
	weight[1] = (float)p / steps;
	weight[2] = (float)q / steps;
	if (c->mesh.symmetry == RBF_ISOTROPIC) { /* weights are shares of theta */
		const float theta = element->inverse[0][0] + weight[1] / element->inverse[0][1];
		d[0] = sinf(theta);
		d[1] = 0;
		d[2] = cosf(theta);
		return;
	}
	for (int n = 0; n < 3; n++) {
		d[n] = 0;
		for (int k = 0; k < 3; k++)
			d[n] += weight[k] * c->mesh.vertex[element->v[k]].direction[n];
	}
}

static void set_element_node(const rbf_component *c, uint32_t e, uint32_t p, uint32_t q, float *table)
{
	float weight[3], d[3];
	node_at(c, e, p, q, weight, d);
	set_node(c, e, weight, d, table + rbf_dhr_lattice(c->dhr_steps, p, q) * c->channels);
}

/* How far a is from b, relative to that. */
static float difference(const float *a, const float *b, uint32_t channels)
{
	float most = 0;
	for (uint32_t n = 0; n < channels; n++)
		most = fmaxf(most, fabsf(a[n] - b[n]) / fmaxf(fabsf(b[n]), 1e-12f));
	return most;
}

/* A triangle's nodes: every other one first. Where their quadratic pieces meet the others that are tried, the rest is theirs. Returns
 * by how much they miss those. */
static float fill_triangle(const rbf_component *c, uint32_t e, float *table)
{
	const uint32_t steps = c->dhr_steps, channels = c->channels;
	float half_table[(STEPS_FINE / 2 + 1) * (STEPS_FINE / 2 + 2) / 2 * 3], missed = 0;
	rbf_component half = *c;
	half.dhr_steps = steps / 2;
	half.dhr = half_table;
	for (uint32_t q = 0; q <= steps; q += 2)
		for (uint32_t p = 0; p + q <= steps; p += 2) {
			set_element_node(c, e, p, q, table);
			memcpy(half_table + rbf_dhr_lattice(steps / 2, p / 2, q / 2) * channels, table + rbf_dhr_lattice(steps, p, q) * channels,
				channels * sizeof *table);
		}
	for (uint32_t q = 1; q <= steps; q += 2)
		for (uint32_t p = q % 4; p + q <= steps; p += 4) {
			float weight[3], d[3], value[3];
			set_element_node(c, e, p, q, table);
			node_at(c, e, p, q, weight, d);
			rbf_dhr_inside(&half, 0, weight, value);
			missed = fmaxf(missed, difference(value, table + rbf_dhr_lattice(steps, p, q) * channels, channels));
		}
	for (uint32_t q = 0; q <= steps; q++)
		for (uint32_t p = 0; p + q <= steps; p++) {
			float weight[3], d[3];
			if (p % 2 == 0 && q % 2 == 0)
				continue;
			node_at(c, e, p, q, weight, d);
			if (missed <= SMOOTH)
				rbf_dhr_inside(&half, 0, weight, table + rbf_dhr_lattice(steps, p, q) * channels);
			else if (q % 2 == 0 || p % 4 != q % 4) /* not tried above */
				set_element_node(c, e, p, q, table);
		}
	return missed;
}

/* Returns as fill_triangle(); 0 for a segment, whose nodes are dense. */
static float fill_element(const rbf_component *c, uint32_t e, float *table)
{
	if (c->mesh.symmetry != RBF_ISOTROPIC)
		return fill_triangle(c, e, table);
	for (uint32_t p = 0; p <= c->dhr_steps; p++)
		set_element_node(c, e, p, 0, table);
	return 0;
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

/* Lines that never count repeat the end of the arc that they are nearer to; from the point where a chain over theta ends there is but
 * one way on, and all are the same. */
static void fill_border(const rbf_component *c, uint32_t border, float *node)
{
	const uint32_t steps = c->dhr_steps, lines = 4 * steps;
	const size_t line_size = (size_t)(steps + 1) * c->channels;
	char counts[4 * RBF_DHR_STEPS_MAX], piece[4 * RBF_DHR_STEPS_MAX];
	const int straight = c->mesh.symmetry == RBF_ISOTROPIC;
	for (uint32_t i = 0; i < lines && !straight; i++)
		counts[i] = (char)line_counts(c, border, i);
	for (uint32_t i = 0; i < lines && !straight; i++) { /* all of a quadratic piece, if one of its three lines does */
		const uint32_t first = i & ~1u, before = (first + lines - 2) % lines;
		piece[i] = counts[first] || counts[first + 1] || counts[(first + 2) % lines];
		if (i % 2 == 0 && (counts[before] || counts[before + 1]))
			piece[i] = 1;
	}
	for (uint32_t i = 0; i < lines; i++) {
		float *line = node + i * line_size;
		if (straight ? i > 0 : !piece[i]) {
			memcpy(line, node + (i < 5 * steps / 2 && !straight ? steps * line_size : 0), line_size * sizeof *line);
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

/* The table for c->dhr_steps, as far as elements go. missed[elements]: as fill_element(). */
static int fill_elements(const rbf_team *team, rbf_component *c, float *missed)
{
	const size_t inside = rbf_dhr_element_nodes(c), outside = rbf_dhr_border_nodes(c);
	float *table = calloc((c->mesh.elements * inside + c->mesh.borders * outside) * c->channels + 1, sizeof *table);
	c->dhr = table;
	if (!table)
		return -1;
	#pragma omp parallel for schedule(dynamic)
	for (int64_t i = 0; i < (int64_t)c->mesh.elements; i++)
		if (rbf_team_mine(team, (uint64_t)i))
			missed[i] = fill_element(c, (uint32_t)i, table + (size_t)i * inside * c->channels);
	return rbf_team_share_rows(team, c->mesh.elements, sizeof *missed, missed)
		|| rbf_team_share_rows(team, c->mesh.elements, inside * c->channels * sizeof *table, table) ? -1 : 0;
}

static int fill_borders(const rbf_team *team, rbf_component *c)
{
	const size_t row = (size_t)rbf_dhr_border_nodes(c) * c->channels;
	float *borders = (float *)c->dhr + c->mesh.elements * (size_t)rbf_dhr_element_nodes(c) * c->channels;
	#pragma omp parallel for schedule(dynamic)
	for (int64_t i = 0; i < (int64_t)c->mesh.borders; i++)
		if (rbf_team_mine(team, (uint64_t)i))
			fill_border(c, (uint32_t)i, borders + (size_t)i * row);
	return rbf_team_share_rows(team, c->mesh.borders, row * sizeof *borders, borders);
}

int rbf_assemble_dhr(const rbf_team *team, rbf_component *c)
{
	float *missed = calloc((size_t)c->mesh.elements + 1, sizeof *missed), most = 0;
	c->dhr_steps = steps_of(&c->mesh);
	int failed = !missed || fill_elements(team, c, missed);
	for (uint32_t e = 0; e < c->mesh.elements && !failed; e++)
		most = fmaxf(most, missed[e]);
	if (most > COARSE && c->dhr_steps < STEPS_FINE) {
		free((void *)c->dhr);
		c->dhr_steps = 2 * c->dhr_steps < STEPS_FINE ? 2 * c->dhr_steps : STEPS_FINE;
		failed = fill_elements(team, c, missed);
	}
	free(missed);
	failed = failed || fill_borders(team, c);
	if (!failed)
		rbf_pack_round_dhr(c);
	return failed ? -1 : 0;
}
