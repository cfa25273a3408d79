/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Block principal pivoting (Portugal, Judice, Vicente, A comparison of block pivoting and interior-point algorithms for
 * linear least squares problems with nonnegative variables, 1994), started from a few rounds of coordinate descent, which
 * find most of the positive set.
 */
#include "clones.h"
#include "kernel.h"
#include "nonnegative.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PANEL = 16, ROWS = 4, MORE = 8, LANES = 4, COLUMNS = 2 * LANES, WARM = 20, EXCHANGES = 60, PATIENCE = 3, FINISH = 400, STEPS = 40 };
static const double WORK = 2e9; /* m^3 a step */
static const double EXACT = 1e-10;       /* a gradient that is rounding, of the largest */
static const double INSIGNIFICANT = .02; /* of the noise's variance: what a variable must lower the objective's double by */

/* Coordinate descent: x and the gradient Gx - b are kept together. */
RBF_CLONES static void descend(size_t m, const double *gram, double *x, double *gradient, int sweeps)
{
	for (int sweep = 0; sweep < sweeps; sweep++) {
		double largest = 0, scale = 0;
		for (size_t j = 0; j < m; j++) {
			const double diagonal = gram[j * m + j];
			double a = x[j] - gradient[j] / diagonal;
			if (!(a > 0))
				a = 0;
			const double step = a - x[j];
			scale = fmax(scale, a * sqrt(diagonal));
			if (step == 0)
				continue;
			x[j] = a;
			largest = fmax(largest, fabs(step) * sqrt(diagonal));
			const double *restrict row = gram + j * m;
			double *restrict g = gradient;
			for (size_t i = 0; i < m; i++)
				g[i] += step * row[i];
		}
		if (largest <= 1e-9 * scale)
			break;
	}
}

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef double wide __attribute__((vector_size(8 * COLUMNS)));

/* row -= factor pivot, columns `from` on */
RBF_CLONES static void subtract(double *restrict row, const double *restrict pivot, double factor, size_t from, size_t end)
{
	for (size_t j = from; j < end; j++)
		row[j] -= factor * pivot[j];
}

/* Subtracts from ROWS rows the multiples of PANEL pivot rows, columns `from`, a multiple of COLUMNS, on: sums that stay in registers. */
RBF_CLONES static void eliminate(double *row, const double *pivot, size_t stride, size_t from, const double (*f)[ROWS])
{
	for (size_t q = from; q < stride; q += COLUMNS) {
		lanes low[ROWS] = {{0}}, high[ROWS] = {{0}};
		for (size_t p = 0; p < PANEL; p++) {
			lanes left, right;
			memcpy(&left, pivot + p * stride + q, sizeof left);
			memcpy(&right, pivot + p * stride + q + LANES, sizeof right);
			for (int r = 0; r < ROWS; r++) {
				low[r] += f[p][r] * left;
				high[r] += f[p][r] * right;
			}
		}
		for (size_t r = 0; r < ROWS; r++) {
			lanes left, right;
			double *at = row + r * stride + q;
			memcpy(&left, at, sizeof left);
			memcpy(&right, at + LANES, sizeof right);
			left -= low[r];
			right -= high[r];
			memcpy(at, &left, sizeof left);
			memcpy(at + LANES, &right, sizeof right);
		}
	}
}

/* The same with half as many, wider registers of sums a row: MORE rows at once fill those that AVX-512 has. */
RBF_CLONES static void eliminate_more(double *row, const double *pivot, size_t stride, size_t from, const double (*f)[MORE])
{
	for (size_t q = from; q < stride; q += COLUMNS) {
		wide sum[MORE] = {{0}};
		for (size_t p = 0; p < PANEL; p++) {
			wide of;
			memcpy(&of, pivot + p * stride + q, sizeof of);
			for (int r = 0; r < MORE; r++)
				sum[r] += f[p][r] * of;
		}
		for (size_t r = 0; r < MORE; r++) {
			wide at;
			memcpy(&at, row + r * stride + q, sizeof at);
			at -= sum[r];
			memcpy(row + r * stride + q, &at, sizeof at);
		}
	}
}

/* Sum of products in LANES parts: one after the other, each would wait for the last. */
RBF_CLONES static double product(const double *a, const double *b, size_t n)
{
	double part[LANES] = {0}, rest = 0;
	size_t i = 0;
	for (; i + LANES <= n; i += LANES)
		for (size_t l = 0; l < LANES; l++)
			part[l] += a[i + l] * b[i + l];
	for (; i < n; i++)
		rest += a[i] * b[i];
	return (part[0] + part[1]) + (part[2] + part[3]) + rest;
}

