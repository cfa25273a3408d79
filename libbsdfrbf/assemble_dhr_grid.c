/* SPDX-License-Identifier: BSD-3-Clause */
#include "arrays.h"
#include "assemble.h"
#include "dhr_grid.h"
#include "evaluate.h"

#include <stdlib.h>
#include <string.h>

enum { DISC_FIRST = 24, LINE_FIRST = 128 }; /* cells at first */
static const float MISSED = 1e-3f; /* of DHR: what a cell may miss */
static const float NEARLY = .4f; /* of that: worth a closer look */
static const double FEW = .05, MANY = .5; /* share of cells that are marked: good enough, of no use */
static const double STEP_LEAST = 1.1, STEP_MOST = 1.5; /* times as many cells */
static const double ASKED_Z = .15; /* cells below it do not count for that */
static const uint64_t SHARE = 30;  /* of the component's other arrays: one part of so many, at most */

/* What the mesh's table holds at every node, and half way between them: nodes are the even ones. */
typedef struct lattice {
	uint32_t columns, rows; /* of points */
	float *value;
} lattice;

static const float *at(const lattice *l, const rbf_component *c, uint32_t column, uint32_t row)
{
	return l->value + ((size_t)row * l->columns + column) * c->channels;
}

/* Direction at a place of the grid, in cells. */
static void direction_at(const rbf_component *c, double column, double row, float d[3])
{
	const double disc[2] = {column / c->dhr_cells - (rbf_dhr_before_x(c) > 0), row / c->dhr_cells - (rbf_dhr_before_y(c) > 0)};
	double exact[3];
	rbf_direction_from_disc(disc, exact);
	for (int n = 0; n < 3; n++)
		d[n] = (float)exact[n];
	d[2] = fmaxf(d[2], 1e-3f);
	rbf_normalize(d);
}

/* What nodes say at a point of the lattice. */
static float between(const rbf_component *c, const float *node, uint32_t column, uint32_t row, uint32_t n)
{
	const size_t width = rbf_dhr_columns(c) + 1, right = (column % 2) * c->channels, up = (row % 2) * width * c->channels;
	const float *a = node + ((row / 2) * width + column / 2) * c->channels + n;
	return .25f * (a[0] + a[right] + a[up] + a[right + up]);
}

/* A node so that the largest misses are small: where DHR curves, the middle of a cell is then missed on one side, and its corners as much
 * on the other. Points count as the node does there. What is missed by more than twice of what may be cannot be met, and pulls no further.
 * exact: nodes as the lattice has them. */
static void set_node(const rbf_component *c, const lattice *l, const float *exact, uint32_t column, uint32_t row, float *node)
{
	for (uint32_t n = 0; n < c->channels; n++) {
		float sum = 0, weights = 0;
		for (int dy = -1; dy <= 1; dy++)
			for (int dx = -1; dx <= 1; dx++) {
				const int64_t x = 2 * (int64_t)column + dx, y = 2 * (int64_t)row + dy;
				if (x < 0 || y < 0 || x >= l->columns || y >= l->rows)
					continue;
				const float weight = (dx ? .5f : 1) * (dy ? .5f : 1), is = at(l, c, (uint32_t)x, (uint32_t)y)[n], most = 2 * MISSED * is;
				sum += weight * fmaxf(fminf(is - between(c, exact, (uint32_t)x, (uint32_t)y, n), most), -most);
				weights += weight;
			}
		node[n] = fmaxf(at(l, c, 2 * column, 2 * row)[n] + sum / weights, 0);
	}
}

static void set_nodes(const rbf_component *c, const lattice *l, float *exact, float *node)
{
	const uint32_t columns = rbf_dhr_columns(c), rows = rbf_dhr_rows(c);
	for (uint32_t row = 0, i = 0; row <= rows; row++)
		for (uint32_t column = 0; column <= columns; column++, i += c->channels)
			memcpy(exact + i, at(l, c, 2 * column, 2 * row), c->channels * sizeof *exact);
	for (uint32_t row = 0, i = 0; row <= rows; row++)
		for (uint32_t column = 0; column <= columns; column++, i += c->channels)
			set_node(c, l, exact, column, row, node + i);
}

/* Writes nodes down, and makes them what is written. */
static void round_nodes(rbf_component *c, float *node, uint16_t *grid)
{
	const uint32_t most = RBF_DHR_MARK - 1, numbers = (uint32_t)rbf_dhr_nodes(c) * c->channels;
	for (uint32_t n = 0; n < c->channels; n++) {
		float highest = 1e-12f;
		for (uint32_t i = n; i < numbers; i += c->channels)
			highest = fmaxf(highest, node[i]);
		const float unit = highest / (float)most;
		memcpy(&c->dhr_unit[n], &unit, sizeof unit);
		for (uint32_t i = n; i < numbers; i += c->channels) {
			const uint32_t times = (uint32_t)(node[i] / unit + .5f);
			grid[i] = (uint16_t)(times < most ? times : most);
			node[i] = unit * grid[i];
		}
	}
}

/* By how much of DHR a number misses what it should be. */
static float miss(float number, float is)
{
	return fabsf(number - is) / fmaxf(is, 1e-20f);
}

/* Largest miss half way between the points of the lattice. */
static float missed_within(const rbf_component *c, uint32_t column, uint32_t row)
{
	const int line = !rbf_dhr_rows(c);
	float most = 0;
	for (int y = 0; y <= (line ? 0 : 4); y++)
		for (int x = 0; x <= 4; x++) {
			float d[3], says[3], is[3];
			if (x % 2 == 0 && y % 2 == 0)
				continue;
			direction_at(c, column + .25 * x, row + .25 * y, d);
			rbf_component_dhr(c, d, is);
			rbf_dhr_from_grid(c, d, says);
			for (uint32_t n = 0; n < c->channels; n++)
				most = fmaxf(most, miss(says[n], is[n]));
		}
	return most;
}

