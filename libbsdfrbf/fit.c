/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Lobe fit of one incidence: DSF(w) = sum a_j exp(-kappa_j |w - c_j|^2 / 2), a >= 0.
 * Centres are samples, taken farthest first in a metric that shrinks where the signal is high; widths follow the
 * spacing of the centres; amplitudes are a non-negative least-squares solution by coordinate descent on the Gram matrix.
 */
#include "fit.h"
#include "neighbours.h"

#include <stdlib.h>
#include <string.h>

enum { SMOOTH = 8, SPACING = 5, SWEEPS = 400 };
static const double DENSITY = .4;       /* spacing ~ signal^-DENSITY */
static const double FLOOR = 1e-4;       /* of the maximum: below, the signal asks for no more lobes */
static const double WIDTH = .8;         /* sigma over the mean distance of the nearest centres */
static const double SIGMA_MIN = .002, SIGMA_MAX = .6;
static const double RIDGE = 1e-5;
static const double WEIGHT_FLOOR = 1e-3;
static const double CUT = 5;            /* sigmas beyond which a lobe is left out of the equations: exp(-12.5) */
static const double STEP = 1e-5;        /* relative to the largest amplitude's effect: convergence */

/* Working arrays of one fit. */
typedef struct work {
	size_t n;                 /* samples in use */
	float (*w)[3];            /* directions */
	float *y[3];              /* DSF less the Lambertian part */
	float *smooth;            /* geometric mean of the neighbours, luminance */
	float *spacing, *nearest;
	uint32_t lobes;
	float (*centre)[3];
	float *kappa;
	size_t *first;            /* sparse basis, by sample: entries first[i] .. first[i+1]-1 */
	uint32_t *column;
	float *value;
	double *gram, *right, *gradient, *amplitude;
} work;

static void work_free(work *k)
{
	free(k->w);
	for (int c = 0; c < 3; c++)
		free(k->y[c]);
	free(k->smooth);
	free(k->spacing);
	free(k->nearest);
	free(k->centre);
	free(k->kappa);
	free(k->first);
	free(k->column);
	free(k->value);
	free(k->gram);
	free(k->right);
	free(k->gradient);
	free(k->amplitude);
}

static int gather(work *k, const rbf_incidence *in, int channels, const float lambertian[3], uint32_t hold)
{
	k->w = malloc(in->count * sizeof *k->w);
	for (int c = 0; c < channels; c++)
		k->y[c] = malloc(in->count * sizeof(float));
	k->smooth = malloc(in->count * sizeof(float));
	k->spacing = malloc(in->count * sizeof(float));
	k->nearest = malloc(in->count * sizeof(float));
	if (!k->w || !k->y[0] || (channels == 3 && (!k->y[1] || !k->y[2])) || !k->smooth || !k->spacing || !k->nearest)
		return -1;
	for (size_t i = 0; i < in->count; i++) {
		if (hold > 1 && i % hold == hold / 2)
			continue;
		for (int a = 0; a < 3; a++)
			k->w[k->n][a] = (float)in->outgoing[3*i + (size_t)a];
		for (int c = 0; c < channels; c++)
			k->y[c][k->n] = in->dsf[i * (size_t)channels + (size_t)c] - lambertian[c] * (float)(in->outgoing[3*i + 2] / RBF_PI);
		k->n++;
	}
	return 0;
}

/* Geometric mean of the nearest samples: a value that noise and outliers hardly move. */
static int smooth(work *k, const float *y)
{
	rbf_tree tree;
	if (rbf_tree_build(&tree, k->n, (const float (*)[3])k->w))
		return -1;
	float top = 0;
	for (size_t i = 0; i < k->n; i++)
		top = fmaxf(top, y[i]);
	if (!(top > 0)) {
		memset(k->smooth, 0, k->n * sizeof *k->smooth);
		rbf_tree_free(&tree);
		return 0;
	}
	const float low = 1e-6f * top;
	float *logarithm = k->nearest;
	for (size_t i = 0; i < k->n; i++)
		logarithm[i] = logf(fmaxf(y[i], low));
	for (size_t i = 0; i < k->n; i++) {
		uint32_t index[SMOOTH];
		float distance[SMOOTH], sum = 0;
		const int found = rbf_tree_nearest(&tree, k->w[i], SMOOTH, index, distance);
		for (int j = 0; j < found; j++)
			sum += logarithm[index[j]];
		k->smooth[i] = expf(sum / (float)found);
	}
	rbf_tree_free(&tree);
	return 0;
}

