/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Diagonals that the Delaunay condition leaves open. Steps of theta and phi put four incidences on one circle nearly everywhere, and either
 * diagonal may cut such a quadrilateral. The data can tell which is better (Dyn, Levin, Rippa, Data dependent triangulations for piecewise linear
 * interpolation, 1990): what a cut-off or a bend runs along, slats for one, is the same at both ends of one diagonal and not of the other. An
 * end is told from the other end and from the side beyond it, where the diagonal goes on.
 *
 * One quadrilateral tells too little to be asked alone, and a law holds for more than one: within a quadrant all diagonals lean alike, with azimuth
 * rising or falling from the inner ring to the outer one. Images are judged by the same trials, so that the mesh keeps its symmetry; a
 * quadrilateral that is its own image, across a mirror axis, is left as it is, as its diagonals are images of each other.
 */
#include "mesh_build.h"

#include <stdlib.h>
#include <string.h>

/* Sum of opposite angles less half a circle: instruments set angles to a tenth of a degree, which is this much of a few degrees. */
static const double OPEN = .02;
static const double CONVEX = 1e-6, OUTSIDE = -1e-6, AXIS = 1e-6;

enum { VOTES = 256 }; /* of quadrilaterals in quadrants; of more than that, these decide for all */

/* Two triangles that make a quadrilateral: a, u, w and q, w, u, counter-clockwise. */
typedef struct quad {
	uint32_t i, j;
	uint32_t corner[4]; /* a, u, q, w: the mesh has the diagonal from u to w */
	size_t trial[4];    /* of each corner as an end of its diagonal, or NONE */
} quad;
#define NONE SIZE_MAX

static double det3(const double a[3], const double b[3], const double c[3])
{
	double n[3];
	rbf_cross3(b, c, n);
	return rbf_dot3(a, n);
}

static double angle3(const double a[3], const double b[3])
{
	double n[3];
	rbf_cross3(a, b, n);
	return atan2(sqrt(rbf_dot3(n, n)), rbf_dot3(a, b));
}

/* Angle of the chords from a to b and c. */
static double chords(const double a[3], const double b[3], const double c[3])
{
	double ab[3], ac[3];
	for (int n = 0; n < 3; n++) {
		ab[n] = b[n] - a[n];
		ac[n] = c[n] - a[n];
	}
	return angle3(ab, ac);
}

static int corner_of(const rbf_triangle *t, uint32_t vertex)
{
	return t->v[0] == vertex ? 0 : t->v[1] == vertex ? 1 : t->v[2] == vertex ? 2 : -1;
}

static int side_to(const rbf_triangle *t, int32_t neighbour)
{
	return t->neighbour[0] == neighbour ? 0 : t->neighbour[1] == neighbour ? 1 : 2;
}

static quad quad_at(const rbf_triangle *t, uint32_t i, int side)
{
	const uint32_t j = (uint32_t)t[i].neighbour[side];
	return (quad){i, j, {t[i].v[side], t[i].v[(side + 1) % 3], t[j].v[side_to(&t[j], (int32_t)i)], t[i].v[(side + 2) % 3]}, {NONE, NONE, NONE, NONE}};
}

/* May either diagonal cut it? */
static int is_open(const double (*p)[3], const quad *s)
{
	const double *a = p[s->corner[0]], *u = p[s->corner[1]], *q = p[s->corner[2]], *w = p[s->corner[3]];
	return det3(a, u, q) > CONVEX && det3(q, w, a) > CONVEX && fabs(chords(a, u, w) + chords(q, w, u) - RBF_PI) < OPEN;
}

enum { ALONE = -1, NEVER = -2 };

/* The quadrant of one whose diagonals lean one way and the other; else it is asked alone, or never, if the domain does not depend on it. *lean: of
 * the diagonal that is there, alike for images. */
