/* SPDX-License-Identifier: BSD-3-Clause */
#include "draws.h"
#include "kernel.h"
#include "takeover.h"

#include <stdlib.h>
#include <string.h>

static const float TWIST = .05f; /* what two rotations one after the other can add to the angle between the corners */

float rbf_lobe_slant(const rbf_reach *r, const float centre[3], float kappa)
{
	if (rbf_map_get(r->map)->kind != RBF_KIND_HALF)
		return 0;
	/* exitant directions above the horizon map to at most `beyond` below it */
	const float spread = (kappa > 0 ? RBF_LOBE_SPREAD / sqrtf(kappa) : 4) + r->motion;
	const float theta = acosf(rbf_min(rbf_max(r->base[2], -1.f), 1.f)) + (float)(RBF_PI / 2) + r->beyond;
	const float half = .5f * rbf_min(rbf_angle(r->base, centre) + spread, theta);
	return half < 1.55f ? rbf_min(tanf(half), RBF_SLANT_MAX) : RBF_SLANT_MAX;
}

/* A corner takes over only where another one's mapped direction is lower than RBF_VALID_Z; maps move directions by the margin, shifts
 * move their tangential components. */
float rbf_draw_band(const rbf_reach *r)
{
	float edge = asinf(RBF_VALID_Z) + r->margin + TWIST;
	if (rbf_map_get(r->map)->kind == RBF_KIND_SHIFT)
		edge = acosf(rbf_max(RBF_VALID_S - 2 * sinf(.5f * r->margin), 0.f)) + 1e-3f;
	return sinf(rbf_min(edge + r->motion, (float)(RBF_PI / 2)));
}

/* Largest residual motion of every set, rad. */
static void motions(const rbf_component *c, float *motion)
{
	memset(motion, 0, c->sets * sizeof *motion);
	for (uint32_t e = 0; e < c->mesh.elements && c->shift_of; e++)
		for (uint32_t slot = 0; slot < 6; slot++) {
			const uint32_t at = c->shift_of[e * 6 + slot], base = c->mesh.vertex[c->mesh.element[e].v[slot / 2]].base;
			for (uint32_t f = 0; f < c->frames && at != RBF_NO_SHIFT; f++) {
				const rbf_set *set = &c->set[base * c->frames + f];
				const rbf_shift *s = &c->shift[at + (set->first - c->set[base * c->frames].first)];
				float *m = &motion[base * c->frames + f];
				for (uint32_t i = 0; i < set->blocks * RBF_LANES; i++) {
					const float x = s[i / RBF_LANES].x[i % RBF_LANES], y = s[i / RBF_LANES].y[i % RBF_LANES], z = s[i / RBF_LANES].z[i % RBF_LANES];
					*m = fmaxf(*m, 1.05f * sqrtf(x*x + y*y + z*z));
				}
			}
		}
}

static void reaches(const rbf_mesh *mesh, rbf_reach *reach)
{
	for (uint32_t v = 0; v < mesh->vertices; v++)
		rbf_mirror(mesh->vertex[v].op, mesh->vertex[v].direction, reach[mesh->vertex[v].base].base);
	for (uint32_t e = 0; e < mesh->elements + mesh->borders; e++) {
		const int border = e >= mesh->elements;
		const uint32_t *v = border ? mesh->border[e - mesh->elements] : mesh->element[e].v;
		for (int i = 0; i < (border ? 2 : 3); i++) {
			const rbf_vertex *a = &mesh->vertex[v[i]], *b = &mesh->vertex[v[border ? 1 - i : (i + 1) % 3]];
			const float m = rbf_angle(a->direction, b->direction);
			reach[a->base].margin = fmaxf(reach[a->base].margin, m);
			reach[b->base].margin = fmaxf(reach[b->base].margin, m);
			if (border)
				reach[a->base].beyond = fmaxf(reach[a->base].beyond, asinf(fminf(a->direction[2], 1.f)));
		}
	}
}

/* The part of a lobe that may lie where its corner takes over from another. */
static double tail(const rbf_reach *r, const rbf_neighbour *n, uint32_t count, const float centre[3], float kappa)
{
	float angle = INFINITY;
	if (kappa <= RBF_LOBE_SHARP)
		return 1;
	for (uint32_t i = 0; i < count && angle > 0; i++)
		angle = rbf_min(rbf_takeover_angle(&n[i], r->map, r->linear, centre), angle);
	angle = rbf_max(angle - r->motion, 0);
	return angle < (float)RBF_PI ? exp(-(double)kappa * (1 - cos((double)angle))) : 0;
}