/* Columns of a row of n, so that whole vectors fit. */
static size_t padded(size_t n)
{
	return (n + COLUMNS - 1) / COLUMNS * COLUMNS;
}

/* Cholesky U'U of the n x n matrix in a, rows padded(n) apart (upper part used and overwritten, the rest any finite numbers), then the
 * solution in x. Returns 0, or -1 if the matrix is not positive definite. */
static int cholesky_solve(size_t n, double *a, double *x)
{
	const size_t stride = padded(n);
	const int more = rbf_kernel_has_avx512();
	for (size_t first = 0; first < n; first += PANEL) {
		const size_t end = first + PANEL < n ? first + PANEL : n;
		for (size_t k = first; k < end; k++) {
			double *pivot = a + k * stride;
			if (!(pivot[k] > 0))
				return -1;
			const double root = 1 / sqrt(pivot[k]);
			for (size_t j = k; j < n; j++)
				pivot[j] *= root;
			for (size_t i = k + 1; i < end; i++)
				subtract(a + i * stride, pivot, pivot[i], i, n);
		}
		size_t i = end;
		for (; more && i + MORE <= n; i += MORE) {
			double f[PANEL][MORE];
			for (size_t p = 0; p < PANEL; p++)
				memcpy(f[p], a + (first + p) * stride + i, sizeof f[p]);
			eliminate_more(a + i * stride, a + first * stride, stride, i / COLUMNS * COLUMNS, (const double (*)[MORE])f);
		}
		for (; i + ROWS <= n; i += ROWS) {
			double f[PANEL][ROWS];
			for (size_t p = 0; p < PANEL; p++)
				memcpy(f[p], a + (first + p) * stride + i, sizeof f[p]);
			eliminate(a + i * stride, a + first * stride, stride, i / COLUMNS * COLUMNS, (const double (*)[ROWS])f);
		}
		for (; i < n; i++)
			for (size_t p = first; p < end; p++)
				subtract(a + i * stride, a + p * stride, a[p * stride + i], i, n);
	}
	for (size_t k = 0; k < n; k++) {
		x[k] /= a[k * stride + k];
		subtract(x, a + k * stride, x[k], k + 1, n);
	}
	for (size_t k = n; k-- > 0;) {
		const double *pivot = a + k * stride;
		x[k] = (x[k] - product(pivot + k + 1, x + k + 1, n - k - 1)) / pivot[k];
	}
	return 0;
}

typedef struct pivoting {
	size_t m, free;
	const double *gram, *right;
	double squares, count; /* of what is fitted */
	double scale;          /* largest gradient at 0, over the root of the diagonal */
	double least;          /* gradients over the root of the diagonal count from here */
	double *x, *gradient, *matrix, *part;
	size_t *index;      /* the free ones */
	unsigned char *in;  /* 1: free, may be positive */
} pivoting;

/* Solves for the free variables, the others 0, and their gradient. */
static int solve_free(pivoting *p)
{
	p->free = 0;
	for (size_t j = 0; j < p->m; j++)
		if (p->in[j])
			p->index[p->free++] = j;
	const size_t stride = padded(p->free);
	for (size_t r = 0; r < p->free; r++) {
		const double *row = p->gram + p->index[r] * p->m;
		double *to = p->matrix + r * stride;
		for (size_t c = r / COLUMNS * COLUMNS; c < stride; c++)
			to[c] = c < p->free ? row[p->index[c]] : 0;
		p->part[r] = p->right[p->index[r]];
	}
	if (cholesky_solve(p->free, p->matrix, p->part))
		return -1;
	memset(p->x, 0, p->m * sizeof *p->x);
	double rest = p->squares;
	for (size_t j = 0; j < p->m; j++)
		p->gradient[j] = -p->right[j];
	for (size_t r = 0; r < p->free; r++)
		rest -= p->part[r] * p->right[p->index[r]];
	p->least = fmax(EXACT * p->scale, sqrt(INSIGNIFICANT * fmax(rest, 0) / fmax(p->count - (double)p->free, 1)));
	for (size_t r = 0; r < p->free; r++) {
		p->x[p->index[r]] = p->part[r];
		subtract(p->gradient, p->gram + p->index[r] * p->m, -p->part[r], 0, p->m);
	}
	return 0;
}

