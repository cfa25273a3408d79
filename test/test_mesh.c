/* SPDX-License-Identifier: BSD-3-Clause */
/* The mesh of incident directions, and its locator against a brute-force search. */
#define _POSIX_C_SOURCE 200809L
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>

#include "../libbsdfrbf/mesh_build.h"
#include "../libbsdfrbf/mesh_inside.h"
#include "plans.h"

static uint64_t random_state;

static double uniform(void)
{
	random_state = random_state * 6364136223846793005u + 1442695040888963407u;
	return (double)(random_state >> 11) * 0x1p-53;
}

static double seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void random_direction(rbf_symmetry symmetry, double theta_max, float d[3])
{
	const double z = 1 - uniform() * (1 - cos(theta_max)), r = sqrt(1 - z * z), phi = 2 * RBF_PI * uniform();
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)z;
	rbf_normalize(d);
	rbf_mirror((unsigned)rbf_symmetry_fold(symmetry, d), d, d);
}

/* ------------------------------------------------------------ brute force, in double */

static double det3(const double a[3], const double b[3], const double c[3])
{
	double n[3];
	rbf_cross3(a, b, n);
	return rbf_dot3(n, c);
}

static void vertex_of(const rbf_mesh *m, uint32_t i, double p[3])
{
	for (int k = 0; k < 3; k++)
		p[k] = m->vertex[i].direction[k];
}

/* Smallest normalised weight of d in the best element; negative outside all. */
static double best_weight(const rbf_mesh *m, const double d[3], uint32_t *element)
{
	double best = -1e30;
	for (uint32_t e = 0; e < m->elements; e++) {
		double p[3][3], w[3], sum = 0;
		for (int k = 0; k < 3; k++)
			vertex_of(m, m->element[e].v[k], p[k]);
		for (int k = 0; k < 3; k++)
			sum += w[k] = det3(p[(k + 1) % 3], p[(k + 2) % 3], d);
		const double least = fmin(fmin(w[0], w[1]), w[2]) / sum;
		if (sum > 0 && least > best) {
			best = least;
			*element = e;
		}
	}
	return best;
}

/* Distance to the nearest border by walking along each arc: slow, and unlike the library's way. */
static double border_distance(const rbf_mesh *m, const double d[3])
{
	double best = 10;
	for (uint32_t i = 0; i < m->borders; i++) {
		double a[3], b[3], low = 0, high = 1;
		vertex_of(m, m->border[i][0], a);
		vertex_of(m, m->border[i][1], b);
		for (int turn = 0; turn < 60; turn++) {
			double at[2];
			for (int s = 0; s < 2; s++) {
				const double t = low + (high - low) * (s + 1) / 3;
				double p[3], gap[3];
				for (int k = 0; k < 3; k++)
					p[k] = (1 - t) * a[k] + t * b[k];
				rbf_unit3(p);
				for (int k = 0; k < 3; k++)
					gap[k] = p[k] - d[k];
				at[s] = sqrt(rbf_dot3(gap, gap));
				best = fmin(best, at[s]);
			}
			if (at[0] < at[1])
				high = low + (high - low) * 2 / 3;
			else
				low = low + (high - low) / 3;
		}
	}
	return best;
}

static double triangle_area(const double a[3], const double b[3], const double c[3])
{
	/* Van Oosterom and Strackee, 1983 */
	return 2 * atan2(det3(a, b, c), 1 + rbf_dot3(a, b) + rbf_dot3(b, c) + rbf_dot3(c, a));
}

/* The point that weights stand for. */
static void reproduced(const rbf_mesh *m, const uint32_t corner[3], const float weight[3], double p[3])
{
	p[0] = p[1] = p[2] = 0;
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 3; i++)
			p[i] += (double)weight[k] * m->vertex[corner[k]].direction[i];
	rbf_unit3(p);
}