/* Whether the nodes tell what is in a cell. Where they hardly miss the lattice, nothing between its points is looked for. */
static int is_met(const rbf_component *c, const lattice *l, const float *node, uint32_t column, uint32_t row)
{
	float most = 0;
	for (uint32_t y = 2 * row; y <= 2 * row + 2 && y < l->rows; y++)
		for (uint32_t x = 2 * column; x <= 2 * column + 2; x++)
			for (uint32_t n = 0; n < c->channels; n++)
				most = fmaxf(most, miss(between(c, node, x, y, n), at(l, c, x, y)[n]));
	if (most > NEARLY * MISSED && most <= MISSED)
		most = missed_within(c, column, row);
	return most <= MISSED;
}

/* 1 - z where the cell is highest. */
static double lowness(const rbf_component *c, uint32_t column, uint32_t row)
{
	const double x = fmax(rbf_dhr_before_x(c) - (double)column - 1, (double)column - rbf_dhr_before_x(c)) / c->dhr_cells;
	const double y = rbf_dhr_rows(c) ? fmax(rbf_dhr_before_y(c) - (double)row - 1, (double)row - rbf_dhr_before_y(c)) / c->dhr_cells : 0;
	return fmax(x, 0) * fmax(x, 0) + fmax(y, 0) * fmax(y, 0);
}

/* Returns the share of cells that are marked. */
static double mark_cells(const rbf_component *c, const lattice *l, const float *node, uint16_t *grid)
{
	const uint32_t columns = rbf_dhr_columns(c), rows = rbf_dhr_rows(c);
	uint64_t asked = 0, marked = 0;
	#pragma omp parallel for schedule(dynamic) reduction(+ : asked, marked)
	for (int64_t row = 0; row < (int64_t)(rows ? rows : 1); row++)
		for (uint32_t column = 0; column < columns; column++) {
			const double low = lowness(c, column, (uint32_t)row);
			const int missed = low < 1 && !is_met(c, l, node, column, (uint32_t)row);
			if (missed)
				grid[((size_t)row * (columns + 1) + column) * c->channels] |= RBF_DHR_MARK;
			asked += low < 1 - ASKED_Z;
			marked += missed && low < 1 - ASKED_Z;
		}
	return (double)marked / (double)asked;
}

/* A grid of c->dhr_cells. */
static int make(rbf_component *c, double *marked)
{
	const size_t numbers = rbf_dhr_nodes(c) * c->channels;
	lattice l = {2 * rbf_dhr_columns(c) + 1, 2 * rbf_dhr_rows(c) + 1, NULL};
	float *node = malloc(2 * numbers * sizeof *node);
	uint16_t *grid = malloc(numbers * sizeof *grid);
	l.value = malloc((size_t)l.columns * l.rows * c->channels * sizeof *l.value);
	c->dhr_grid = grid;
	const int failed = !node || !grid || !l.value;
	if (!failed) {
		#pragma omp parallel for schedule(dynamic)
		for (int64_t row = 0; row < (int64_t)l.rows; row++)
			for (uint32_t column = 0; column < l.columns; column++) {
				float d[3], value[3];
				direction_at(c, .5 * column, .5 * (double)row, d);
				rbf_component_dhr(c, d, value);
				memcpy(l.value + ((size_t)row * l.columns + column) * c->channels, value, c->channels * sizeof *value);
			}
		set_nodes(c, &l, node + numbers, node);
		round_nodes(c, node, grid);
		*marked = mark_cells(c, &l, node, grid);
	}
	free(node);
	free(l.value);
	return failed ? -1 : 0;
}

/* The most cells whose nodes have room. */
static uint32_t most_cells(const rbf_component *component)
{
	rbf_component c = *component;
	uint64_t bytes = 0;
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		if (rbf_array_get(&c, row))
			bytes += rbf_array_entries(&c, row) * rbf_array_row[row].entry;
	for (c.dhr_cells = 1; c.dhr_cells <= RBF_DHR_CELLS_MAX; c.dhr_cells++)
		if (rbf_dhr_nodes(&c) * c.channels * sizeof *c.dhr_grid > bytes / SHARE)
			break;
	return c.dhr_cells - 1;
}

int rbf_assemble_dhr_grid(rbf_component *c)
{
	const uint32_t most = most_cells(c), first = c->mesh.symmetry == RBF_ISOTROPIC ? LINE_FIRST : DISC_FIRST;
	rbf_component best = *c;
	double share = MANY;
	int failed = 0;
	for (uint32_t cells = first < most ? first : most, last = 0; cells > last && share > FEW && !failed; ) {
		rbf_component tried = *c;
		double marked = 1;
		tried.dhr_cells = cells;
		failed = make(&tried, &marked);
		const int better = !failed && marked < share;
		free((void *)(better ? best.dhr_grid : tried.dhr_grid));
		if (better) {
			best = tried;
			share = marked;
		}
		/* kinks are narrower in finer cells, and miss less */
		const double wanted = ceil(cells * fmin(fmax(sqrt(marked / FEW), STEP_LEAST), STEP_MOST));
		last = cells;
		cells = wanted < most ? (uint32_t)wanted : most;
	}
	*c = best;
	return failed;
}
