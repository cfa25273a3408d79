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
static const double WILD = 1e10; /* squares with over squares without what is left out */
static const float CUT = 5; /* sigmas beyond which a lobe is left out: exp(-12.5) */

/* One group. Arrays over its lobes are padded to COLUMNS, with lobes that are 0 everywhere. */
typedef struct group {
	size_t size, near, padded;
	uint32_t *list;
	float *x, *y, *z, *half; /* [padded] */
	float *twin;             /* [padded]: 1 for a lobe that has an image */
	float *value;            /* [GROUP][padded]: times the root of the sample's weight */
	float *sum;              /* [padded] */
	float *product;          /* [ROWS][padded] */
	float *reach;            /* of all lobes */
	float root[GROUP], w[GROUP][3], v[GROUP]; /* v: the value times the root */
} group;

/* Lobes whose reach meets the group's sphere. */
static void list_near(const rbf_equations *e, group *g)
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
		const float x = c[0] - middle[0], y = c[1] - middle[1], z = c[2] - middle[2], limit = radius + g->reach[j];
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
		g->twin[p] = e->paired && e->centre[j][1] > 0;
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

/* And what the images are there. */
RBF_CLONES static void add_images(const group *g)
{
	const float *restrict cx = g->x, *restrict cy = g->y, *restrict cz = g->z, *restrict half = g->half, *restrict twin = g->twin;
	for (size_t s = 0; s < GROUP; s++) {
		const float *w = g->w[s], root = g->root[s];
		float *restrict row = g->value + s * g->padded;
		for (size_t p = 0; p < g->padded; p++) {
			const float x = w[0] - cx[p], y = w[1] + cy[p], z = w[2] - cz[p];
			row[p] += twin[p] * root * rbf_exp_negative(half[p] * (x*x + y*y + z*z));
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

/* Of the lobes in the list from `start` on. sign: 1, or -1 to take the same away. */
static void add_right(rbf_equations *e, size_t first, group *g, size_t start, double sign)
{
	for (int c = 0; c < e->channels; c++) {
		double *right = e->right + (size_t)c * e->lobes;
		for (size_t s = 0; s < GROUP; s++)
			g->v[s] = s < g->size ? g->root[s] * e->value[c][first + s] : 0;
		project(g);
		for (size_t p = start; p < g->near; p++)
			right[g->list[p]] += sign * (double)g->sum[p];
	}
}

/* The upper half of the lobes in the list, columns `start` on. */
static void add_gram(rbf_equations *e, group *g, size_t start, double sign)
{
	for (size_t row = 0; row < g->near; row += ROWS) {
		multiply(g, row, (row > start ? row : start) / COLUMNS * COLUMNS, g->product);
		for (size_t r = 0; r < ROWS && row + r < g->near; r++) {
			const float *from = g->product + r * g->padded;
			double *to = e->gram + (size_t)g->list[row + r] * e->lobes;
			for (size_t q = row + r > start ? row + r : start; q < g->near; q++)
				to[g->list[q]] += sign * (double)from[q];
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

static void group_free(group *g)
{
	free(g->list);
	free(g->x);
	free(g->value);
	free(g->product);
	free(g->reach);
}

static int group_new(const rbf_equations *e, group *g)
{
	const size_t m = e->lobes, padded = m + COLUMNS;
	g->list = malloc((m + 1) * sizeof *g->list);
	g->x = malloc(6 * padded * sizeof *g->x);
	g->value = malloc(GROUP * padded * sizeof *g->value);
	g->product = malloc(ROWS * padded * sizeof *g->product);
	g->reach = malloc((m + 1) * sizeof *g->reach);
	if (!g->list || !g->x || !g->value || !g->product || !g->reach) {
		group_free(g);
		return -1;
	}
	g->y = g->x + padded;
	g->z = g->x + 2 * padded;
	g->half = g->x + 3 * padded;
	g->sum = g->x + 4 * padded;
	g->twin = g->x + 5 * padded;
	for (size_t j = 0; j < m; j++)
		g->reach[j] = CUT / sqrtf(e->kappa[j]);
	return 0;
}

/* The group of samples from `first` on without those that are out, and the lobes near it. out: or NULL. */
static void group_start(const rbf_equations *e, size_t first, const uint8_t *out, group *g)
{
	g->size = e->samples - first < GROUP ? e->samples - first : GROUP;
	for (size_t s = 0; s < GROUP; s++) {
		const size_t i = first + (s < g->size ? s : 0);
		memcpy(g->w[s], e->direction[i], sizeof g->w[s]);
		g->root[s] = s < g->size && !(out && out[i]) ? sqrtf(e->weight[i]) : 0;
	}
	list_near(e, g);
}

static void set_all(const rbf_equations *e, const group *g)
{
	set_values(g);
	if (e->paired)
		add_images(g);
}

/* And what these lobes are there. */
static void group_set(const rbf_equations *e, size_t first, const uint8_t *out, group *g)
{
	group_start(e, first, out, g);
	set_all(e, g);
}

/* How many count, and the weighted squares of their values. */
static void sum_up(rbf_equations *e, const uint8_t *out)
{
	e->count = 0;
	for (int c = 0; c < 3; c++)
		e->squares[c] = 0;
	for (size_t i = 0; i < e->samples; i++) {
		if ((out && out[i]) || !(e->weight[i] > 0))
			continue;
		e->count++;
		for (int c = 0; c < e->channels; c++)
			e->squares[c] += (double)e->weight[i] * (double)e->value[c][i] * (double)e->value[c][i];
	}
}

int rbf_equations_make(rbf_equations *e)
{
	const size_t m = e->lobes;
	group g = {0};
	e->gram = calloc(m * m + 1, sizeof *e->gram);
	e->right = calloc(m * (size_t)e->channels + 1, sizeof *e->right);
	if (!e->gram || !e->right || group_new(e, &g))
		return -1;
	for (size_t first = 0; first < e->samples && m; first += GROUP) {
		group_set(e, first, NULL, &g);
		add_right(e, first, &g, 0, 1);
		add_gram(e, &g, 0, 1);
	}
	mirror(m, e->gram);
	group_free(&g);
	sum_up(e, NULL);
	return 0;
}

int rbf_equations_add(rbf_equations *e, size_t former, const uint8_t *out)
{
	const size_t m = e->lobes;
	group g = {0};
	double *gram = calloc(m * m + 1, sizeof *gram), *right = calloc(m * (size_t)e->channels + 1, sizeof *right);
	if (!gram || !right || group_new(e, &g)) {
		free(gram);
		free(right);
		return -1;
	}
	for (size_t row = 0; row < former; row++)
		memcpy(gram + row * m, e->gram + row * former, former * sizeof *gram);
	for (size_t c = 0; c < (size_t)e->channels; c++)
		memcpy(right + c * m, e->right + c * former, former * sizeof *right);
	rbf_equations_free(e);
	e->gram = gram;
	e->right = right;
	for (size_t first = 0; first < e->samples; first += GROUP) {
		group_start(e, first, out, &g);
		size_t start = g.near;
		while (start > 0 && g.list[start - 1] >= former) /* they rise */
			start--;
		if (start == g.near)
			continue;
		set_all(e, &g);
		add_right(e, first, &g, start, 1);
		add_gram(e, &g, start, 1);
	}
	mirror(m, gram);
	group_free(&g);
	return 0;
}

static int any(const uint8_t *out, size_t first, size_t samples)
{
	for (size_t i = first; i < first + GROUP && i < samples; i++)
		if (out[i])
			return 1;
	return 0;
}

int rbf_equations_leave_out(rbf_equations *e, const uint8_t *out)
{
	group g = {0};
	if (group_new(e, &g))
		return -1;
	const double before = e->squares[0] + e->squares[1] + e->squares[2];
	sum_up(e, out);
	const int wild = !(before < WILD * (e->squares[0] + e->squares[1] + e->squares[2])); /* taken away, they would leave their rounding */
	if (wild)
		memset(e->right, 0, e->lobes * (size_t)e->channels * sizeof *e->right);
	for (size_t first = 0; first < e->samples && e->lobes; first += GROUP) {
		const int some = any(out, first, e->samples);
		if (some) { /* to the last digit what was added */
			group_set(e, first, NULL, &g);
			add_gram(e, &g, 0, -1);
			if (!wild)
				add_right(e, first, &g, 0, -1);
		}
		if (some || wild) {
			group_set(e, first, out, &g);
			add_right(e, first, &g, 0, 1);
		}
		if (some)
			add_gram(e, &g, 0, 1);
	}
	mirror(e->lobes, e->gram);
	group_free(&g);
	return 0;
}

void rbf_equations_free(rbf_equations *e)
{
	free(e->gram);
	free(e->right);
	e->gram = e->right = NULL;
}