/* Farthest-point order in the density-adapted metric. */
static int place(work *k, uint32_t lobes)
{
	float top = 0;
	size_t next = 0;
	for (size_t i = 0; i < k->n; i++)
		top = fmaxf(top, k->smooth[i]);
	for (size_t i = 0; i < k->n && top > 0; i++) {
		k->spacing[i] = powf(fmaxf(k->smooth[i] / top, (float)FLOOR), (float)DENSITY); /* 1 / s */
		k->nearest[i] = 1e30f;
		if (k->spacing[i] > k->spacing[next])
			next = i;
	}
	if (lobes > k->n)
		lobes = (uint32_t)k->n;
	if (!(top > 0))
		lobes = 0; /* nothing but the Lambertian part */
	k->centre = malloc((lobes + 1) * sizeof *k->centre);
	k->kappa = malloc((lobes + 1) * sizeof *k->kappa);
	if (!k->centre || !k->kappa)
		return -1;
	for (k->lobes = 0; k->lobes < lobes; k->lobes++) {
		if (k->nearest[next] <= 1e-12f)
			break; /* only duplicates are left */
		const float *c = k->w[next];
		memcpy(k->centre[k->lobes], c, sizeof *k->centre);
		float far = -1;
		size_t at = 0;
		for (size_t i = 0; i < k->n; i++) {
			const float x = k->w[i][0] - c[0], y = k->w[i][1] - c[1], z = k->w[i][2] - c[2];
			const float d = (x*x + y*y + z*z) * k->spacing[i] * k->spacing[i];
			if (d < k->nearest[i])
				k->nearest[i] = d;
			if (k->nearest[i] > far) {
				far = k->nearest[i];
				at = i;
			}
		}
		next = at;
	}
	rbf_tree tree;
	if (rbf_tree_build(&tree, k->lobes, (const float (*)[3])k->centre))
		return -1;
	for (uint32_t j = 0; j < k->lobes; j++) {
		uint32_t index[SPACING + 1];
		float distance[SPACING + 1];
		double sum = 0;
		const int found = rbf_tree_nearest(&tree, k->centre[j], SPACING + 1, index, distance);
		for (int i = 0; i < found; i++)
			sum += sqrt(distance[i]); /* its own is 0 */
		double sigma = found > 1 ? WIDTH * sum / (found - 1) : SIGMA_MAX;
		sigma = fmin(fmax(sigma, SIGMA_MIN), SIGMA_MAX);
		k->kappa[j] = (float)(1 / (sigma * sigma));
	}
	rbf_tree_free(&tree);
	return 0;
}

/* Sparse basis: which lobes matter at which sample. */
static int basis(work *k)
{
	k->first = calloc(k->n + 2, sizeof *k->first);
	if (!k->first)
		return -1;
	for (int pass = 0; pass < 2; pass++) {
		for (uint32_t j = 0; j < k->lobes; j++) {
			const float limit = (float)(CUT * CUT) / k->kappa[j];
			const float *c = k->centre[j];
			for (size_t i = 0; i < k->n; i++) {
				const float x = k->w[i][0] - c[0], y = k->w[i][1] - c[1], z = k->w[i][2] - c[2];
				const float d2 = x*x + y*y + z*z;
				if (d2 > limit)
					continue;
				if (!pass)
					k->first[i + 2]++;
				else {
					const size_t at = k->first[i + 1]++;
					k->column[at] = j;
					k->value[at] = expf(-.5f * k->kappa[j] * d2);
				}
			}
		}
		if (!pass) {
			for (size_t i = 0; i < k->n; i++)
				k->first[i + 2] += k->first[i + 1];
			const size_t entries = k->first[k->n + 1];
			k->column = malloc((entries + 1) * sizeof *k->column);
			k->value = malloc((entries + 1) * sizeof *k->value);
			if (!k->column || !k->value)
				return -1;
		}
	}
	return 0;
}

/* Gram matrix with weights w_i^2, w_i = max(signal, floor)^-1/2 from the smoothed signal (the noisy one would bias the
 * energy), and its ridge. */
