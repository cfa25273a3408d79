/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * k takes over at d where the direction at l that belongs to it is lower than d, and lower than RBF_VALID_Z. A lower bound of the angle to
 * where each of both begins is known for every kind of map; the greater one counts.
 */
#include "takeover.h"

#include <stdlib.h>
#include <string.h>

#define SAFE 1e-3f /* rad, for rounding */

static float angle_from_sine(float sine)
{
	return asinf(rbf_min(rbf_max(sine, -1.f), 1.f));
}

/* z at l is row . d, row being the third one of the rotation from beam to beam; more turns about the beam at l move the row by the twist. */
static float turned(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float d[3])
{
	rbf_warp w;
	float beam[3];
	rbf_warp_set(&w, map, linear, n->k, n->l);
	rbf_map_source(map, linear, n->l, beam);
	const float row[3] = {w.m[6], w.m[7], w.m[8]}, less[3] = {-row[0], -row[1], 1 - row[2]}, length = sqrtf(rbf_dot(less, less));
	const float off = n->twist * sqrtf(rbf_max(1 - beam[2]*beam[2], 0.f));
	const float low = angle_from_sine(rbf_dot(row, d)) - angle_from_sine(RBF_VALID_Z) - off;
	if (length <= off)
		return low;
	return rbf_max(low, -angle_from_sine(rbf_dot(less, d) / length) - angle_from_sine(off / length));
}

/* Tangential components move by the same everywhere; angles are at least as long as distances of these. */
static float shifted(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float d[3])
{
	rbf_warp w;
	rbf_warp_set(&w, map, linear, n->k, n->l);
	const float x = d[0] + w.m[0], y = d[1] + w.m[1], length = sqrtf(w.m[0]*w.m[0] + w.m[1]*w.m[1]);
	const float low = RBF_VALID_S - sqrtf(x*x + y*y);
	if (!(length > 0))
		return INFINITY; /* nothing moves */
	return rbf_max(low, -(d[0]*w.m[0] + d[1]*w.m[1]) / length - .5f * length);
}

/* With the half vector h, l is mirrored to m(l) = 2 (h.l) h - l, and what is at l higher than at k is the z of m(l - k). If d moves by e, h
 * moves by at most e / (2 cos g), g from k to h, and mirrored vectors by twice that; g itself grows by at most e/2. */
static float halved(const rbf_neighbour *n, const float d[3])
{
	float h[3] = {n->k[0] + d[0], n->k[1] + d[1], n->k[2] + d[2]};
	if (!(rbf_normalize(h) > 0))
		return 0;
	const float e[3] = {n->l[0] - n->k[0], n->l[1] - n->k[1], n->l[2] - n->k[2]}, length = sqrtf(rbf_dot(e, e));
	const float low = angle_from_sine(2 * rbf_dot(h, n->l) * h[2] - n->l[2]) - angle_from_sine(RBF_VALID_Z);
	const float higher = length > 0 ? angle_from_sine((2 * rbf_dot(h, e) * h[2] - e[2]) / length) : INFINITY;
	const float way = rbf_max(low, higher), cosine = rbf_min(rbf_max(rbf_dot(h, n->k), -1.f), 1.f), g = acosf(cosine);
	if (!(length > 0))
		return INFINITY;
	const float most = way * cosine, wide = g + .5f * most;
	return way > 0 && wide < (float)(RBF_PI / 2) ? way * cosf(wide) : 0;
}

float rbf_takeover_angle(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float centre[3])
{
	float d[3], angle;
	rbf_mirror(n->op, centre, d);
	switch (rbf_map_get(map)->kind) {
	case RBF_KIND_TURN: angle = turned(n, map, linear, d); break;
	case RBF_KIND_SHIFT: angle = shifted(n, map, linear, d); break;
	case RBF_KIND_HALF: angle = halved(n, d); break;
	default: return INFINITY;
	}
	return angle > SAFE ? angle - SAFE : 0; /* also for what is not a number */
}

/* Solid angle of the triangle of three directions, or for two of them of what lies between their arc and the horizon, somewhat more: the
 * angle by which ways around it turn. */
static float area(const float *a, const float *b, const float *c)
{
	const float e[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
	if (!c)
		return 1.2f * sqrtf(rbf_dot(e, e)) * asinf(rbf_min(rbf_max(rbf_max(a[2], b[2]), 0), 1));
	const float f[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
	float n[3];
	rbf_cross(e, f, n);
	return .6f * sqrtf(rbf_dot(n, n));
}

void rbf_neighbours_free(rbf_neighbours *n)
{
	free(n->first);
	free(n->of);
}

/* A pair that two elements share is there once, with the larger twist: that angle is the lower one. */
static void take_once(rbf_neighbours *n, uint32_t bases)
{
	uint32_t kept = 0;
	for (uint32_t b = 0; b < bases; b++) {
		const uint32_t begin = kept, from = n->first[b];
		n->first[b] = begin;
		for (uint32_t i = from; i < n->first[b + 1]; i++) {
			const rbf_neighbour next = n->of[i];
			uint32_t at = begin;
			while (at < kept && (n->of[at].op != next.op || memcmp(n->of[at].k, next.k, sizeof next.k) || memcmp(n->of[at].l, next.l, sizeof next.l)))
				at++;
			const float twist = at < kept ? rbf_max(n->of[at].twist, next.twist) : next.twist;
			n->of[at] = next;
			n->of[at].twist = twist;
			kept += at == kept;
		}
	}
	n->first[bases] = kept;
}

int rbf_neighbours_find(const rbf_mesh *mesh, rbf_neighbours *n)
{
	const int chain = mesh->symmetry == RBF_ISOTROPIC;
	uint32_t all = 0;
	n->first = calloc((size_t)mesh->bases + 2, sizeof *n->first);
	n->of = malloc((6 * (size_t)mesh->elements + 2 * (size_t)mesh->borders + 1) * sizeof *n->of);
	if (!n->first || !n->of)
		return -1;
	for (int pass = 0; pass < 2; pass++) { /* count, then fill in from behind */
		for (uint32_t e = 0; e < mesh->elements + mesh->borders; e++) {
			const uint32_t *border = e < mesh->elements ? NULL : mesh->border[e - mesh->elements], *v = border ? border : mesh->element[e].v;
			const uint32_t corners = border || chain ? 2 : 3;
			for (uint32_t i = 0; i < corners; i++)
				for (uint32_t j = 0; j < corners; j++) {
					const rbf_vertex *a = &mesh->vertex[v[i]], *b = &mesh->vertex[v[j]];
					if (v[i] == v[j])
						continue;
					if (!pass) {
						n->first[a->base + 1]++;
						continue;
					}
					rbf_neighbour *to = &n->of[--n->first[a->base + 1]];
					memcpy(to->k, a->direction, sizeof to->k);
					memcpy(to->l, b->direction, sizeof to->l);
					to->op = a->op;
					to->twist = chain ? 0 : area(a->direction, b->direction, border ? NULL : mesh->vertex[v[3 - i - j]].direction);
				}
		}
		for (uint32_t b = 0; b < mesh->bases && !pass; b++)
			all = n->first[b + 1] += n->first[b];
	}
	/* first[base + 1] went down to where the base begins */
	memmove(n->first, n->first + 1, mesh->bases * sizeof *n->first);
	n->first[mesh->bases] = all;
	take_once(n, mesh->bases);
	return 0;
}