static int quadrant_of(const rbf_mesh *mesh, const double (*p)[3], const quad *s, int *lean)
{
	const rbf_symmetry symmetry = mesh->symmetry;
	double at[2], turn[2];
	for (int n = 0; n < 2; n++) {
		const double *a = p[s->corner[n]], *b = p[s->corner[n + 2]];
		at[n] = a[n] + b[n] + p[s->corner[1 - n]][n] + p[s->corner[3 - n]][n];
		turn[n] = (a[2] - b[2]) * (a[0] * b[1] - a[1] * b[0]);
	}
	if (((symmetry == RBF_BILATERAL_X || symmetry == RBF_QUADRILATERAL) && at[0] < AXIS)
			|| ((symmetry == RBF_BILATERAL_Y || symmetry == RBF_QUADRILATERAL) && at[1] < AXIS))
		return NEVER;
	*lean = turn[1] * at[0] * at[1] > 0;
	if (fabs(at[0]) < AXIS || fabs(at[1]) < AXIS || !(turn[0] * turn[1] < 0))
		return ALONE;
	return (at[0] * at[1] < 0) + (symmetry != RBF_UP && at[1] < 0) * 2;
}

/* An end of a diagonal as told from the other end and the side beyond. Returns 0 if it is on the rim. */
static int trial_of(const rbf_mesh *mesh, const double (*p)[3], const rbf_triangle *t, const quad *s, uint32_t end, uint32_t other,
	rbf_mesh_trial *trial)
{
	const int32_t start = (int32_t)(corner_of(&t[s->i], end) >= 0 ? s->i : s->j);
	double best = OUTSIDE, weight[3] = {0, 0, 0};
	uint32_t beyond[2] = {0, 0};
	for (int way = 1, round = 0; way <= 2 && !round; way++) { /* round the end, or either way to the rim */
		int32_t at = start;
		do {
			const int k = corner_of(&t[at], end);
			uint32_t b = t[at].v[(k + 1) % 3], c = t[at].v[(k + 2) % 3];
			if (mesh->vertex[c].base < mesh->vertex[b].base) { /* in one order for all images */
				const uint32_t swap = b;
				b = c;
				c = swap;
			}
			const double all = det3(p[other], p[b], p[c]);
			const double w[3] = {det3(p[end], p[b], p[c]) / all, det3(p[other], p[end], p[c]) / all, det3(p[other], p[b], p[end]) / all};
			const double least = fmin(w[0], fmin(w[1], w[2]));
			if (b != other && c != other && fabs(all) > CONVEX && least > best) {
				best = least;
				beyond[0] = b;
				beyond[1] = c;
				memcpy(weight, w, sizeof w);
			}
			at = t[at].neighbour[(k + way) % 3];
		} while (at >= 0 && at != start);
		round = at == start;
	}
	if (!(best > OUTSIDE))
		return 0;
	const uint32_t from[3] = {other, beyond[0], beyond[1]};
	const unsigned op = (unsigned)rbf_symmetry_fold(mesh->symmetry, mesh->vertex[end].direction);
	double sum = 0;
	for (int n = 0; n < 3; n++)
		sum += weight[n] = fmax(weight[n], 0);
	for (int n = 0; n < 3; n++) {
		const rbf_vertex *v = &mesh->vertex[from[n]];
		trial->weight[n] = (float)(weight[n] / sum);
		trial->from[n] = (rbf_vertex){.base = v->base, .op = v->op ^ op};
		rbf_mirror(op, v->direction, trial->from[n].direction);
	}
	trial->vertex = (rbf_vertex){.base = mesh->vertex[end].base, .op = mesh->vertex[end].op ^ op};
	rbf_mirror(op, mesh->vertex[end].direction, trial->vertex.direction);
	return 1;
}

/* The mean over the ends of the diagonal from corner `from` that were tried; < 0: none. */
static double mean_error(const quad *s, const float *error, int from)
{
	double sum = 0;
	int count = 0;
	for (int n = from; n < 4; n += 2)
		if (s->trial[n] != NONE) {
			sum += (double)error[s->trial[n]];
			count++;
		}
	return count ? sum / count : -1;
}

static void flip(rbf_triangle *t, const quad *s)
{
	const uint32_t a = s->corner[0], u = s->corner[1], q = s->corner[2], w = s->corner[3];
	const rbf_triangle one = t[s->i], two = t[s->j];
	const int32_t i = (int32_t)s->i, j = (int32_t)s->j;
	const int32_t wa = one.neighbour[corner_of(&one, u)], au = one.neighbour[corner_of(&one, w)];
	const int32_t uq = two.neighbour[corner_of(&two, w)], qw = two.neighbour[corner_of(&two, u)];
	t[i] = (rbf_triangle){{a, u, q}, {uq, j, au}};
	t[j] = (rbf_triangle){{q, w, a}, {wa, i, qw}};
	if (uq >= 0)
		t[uq].neighbour[side_to(&t[uq], j)] = i;
	if (wa >= 0)
		t[wa].neighbour[side_to(&t[wa], i)] = j;
}

