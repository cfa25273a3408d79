/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Samples come in small groups of near ones: the lobes that matter to a group are listed once, and its small dense product is
 * added to the whole.
 */
#include "clones.h"
#include "elementary.h"
#include "equations.h"

#include <stdlib.h>

enum { GROUP = 32, ROWS = 4, LANES = 8, COLUMNS = 2 * LANES, TILE = 16 };
static const float CUT = 5; /* sigmas beyond which a lobe is left out: exp(-12.5) */

/* One group. Arrays over its lobes are padded to COLUMNS, with lobes that are 0 everywhere. */
typedef struct group {
	size_t size, near, padded;
	uint32_t *list;
	float *x, *y, *z, *half; /* [padded] */
	float *value;            /* [GROUP][padded]: times the root of the sample's weight */
	float *sum;              /* [padded] */
	float root[GROUP], w[GROUP][3], v[GROUP]; /* v: the value times the root */
} group;

/* Lobes whose reach meets the group's sphere. */
static void list_near(const rbf_equations *e, const float *reach, group *g)
{
	float middle[3] = {0, 0, 0}, radius = 0;
	for (size_t s = 0; s < g->size; s++)
		for (int a = 0; a < 3; a++)
			middle[a] += g->w[s][a] / (float)g->size;
	for (size_t s = 0; s < g->size; s++) {
		const float x = g->w[s][0] - middle[0], y = g->w[s][1] - middle[1], z = g->w[s][2] - middle[2];
		radius = rbf_max(radius, sqrtf(x*x + y*y + z*z));
	}
	g->near = 0;
	for (size_t j = 0; j < e->lobes; j++) {
		const float *c = e->centre[j];
		const float x = c[0] - middle[0], y = c[1] - middle[1], z = c[2] - middle[2], limit = radius + reach[j];
		g->list[g->near] = (uint32_t)j;
		g->near += x*x + y*y + z*z < limit * limit;
	}
	g->padded = (g->near + COLUMNS - 1) / COLUMNS * COLUMNS;
	for (size_t p = 0; p < g->padded; p++) {
		const size_t j = p < g->near ? g->list[p] : 0;
		g->x[p] = p < g->near ? e->centre[j][0] : 100;
		g->y[p] = e->centre[j][1];
		g->z[p] = e->centre[j][2];
		g->half[p] = -.5f * e->kappa[j];
	}
}

RBF_CLONES static void set_values(const group *g)
{
	const float *restrict cx = g->x, *restrict cy = g->y, *restrict cz = g->z, *restrict half = g->half;
	for (size_t s = 0; s < GROUP; s++) {
		const float *w = g->w[s], root = g->root[s];
		float *restrict row = g->value + s * g->padded;
		for (size_t p = 0; p < g->padded; p++) {
			const float x = w[0] - cx[p], y = w[1] - cy[p], z = w[2] - cz[p];
			row[p] = root * rbf_exp_negative(half[p] * (x*x + y*y + z*z));
		}
	}
}

typedef float lanes __attribute__((vector_size(4 * LANES)));

/* Products of ROWS lobes with all from column `from` on, a multiple of COLUMNS: a block of sums that stays in registers. */
RBF_CLONES static void multiply(const group *g, size_t row, size_t from, float *product)
{
	for (size_t q = from; q < g->padded; q += COLUMNS) {
		lanes low[ROWS] = {{0}}, high[ROWS] = {{0}};
		const float *v = g->value;
		for (size_t s = 0; s < GROUP; s++, v += g->padded) {
			lanes left, right;
			memcpy(&left, v + q, sizeof left);
			memcpy(&right, v + q + LANES, sizeof right);
			for (int r = 0; r < ROWS; r++) {
				low[r] += v[row + (size_t)r] * left;
				high[r] += v[row + (size_t)r] * right;
			}
		}
		for (int r = 0; r < ROWS; r++) {
			memcpy(product + (size_t)r * g->padded + q, &low[r], sizeof low[r]);
			memcpy(product + (size_t)r * g->padded + q + LANES, &high[r], sizeof high[r]);
		}
	}
}

