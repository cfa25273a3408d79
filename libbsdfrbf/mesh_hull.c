/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Spherical Delaunay triangles by way of the convex hull (Brown, Voronoi diagrams from convex hulls, 1979):
 * the faces of the hull of points on a sphere are the Delaunay triangles.
 *
 * The points fill at most a hemisphere. The origin joins them as a further point and the faces that meet it are
 * dropped: those left are exactly the ones that face away from the origin, that is, the triangles of the whole
 * spherical convex hull. A point at -z would do as well in the middle, but it takes part in the Delaunay
 * condition and bites notches into an uneven rim, and over a notch the nearest rim point jumps.
 *
 * Regular scan plans have four points on one circle nearly everywhere. Lifting each point off the sphere by a
 * trifle that depends on its azimuth (LIFT) makes most such faces triangles at once, which takes qhull about half
 * the time of merging them first; what still is on one circle, across a mirror axis, option Qt cuts up. No
 * joggle: results must be the same everywhere.
 */
#define _POSIX_C_SOURCE 200809L
#include "mesh_build.h"

#include <libqhull_r/qhull_ra.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A triangle whose plane passes this close to the origin spans a half circle: weights are not defined. */
#define MIN_HEIGHT 1e-5
/* Weights are evaluated in float: with entries of the inverse above this they would be noise. */
#define MAX_INVERSE 1e6
/* Far above qhull's rounding, and below what would sink a point into the hull of others 1e-4 away: 1e-8 / 8. */
#define LIFT 1e-10
/* A rim triangle as flat as this at its inner corner joins two vertices past a third that is as good as on
 * the line between them, and would hide that third one. */
#define FLAT_COSINE (-0.99996192306) /* 179.5 degrees */

/* Orients the triangle; false if it cannot carry weights. */
static int orient(const double (*p)[3], uint32_t v[3])
{
	double n[3], ab[3], ac[3];
	for (int i = 0; i < 3; i++) {
		ab[i] = p[v[1]][i] - p[v[0]][i];
		ac[i] = p[v[2]][i] - p[v[0]][i];
	}
	rbf_cross3(ab, ac, n);
	double height = rbf_dot3(n, p[v[0]]);
	if (height < 0) {
		const uint32_t swap = v[1];
		v[1] = v[2];
		v[2] = swap;
		height = -height;
	}
	if (!(height > MIN_HEIGHT * sqrt(rbf_dot3(n, n))))
		return 0;
	/* height is the determinant; row k of the inverse is the cross product of the other two corners over it */
	for (int k = 0; k < 3; k++) {
		double row[3];
		rbf_cross3(p[v[(k + 1) % 3]], p[v[(k + 2) % 3]], row);
		if (!(rbf_dot3(row, row) < MAX_INVERSE * MAX_INVERSE * height * height))
			return 0;
	}
	return 1;
}

/* Copies the triangles out. False: no memory. */
static int collect(qhT *qh, size_t count, const double (*direction)[3], rbf_triangle **triangle, size_t *triangles)
{
	facetT *facet;
	vertexT *vertex, **vertexp;
	size_t room = 0, n = 0;
	FORALLfacets
		room++;
	rbf_triangle *list = malloc((room ? room : 1) * sizeof *list);
	if (!list)
		return 0;
	FORALLfacets {
		uint32_t v[3];
		int corners = 0;
		FOREACHvertex_(facet->vertices) {
			const int id = qh_pointid(qh, vertex->point);
			if (id < 0 || (size_t)id >= count || corners >= 3) {
				corners = -1; /* the closing point */
				break;
			}
			v[corners++] = (uint32_t)id;
		}
		if (corners == 3 && orient(direction, v)) {
			memcpy(list[n].v, v, sizeof v);
			n++;
		}
	}
	*triangle = list;
	*triangles = n;
	return 1;
}

/* Finds the neighbours: sides are bucketed by their smaller vertex. */
static int connect(size_t count, size_t triangles, rbf_triangle *triangle)
{
	uint32_t *first = calloc(count + 1, sizeof *first), *side = malloc((3 * triangles + 1) * sizeof *side);
	if (!first || !side) {
		free(first);
		free(side);
		return 0;
	}
#define SIDE_FROM(s) triangle[(s) / 3].v[((s) % 3 + 1) % 3]
#define SIDE_TO(s) triangle[(s) / 3].v[((s) % 3 + 2) % 3]
#define SIDE_LOW(s) (SIDE_FROM(s) < SIDE_TO(s) ? SIDE_FROM(s) : SIDE_TO(s))
	const uint32_t sides = (uint32_t)(3 * triangles);
	for (uint32_t s = 0; s < sides; s++) {
		triangle[s / 3].neighbour[s % 3] = -1;
		first[SIDE_LOW(s)]++;
	}
	for (size_t i = 1; i <= count; i++)
		first[i] += first[i - 1];
	for (uint32_t s = sides; s-- > 0;)
		side[--first[SIDE_LOW(s)]] = s;
	for (size_t i = 0; i < count; i++)
		for (uint32_t a = first[i]; a < first[i + 1]; a++)
			for (uint32_t b = a + 1; b < first[i + 1]; b++) {
				const uint32_t s = side[a], t = side[b];
				if (triangle[s / 3].neighbour[s % 3] < 0 && triangle[t / 3].neighbour[t % 3] < 0
						&& SIDE_FROM(s) == SIDE_TO(t) && SIDE_TO(s) == SIDE_FROM(t)) {
					triangle[s / 3].neighbour[s % 3] = (int32_t)(t / 3);
					triangle[t / 3].neighbour[t % 3] = (int32_t)(s / 3);
				}
			}
	free(first);
	free(side);
	return 1;
}

