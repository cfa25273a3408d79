/* SPDX-License-Identifier: BSD-3-Clause */
/* Adaptive quadrature over the hemisphere, whose cells also serve as bins for samples. Include after cmocka.h. */
#ifndef TEST_QUADRATURE_H
#define TEST_QUADRATURE_H
#include "../libbsdfrbf/vector.h"

#include <stdint.h>
#include <stdlib.h>

/* Density per solid angle, at most 3 channels, in a direction of z > 0. */
typedef void density(void *user, const float direction[3], float value[3]);

enum { QUADRATURE_START = 16, QUADRATURE_DEPTH = 9, QUADRATURE_SIDE = 4 };

typedef struct quad_cell {
	double x, y, size;
	int32_t child;       /* first of four, or -1 */
	int depth;
	double value[3];     /* integral */
} quad_cell;

typedef struct quadrature {
	density *f;
	void *user;
	int channels, start;
	size_t cells, room;
	quad_cell *cell;     /* the first start^2 are the roots */
	double total[3];
} quadrature;

/* Unit square to hemisphere at constant solid angle: concentric (Shirley and Chiu 1997), then z = 1 - r^2. */
static inline void quadrature_direction(double x, double y, float d[3])
{
	const double a = 2*x - 1, b = 2*y - 1;
	double r = 0, phi = 0;
	if (a != 0 || b != 0) {
		r = fabs(a) >= fabs(b) ? a : b;
		phi = fabs(a) >= fabs(b) ? RBF_PI / 4 * (b / a) : RBF_PI / 2 - RBF_PI / 4 * (a / b);
	}
	const double z = 1 - r*r, s = sqrt(fmax(0, 1 - z*z)) * (r < 0 ? -1 : 1);
	d[0] = (float)(s * cos(phi));
	d[1] = (float)(s * sin(phi));
	d[2] = (float)z;
}

static inline void quadrature_square(const float d[3], double *x, double *y)
{
	const double r = sqrt(fmax(0, 1 - (double)d[2]));
	double phi = atan2((double)d[1], (double)d[0]), a, b;
	if (phi < -RBF_PI / 4)
		phi += 2 * RBF_PI;
	if (phi < RBF_PI / 4) {
		a = r;
		b = phi * r / (RBF_PI / 4);
	} else if (phi < 3 * RBF_PI / 4) {
		b = r;
		a = -(phi - RBF_PI / 2) * r / (RBF_PI / 4);
	} else if (phi < 5 * RBF_PI / 4) {
		a = -r;
		b = (phi - RBF_PI) * a / (RBF_PI / 4);
	} else {
		b = -r;
		a = -(phi - 3 * RBF_PI / 2) * b / (RBF_PI / 4);
	}
	*x = fmin(fmax(.5 * (a + 1), 0), 1 - 1e-12);
	*y = fmin(fmax(.5 * (b + 1), 0), 1 - 1e-12);
}

/* Gauss-Legendre, QUADRATURE_SIDE^2 points. */
static inline void quadrature_cell(const quadrature *q, quad_cell *c)
{
	static const double at[QUADRATURE_SIDE] = {.0694318442, .3300094782, .6699905218, .9305681558};
	static const double weight[QUADRATURE_SIDE] = {.1739274226, .3260725774, .3260725774, .1739274226};
	c->child = -1;
	memset(c->value, 0, sizeof c->value);
	for (int j = 0; j < QUADRATURE_SIDE; j++)
		for (int i = 0; i < QUADRATURE_SIDE; i++) {
			float d[3], v[3];
			quadrature_direction(c->x + at[i] * c->size, c->y + at[j] * c->size, d);
			q->f(q->user, d, v);
			for (int n = 0; n < q->channels; n++)
				c->value[n] += 2 * RBF_PI * weight[i] * weight[j] * c->size * c->size * (double)v[n];
		}
}

static inline void quadrature_refine(quadrature *q, int32_t at, double tolerance)
{
	quad_cell c = q->cell[at];
	const int y = q->channels == 3;
	if (c.depth >= QUADRATURE_DEPTH)
		return;
	if (q->cells + 4 > q->room) {
		q->room *= 2;
		q->cell = realloc(q->cell, q->room * sizeof *q->cell);
		assert_non_null(q->cell);
	}
	const int32_t child = (int32_t)q->cells;
	double sum[3] = {0, 0, 0};
	for (int k = 0; k < 4; k++) {
		quad_cell *n = &q->cell[child + k];
		*n = (quad_cell){.x = c.x + (k & 1) * c.size / 2, .y = c.y + (k >> 1) * c.size / 2, .size = c.size / 2, .depth = c.depth + 1};
		quadrature_cell(q, n);
		for (int m = 0; m < q->channels; m++)
			sum[m] += n->value[m];
	}
	q->cells += 4;
	q->cell[at].child = child;
	if (fabs(sum[y] - c.value[y]) > tolerance)
		for (int k = 0; k < 4; k++)
			quadrature_refine(q, child + k, tolerance);
	memset(sum, 0, sizeof sum);
	for (int k = 0; k < 4; k++)
		for (int m = 0; m < q->channels; m++)
			sum[m] += q->cell[child + k].value[m];
	memcpy(q->cell[at].value, sum, sizeof sum);
}