/* Sums over the samples of lobe times value. */
RBF_CLONES static void project(const group *g)
{
	float *restrict sum = g->sum;
	memset(sum, 0, g->padded * sizeof *sum);
	for (size_t s = 0; s < GROUP; s++) {
		const float *restrict row = g->value + s * g->padded, v = g->v[s];
		for (size_t p = 0; p < g->padded; p++)
			sum[p] += row[p] * v;
	}
}

static void add_group(rbf_equations *e, size_t first, group *g, float *product)
{
	const size_t m = e->lobes;
	for (int c = 0; c < e->channels; c++) {
		double *right = e->right + (size_t)c * m;
		for (size_t s = 0; s < GROUP; s++) {
			g->v[s] = s < g->size ? g->root[s] * e->value[c][first + s] : 0;
			e->squares[c] += (double)(g->v[s] * g->v[s]);
		}
		project(g);
		for (size_t p = 0; p < g->near; p++)
			right[g->list[p]] += (double)g->sum[p];
	}
	for (size_t row = 0; row < g->near; row += ROWS) {
		multiply(g, row, row / COLUMNS * COLUMNS, product);
		for (size_t r = 0; r < ROWS && row + r < g->near; r++) {
			const float *from = product + r * g->padded;
			double *to = e->gram + (size_t)g->list[row + r] * m;
			for (size_t q = row + r; q < g->near; q++)
				to[g->list[q]] += (double)from[q];
		}
	}
}

/* The lower half from the upper one, in tiles: a column's elements lie far apart. */
static void mirror(size_t m, double *gram)
{
	for (size_t row = 0; row < m; row += TILE)
		for (size_t column = row; column < m; column += TILE)
			for (size_t i = row; i < row + TILE && i < m; i++)
				for (size_t j = column > i ? column : i + 1; j < column + TILE && j < m; j++)
					gram[j * m + i] = gram[i * m + j];
}

int rbf_equations_make(rbf_equations *e)
{
	const size_t m = e->lobes, padded = m + COLUMNS;
	group g = {0};
	float *reach = malloc((m + 1) * sizeof *reach), *product = malloc(ROWS * padded * sizeof *product);
	float *columns = malloc(5 * padded * sizeof *columns);
	g.list = malloc((m + 1) * sizeof *g.list);
	g.value = malloc(GROUP * padded * sizeof *g.value);
	e->gram = calloc(m * m + 1, sizeof *e->gram);
	e->right = calloc(m * (size_t)e->channels + 1, sizeof *e->right);
	const int failed = !reach || !product || !columns || !g.list || !g.value || !e->gram || !e->right;
	e->count = 0;
	for (int c = 0; c < 3; c++)
		e->squares[c] = 0;
	if (!failed) {
		g.x = columns;
		g.y = columns + padded;
		g.z = columns + 2 * padded;
		g.half = columns + 3 * padded;
		g.sum = columns + 4 * padded;
		for (size_t j = 0; j < m; j++)
			reach[j] = CUT / sqrtf(e->kappa[j]);
		for (size_t first = 0; first < e->samples && m; first += GROUP) {
			g.size = e->samples - first < GROUP ? e->samples - first : GROUP;
			for (size_t s = 0; s < GROUP; s++) {
				const size_t i = first + (s < g.size ? s : 0);
				memcpy(g.w[s], e->direction[i], sizeof g.w[s]);
				g.root[s] = s < g.size ? sqrtf(e->weight[i]) : 0;
				e->count += g.root[s] > 0;
			}
			list_near(e, reach, &g);
			set_values(&g);
			add_group(e, first, &g, product);
		}
		mirror(m, e->gram);
	}
	free(reach);
	free(product);
	free(columns);
	free(g.list);
	free(g.value);
	return failed ? -1 : 0;
}

void rbf_equations_free(rbf_equations *e)
{
	free(e->gram);
	free(e->right);
	e->gram = e->right = NULL;
}
