/* SPDX-License-Identifier: BSD-3-Clause */
/* Transport: against all permutations where there are few, and by its own certificate (feasible duals, no gap)
 * everywhere else: by weak duality that proves the optimum. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>

#include "transport.h"

typedef struct problem {
	size_t n, m, arcs, count;
	double *supply, *demand, *u, *v;
	rbf_arc *arc;
	rbf_move *moves;
	double cap, cost, gap;
} problem;

static uint64_t state;

static double uniform(void)
{
	state = state * 6364136223846793005u + 1442695040888963407u;
	return (double)(state >> 11) / 9007199254740992.0;
}

static problem problem_new(size_t n, size_t m, double cap)
{
	problem p = {.n = n, .m = m, .cap = cap};
	p.supply = calloc(n, sizeof *p.supply);
	p.demand = calloc(m, sizeof *p.demand);
	p.u = calloc(n, sizeof *p.u);
	p.v = calloc(m, sizeof *p.v);
	p.arc = calloc(n * m + 1, sizeof *p.arc);
	p.moves = calloc(n * m + n + m, sizeof *p.moves);
	return p;
}

static void problem_free(problem *p)
{
	free(p->supply);
	free(p->demand);
	free(p->u);
	free(p->v);
	free(p->arc);
	free(p->moves);
}

static void add_arc(problem *p, size_t i, size_t j, double cost)
{
	p->arc[p->arcs++] = (rbf_arc){(uint32_t)i, (uint32_t)j, (float)cost};
}

static int solve(problem *p)
{
	return rbf_transport_solve(p->n, p->supply, p->m, p->demand, p->arcs, p->arc, p->cap, p->moves, &p->count, &p->cost,
		p->u, p->v, &p->gap);
}

/* Solves and checks everything that must hold of any answer. */
static void solve_and_check(problem *p)
{
	assert_int_equal(solve(p), 0);
	double supply_total = 0, demand_total = 0;
	for (size_t i = 0; i < p->n; i++)
		supply_total += p->supply[i];
	for (size_t j = 0; j < p->m; j++)
		demand_total += p->demand[j];

	float *best = malloc(p->n * p->m * sizeof *best);
	for (size_t k = 0; k < p->n * p->m; k++)
		best[k] = INFINITY;
	for (size_t k = 0; k < p->arcs; k++) {
		float *b = &best[p->arc[k].source * p->m + p->arc[k].target];
		*b = fminf(*b, p->arc[k].cost);
	}
	double *left = calloc(p->n, sizeof *left), *missing = calloc(p->m, sizeof *missing);
	for (size_t i = 0; i < p->n; i++)
		left[i] = p->supply[i] / supply_total;
	for (size_t j = 0; j < p->m; j++)
		missing[j] = p->demand[j] / demand_total;
	double cost = 0, moved = 0;
	for (size_t k = 0; k < p->count; k++) {
		const rbf_move *move = &p->moves[k];
		assert_true(move->mass > 0 && move->source < p->n && move->target < p->m);
		if (k > 0)
			assert_true(move[-1].source < move->source
				|| (move[-1].source == move->source && move[-1].target <= move->target));
		const float c = best[move->source * p->m + move->target];
		assert_true(c < p->cap);
		left[move->source] -= move->mass;
		missing[move->target] -= move->mass;
		cost += move->mass * c;
		moved += move->mass;
	}
	for (size_t i = 0; i < p->n; i++)
		assert_true(left[i] >= -1e-15 * (double)(p->n + p->m));
	for (size_t j = 0; j < p->m; j++)
		assert_true(missing[j] >= -1e-15 * (double)(p->n + p->m));
	assert_true(fabs(cost + (1 - moved) * p->cap - p->cost) <= 1e-12 * p->cap);

	double dual = 0;
	for (size_t i = 0; i < p->n; i++)
		dual += p->u[i] * p->supply[i] / supply_total;
	for (size_t j = 0; j < p->m; j++)
		dual += p->v[j] * p->demand[j] / demand_total;
	for (size_t i = 0; i < p->n; i++)
		for (size_t j = 0; j < p->m; j++)
			assert_true(p->u[i] + p->v[j] <= fmin(best[i * p->m + j], p->cap) + 1e-13 * p->cap);
	assert_true(fabs(p->cost - dual - p->gap) <= 1e-12 * p->cap);
	assert_true(fabs(p->gap) <= 1e-9 * p->cap);
	free(best);
	free(left);
	free(missing);
}

/* Cheapest assignment of the rows from `row` on to the columns that are free. */
static double permute(const problem *p, const float *cost, size_t row, unsigned taken)
{
	if (row == p->n)
		return 0;
	double least = INFINITY;
	for (size_t j = 0; j < p->m; j++)
		if (!(taken >> j & 1))
			least = fmin(least, fmin(cost[row * p->m + j], p->cap) + permute(p, cost, row + 1, taken | 1u << j));
	return least;
}