static double distance(const double a[3], const double b[3])
{
	const double d[3] = { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
	return sqrt(rbf_dot3(d, d));
}

/* Locates d, checks the answer by brute force; returns 1 if inside. p: the point reproduced. */
static int check_locate(const rbf_mesh *m, const float d[3], double p[3])
{
	uint32_t corner[3] = { ~0u, ~0u, ~0u }, element = 0;
	float w[3] = { NAN, NAN, NAN };
	const uint32_t found = rbf_mesh_locate(m, d, corner, w);
	const double dd[3] = { d[0], d[1], d[2] };
	double sum = 0;
	for (int k = 0; k < 3; k++) {
		assert_true(corner[k] < m->vertices);
		assert_true(w[k] >= 0 && w[k] <= 1.000001f);
		sum += w[k];
	}
	assert_true(fabs(sum - 1) < 1e-5);
	reproduced(m, corner, w, p);
	const double least = best_weight(m, dd, &element);
	if (found & RBF_MESH_BORDER) {
		assert_true((found & ~RBF_MESH_BORDER) < m->borders);
		assert_true(least < 2e-4); /* not inside any element, up to rounding in thin ones */
		const double expected = border_distance(m, dd);
		if (fabs(distance(p, dd) - expected) > 2e-5)
			fail_msg("border at %g, nearest at %g, d = %g %g %g", distance(p, dd), expected, dd[0], dd[1], dd[2]);
		return 0;
	}
	assert_true(found < m->elements);
	assert_true(least > -2e-4);
	/* an inverse in float loses what a thin element amplifies */
	double amplified = 0;
	for (int k = 0; k < 9; k++)
		amplified = fmax(amplified, fabs(m->element[found].inverse[k / 3][k % 3]));
	if (distance(p, dd) > 1.5e-5 + 2e-7 * amplified)
		fail_msg("direction %g %g %g comes back %g off", dd[0], dd[1], dd[2], distance(p, dd));
	return 1;
}

static void check_structure(const rbf_mesh *m, const plan *plan, long exclude)
{
	for (uint32_t i = 0; i < m->vertices; i++) {
		const rbf_vertex *v = &m->vertex[i];
		assert_true(v->base < plan->count && (long)v->base != exclude && v->op < 4);
		assert_true(v->direction[2] >= 0);
		if (m->symmetry == RBF_ISOTROPIC) {
			assert_true(v->op == (v->direction[0] < 0 ? RBF_OP_X : RBF_OP_NONE));
			continue;
		}
		const float base[3] = { (float)plan->d[v->base][0], (float)plan->d[v->base][1], (float)plan->d[v->base][2] };
		float image[3];
		rbf_mirror(v->op, base, image);
		for (int k = 0; k < 3; k++)
			assert_true(fabsf(image[k] - v->direction[k]) < 1e-4f);
	}
	for (uint32_t e = 0; e < m->elements; e++) {
		double p[3][3];
		for (int k = 0; k < 3; k++) {
			assert_true(m->element[e].v[k] < m->vertices);
			vertex_of(m, m->element[e].v[k], p[k]);
		}
		if (m->symmetry != RBF_ISOTROPIC)
			assert_true(det3(p[0], p[1], p[2]) > 0);
	}
	assert_true(m->borders > 0);
	for (uint32_t i = 0; i < m->borders; i++) {
		assert_true(m->border[i][0] < m->vertices && m->border[i][1] < m->vertices);
		const uint32_t e = m->border[i][2];
		if (e == RBF_MESH_NO_ELEMENT) {
			assert_true(m->elements == 0);
			continue;
		}
		assert_true(e < m->elements);
		int cyclic = 0;
		for (int k = 0; k < 3; k++)
			cyclic |= m->element[e].v[k] == m->border[i][0] && m->element[e].v[(k + 1) % 3] == m->border[i][1];
		assert_true(cyclic || m->symmetry == RBF_ISOTROPIC);
	}
	assert_true(m->cell_first[0] == 0 && m->cell_first[rbf_mesh_cells(m)] == m->cell_entries);
	for (uint32_t c = 0; c < rbf_mesh_cells(m); c++)
		for (uint32_t k = m->cell_first[c]; k < m->cell_first[c + 1]; k++) {
			const uint32_t item = m->cell_element[k];
			assert_true((item & ~RBF_MESH_BORDER) < (item & RBF_MESH_BORDER ? m->borders : m->elements));
			for (uint32_t l = m->cell_first[c]; l < k; l++) /* elements, none twice, then borders in ascending order */
				assert_true(item & RBF_MESH_BORDER ? m->cell_element[l] < item : m->cell_element[l] != item && !(m->cell_element[l] & RBF_MESH_BORDER));
		}
}

/* Of the directions in cells of more than two elements, how many one of the first two holds. */
static double found_first(const rbf_mesh *m, double theta_max)
{
	int found = 0, all = 0;
	for (int i = 0; i < 20000; i++) {
		float d[3], theta, w[3];
		uint32_t corner[3];
		random_direction(m->symmetry, theta_max, d);
		const uint32_t c = rbf_mesh_cell(m, d, &theta), first = m->cell_first[c], item = rbf_mesh_locate(m, d, corner, w);
		if (m->cell_first[c + 1] - first < 3 || m->cell_element[first + 2] & RBF_MESH_BORDER || item & RBF_MESH_BORDER)
			continue;
		all++;
		found += item == m->cell_element[first] || item == m->cell_element[first + 1];
	}
	return all ? (double)found / all : 1;
}

/* Vertices must return themselves; random directions, directions on edges, the pole and the horizon must agree with
 * brute force; a small step moves the reproduced point by a small step, inside, across borders and outside. */
static int check_mesh(const rbf_mesh *m, const plan *plan, long exclude, int trials, double theta_max)
{
	double p[3], q[3];
	int inside = 0;
	check_structure(m, plan, exclude);
	for (uint32_t i = 0; i < m->vertices; i++) {
		float d[3];
		memcpy(d, m->vertex[i].direction, sizeof d);
		if (rbf_symmetry_fold(m->symmetry, d) != RBF_OP_NONE)
			continue;
		uint32_t corner[3];
		float w[3];
		check_locate(m, d, p);
		rbf_mesh_locate(m, d, corner, w);
		float own = 0;
		for (int k = 0; k < 3; k++)
			if (corner[k] == i)
				own += w[k];
		if (own < .999f)
			fail_msg("vertex %u is reproduced to %g only", i, (double)own);
	}
	for (int i = 0; i < trials; i++) {
		float d[3], e[3];
		random_direction(m->symmetry, theta_max, d);
		if (i % 5 == 1 && m->elements) { /* on an edge */
			const rbf_element *el = &m->element[(uint32_t)(uniform() * m->elements)];
			const float t = (float)uniform();
			for (int k = 0; k < 3; k++)
				d[k] = (1 - t) * m->vertex[el->v[0]].direction[k] + t * m->vertex[el->v[1]].direction[k];
			rbf_normalize(d);
			rbf_mirror((unsigned)rbf_symmetry_fold(m->symmetry, d), d, d);
		} else if (i % 50 == 2) {
			d[2] = 0; /* horizon */
			rbf_normalize(d);
		} else if (i % 50 == 3) {
			d[0] = d[1] = 0;
			d[2] = 1;
		}
		inside += check_locate(m, d, p);
		const double step = 1e-4;
		for (int k = 0; k < 3; k++)
			e[k] = d[k] + (float)(step * (2 * uniform() - 1));
		e[2] = fmaxf(e[2], 0);
		rbf_normalize(e);
		const int op = rbf_symmetry_fold(m->symmetry, e);
		rbf_mirror((unsigned)op, e, e);
		check_locate(m, e, q);
		if (op & RBF_OP_X)
			q[0] = -q[0];
		if (op & RBF_OP_Y)
			q[1] = -q[1];
		const double dd[3] = { d[0], d[1], d[2] };
		/* nearest points are unique up to a quarter circle from a convex rim, and contract */
		if (border_distance(m, dd) < .5 && distance(p, q) > 4 * step)
			fail_msg("a step of %g jumps by %g at %g %g %g", step, distance(p, q), dd[0], dd[1], dd[2]);
	}
	return inside;
}

static rbf_mesh build(rbf_symmetry symmetry, const plan *plan, long exclude)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	static unsigned char out[MAX_PLAN];
	rbf_mesh m;
	memset(out, 0, sizeof out);
	if (exclude >= 0)
		rbf_mesh_leave_out(symmetry, plan->count, &plan->d[0][0], (size_t)exclude, out);
	const bsdfrbf_status status = rbf_mesh_build(context, symmetry, plan->count, &plan->d[0][0], exclude >= 0 ? out : NULL, &m);
	if (status != BSDFRBF_OK)
		fail_msg("mesh: %s", bsdfrbf_message(context));
	bsdfrbf_context_free(context);
	return m;
}