static int optimal(pivoting *p)
{
	size_t fewest = p->m + 1;
	int patience = PATIENCE;
	for (int exchange = 0; exchange < EXCHANGES; exchange++) {
		if (solve_free(p))
			return 0;
		size_t wrong = 0, last = 0;
		for (size_t j = 0; j < p->m; j++) {
			const double root = sqrt(p->gram[j * p->m + j]);
			if (p->in[j] ? p->x[j] < 0 : p->gradient[j] < -p->least * root) {
				wrong++;
				last = j;
			}
		}
		if (!wrong)
			return 1;
		if (wrong < fewest) {
			fewest = wrong;
			patience = PATIENCE;
		} else if (patience-- <= 0) { /* Murty's rule, finite: one exchange, the last */
			p->in[last] ^= 1;
			continue;
		}
		for (size_t j = 0; j < p->m; j++) {
			const double root = sqrt(p->gram[j * p->m + j]);
			if (p->in[j] ? p->x[j] < 0 : p->gradient[j] < -p->least * root)
				p->in[j] ^= 1;
		}
	}
	return 0;
}

/* Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23: slower, but every step lowers the objective. Starts from p->x. */
static int active_set(pivoting *p)
{
	double *old = malloc((p->m + 1) * sizeof *old);
	if (!old)
		return -1;
	for (size_t j = 0; j < p->m; j++)
		p->in[j] = p->x[j] > 0;
	/* Small problems are finished; for large ones, whose last steps change the sum of the lobes by nothing that can be seen, the
	 * work is bounded. */
	const double m = (double)p->m + 1, most = fmin(3*m + 100, fmax(STEPS, WORK / (m*m*m)));
	for (int step = 0; step < most; step++) {
		memcpy(old, p->x, p->m * sizeof *old);
		if (solve_free(p)) { /* rounding: what there was is kept */
			memcpy(p->x, old, p->m * sizeof *old);
			break;
		}
		double reach = 1;
		size_t at = p->m;
		for (size_t j = 0; j < p->m; j++)
			if (p->in[j] && p->x[j] < 0 && !(old[j] / (old[j] - p->x[j]) >= reach)) {
				reach = old[j] / (old[j] - p->x[j]);
				at = j;
			}
		if (at < p->m) { /* as far as the first variable that becomes 0 */
			for (size_t j = 0; j < p->m; j++) {
				p->x[j] = fmax(old[j] + reach * (p->x[j] - old[j]), 0);
				if (!(p->x[j] > 0))
					p->in[j] = 0;
			}
			p->in[at] = 0;
			p->x[at] = 0;
			continue;
		}
		double least = -p->least;
		for (size_t j = 0; j < p->m; j++) {
			const double g = p->gradient[j] / sqrt(p->gram[j * p->m + j]);
			if (!p->in[j] && g < least) {
				least = g;
				at = j;
			}
		}
		if (at == p->m)
			break;
		p->in[at] = 1;
	}
	free(old);
	return 0;
}

int rbf_nonnegative_solve(size_t m, const double *gram, const double *right, double squares, double count, double *x)
{
	pivoting p = {.m = m, .gram = gram, .right = right, .squares = squares, .count = count, .x = x};
	p.gradient = malloc((m + 1) * sizeof *p.gradient);
	p.matrix = malloc((m * padded(m) + 1) * sizeof *p.matrix);
	p.part = malloc((m + 1) * sizeof *p.part);
	p.index = malloc((m + 1) * sizeof *p.index);
	p.in = malloc(m + 1);
	int failed = !p.gradient || !p.matrix || !p.part || !p.index || !p.in;
	if (!failed) {
		int started = 0;
		for (size_t j = 0; j < m; j++) {
			started |= x[j] > 0;
			p.gradient[j] = -right[j];
			p.scale = fmax(p.scale, fabs(right[j]) / sqrt(gram[j * m + j]));
		}
		if (!started)
			descend(m, gram, x, p.gradient, WARM);
		for (size_t j = 0; j < m; j++)
			p.in[j] = x[j] > 0;
		if (!optimal(&p)) { /* rounding, or too many exchanges: on from what there is */
			for (size_t j = 0; j < m; j++) {
				x[j] = isfinite(x[j]) && x[j] > 0 ? x[j] : 0;
				p.gradient[j] = -right[j];
			}
			for (size_t i = 0; i < m; i++)
				for (size_t j = 0; x[i] > 0 && j < m; j++)
					p.gradient[j] += x[i] * gram[i * m + j];
			descend(m, gram, x, p.gradient, FINISH);
			failed = active_set(&p) != 0;
		}
	}
	free(p.gradient);
	free(p.matrix);
	free(p.part);
	free(p.index);
	free(p.in);
	return failed ? -1 : 0;
}