static void all_permutations(void **unused)
{
	(void)unused;
	for (int seed = 0; seed < 300; seed++) {
		state = (uint64_t)seed;
		const size_t n = 1 + (size_t)(uniform() * 6);
		problem p = problem_new(n, n, .5 + uniform());
		float cost[36];
		for (size_t i = 0; i < n; i++)
			p.supply[i] = p.demand[i] = 3;
		const double share = uniform();
		for (size_t i = 0; i < n; i++)
			for (size_t j = 0; j < n; j++) {
				cost[i * n + j] = INFINITY;
				if (uniform() < share) {
					cost[i * n + j] = (float)(seed % 3 ? uniform() : floor(4 * uniform()) / 4);
					add_arc(&p, i, j, cost[i * n + j]);
				}
			}
		solve_and_check(&p);
		assert_true(fabs(p.cost - permute(&p, cost, 0, 0) / (double)n) < 1e-9 * p.cap);
		problem_free(&p);
	}
}

/* Points in the plane; masses over `decades` powers of ten, every fifth zero if asked for. */
static void fill(problem *p, double reach, double decades, int zeros)
{
	double *x = malloc(2 * (p->n + p->m) * sizeof *x);
	for (size_t i = 0; i < 2 * (p->n + p->m); i++)
		x[i] = uniform();
	for (size_t i = 0; i < p->n; i++)
		p->supply[i] = zeros && i % 5 == 1 ? 0 : pow(10, -decades * uniform());
	for (size_t j = 0; j < p->m; j++)
		p->demand[j] = zeros && j % 5 == 3 ? 0 : 7 * pow(10, -decades * uniform());
	for (size_t i = 0; i < p->n; i++)
		for (size_t j = 0; j < p->m; j++) {
			const double d = hypot(x[2*i] - x[2*(p->n + j)], x[2*i + 1] - x[2*(p->n + j) + 1]);
			if (d < reach)
				add_arc(p, i, j, d * d);
		}
	free(x);
}

static void certified(void **unused)
{
	(void)unused;
	static const struct { size_t n, m; double reach, decades; int zeros; } cases[] = {
		{300, 300, .13, 2, 0}, {300, 300, .27, 2, 0}, {100, 300, 2, 1, 0}, {300, 80, .3, 4, 1}, {50, 50, .4, 12, 0},
		{50, 50, .4, 12, 1}, {1, 40, .5, 2, 0}, {40, 1, .5, 2, 0}, {1, 1, 2, 0, 0}, {2, 2, 2, 15, 0}, {17, 29, .01, 1, 1},
	};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
		for (int seed = 1; seed <= 4; seed++) {
			state = (uint64_t)seed + 100 * k;
			problem p = problem_new(cases[k].n, cases[k].m, cases[k].reach * cases[k].reach * (seed == 4 ? .5 : 1));
			fill(&p, cases[k].reach, cases[k].decades, cases[k].zeros);
			solve_and_check(&p);
			problem_free(&p);
		}
}

static void no_arcs(void **unused)
{
	(void)unused;
	problem p = problem_new(3, 4, 2.5);
	for (size_t i = 0; i < 3; i++)
		p.supply[i] = 1;
	for (size_t j = 0; j < 4; j++)
		p.demand[j] = 1;
	solve_and_check(&p);
	assert_int_equal(p.count, 0);
	assert_true(fabs(p.cost - 2.5) < 1e-12);
	add_arc(&p, 0, 0, 2.5); /* as dear as the cap, and dearer: no arcs either */
	add_arc(&p, 1, 2, 1e30);
	solve_and_check(&p);
	assert_int_equal(p.count, 0);
	p.cap = 0;
	assert_int_equal(solve(&p), 0);
	assert_true(p.cost == 0 && p.gap == 0);
	problem_free(&p);
}

/* Every tree is optimal: the worst case for cycling. */
static void equal_costs(void **unused)
{
	(void)unused;
	for (int c = 0; c < 3; c++) {
		problem p = problem_new(40, 40, 1);
		for (size_t i = 0; i < 40; i++) {
			p.supply[i] = p.demand[i] = 1;
			for (size_t j = 0; j < 40; j++)
				add_arc(&p, i, j, c * .25);
		}
		solve_and_check(&p);
		assert_true(fabs(p.cost - c * .25) < 1e-12);
		problem_free(&p);
	}
}

static void identical(void **unused)
{
	(void)unused;
	problem p = problem_new(200, 200, .1);
	state = 5;
	fill(&p, 2, 3, 0);
	p.arcs = 0;
	for (size_t i = 0; i < 200; i++)
		for (size_t j = 0; j < 200; j++) {
			p.demand[j] = 1e-3 * p.supply[j]; /* another scale, the same shares */
			add_arc(&p, i, j, i == j ? 0 : .001 + .2 * uniform());
		}
	solve_and_check(&p);
	assert_true(fabs(p.cost) < 1e-12);
	double stay = 0;
	for (size_t k = 0; k < p.count; k++)
		stay += p.moves[k].source == p.moves[k].target ? p.moves[k].mass : 0;
	assert_true(stay > 1 - 1e-13); /* the rest is the rounding of the other scale */
	problem_free(&p);
}