/* --------------------------------------------------------------------- whole hull */

static const double (*hull_point)[2];

static int by_xy(const void *a, const void *b)
{
	const double *p = hull_point[*(const int *)a], *q = hull_point[*(const int *)b];
	if (p[0] != q[0])
		return p[0] < q[0] ? -1 : 1;
	return (p[1] > q[1]) - (p[1] < q[1]);
}

/* Area of the spherical convex hull by way of the plane convex hull of the gnomonic projection. */
static double hull_area(size_t n, const double (*p)[3])
{
	double (*flat)[2] = calloc(n, sizeof *flat);
	int *order = calloc(n, sizeof *order), *hull = calloc(2 * n + 2, sizeof *hull);
	for (size_t i = 0; i < n; i++) {
		flat[i][0] = p[i][0] / p[i][2];
		flat[i][1] = p[i][1] / p[i][2];
		order[i] = (int)i;
	}
	hull_point = (const double (*)[2])flat;
	qsort(order, n, sizeof *order, by_xy);
	size_t k = 0;
	for (int pass = 0; pass < 2; pass++) {
		const size_t floor = k + 1;
		for (size_t j = 0; j < n; j++) {
			const int i = order[pass ? n - 1 - j : j];
			while (k > floor && (flat[hull[k-1]][0] - flat[hull[k-2]][0]) * (flat[i][1] - flat[hull[k-2]][1])
					<= (flat[hull[k-1]][1] - flat[hull[k-2]][1]) * (flat[i][0] - flat[hull[k-2]][0]))
				k--;
			hull[k++] = i;
		}
		k--;
	}
	double area = 0;
	for (size_t i = 1; i + 1 < k; i++)
		area += triangle_area(p[hull[0]], p[hull[i]], p[hull[i + 1]]);
	free(flat);
	free(order);
	free(hull);
	return area;
}

/* The triangles cover the convex hull once: areas add up, every vertex is used, neighbours are mutual and
 * Delaunay's empty circle holds. */
static void check_hull(const plan *plan, double expected, double slack)
{
	size_t n;
	rbf_triangle *t;
	assert_int_equal(rbf_hull(NULL, plan->count, (const double (*)[3])plan->d, &n, &t), BSDFRBF_OK);
	double area = 0, enclosed = 0, middle[3] = { 0, 0, 0 };
	unsigned char *used = calloc(plan->count, 1);
	size_t rim = 0;
	for (size_t j = 0; j < plan->count; j++)
		for (int k = 0; k < 3; k++)
			middle[k] += plan->d[j][k];
	rbf_unit3(middle);
	for (size_t i = 0; i < n; i++) {
		const double *a = plan->d[t[i].v[0]], *b = plan->d[t[i].v[1]], *c = plan->d[t[i].v[2]];
		const double one = triangle_area(a, b, c);
		assert_true(one > 0);
		area += one;
		double ab[3], ac[3], normal[3];
		for (int k = 0; k < 3; k++) {
			used[t[i].v[k]] = 1;
			ab[k] = b[k] - a[k];
			ac[k] = c[k] - a[k];
			if (t[i].neighbour[k] < 0) {
				enclosed += triangle_area(middle, plan->d[t[i].v[(k + 1) % 3]], plan->d[t[i].v[(k + 2) % 3]]);
				rim++;
				continue;
			}
			int back = 0;
			for (int j = 0; j < 3; j++)
				back |= t[t[i].neighbour[k]].neighbour[j] == (int32_t)i;
			assert_true(back);
		}
		rbf_cross3(ab, ac, normal);
		rbf_unit3(normal);
		const double height = rbf_dot3(normal, a);
		if (plan->count <= 500)
			for (size_t j = 0; j < plan->count; j++)
				assert_true(rbf_dot3(normal, plan->d[j]) < height + 1e-9);
	}
	for (size_t j = 0; j < plan->count; j++)
		assert_true(used[j]);
	/* Euler: triangles = 2 vertices - 2 - rim sides, for one piece without holes */
	assert_int_equal(n, 2 * plan->count - 2 - rim);
	if (fabs(area - enclosed) > 1e-9)
		fail_msg("area %.12f, but the rim encloses %.12f", area, enclosed);
	/* never more than the hull; less only by the flat triangles that the rim of a scattered plan loses */
	if (area > expected * (1 + 1e-9) || area < expected - slack - 1e-9)
		fail_msg("area %.9f, hull %.9f", area, expected);
	free(used);
	free(t);
}