/* Cosine of the angle at corner k. */
static double corner_cosine(const double (*p)[3], const rbf_triangle *t, int k)
{
	double left[3], right[3];
	rbf_cross3(p[t->v[k]], p[t->v[(k + 1) % 3]], left);
	rbf_cross3(p[t->v[k]], p[t->v[(k + 2) % 3]], right);
	rbf_unit3(left);
	rbf_unit3(right);
	return rbf_dot3(left, right);
}

/* Takes flat triangles off the rim, as long as their inner corner stays in other triangles. False: no memory. */
static int peel(const double (*p)[3], size_t *triangles, rbf_triangle *triangle)
{
	const size_t n = *triangles;
	int32_t *number = malloc((n + 1) * sizeof *number), alive = 0; /* -1: dead */
	if (!number)
		return 0;
	memset(number, 0, (n + 1) * sizeof *number);
	for (int changed = 1; changed;) {
		changed = 0;
		for (size_t i = 0; i < n; i++) {
			int rim = -1, sides = 0;
			for (int k = 0; k < 3; k++)
				if (triangle[i].neighbour[k] < 0) {
					rim = k;
					sides++;
				}
			if (number[i] < 0 || sides != 1 || corner_cosine(p, &triangle[i], rim) > FLAT_COSINE)
				continue;
			for (int k = 0; k < 3; k++)
				for (int j = 0; j < 3 && k != rim; j++)
					if (triangle[triangle[i].neighbour[k]].neighbour[j] == (int32_t)i)
						triangle[triangle[i].neighbour[k]].neighbour[j] = -1;
			number[i] = -1;
			changed = 1;
		}
	}
	for (size_t i = 0; i < n; i++)
		if (number[i] >= 0)
			number[i] = alive++;
	for (size_t i = 0; i < n; i++)
		if (number[i] >= 0) {
			rbf_triangle t = triangle[i];
			for (int k = 0; k < 3; k++)
				if (t.neighbour[k] >= 0)
					t.neighbour[k] = number[t.neighbour[k]];
			triangle[number[i]] = t;
		}
	*triangles = (size_t)alive;
	free(number);
	return 1;
}

/* Frees what qhull holds. Its long jumps are caught here too: unasked, it would end the process. */
static void release(qhT *qh)
{
	int current, total;
	if (!setjmp(qh->errexit)) {
		qh->NOerrexit = False;
		qh_freeqhull(qh, !qh_ALL);
	}
	qh->NOerrexit = True;
	qh_memfreeshort(qh, &current, &total);
	free(qh);
}

bsdfrbf_status rbf_hull(bsdfrbf_context *context, size_t count, const double (*direction)[3],
	size_t *triangles, rbf_triangle **triangle)
{
	*triangles = 0;
	*triangle = NULL;
	/* qhull writes what goes wrong to a stream and insists on having one */
	char *text = NULL;
	size_t text_size = 0;
	coordT *point = malloc((count + 1) * 3 * sizeof *point);
	FILE *messages = open_memstream(&text, &text_size);
	qhT *qh = malloc(sizeof *qh);
	if (!point || !messages || !qh) {
		free(point);
		free(qh);
		if (messages)
			fclose(messages);
		free(text);
		return rbf_out_of_memory(context);
	}
	for (size_t i = 0; i < count; i++) {
		const double lift = 1 + LIFT * atan2(fabs(direction[i][1]), fabs(direction[i][0]));
		for (int k = 0; k < 3; k++)
			point[3 * i + (size_t)k] = lift * direction[i][k];
	}
	memset(point + 3 * count, 0, 3 * sizeof *point);
	char command[] = "qhull Qt Q12 Pp";
	qh_zero(qh, messages);
	int copied = 0;
	/* qh_new_qhull catches qhull's long jumps; walking its lists raises none */
	const int failed = qh_new_qhull(qh, 3, (int)count + 1, point, False, command, NULL, messages);
	if (!failed)
		copied = collect(qh, count, direction, triangle, triangles);
	release(qh);
	free(point);
	fclose(messages);
	bsdfrbf_status status = BSDFRBF_OK;
	if (failed) {
		if (text)
			text[strcspn(text, "\n")] = 0;
		status = rbf_fail(context, failed == qh_ERRmem ? BSDFRBF_ERR_MEMORY : BSDFRBF_ERR_INTERNAL, "no mesh of %zu incident directions: %s", count,
			text ? text : "qhull failed");
	} else if (!copied || !connect(count, *triangles, *triangle)
			|| !peel(direction, triangles, *triangle)) {
		free(*triangle);
		*triangle = NULL;
		*triangles = 0;
		status = rbf_out_of_memory(context);
	}
	free(text);
	return status;
}