/* Refines until no cell's error estimate exceeds `tolerance` of the whole. start: cells a side to begin with. */
static inline quadrature quadrature_from(density *f, void *user, int channels, double tolerance, int start)
{
	quadrature q = {.f = f, .user = user, .channels = channels, .start = start, .room = 16 * (size_t)(start * start)};
	double coarse = 0;
	q.cell = malloc(q.room * sizeof *q.cell);
	assert_non_null(q.cell);
	for (int j = 0; j < start; j++)
		for (int i = 0; i < start; i++) {
			quad_cell *c = &q.cell[q.cells++];
			*c = (quad_cell){.x = (double)i / start, .y = (double)j / start, .size = 1. / start};
			quadrature_cell(&q, c);
			coarse += c->value[channels == 3];
		}
	for (int32_t n = 0; n < start * start; n++) {
		quadrature_refine(&q, n, tolerance * coarse);
		for (int m = 0; m < channels; m++)
			q.total[m] += q.cell[n].value[m];
	}
	return q;
}

static inline quadrature quadrature_make(density *f, void *user, int channels, double tolerance)
{
	return quadrature_from(f, user, channels, tolerance, QUADRATURE_START);
}

/* How far two are apart in each of 8 x 8 blocks, added up, as a part of the whole. Both start with a multiple of 8. */
static inline double quadrature_apart(const quadrature *a, const quadrature *b)
{
	enum { BLOCKS = 8 };
	const quadrature *both[2] = {a, b};
	const int y = a->channels == 3;
	double sum[BLOCKS * BLOCKS] = {0}, apart = 0;
	for (int k = 0; k < 2; k++) {
		const int start = both[k]->start, side = start / BLOCKS;
		for (int n = 0; n < start * start; n++)
			sum[n / start / side * BLOCKS + n % start / side] += (k ? -1 : 1) * both[k]->cell[n].value[y];
	}
	for (int n = 0; n < BLOCKS * BLOCKS; n++)
		apart += fabs(sum[n]);
	return b->total[y] > 0 ? apart / b->total[y] : apart;
}

/* Cells whose points all lie beside a narrow lobe see nothing to refine for, and small errors of many cells add up. One quadrature is no
 * truth, therefore, until the next, from finer cells whose points are others, finds the same light in the same places; from the third
 * on tolerances are finer too. *apart: by how much the two last ones differ; above `most`: no two agree. */
static inline quadrature quadrature_agreed(density *f, void *user, int channels, double tolerance, double most, double *apart)
{
	static const int start[] = {QUADRATURE_START, 24, 32, 48, 64, 96};
	quadrature q = quadrature_make(f, user, channels, tolerance);
	*apart = INFINITY;
	for (size_t n = 1; n < sizeof start / sizeof *start && !(*apart <= most); n++) {
		if (n > 1)
			tolerance /= 4;
		quadrature next = quadrature_from(f, user, channels, tolerance, start[n]);
		*apart = quadrature_apart(&q, &next);
		free(q.cell);
		q = next;
	}
	return q;
}

/* Leaf that holds a direction. */
static inline int32_t quadrature_find(const quadrature *q, const float d[3])
{
	double x, y;
	quadrature_square(d, &x, &y);
	int32_t at = (int32_t)(y * q->start) * q->start + (int32_t)(x * q->start);
	while (q->cell[at].child >= 0) {
		const quad_cell *c = &q->cell[at];
		at = c->child + (x >= c->x + c->size / 2) + 2 * (y >= c->y + c->size / 2);
	}
	return at;
}

/* Numbers the bins: leaves in the order of the tree, joined until a bin holds `share` of the whole. bin[cells]; expected[] gets
 * each bin's share. Returns how many; what is left over at the end joins the last. */
static inline int quadrature_bins(const quadrature *q, double share, int *bin, double *expected, int most)
{
	const int y = q->channels == 3;
	int bins = 0;
	double sum = 0;
	int32_t stack[4 * QUADRATURE_DEPTH + 8];
	for (int32_t root = 0; root < q->start * q->start; root++) {
		int top = 0;
		stack[top++] = root;
		while (top) {
			const int32_t at = stack[--top];
			if (q->cell[at].child >= 0) {
				for (int k = 3; k >= 0; k--)
					stack[top++] = q->cell[at].child + k;
				continue;
			}
			bin[at] = bins;
			sum += q->cell[at].value[y] / q->total[y];
			if (sum >= share && bins + 1 < most) {
				expected[bins++] = sum;
				sum = 0;
			}
		}
	}
	if (!bins)
		expected[bins++] = 0;
	expected[bins - 1] += sum;
	for (size_t i = 0; i < q->cells; i++)
		if (bin[i] >= bins)
			bin[i] = bins - 1;
	return bins;
}
#endif