static void test_hull(void **state)
{
	(void)state;
	plan *p = rings(1, 10, 80, 10, 0, 345, 15);
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	p = rings(0, 10, 80, 10, 7.5, 352.5, 15); /* a 24-gon about the pole */
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	p = rings(1, 15, 75, 15, 0, 359, 24);
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	p = rings(1, 12, 72, 12, 0, 180, 20); /* a half, straight rim through the pole */
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	p = rings(1, 10, 80, 10, 0, 90, 15);
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	p = rings(1, 10, 90, 10, 0, 359, 10); /* to the horizon */
	check_hull(p, 2 * RBF_PI, 0);
	p = rings(1, 1.5, 88.5, 1.5, 0, 359, 5); /* 4249 points */
	check_hull(p, hull_area(p->count, (const double (*)[3])p->d), 0);
	random_state = 5;
	for (int trial = 0; trial < 200; trial++) {
		scratch.count = 0;
		const int n = 4 + (int)(uniform() * 60);
		for (int i = 0; i < n; i++)
			add(&scratch, 85 * sqrt(uniform()), 360 * uniform());
		check_hull(&scratch, hull_area(scratch.count, (const double (*)[3])scratch.d), .02);
	}
}

/* ------------------------------------------------------------------------- meshes */

static void test_plans(void **state)
{
	(void)state;
	random_state = 1;
	struct { const char *name; rbf_symmetry symmetry; plan *plan; double reach; } set[4];
	for (int i = 0; i < 4; i++) {
		switch (i) {
		case 0: set[i].plan = rings(1, 10, 80, 10, 0, 90, 15); set[i].symmetry = RBF_QUADRILATERAL; set[i].reach = 79; break;
		case 1: set[i].plan = rings(1, 12, 72, 12, 0, 180, 20); set[i].symmetry = RBF_BILATERAL_Y; set[i].reach = 71; break;
		case 2: set[i].plan = rings(0, 0, 80, 8, 0, 0, 1); set[i].symmetry = RBF_ISOTROPIC; set[i].reach = 80; break;
		case 3: set[i].plan = rings(1, 15, 75, 15, 0, 359, 24); set[i].symmetry = RBF_ANISOTROPIC; set[i].reach = 74; break;
		}
		if (i == 2)
			continue; /* test_isotropic */
		rbf_mesh m = build(set[i].symmetry, set[i].plan, -1);
		check_mesh(&m, set[i].plan, -1, 6000, RBF_PI / 2);
		/* everything well inside the measured cone is inside the mesh */
		assert_int_equal(check_mesh(&m, set[i].plan, -1, 300, (set[i].reach - 10) * DEGREE), 300 - 6);
		print_message("plan %d: %u vertices, %u elements, %u borders, %u entries\n", i, m.vertices, m.elements,
			m.borders, m.cell_entries);
		rbf_mesh_free(&m);
		/* leave each out once */
		for (size_t k = 0; k < set[i].plan->count; k += 7) {
			m = build(set[i].symmetry, set[i].plan, (long)k);
			check_mesh(&m, set[i].plan, (long)k, 200, RBF_PI / 2);
			rbf_mesh_free(&m);
		}
	}
}

static void test_isotropic(void **state)
{
	(void)state;
	for (int pole = 0; pole < 2; pole++) {
		plan *p = rings(0, pole ? 0 : 8, 80, 8, 30, 30, 1);
		for (long exclude = -1; exclude < (long)p->count; exclude++) {
			rbf_mesh m = build(RBF_ISOTROPIC, p, exclude);
			check_structure(&m, p, exclude);
			float last = m.vertex[m.vertices - 1].direction[0];
			for (double t = 0; t <= 90; t += .37) {
				const float d[3] = { (float)sin(t * DEGREE), 0, (float)cos(t * DEGREE) };
				uint32_t corner[3];
				float w[3];
				const uint32_t found = rbf_mesh_locate(&m, d, corner, w);
				double theta = 0;
				for (int k = 0; k < 3; k++) {
					assert_true(w[k] >= 0);
					theta += w[k] * atan2(m.vertex[corner[k]].direction[0], m.vertex[corner[k]].direction[2]);
				}
				assert_true(fabs(w[0] + w[1] + w[2] - 1) < 1e-6);
				assert_int_equal((found & RBF_MESH_BORDER) != 0, d[0] > last);
				assert_true(fabs(theta - fmin(t * DEGREE, asin(last))) < 1e-5);
			}
			rbf_mesh_free(&m);
		}
	}
}

