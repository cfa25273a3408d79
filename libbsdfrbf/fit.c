/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Lobe fit of one incidence: DSF(w) = sum a_j exp(-kappa_j |w - c_j|^2 / 2), a >= 0.
 * Centres are samples, taken farthest first in a metric that shrinks where the signal is high; widths follow the
 * spacing of the centres; amplitudes are the non-negative least-squares solution.
 */
#include "fit.h"
#include "arrange.h"
#include "equations.h"
#include "farthest.h"
#include "neighbours.h"
#include "nonnegative.h"

#include <stdlib.h>
#include <string.h>

enum { SMOOTH = 8, SPACING = 5, LEVEL_RATIO = 4, LEVEL_MIN = 8, PEAKS = 16, PEAK_AROUND = 48, GAP_AROUND = 48, AREA_AROUND = 32 };
static const float PEAK_PART = .05f; /* of a peak's own height */
static const double PEAK_SEEN = 2;      /* a sample lies within so many sigmas of a peak's top */
static const double DENSITY = .4;       /* spacing ~ signal^-DENSITY */
static const double FLOOR = 1e-4;       /* of the maximum: below, the signal asks for no more lobes */
static const double WIDTH = .8;         /* sigma over the mean distance of the nearest centres */
static const double GAP = 2, GAP_NONE = 1.6; /* sigmas that bridge a gap between samples; up to so many times that it is none */
static const float AXIS = .41421356f;   /* tan 22.5 degrees */
static const double SIGMA_MIN = .002, SIGMA_MAX = .6;
static const double RIDGE = 1e-5, RIDGE_MOST = .01;
static const float OUTLIER = 8, OUTLIER_MIN = .2f; /* times the spread of the fit's relative error; and at least */
static const double WEIGHT_FLOOR = 1e-3;
static const float SAME = 1e-12f;       /* square of a distance: no distance */

/* Working arrays of one incidence: what its fits share, and those of the last one. */
typedef struct rbf_fitting {
	const rbf_incidence *incidence;
	int channels;
	float lambertian[3];
	uint32_t hold;
	size_t n;                 /* samples in use */
	rbf_tree tree;
	float (*w)[3];            /* directions: the tree's points */
	float *y[3];              /* DSF less the Lambertian part */
	float *smooth, top;       /* geometric mean of the neighbours, luminance; the highest */
	float *density;           /* of lobes that the signal asks for */
	float *miss, *sorted;     /* scratch */
	float *weight;            /* of the squared difference, all samples */
	float *gap;               /* gap_at(), -1: not asked yet */
	float *area;              /* of the samples held out (areas()), NULL: not asked yet */
	uint8_t *outlier;         /* 1: not used */
	const float *level;       /* luminance of y */
	uint32_t lobes;
	float (*centre)[3];
	float *across;            /* gap_at() of those that are samples */
	float *kappa;
	rbf_equations equations;
	double *amplitude;        /* their solution, by channel */
} work;

/* What one number of lobes needed. */
static void forget(work *k)
{
	free(k->centre);
	free(k->across);
	free(k->kappa);
	rbf_equations_free(&k->equations);
	free(k->amplitude);
	k->centre = NULL;
	k->across = NULL;
	k->kappa = NULL;
	k->amplitude = NULL;
}