/* A mass of 1e-12 of the total still goes where it belongs, to a thousandth of itself. */
static void small_mass(void **unused)
{
	(void)unused;
	problem p = problem_new(2, 2, 1);
	p.supply[0] = p.demand[0] = 1;
	p.supply[1] = p.demand[1] = 1e-12;
	add_arc(&p, 0, 0, 0);
	add_arc(&p, 0, 1, .3);
	add_arc(&p, 1, 1, .4);
	solve_and_check(&p);
	assert_int_equal(p.count, 2);
	assert_true(fabs(p.moves[1].mass - 1e-12) < 1e-15);
	problem_free(&p);
}

static void parallel_arcs(void **unused)
{
	(void)unused;
	problem p = problem_new(1, 1, 1);
	p.supply[0] = p.demand[0] = 1;
	p.arc[p.arcs++] = (rbf_arc){0, 0, .5f};
	p.arc[p.arcs++] = (rbf_arc){0, 0, .25f};
	solve_and_check(&p);
	assert_int_equal(p.count, 1);
	assert_true(p.cost == .25);
	problem_free(&p);
}

static void bad_input(void **unused)
{
	(void)unused;
	problem p = problem_new(2, 2, 1);
	p.supply[0] = p.demand[1] = 1;
	add_arc(&p, 0, 1, .5);
	assert_int_equal(solve(&p), 0);
	static const double bad[] = {-1, NAN, INFINITY, -INFINITY};
	for (size_t k = 0; k < 4; k++) {
		p.supply[1] = bad[k];
		assert_int_equal(solve(&p), -2);
		p.supply[1] = 0;
		p.demand[0] = bad[k];
		assert_int_equal(solve(&p), -2);
		p.demand[0] = 0;
		p.cap = bad[k];
		assert_int_equal(solve(&p), -2);
		p.cap = 1;
		p.arc[0].cost = (float)bad[k];
		assert_int_equal(solve(&p), -2);
		p.arc[0].cost = .5f;
	}
	p.arc[0].source = 2;
	assert_int_equal(solve(&p), -2);
	p.arc[0].source = 0;
	p.arc[0].target = 2;
	assert_int_equal(solve(&p), -2);
	p.arc[0].target = 1;
	p.supply[0] = 0;
	assert_int_equal(solve(&p), -2);
	p.supply[0] = 1;
	p.demand[1] = 0;
	assert_int_equal(solve(&p), -2);
	p.demand[1] = 1;
	p.n = 0;
	assert_int_equal(solve(&p), -2);
	p.n = 2;
	assert_int_equal(solve(&p), 0);
	assert_int_equal(rbf_transport_solve(p.n, p.supply, p.m, p.demand, p.arcs, p.arc, p.cap, p.moves, &p.count, &p.cost,
		NULL, NULL, NULL), 0);
	problem_free(&p);
}

static void deterministic(void **unused)
{
	(void)unused;
	problem p[2];
	for (int k = 0; k < 2; k++) {
		state = 77;
		p[k] = problem_new(150, 120, .09);
		fill(&p[k], .3, 2, 1);
		solve_and_check(&p[k]);
	}
	assert_int_equal(p[0].count, p[1].count);
	assert_memory_equal(p[0].moves, p[1].moves, p[0].count * sizeof *p[0].moves);
	assert_memory_equal(p[0].u, p[1].u, p[0].n * sizeof *p[0].u);
	assert_memory_equal(p[0].v, p[1].v, p[0].m * sizeof *p[0].v);
	problem_free(&p[0]);
	problem_free(&p[1]);
}

/* The build solves a few hundred of these: 1.7 ms when written, the limit is for a loaded or instrumented machine. */
static void quick(void **unused)
{
	(void)unused;
	state = 3;
	problem p = problem_new(300, 300, .0729);
	fill(&p, .27, 2, 0);
	const clock_t start = clock();
	for (int k = 0; k < 10; k++)
		assert_int_equal(solve(&p), 0);
	const double ms = 100. * (double)(clock() - start) / CLOCKS_PER_SEC;
	print_message("300 x 300, %zu arcs: %.2f ms\n", p.arcs, ms);
	assert_true(ms < 50);
	problem_free(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_permutations), cmocka_unit_test(certified), cmocka_unit_test(no_arcs),
		cmocka_unit_test(equal_costs), cmocka_unit_test(identical), cmocka_unit_test(small_mass),
		cmocka_unit_test(parallel_arcs), cmocka_unit_test(bad_input), cmocka_unit_test(deterministic),
		cmocka_unit_test(quick),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