/* A base and all its images are found by folding, with the base's own weight. */
static void test_folds(void **state)
{
	(void)state;
	static const rbf_symmetry group[] = { RBF_ANISOTROPIC, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_QUADRILATERAL };
	for (int g = 0; g < 5; g++) {
		int op[4];
		const int ops = rbf_symmetry_ops(group[g], op);
		assert_int_equal(ops, g == 0 ? 1 : g == 4 ? 4 : 2);
		for (int a = 0; a < ops; a++)
			for (int b = 0; b < ops; b++) {
				int member = 0;
				for (int c = 0; c < ops; c++)
					member |= op[c] == (op[a] ^ op[b]);
				assert_true(member);
			}
		random_state = 9;
		plan *p = rings(1, 20, 80, 15, 5, 360, 13); /* no axis, the full circle: more than any group needs */
		rbf_mesh m = build(group[g], p, -1);
		check_mesh(&m, p, -1, 1500, RBF_PI / 2);
		if (g == 0)
			assert_int_equal(m.vertices, p->count);
		rbf_mesh_free(&m);
		/* half of the fundamental domain's data lies outside it: images take over */
		p = rings(1, 20, 80, 15, g == 1 ? 90 : 180, g == 1 ? 270 : 360, 15);
		m = build(group[g], p, -1);
		check_mesh(&m, p, -1, 1500, RBF_PI / 2);
		rbf_mesh_free(&m);
	}
	/* On the axes an image is its own base: no doubles. Full mesh of the quadrilateral plan: 1 + 8 x 24. */
	plan *p = rings(1, 10, 80, 10, 0, 90, 15);
	rbf_mesh m = build(RBF_QUADRILATERAL, p, -1);
	for (uint32_t i = 0; i < m.vertices; i++)
		for (uint32_t j = 0; j < i; j++)
			assert_true(rbf_dot(m.vertex[i].direction, m.vertex[j].direction) < .9999f);
	assert_int_equal(m.vertices, 57);
	rbf_mesh_free(&m);
}

/* A group's mesh places a direction as the mesh of all images, spelled out, does: at the same distance outside, and
 * exactly inside. */
static void test_images(void **state)
{
	(void)state;
	static const rbf_symmetry group[] = { RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_QUADRILATERAL };
	random_state = 21;
	for (int trial = 0; trial < 40; trial++) {
		int op[4];
		const int ops = rbf_symmetry_ops(group[trial % 4], op);
		scratch.count = 0;
		for (int i = 0; i < 12; i++)
			if (trial < 20) /* along a tilted plane: under rotation the nearest rim may lie across y = 0 */
				add(&scratch, 5 + 6 * i, 20 + 15 * uniform());
			else
				add(&scratch, 20 + 50 * uniform(), 360 * uniform());
		rbf_mesh m = build(group[trial % 4], &scratch, -1);
		for (int k = 1; k < ops; k++)
			for (int i = 0; i < 12; i++) {
				double *d = scratch.d[scratch.count++];
				memcpy(d, scratch.d[i], sizeof scratch.d[i]);
				d[0] = op[k] & RBF_OP_X ? -d[0] : d[0];
				d[1] = op[k] & RBF_OP_Y ? -d[1] : d[1];
			}
		rbf_mesh all = build(RBF_ANISOTROPIC, &scratch, -1);
		for (int i = 0; i < 400; i++) {
			uint32_t corner[3];
			float d[3], w[3];
			double p[3], q[3];
			random_direction(m.symmetry, RBF_PI / 2, d);
			const double dd[3] = { d[0], d[1], d[2] };
			rbf_mesh_locate(&m, d, corner, w);
			reproduced(&m, corner, w, p);
			rbf_mesh_locate(&all, d, corner, w);
			reproduced(&all, corner, w, q);
			if (fabs(distance(p, dd) - distance(q, dd)) > 5e-5)
				fail_msg("group %c: %g and %g away", group[trial % 4], distance(p, dd), distance(q, dd));
		}
		rbf_mesh_free(&m);
		rbf_mesh_free(&all);
	}
}