/* Running sums of shares that are at least the parts; returns the unit. Unused lanes get none. */
static float shares(const double *part, size_t count, uint16_t *running)
{
	double total = 0;
	size_t some = 0, largest = 0;
	for (size_t i = 0; i < count; i++) {
		total += part[i];
		some += part[i] > 0;
		largest = part[i] > part[largest] ? i : largest;
	}
	if (!(total > 0) || some >= RBF_DRAW_TOTAL / 2) {
		memset(running, 0, count * sizeof *running);
		return 0;
	}
	const float unit = nextafterf((float)(total / (double)(RBF_DRAW_TOTAL - some)), INFINITY);
	long rest = RBF_DRAW_TOTAL, sum = 0;
	for (size_t i = 0; i < count; i++)
		rest -= (long)ceil(part[i] / (double)unit);
	for (size_t i = 0; i < count; i++) {
		sum += (long)ceil(part[i] / (double)unit) + (i == largest ? rest : 0);
		running[i] = (uint16_t)sum;
	}
	return unit;
}

static void make_set(const rbf_component *c, const rbf_reach *r, const rbf_neighbour *n, uint32_t neighbours, rbf_set *set, double *part)
{
	const size_t lanes = (size_t)c->blocks * RBF_LANES, first = (size_t)set->first * RBF_LANES, count = (size_t)set->blocks * RBF_LANES;
	const uint32_t tables = rbf_draw_tables(c), y = rbf_luminance(c->channels);
	const double sine = r->beyond < (float)(RBF_PI / 2) ? sin((double)r->beyond) : 1;
	double *const mass = part, *const band = part + count, *const slant = part + 2 * count;
	uint16_t *running = (uint16_t *)c->draws + first;
	set->band = r->limit > 1 ? rbf_draw_band(r) : 0;
	for (size_t i = 0; i < count; i++) {
		const rbf_block *b = &c->block[set->first + i / RBF_LANES];
		const int lane = i % RBF_LANES;
		const float centre[3] = {b->x[lane], b->y[lane], b->z[lane]}, kappa = b->k[lane];
		mass[i] = (double)c->amplitude[(size_t)y * c->blocks + set->first + i / RBF_LANES].a[lane] * rbf_lobe_integral((double)kappa);
		slant[i] = mass[i] * (double)rbf_lobe_slant(r, centre, kappa);
		band[i] = !(r->limit > 1) ? 0 : (mass[i] + sine * slant[i]) * tail(r, n, neighbours, centre, kappa);
	}
	for (uint32_t t = 0; t < 3; t++)
		set->unit[t] = t < tables ? shares(part + t * count, count, running + t * lanes) : 0;
}

int rbf_draws_make(rbf_component *c)
{
	uint32_t longest = 0;
	for (uint32_t s = 0; s < c->sets; s++)
		longest = c->set[s].blocks > longest ? c->set[s].blocks : longest;
	rbf_reach *reach = calloc((size_t)c->mesh.bases + 1, sizeof *reach);
	float *motion = malloc((c->sets + 1) * sizeof *motion);
	double *part = malloc((3 * (size_t)longest * RBF_LANES + 1) * sizeof *part);
	rbf_neighbours near = {NULL, NULL};
	const int good = reach && motion && part && !rbf_neighbours_find(&c->mesh, &near);
	if (good) {
		motions(c, motion);
		reaches(&c->mesh, reach);
		for (uint32_t s = 0; s < c->sets; s++) {
			const uint32_t b = s / c->frames, f = s % c->frames;
			rbf_reach r = reach[b];
			r.map = c->frame[f];
			r.limit = rbf_frame_limit(c, f);
			r.motion = motion[s];
			r.beyond = fmaxf(r.beyond, r.margin);
			r.linear = rbf_frame_linear(c, f);
			r.margin = rbf_map_margin(r.map, r.linear, r.base, r.margin);
			make_set(c, &r, near.of + near.first[b], near.first[b + 1] - near.first[b], (rbf_set *)&c->set[s], part);
		}
	}
	free(reach);
	free(motion);
	free(part);
	rbf_neighbours_free(&near);
	return good ? 0 : -1;
}