static int equations(work *k)
{
	const size_t m = k->lobes;
	k->gram = calloc(m * m + 1, sizeof *k->gram);
	k->right = malloc((m + 1) * sizeof *k->right);
	k->gradient = malloc((m + 1) * sizeof *k->gradient);
	k->amplitude = malloc((m + 1) * sizeof *k->amplitude);
	if (!k->gram || !k->right || !k->gradient || !k->amplitude)
		return -1;
	float top = 0;
	for (size_t i = 0; i < k->n; i++)
		top = fmaxf(top, k->smooth[i]);
	for (size_t i = 0; i < k->n; i++) {
		k->spacing[i] = 1 / fmaxf(k->smooth[i], (float)WEIGHT_FLOOR * top);
		for (size_t p = k->first[i]; p < k->first[i + 1]; p++) {
			double *row = k->gram + (size_t)k->column[p] * m;
			const double v = (double)(k->spacing[i] * k->value[p]);
			for (size_t q = p; q < k->first[i + 1]; q++)
				row[k->column[q]] += v * (double)k->value[q];
		}
	}
	double mean = 0;
	for (size_t j = 0; j < m; j++)
		mean += k->gram[j * m + j] / (double)m;
	for (size_t j = 0; j < m; j++) {
		k->gram[j * m + j] += RIDGE * mean;
		for (size_t i = 0; i < j; i++)
			k->gram[j * m + i] = k->gram[i * m + j];
	}
	return 0;
}

/* Non-negative least squares for one channel. */
static void solve(work *k, const float *y)
{
	const size_t m = k->lobes;
	memset(k->right, 0, m * sizeof *k->right);
	for (size_t i = 0; i < k->n; i++)
		for (size_t p = k->first[i]; p < k->first[i + 1]; p++)
			k->right[k->column[p]] += (double)(k->spacing[i] * k->value[p]) * (double)y[i];
	for (size_t j = 0; j < m; j++) {
		k->amplitude[j] = 0;
		k->gradient[j] = -k->right[j];
	}
	double scale = 0;
	for (size_t j = 0; j < m; j++)
		scale = fmax(scale, fabs(k->right[j]) / sqrt(k->gram[j * m + j]));
	for (int sweep = 0; sweep < SWEEPS; sweep++) {
		double largest = 0;
		for (size_t j = 0; j < m; j++) {
			const double diagonal = k->gram[j * m + j];
			double a = k->amplitude[j] - k->gradient[j] / diagonal;
			if (!(a > 0))
				a = 0;
			const double step = a - k->amplitude[j];
			if (step == 0)
				continue;
			k->amplitude[j] = a;
			largest = fmax(largest, fabs(step) * sqrt(diagonal));
			const double *restrict row = k->gram + j * m;
			double *restrict gradient = k->gradient;
			for (size_t i = 0; i < m; i++)
				gradient[i] += step * row[i];
		}
		if (largest < STEP * scale)
			break;
	}
}

/* Position along a Hilbert curve over the square map: neighbours in order are neighbours in direction, which keeps
 * blocks compact and stratified sampling stratified. */
static uint32_t hilbert(const float direction[3])
{
	float square[2];
	uint32_t x[2], order = 0;
	rbf_square_from_direction(direction, square);
	for (int a = 0; a < 2; a++)
		x[a] = (uint32_t)fminf(fmaxf((square[a] + 1) * 32768, 0.f), 65535.f);
	for (uint32_t s = 32768; s; s >>= 1) {
		const uint32_t rx = (x[0] & s) != 0, ry = (x[1] & s) != 0;
		order += s * s * ((3 * rx) ^ ry);
		if (!ry) {
			if (rx) {
				x[0] = 65535 - x[0];
				x[1] = 65535 - x[1];
			}
			const uint32_t t = x[0];
			x[0] = x[1];
			x[1] = t;
		}
	}
	return order;
}

typedef struct ranked { uint32_t order, lobe; } ranked;

static int by_order(const void *a, const void *b)
{
	const ranked *x = a, *y = b;
	return x->order != y->order ? (x->order < y->order ? -1 : 1) : x->lobe < y->lobe ? -1 : x->lobe > y->lobe;
}

/* Keeps the lobes that matter. */
static int keep(const work *k, const double *amplitude[3], int channels, rbf_lobes *out)
{
	const uint32_t y = rbf_luminance((uint32_t)channels);
	uint32_t count = 0;
	double total = 0;
	ranked *rank = malloc((k->lobes + 1) * sizeof *rank);
	if (!rank)
		return -1;
	for (uint32_t j = 0; j < k->lobes; j++)
		total += amplitude[y][j] * rbf_lobe_integral(k->kappa[j]);
	for (uint32_t j = 0; j < k->lobes; j++) {
		double energy = 0;
		for (int c = 0; c < channels; c++)
			energy = fmax(energy, amplitude[c][j] * rbf_lobe_integral(k->kappa[j]));
		if (energy > 1e-8 * total)
			rank[count++] = (ranked){hilbert(k->centre[j]), j};
	}
	qsort(rank, count, sizeof *rank, by_order);
	if (rbf_lobes_new(out, count, (uint32_t)channels)) {
		free(rank);
		return -1;
	}
	for (uint32_t at = 0; at < count; at++) {
		const uint32_t j = rank[at].lobe;
		rbf_lobe_set(out, at, k->centre[j], k->kappa[j]);
		for (uint32_t c = 0; c < (uint32_t)channels; c++)
			out->amplitude[c * out->blocks + at / RBF_LANES].a[at % RBF_LANES] = (float)amplitude[c][j];
		out->mass[at] = amplitude[y][j] * rbf_lobe_integral(k->kappa[j]);
	}
	free(rank);
	return 0;
}