static void test_degenerate(void **state)
{
	(void)state;
	random_state = 3;
	static const rbf_symmetry group[] = { RBF_ANISOTROPIC, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_QUADRILATERAL };
	static const struct { int n; double at[8][2]; } set[] = {
		{ 1, { { 0, 0 } } }, { 1, { { 40, 30 } } }, { 1, { { 90, 0 } } },
		{ 2, { { 0, 0 }, { 30, 0 } } }, { 2, { { 40, 10 }, { 60, 80 } } }, { 2, { { 20, 0 }, { 20.01, 0 } } },
		{ 3, { { 0, 0 }, { 30, 0 }, { 60, 0 } } }, { 3, { { 30, 0 }, { 50, 40 }, { 10, 70 } } },
		{ 3, { { 80, 0 }, { 80, 120 }, { 80, 240 } } }, { 3, { { 60, 0 }, { 0, 0 }, { 60, 180 } } },
		{ 4, { { 89.9, 0 }, { 89.9, 90 }, { 89.9, 180 }, { 89.9, 270 } } },
		{ 5, { { 90, 0 }, { 90, 72 }, { 90, 144 }, { 90, 216 }, { 90, 288 } } },
		{ 4, { { 30, 10 }, { 30.02, 10 }, { 30, 10.03 }, { 30.02, 10.05 } } },
		{ 5, { { 10, 45 }, { 30, 45 }, { 50, 45 }, { 70, 45 }, { 0, 0 } } },
		{ 6, { { 0, 0 }, { 40, 0 }, { 40.2, 0 }, { 40, 90 }, { 40, 180 }, { 40, 270 } } },
		{ 8, { { 0, 0 }, { 0.002, 50 }, { 40, 0 }, { 40.001, 0 }, { 40, 90 }, { 40, 180 }, { 40, 270 }, { 90, 0 } } },
	};
	for (size_t s = 0; s < sizeof set / sizeof *set; s++)
		for (int g = 0; g < 5; g++) {
			scratch.count = 0;
			for (int i = 0; i < set[s].n; i++)
				add(&scratch, set[s].at[i][0], set[s].at[i][1]);
			rbf_mesh m = build(group[g], &scratch, -1);
			check_structure(&m, &scratch, -1);
			for (int i = 0; i < 200; i++) {
				float d[3];
				double p[3];
				random_direction(group[g], RBF_PI / 2, d);
				check_locate(&m, d, p);
			}
			rbf_mesh_free(&m);
		}
	/* what is closer than a device can tell is one vertex */
	scratch.count = 0;
	add(&scratch, 0, 0);
	add(&scratch, 40, 0);
	add(&scratch, 40.001, 0);
	add(&scratch, 40, 90);
	add(&scratch, 40, 89.999);
	add(&scratch, 40, 200);
	rbf_mesh m = build(RBF_ANISOTROPIC, &scratch, -1);
	assert_int_equal(m.vertices, 4);
	rbf_mesh_free(&m);
	/* a rim all on the horizon is a closed chain */
	scratch.count = 0;
	for (int p = 0; p < 360; p += 72)
		add(&scratch, 90, p);
	m = build(RBF_ANISOTROPIC, &scratch, -1);
	assert_int_equal(m.borders, 5);
	rbf_mesh_free(&m);
	/* a flat triangle stays where its inner corner has no other */
	scratch.count = 0;
	add(&scratch, 40, 0);
	add(&scratch, .15, 90);
	add(&scratch, 40, 180);
	m = build(RBF_ANISOTROPIC, &scratch, -1);
	assert_int_equal(m.elements, 1);
	rbf_mesh_free(&m);
	/* nothing left: a DATA error, and nothing to free */
	bsdfrbf_context *context = bsdfrbf_context_new();
	scratch.count = 0;
	add(&scratch, 10, 10);
	const unsigned char all = 1;
	assert_int_equal(rbf_mesh_build(context, RBF_ANISOTROPIC, 1, &scratch.d[0][0], &all, &m), BSDFRBF_ERR_DATA);
	assert_int_equal(rbf_mesh_build(context, RBF_ISOTROPIC, 1, &scratch.d[0][0], &all, &m), BSDFRBF_ERR_DATA);
	assert_int_equal(rbf_mesh_build(context, RBF_ISOTROPIC, 0, NULL, NULL, &m), BSDFRBF_ERR_DATA);
	assert_true(strlen(bsdfrbf_message(context)) > 0 && !m.vertex);
	bsdfrbf_context_free(context);
}

/* The point of a border of .1 degrees that is nearest to a direction beside it: to the last bits of the directions, though the lengths
 * of rounded unit vectors differ by as much as its way along the border. */
static void test_short_border(void **state)
{
	(void)state;
	double worst = 0;
	for (int turn = 0; turn < 180; turn++) {
		scratch.count = 0;
		add(&scratch, 20, 2 * turn - 40);
		add(&scratch, 20, 2 * turn + 40);
		add(&scratch, 50, 2 * turn);
		add(&scratch, 50.05, 2 * turn + .1);
		rbf_mesh m = build(RBF_ANISOTROPIC, &scratch, -1);
		for (uint32_t i = 0; i < m.borders; i++) {
			double a[3], b[3], e[3], out[3], d[3], p[3], near[3];
			vertex_of(&m, m.border[i][0], a);
			vertex_of(&m, m.border[i][1], b);
			if (distance(a, b) > .01)
				continue;
			rbf_unit3(a);
			rbf_unit3(b);
			for (int k = 0; k < 3; k++)
				e[k] = b[k] - a[k];
			rbf_cross3(b, a, out); /* outwards: to the right of the way from a to b */
			rbf_unit3(out);
			for (int k = 0; k < 3; k++) {
				near[k] = a[k] + .3 * e[k];
				d[k] = near[k] + 1e-4 * out[k];
			}
			rbf_unit3(near);
			rbf_unit3(d);
			const float f[3] = { (float)d[0], (float)d[1], (float)d[2] };
			uint32_t corner[3];
			float weight[3];
			assert_int_equal(rbf_mesh_locate(&m, f, corner, weight), RBF_MESH_BORDER | i);
			reproduced(&m, corner, weight, p);
			worst = fmax(worst, distance(p, near));
		}
		rbf_mesh_free(&m);
	}
	print_message("short borders: nearest point off by at most %.2g rad\n", worst);
	assert_true(worst > 0 && worst < 5e-7);
}

/* Directions that nobody should ask for must not break anything. */
static void test_odd_queries(void **state)
{
	(void)state;
	plan *p = rings(1, 10, 80, 10, 0, 90, 15);
	rbf_mesh m = build(RBF_QUADRILATERAL, p, -1);
	static const float odd[][3] = { { -.5f, -.5f, .7071f }, { 0, 0, -1 }, { 0, 0, 0 }, { NAN, 0, 1 }, { 0, INFINITY, 1 },
		{ -0.f, -0.f, 1 }, { 1, 0, -1e-6f }, { -1e-9f, .5f, .866f } };
	for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
		uint32_t corner[3];
		float w[3];
		const uint32_t found = rbf_mesh_locate(&m, odd[i], corner, w);
		assert_true((found & ~RBF_MESH_BORDER) < (found & RBF_MESH_BORDER ? m.borders : m.elements));
		for (int k = 0; k < 3; k++)
			assert_true(corner[k] < m.vertices && w[k] >= 0 && w[k] <= 1);
	}
	rbf_mesh_free(&m);
}