/* Quadrilaterals that share no triangle with another. Returns how many. */
static size_t find_quads(const double (*p)[3], size_t triangles, const rbf_triangle *t, quad *found)
{
	size_t count = 0;
	for (uint32_t i = 0; i < triangles; i++)
		for (int k = 0; k < 3; k++) {
			if (t[i].neighbour[k] <= (int32_t)i)
				continue;
			const quad s = quad_at(t, i, k);
			const uint32_t of[2] = {s.i, s.j};
			int open = 0;
			for (int n = 0; n < 2; n++)
				for (int l = 0; l < 3; l++) {
					if (t[of[n]].neighbour[l] < 0)
						continue;
					const quad beside = quad_at(t, of[n], l);
					open += is_open(p, &beside);
				}
			if (open == 2 && is_open(p, &s)) /* it alone, from either side */
				found[count++] = s;
		}
	return count;
}

/* Trials of all that are asked; of those in quadrants an even part. Returns how many. */
static size_t make_trials(const rbf_mesh *mesh, const double (*p)[3], const rbf_triangle *t, size_t quads, quad *s, rbf_mesh_trial *trial)
{
	size_t trials = 0, votes = 0, seen = 0;
	int lean;
	for (size_t i = 0; i < quads; i++)
		votes += quadrant_of(mesh, p, &s[i], &lean) >= 0;
	const size_t step = votes > VOTES ? (votes + VOTES - 1) / VOTES : 1;
	for (size_t i = 0; i < quads; i++) {
		const int q = quadrant_of(mesh, p, &s[i], &lean);
		if (q == NEVER || (q >= 0 && seen++ % step))
			continue;
		for (int n = 0; n < 4; n++)
			if (trial_of(mesh, p, t, &s[i], s[i].corner[n], s[i].corner[(n + 2) % 4], &trial[trials]))
				s[i].trial[n] = trials++;
	}
	return trials;
}

/* Flips diagonals by the errors of the trials. */
static void decide(const rbf_mesh *mesh, const double (*p)[3], size_t quads, const quad *s, const float *error, rbf_triangle *triangle)
{
	double sum[4][2] = {{0}}; /* of each quadrant and lean */
	int lean;
	for (size_t i = 0; i < quads; i++) {
		const int q = quadrant_of(mesh, p, &s[i], &lean);
		const double other = mean_error(&s[i], error, 0), is = mean_error(&s[i], error, 1);
		if (q >= 0 && other >= 0 && is >= 0) {
			sum[q][lean] += is;
			sum[q][!lean] += other;
		}
	}
	for (size_t i = 0; i < quads; i++) {
		const int q = quadrant_of(mesh, p, &s[i], &lean);
		const double other = mean_error(&s[i], error, 0), is = mean_error(&s[i], error, 1);
		if (q >= 0 ? sum[q][!lean] < sum[q][lean] : q == ALONE && other >= 0 && other < is)
			flip(triangle, &s[i]);
	}
}

bsdfrbf_status rbf_mesh_diagonals(bsdfrbf_context *context, const rbf_mesh *mesh, const double (*p)[3], size_t triangles,
	rbf_triangle *triangle, rbf_mesh_judge *judge, void *data)
{
	quad *s = malloc((triangles + 1) * sizeof *s);
	const size_t quads = s ? find_quads(p, triangles, triangle, s) : 0;
	rbf_mesh_trial *trial = malloc((4 * quads + 1) * sizeof *trial);
	float *error = malloc((4 * quads + 1) * sizeof *error);
	int failed = !s || !trial || !error;
	const size_t trials = failed ? 0 : make_trials(mesh, p, triangle, quads, s, trial);
	failed = failed || (trials && judge(data, trials, trial, error));
	if (!failed)
		decide(mesh, p, quads, s, error, triangle);
	free(s);
	free(trial);
	free(error);
	return failed ? rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory for the mesh of incident directions") : BSDFRBF_OK;
}