static float held_out_error(const rbf_incidence *in, int channels, const float lambertian[3], uint32_t hold, const rbf_lobes *lobes)
{
	const uint32_t y = rbf_luminance((uint32_t)channels);
	double difference = 0, total = 0;
	if (hold < 2)
		return -1;
	for (size_t i = hold / 2; i < in->count; i += hold) {
		const float w[3] = {(float)in->outgoing[3*i], (float)in->outgoing[3*i + 1], (float)in->outgoing[3*i + 2]};
		float v[3];
		rbf_lobes_sum(lobes, w, v);
		const double t = (double)in->dsf[i * (size_t)channels + y];
		difference += fabs(v[y] + lambertian[y] * w[2] / RBF_PI - t);
		total += fabs(t);
	}
	return total > 0 ? (float)(difference / total) : -1;
}

int rbf_fit(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t lobes, uint32_t hold,
	rbf_lobes *out, float *error)
{
	work k = {0};
	const uint32_t y = rbf_luminance((uint32_t)channels);
	const double *amplitude[3] = {NULL, NULL, NULL};
	double *copy = NULL;
	int failed = gather(&k, incidence, channels, lambertian, hold) || smooth(&k, k.y[y]) || place(&k, lobes)
		|| basis(&k) || equations(&k);
	memset(out, 0, sizeof *out);
	*error = -1;
	if (!failed && !(copy = calloc((size_t)k.lobes * (size_t)channels + 1, sizeof *copy)))
		failed = 1;
	if (!failed) {
		for (int c = 0; c < channels; c++) {
			solve(&k, k.y[c]);
			memcpy(copy + (size_t)c * k.lobes, k.amplitude, k.lobes * sizeof *copy);
			amplitude[c] = copy + (size_t)c * k.lobes;
		}
		failed = keep(&k, amplitude, channels, out);
	}
	if (!failed)
		*error = held_out_error(incidence, channels, lambertian, hold, out);
	free(copy);
	work_free(&k);
	return failed ? -1 : 0;
}

static int ascending(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;
	return x < y ? -1 : x > y;
}

/* The Lambertian part is what every direction at every incidence shares. Local means (noise averages out in them) are
 * sorted, and a low quantile, a little reduced, is taken as each incidence's floor. */
void rbf_fit_lambertian(const rbf_measured *measured, int channels, float lambertian[3])
{
	for (int c = 0; c < 3; c++)
		lambertian[c] = 0;
	for (int c = 0; c < channels; c++) {
		float floor = INFINITY;
		for (size_t b = 0; b < measured->count; b++) {
			const rbf_incidence *in = &measured->incidence[b];
			float (*w)[3] = malloc((in->count + 1) * sizeof *w);
			float *mean = malloc((in->count + 1) * sizeof *mean);
			rbf_tree tree;
			if (!w || !mean)
				floor = 0;
			for (size_t i = 0; w && i < in->count; i++)
				for (int a = 0; a < 3; a++)
					w[i][a] = (float)in->outgoing[3*i + (size_t)a];
			if (floor > 0 && !rbf_tree_build(&tree, in->count, (const float (*)[3])w)) {
				size_t used = 0;
				for (size_t i = 0; i < in->count; i++) {
					uint32_t index[2 * SMOOTH];
					float distance[2 * SMOOTH];
					double sum = 0, cosine = 0;
					if (w[i][2] < .15f)
						continue;
					const int found = rbf_tree_nearest(&tree, w[i], 2 * SMOOTH, index, distance);
					for (int j = 0; j < found; j++) {
						sum += (double)in->dsf[(size_t)index[j] * (size_t)channels + (size_t)c];
						cosine += (double)w[index[j]][2];
					}
					mean[used++] = (float)(sum / cosine);
				}
				if (used) {
					qsort(mean, used, sizeof *mean, ascending);
					floor = fminf(floor, fmaxf(.95f * mean[used / 50], 0.f));
				}
				rbf_tree_free(&tree);
			}
			free(w);
			free(mean);
		}
		lambertian[c] = isfinite(floor) ? floor * (float)RBF_PI : 0;
	}
}