/* Jittered grids, clusters, near-collinear rims, mirrored near the axes. */
static void test_stress(void **state)
{
	(void)state;
	static const rbf_symmetry group[] = { RBF_ANISOTROPIC, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_QUADRILATERAL };
	for (int trial = 0; trial < 300; trial++) {
		random_state = 1000 + (uint64_t)trial;
		scratch.count = 0;
		const int kind = trial % 6, n = 3 + (int)(uniform() * 40);
		const double jitter = pow(10, -7 + 7 * uniform());
		if (kind < 3)
			for (int t = 10; t <= 90; t += 20)
				for (int p = 0; p < 360; p += 30)
					add(&scratch, fmin(t + jitter * (uniform() - .5), 90), p + jitter * (uniform() - .5));
		else
			for (int i = 0; i < n; i++)
				switch (kind) {
				case 3: add(&scratch, 90 * sqrt(uniform()), 360 * uniform()); break;
				case 4: add(&scratch, 40 + jitter * uniform(), 20 + jitter * uniform()); break; /* a cluster */
				default: { /* near one tilted great circle, and a few off it */
					const double a = 360 * uniform(), off = i % 5 ? jitter * DEGREE * uniform() : uniform();
					double *d = scratch.d[scratch.count];
					d[0] = cos(a);
					d[1] = sin(a) * .6 - .8 * off;
					d[2] = fabs(sin(a) * .8 + .6 * off);
					rbf_unit3(d);
					scratch.count++;
				} }
		rbf_mesh m = build(group[trial % 5], &scratch, -1);
		check_structure(&m, &scratch, -1);
		for (int i = 0; i < 150; i++) {
			float d[3];
			double p[3];
			random_direction(m.symmetry, RBF_PI / 2, d);
			check_locate(&m, d, p);
		}
		rbf_mesh_free(&m);
	}
}

static void test_time(void **state)
{
	(void)state;
	static const struct { const char *name; rbf_symmetry symmetry; int pole; double a[6]; } set[] = {
		{ "57 quadrilateral", RBF_QUADRILATERAL, 1, { 10, 80, 10, 0, 90, 15 } },
		{ "61 bilateral", RBF_BILATERAL_Y, 1, { 12, 72, 12, 0, 180, 20 } },
		{ "76 anisotropic", RBF_ANISOTROPIC, 1, { 15, 75, 15, 0, 359, 24 } },
		{ "5041 anisotropic", RBF_ANISOTROPIC, 1, { 1.25, 87.5, 1.25, 0, 359, 5 } },
	};
	for (int i = 0; i < 4; i++) {
		const double *a = set[i].a;
		plan *p = rings(set[i].pole, a[0], a[1], a[2], a[3], a[4], a[5]);
		const int turns = p->count > 1000 ? 1 : 20;
		double start = seconds();
		rbf_mesh m;
		for (int k = 0; k < turns; k++) {
			m = build(set[i].symmetry, p, -1);
			if (k + 1 < turns)
				rbf_mesh_free(&m);
		}
		const double built = (seconds() - start) / turns;
		enum { QUERIES = 20000 };
		static float d[QUERIES][3];
		for (int k = 0; k < QUERIES; k++)
			random_direction(set[i].symmetry, RBF_PI / 2, d[k]);
		uint32_t corner[3], sum = 0;
		float w[3];
		start = seconds();
		for (int k = 0; k < QUERIES; k++)
			sum += rbf_mesh_locate(&m, d[k], corner, w) + corner[0];
		const double located = (seconds() - start) / QUERIES;
		const double first = found_first(&m, RBF_PI / 2);
		print_message("%s: build %.2f ms, locate %.0f ns, %u elements, %.1f entries a cell (%u), where more than two: %.3f in those\n",
			set[i].name, built * 1e3, located * 1e9, m.elements, m.cell_entries / 4096., sum & 1, first);
		assert_true(p->count > 1000 || first > .85); /* .56 in any order */
		assert_true(built < (p->count > 1000 ? 2 : .1)); /* twentyfold slack: sanitizers, shared machines */
		for (int k = 0; k < 200; k++) {
			double q[3];
			if (p->count > 1000)
				check_locate(&m, d[k], q);
		}
		rbf_mesh_free(&m);
	}
}