/* Samples in use, in the order of a tree: near ones follow each other. */
static int gather(work *k)
{
	const rbf_incidence *in = k->incidence;
	const int channels = k->channels;
	float (*w)[3] = malloc((in->count + 1) * sizeof *w);
	size_t *from = malloc((in->count + 1) * sizeof *from);
	for (int c = 0; c < channels; c++)
		k->y[c] = malloc((in->count + 1) * sizeof(float));
	k->smooth = malloc((in->count + 1) * sizeof(float));
	k->density = malloc((in->count + 1) * sizeof(float));
	k->miss = malloc((in->count + 1) * sizeof(float));
	k->sorted = malloc((in->count + 1) * sizeof(float));
	k->weight = malloc((in->count + 1) * sizeof(float));
	k->gap = malloc((in->count + 1) * sizeof(float));
	k->outlier = calloc(in->count + 1, 1);
	int failed = !w || !from || !k->y[0] || (channels == 3 && (!k->y[1] || !k->y[2])) || !k->smooth || !k->density || !k->miss || !k->sorted || !k->weight || !k->gap || !k->outlier;
	for (size_t i = 0; i < in->count && !failed; i++) {
		if (k->hold > 1 && i % k->hold == k->hold / 2)
			continue;
		for (int a = 0; a < 3; a++)
			w[k->n][a] = (float)in->outgoing[3*i + (size_t)a];
		from[k->n++] = i;
	}
	failed = failed || rbf_tree_build(&k->tree, k->n, (const float (*)[3])w);
	for (size_t i = 0; i < k->n && !failed; i++) {
		const size_t sample = from[k->tree.index[i]];
		k->tree.index[i] = (uint32_t)i;
		for (int c = 0; c < channels; c++)
			k->y[c][i] = in->dsf[sample * (size_t)channels + (size_t)c] - k->lambertian[c] * k->tree.point[i][2] * (float)(1 / RBF_PI);
	}
	for (size_t i = 0; i < k->n && !failed; i++)
		k->gap[i] = -1;
	k->w = k->tree.point;
	free(w);
	free(from);
	return failed ? -1 : 0;
}

/* Geometric mean of the nearest samples: a value that noise and outliers hardly move. */
static void smooth(work *k, const float *y)
{
	float top = 0;
	for (size_t i = 0; i < k->n; i++)
		top = fmaxf(top, y[i]);
	if (!(top > 0)) {
		memset(k->smooth, 0, k->n * sizeof *k->smooth);
		return;
	}
	const float low = 1e-6f * top;
	float *logarithm = k->miss;
	for (size_t i = 0; i < k->n; i++)
		logarithm[i] = logf(fmaxf(y[i], low));
	for (size_t i = 0; i < k->n; i++) {
		uint32_t index[SMOOTH];
		float distance[SMOOTH], sum = 0;
		const int found = rbf_tree_nearest(&k->tree, k->w[i], SMOOTH, index, distance);
		for (int j = 0; j < found; j++)
			sum += logarithm[index[j]];
		k->smooth[i] = expf(sum / (float)found);
	}
}

/* How far samples are apart about sample i, along the axis where they are farthest: those of a scan by arcs may be ten times as far
 * from each other across the arcs as along them, and lobes as narrow as along would leave the dark between. Either side of an axis will
 * do, as at the horizon or a hole there is but one; 0 if the nearest samples do not tell, as they all lie on one line. */