/* Measured all round, and twice: whatever symmetry is asked for, nothing that was measured near one that is left out, or near its images, tells of it. */
static void test_left_out(void **state)
{
	static const rbf_symmetry symmetry[] = { RBF_QUADRILATERAL, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_ANISOTROPIC, RBF_ISOTROPIC };
	(void)state;
	plan *p = rings(1, 15, 75, 15, 0, 330, 30);
	for (uint32_t i = 0, once = (uint32_t)p->count; i < once; i++) {
		const double *d = p->d[i], theta = acos(d[2]) / DEGREE;
		if (theta > 1)
			add(p, theta + .2 * uniform(), atan2(d[1], d[0]) / DEGREE + .2 * uniform());
	}
	for (size_t s = 0; s < sizeof symmetry / sizeof *symmetry; s++)
		for (long out = 0; out < (long)p->count; out += 7) {
			rbf_mesh m = build(symmetry[s], p, out);
			float d[3] = { (float)p->d[out][0], (float)p->d[out][1], (float)p->d[out][2] };
			const float sine = hypotf(d[0], d[1]);
			if (symmetry[s] == RBF_ISOTROPIC) {
				d[0] = sine;
				d[1] = 0;
			} else
				rbf_mirror((unsigned)rbf_symmetry_fold(symmetry[s], d), d, d);
			double nearest = 3;
			for (uint32_t v = 0; v < m.vertices; v++) {
				const float *e = m.vertex[v].direction;
				nearest = fmin(nearest, (double)hypotf(hypotf(d[0] - e[0], d[1] - e[1]), d[2] - e[2]));
			}
			if (nearest < .6 * DEGREE || (sine > .5 && nearest > 16 * DEGREE))
				fail_msg("%ld left out of symmetry %c: the nearest is %.2f degrees away", out, symmetry[s], nearest / DEGREE);
			rbf_mesh_free(&m);
		}
}

/* The lean of a diagonal: with azimuth rising outwards or falling, mirrored from quadrant to quadrant; 0: along a ring or a meridian, or across an axis. */
static double lean_of(const float a[3], const float b[3])
{
	const double at = ((double)a[0] + (double)b[0]) * ((double)a[1] + (double)b[1]);
	const double turn = (double)(a[0] * b[1] - a[1] * b[0]), down = (double)(a[2] - b[2]);
	const int across = a[0] * b[0] < -1e-6f || a[1] * b[1] < -1e-6f;
	return across || fabs(at) < 1e-3 || fabs(turn) < 1e-3 || fabs(down) < 1e-3 ? 0 : turn * down * at;
}

/* Finds that incidences are told better along one lean. */
static int by_lean(void *data, size_t count, const rbf_mesh_trial *trial, float *error)
{
	const double *wanted = data;
	assert_true(count > 0);
	for (size_t i = 0; i < count; i++) {
		const rbf_mesh_trial *t = &trial[i];
		double told[3] = { 0, 0, 0 }, sum = 0, is[3];
		for (int n = 0; n < 3; n++) {
			assert_true(t->weight[n] >= 0);
			sum += (double)t->weight[n];
			for (int k = 0; k < 3; k++)
				told[k] += (double)t->weight[n] * (double)t->from[n].direction[k];
		}
		rbf_unit3(told);
		for (int k = 0; k < 3; k++)
			is[k] = t->vertex.direction[k];
		assert_true(distance(told, is) < 1e-5 && fabs(sum - 1) < 1e-5 && t->from[1].base != t->vertex.base);
		error[i] = *wanted * lean_of(t->vertex.direction, t->from[0].direction) > 0 ? .1f : .2f;
	}
	return 0;
}

/* Diagonals of rings lean as the judge says, either way, in all quadrants, and the mesh is as good as any. */
static void test_diagonals(void **state)
{
	(void)state;
	static const struct { rbf_symmetry symmetry; double to, step; } set[] = {
		{ RBF_QUADRILATERAL, 90, 15 }, { RBF_BILATERAL_Y, 180, 20 }, { RBF_UP, 175, 20 }, { RBF_ANISOTROPIC, 359, 24 },
	};
	random_state = 5;
	for (size_t i = 0; i < sizeof set / sizeof *set; i++)
		for (int way = 0; way < 2; way++) {
			bsdfrbf_context *context = bsdfrbf_context_new();
			plan *p = rings(1, 12, 72, 12, set[i].symmetry == RBF_UP ? 5 : 0, set[i].to, set[i].step);
			double wanted = way ? 1 : -1;
			rbf_mesh m, plain = build(set[i].symmetry, p, -1);
			assert_int_equal(rbf_mesh_build_judged(context, set[i].symmetry, p->count, &p->d[0][0], by_lean, &wanted, &m), BSDFRBF_OK);
			check_mesh(&m, p, -1, 3000, RBF_PI / 2);
			assert_int_equal(m.elements, plain.elements);
			int seen = 0;
			for (uint32_t e = 0; e < m.elements; e++)
				for (int k = 0; k < 3; k++) {
					const float *a = m.vertex[m.element[e].v[k]].direction, *b = m.vertex[m.element[e].v[(k + 1) % 3]].direction;
					const double lean = lean_of(a, b);
					if (wanted * lean < 0 && rbf_symmetry_fold(set[i].symmetry, a) == RBF_OP_NONE && rbf_symmetry_fold(set[i].symmetry, b) == RBF_OP_NONE)
						fail_msg("symmetry %c: from %g %g to %g %g leans wrongly", set[i].symmetry, (double)a[0], (double)a[1], (double)b[0], (double)b[1]);
					seen += wanted * lean > 0;
				}
			assert_true(seen > 20);
			rbf_mesh_free(&plain);
			rbf_mesh_free(&m);
			bsdfrbf_context_free(context);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_hull),
		cmocka_unit_test(test_plans),
		cmocka_unit_test(test_isotropic),
		cmocka_unit_test(test_diagonals),
		cmocka_unit_test(test_left_out),
		cmocka_unit_test(test_folds),
		cmocka_unit_test(test_images),
		cmocka_unit_test(test_degenerate),
		cmocka_unit_test(test_short_border),
		cmocka_unit_test(test_odd_queries),
		cmocka_unit_test(test_stress),
		cmocka_unit_test(test_time),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