static float gap_at(work *k, size_t i)
{
	uint32_t index[GAP_AROUND];
	float distance[GAP_AROUND], t[3], u[3], nearest[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, widest = 0;
	if (k->gap[i] >= 0)
		return k->gap[i];
	const int found = rbf_tree_nearest(&k->tree, k->w[i], GAP_AROUND, index, distance);
	rbf_basis(k->w[i], t, u);
	for (int n = 0; n < found; n++) {
		const float x = rbf_dot(k->w[index[n]], t), y = rbf_dot(k->w[index[n]], u);
		const int axis = fabsf(y) < AXIS * fabsf(x) ? 0 : fabsf(x) < AXIS * fabsf(y) ? 1 : x * y > 0 ? 2 : 3;
		if (distance[n] > 1e-10f)
			nearest[axis] = fminf(nearest[axis], distance[n]);
	}
	for (int a = 0; a < 4; a++)
		widest = fmaxf(widest, nearest[a]);
	return k->gap[i] = widest < INFINITY ? sqrtf(widest) : 0;
}

/* The farthest-point order is a hierarchy: its first quarter covers the same ground at twice the spacing. Each such level adds
 * its centres once more with the width of its own spacing, so that smooth parts can be carried by few wide lobes. */
static int widths(work *k)
{
	const uint32_t finest = k->lobes;
	for (uint32_t level = finest; level >= LEVEL_MIN || level == finest; level /= LEVEL_RATIO) {
		rbf_tree tree;
		if (rbf_tree_build(&tree, level, (const float (*)[3])k->centre))
			return -1;
		for (uint32_t j = 0; j < level; j++) {
			uint32_t index[SPACING + 1];
			float distance[SPACING + 1];
			double sum = 0;
			const int found = rbf_tree_nearest(&tree, k->centre[j], SPACING + 1, index, distance);
			for (int i = 0; i < found; i++)
				sum += sqrt((double)distance[i]); /* its own is 0 */
			double sigma = found > 1 ? WIDTH * sum / (found - 1) : SIGMA_MAX;
			const double across = (double)k->across[j] / GAP;
			if (across > GAP_NONE * sigma)
				sigma = fmin(across, sigma + 3 * (across - GAP_NONE * sigma));
			sigma = fmin(fmax(sigma, SIGMA_MIN), SIGMA_MAX);
			const uint32_t at = level == finest ? j : k->lobes++;
			memcpy(k->centre[at], k->centre[j], sizeof *k->centre);
			k->kappa[at] = (float)(1 / (sigma * sigma));
		}
		rbf_tree_free(&tree);
		if (!level)
			break;
	}
	return 0;
}

/* Solves the 4 x 4 system in place by elimination with pivots; 0 if it is singular. */
static int solve4(double m[4][5])
{
	for (int c = 0; c < 4; c++) {
		int pivot = c;
		for (int r = c + 1; r < 4; r++)
			if (fabs(m[r][c]) > fabs(m[pivot][c]))
				pivot = r;
		if (!(fabs(m[pivot][c]) > 1e-12))
			return 0;
		for (int i = 0; i < 5; i++) {
			const double t = m[c][i];
			m[c][i] = m[pivot][i];
			m[pivot][i] = t;
		}
		for (int r = 0; r < 4; r++) {
			const double f = m[r][c] / m[c][c];
			for (int i = c; i < 5 && r != c; i++)
				m[r][i] -= f * m[c][i];
		}
	}
	return 1;
}

/* A Gaussian by regression, log(y - base) = a + b.t - kappa/2 t^2 over the nearest samples of sample i, t in the tangent plane,
 * joins as a candidate if the samples tell it. */
static void add_peak(work *k, size_t i, int nearest, float base)
{
	uint32_t index[PEAK_AROUND];
	float distance[PEAK_AROUND];
	const int count = rbf_tree_nearest(&k->tree, k->w[i], nearest, index, distance);
	const float *w = k->w[i];
	float t[3], u[3];
	rbf_basis(w, t, u);
	const double unit = sqrt((double)distance[count - 1]);
	double m[4][5] = {{0}};
	float peak = 0;
	int used = 0;
	if (count < nearest || !(unit > 0))
		return;
	for (int j = 0; j < count; j++)
		peak = fmaxf(peak, k->level[index[j]] - base);
	for (int j = 0; j < count; j++) {
		const float *p = k->w[index[j]], level = k->level[index[j]] - base;
		const double x = (double)rbf_dot(p, t) / unit, y = (double)rbf_dot(p, u) / unit;
		const double row[5] = {1, x, y, x*x + y*y, (double)logf(fmaxf(level, 1e-30f))};
		if (level < PEAK_PART * peak)
			continue;
		used++;
		for (int r = 0; r < 4; r++)
			for (int q = 0; q < 5; q++)
				m[r][q] += row[r] * row[q];
	}
	if (used < 6 || !solve4(m))
		return;
	const double curvature = -2 * m[3][4] / m[3][3], kappa = curvature / (unit * unit);
	const double x = m[1][4] / m[1][1] / curvature * unit, y = m[2][4] / m[2][2] / curvature * unit;
	if (!(kappa > 1 / (SIGMA_MAX * SIGMA_MAX)) || !(kappa < 1 / (SIGMA_MIN * SIGMA_MIN)) || !(hypot(x, y) < unit))
		return;
	float *c = k->centre[k->lobes];
	for (int q = 0; q < 3; q++)
		c[q] = w[q] + (float)x * t[q] + (float)y * u[q];
	rbf_normalize(c);
	/* samples that all lie on a circle tell neither; an amplitude that no sample sees would be anything */
	rbf_tree_nearest(&k->tree, c, 1, index, distance);
	if (kappa * (double)distance[0] > PEAK_SEEN * PEAK_SEEN)
		return;
	k->kappa[k->lobes++] = (float)kappa;
}

/* A narrow peak holds few samples, and none sits on its top: local maxima add candidates, the most prominent ones if there are
 * many. What counts is how far one stands out of its surroundings, not how high it is: errors are relative. A peak that is seen
 * down to its foot is also tried without what lies under it. */
static void peaks(work *k)
{
	static const int nearest[] = {PEAK_AROUND / 4, PEAK_AROUND / 2, PEAK_AROUND};
	struct { size_t sample; float prominence, base; } most[PEAKS + 1];
	int found = 0;
	for (size_t i = 0; i < k->n && k->top > 0; i++) {
		uint32_t index[PEAK_AROUND];
		float distance[PEAK_AROUND], around = 0, base = k->smooth[i];
		if (k->smooth[i] < (float)WEIGHT_FLOOR * k->top)
			continue;
		const int near = rbf_tree_nearest(&k->tree, k->w[i], SMOOTH, index, distance);
		int highest = 1;
		for (int j = 0; j < near && highest; j++)
			highest = k->smooth[index[j]] < k->smooth[i] || (k->smooth[index[j]] == k->smooth[i] && index[j] >= i);
		if (!highest)
			continue;
		const int count = rbf_tree_nearest(&k->tree, k->w[i], PEAK_AROUND, index, distance);
		for (int j = 0; j < count; j++) {
			around += k->smooth[index[j]] / k->smooth[i] / (float)count;
			base = fminf(base, k->smooth[index[j]]);
		}
		int place = found < PEAKS ? found++ : PEAKS;
		for (; place > 0 && 1 - around > most[place - 1].prominence; place--)
			most[place] = most[place - 1];
		most[place].sample = i;
		most[place].prominence = 1 - around;
		most[place].base = base < .5f * k->smooth[i] ? base : 0;
	}
	for (int p = 0; p < found; p++)
		for (size_t n = 0; n < sizeof nearest / sizeof *nearest; n++)
			for (int foot = 0; foot < (most[p].base > 0 ? 2 : 1); foot++)
				add_peak(k, most[p].sample, nearest[n], foot ? most[p].base : 0);
}

/* Density of lobes and weights from the smoothed signal: max(signal, floor)^-1, since the noisy one would bias the energy. */
static void weigh(work *k)
{
	for (size_t i = 0; i < k->n; i++)
		k->top = fmaxf(k->top, k->smooth[i]);
	for (size_t i = 0; i < k->n && k->top > 0; i++) {
		/* 1 / s; by f rather than DSF, if not wholly: near the horizon f is large where the DSF ends */
		const float signal = k->smooth[i] / k->top / sqrtf(fmaxf(k->w[i][2], .02f));
		k->density[i] = powf(fmaxf(signal, (float)FLOOR), (float)DENSITY);
		k->weight[i] = 1 / fmaxf(k->smooth[i], (float)WEIGHT_FLOOR * k->top);
	}
}

/* Farthest-point order in the density-adapted metric. */
static int place(work *k, uint32_t lobes)
{
	if (lobes > k->n)
		lobes = (uint32_t)k->n;
	if (!(k->top > 0))
		lobes = 0; /* nothing but the Lambertian part */
	k->centre = malloc((2 * (size_t)lobes + 6 * PEAKS + 1) * sizeof *k->centre);
	k->kappa = malloc((2 * (size_t)lobes + 6 * PEAKS + 1) * sizeof *k->kappa);
	k->across = malloc(((size_t)lobes + 1) * sizeof *k->across);
	uint32_t *order = malloc(((size_t)lobes + 1) * sizeof *order);
	const ptrdiff_t placed = !k->centre || !k->kappa || !k->across || !order ? -1
		: rbf_farthest(k->n, (const float (*)[3])k->w, k->density, lobes, order);
	for (ptrdiff_t j = 0; j < placed; j++) {
		memcpy(k->centre[j], k->w[order[j]], sizeof *k->centre);
		k->across[j] = gap_at(k, order[j]);
	}
	free(order);
	if (placed < 0)
		return -1;
	k->lobes = (uint32_t)placed;
	if (widths(k))
		return -1;
	peaks(k);
	return 0;
}

/* Weighted normal equations. */
static int equations(work *k, int channels)
{
	const size_t m = k->lobes;
	rbf_equations *e = &k->equations;
	double mean = 0;
	*e = (rbf_equations){.samples = k->n, .direction = (const float (*)[3])k->w, .weight = k->weight, .value = {k->y[0], k->y[1], k->y[2]},
		.channels = channels, .lobes = m, .centre = (const float (*)[3])k->centre, .kappa = k->kappa};
	k->amplitude = calloc(m * (size_t)channels + 1, sizeof *k->amplitude);
	if (!k->amplitude || rbf_equations_make(e))
		return -1;
	for (size_t j = 0; j < m; j++)
		mean += e->gram[j * m + j] / (double)m;
	for (size_t j = 0; j < m; j++) /* never much of a lobe's own weight: narrow lobes on a peak would be shrunk */
		e->gram[j * m + j] += fmin(RIDGE * mean, RIDGE_MOST * e->gram[j * m + j]);
	return 0;
}

static int ascending(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;
	return x < y ? -1 : x > y;
}

/* A sample that the fit misses by far while it meets those around it is a fault of the measurement (cosmic ray, dropout); where
 * several neighbours are missed, it is the fit that is at fault, and they stay. Returns how many are newly excluded. */
static size_t find_outliers(work *k, const rbf_lobes *fitted)
{
	const uint32_t y = rbf_luminance(fitted->channels);
	float *miss = k->miss, *sorted = k->sorted;
	size_t found = 0;
	for (size_t i = 0; i < k->n; i++) {
		float value[3];
		rbf_lobes_sum(fitted, k->w[i], value);
		miss[i] = sorted[i] = fabsf(k->level[i] - value[y]) / fmaxf(fmaxf(value[y], k->smooth[i]), (float)WEIGHT_FLOOR * k->top);
	}
	qsort(sorted, k->n, sizeof *sorted, ascending);
	const float spread = 1.4826f * sorted[k->n / 2];
	for (size_t i = 0; i < k->n; i++) {
		uint32_t index[SMOOTH + 1];
		float distance[SMOOTH + 1];
		int missed = 0;
		if (k->outlier[i] || !(miss[i] > OUTLIER * spread) || !(miss[i] > OUTLIER_MIN))
			continue;
		const int around = rbf_tree_nearest(&k->tree, k->w[i], SMOOTH + 1, index, distance);
		for (int j = 0; j < around; j++)
			missed += index[j] != i && miss[index[j]] > .4f * miss[i];
		if (missed <= 1) {
			k->outlier[i] = 1;
			found++;
		}
	}
	return found;
}

/* Samples are dense where there is much light: each counts for the solid angle it stands for, up to a common factor that of a cap which
 * holds so many others. Returns -1 when out of memory. */
static int areas(work *k)
{
	const rbf_incidence *in = k->incidence;
	size_t held = 0;
	k->area = malloc((in->count / k->hold + 1) * sizeof *k->area);
	for (size_t i = k->hold / 2; i < in->count && k->area; i += k->hold) {
		const float w[3] = {(float)in->outgoing[3*i], (float)in->outgoing[3*i + 1], (float)in->outgoing[3*i + 2]};
		uint32_t index[AREA_AROUND];
		float distance[AREA_AROUND];
		const int found = rbf_tree_nearest(&k->tree, w, AREA_AROUND, index, distance);
		k->area[held++] = found ? distance[found - 1] + SAME : 1;
	}
	return k->area ? 0 : -1;
}

/* -1: none held out. */
static float held_out_error(const work *k, const rbf_lobes *lobes)
{
	const rbf_incidence *in = k->incidence;
	const uint32_t channels = (uint32_t)k->channels, y = rbf_luminance(channels);
	double difference = 0, total = 0;
	size_t held = 0;
	for (size_t i = k->hold / 2; i < in->count && k->hold > 1; i += k->hold) {
		const float w[3] = {(float)in->outgoing[3*i], (float)in->outgoing[3*i + 1], (float)in->outgoing[3*i + 2]};
		float v[3];
		const double area = (double)k->area[held++], t = (double)in->dsf[i * channels + y];
		rbf_lobes_sum(lobes, w, v);
		difference += area * fabs(v[y] + k->lambertian[y] * w[2] / RBF_PI - t);
		total += area * fabs(t);
	}
	return total > 0 ? (float)(difference / total) : -1;
}

static int solve(work *k, rbf_lobes *out)
{
	const rbf_equations *e = &k->equations;
	for (int c = 0; c < k->channels; c++)
		if (rbf_nonnegative_solve(k->lobes, e->gram, e->right + (size_t)c * k->lobes, e->squares[c], e->count, k->amplitude + (size_t)c * k->lobes))
			return -1;
	return rbf_arrange(k->lobes, (const float (*)[3])k->centre, k->kappa, k->amplitude, k->channels, out);
}

rbf_fitting *rbf_fit_begin(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t hold)
{
	work *k = calloc(1, sizeof *k);
	if (!k)
		return NULL;
	k->incidence = incidence;
	k->channels = channels;
	memcpy(k->lambertian, lambertian, (size_t)channels * sizeof *lambertian);
	k->hold = hold;
	if (gather(k)) {
		rbf_fit_end(k);
		return NULL;
	}
	k->level = k->y[rbf_luminance((uint32_t)channels)];
	smooth(k, k->level);
	weigh(k);
	return k;
}

void rbf_fit_end(rbf_fitting *k)
{
	if (!k)
		return;
	forget(k);
	rbf_tree_free(&k->tree);
	for (int c = 0; c < 3; c++)
		free(k->y[c]);
	free(k->smooth);
	free(k->density);
	free(k->miss);
	free(k->sorted);
	free(k->weight);
	free(k->gap);
	free(k->area);
	free(k->outlier);
	free(k);
}

int rbf_fit_lobes(rbf_fitting *k, uint32_t lobes, rbf_lobes *out, float *error)
{
	memset(out, 0, sizeof *out);
	memset(k->outlier, 0, k->n);
	int failed = place(k, lobes) || equations(k, k->channels) || solve(k, out);
	if (!failed && find_outliers(k, out)) {
		rbf_lobes_free(out);
		failed = rbf_equations_leave_out(&k->equations, k->outlier) || solve(k, out);
	}
	failed = failed || (error && k->hold > 1 && !k->area && areas(k));
	if (!failed && error)
		*error = held_out_error(k, out);
	forget(k);
	return failed ? -1 : 0;
}

int rbf_fit(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t lobes, uint32_t hold,
	rbf_lobes *out, float *error)
{
	rbf_fitting *k = rbf_fit_begin(incidence, channels, lambertian, hold);
	memset(out, 0, sizeof *out);
	const int failed = !k || rbf_fit_lobes(k, lobes, out, error);
	rbf_fit_end(k);
	return failed ? -1 : 0;
}
