/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Lobe fit of one incidence: DSF(w) = sum a_j exp(-kappa_j |w - c_j|^2 / 2), a >= 0.
 * Centres are samples, taken farthest first in a metric that shrinks where the signal is high; widths follow the
 * spacing of the centres; amplitudes are the non-negative least-squares solution. Where that misses what several samples
 * show, lobes join, and it is solved again.
 */
#include "fit.h"
#include "arrange.h"
#include "between.h"
#include "equations.h"
#include "farthest.h"
#include "held_out.h"
#include "missed.h"
#include "nonnegative.h"
#include "peaks.h"
#include "twins.h"

#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 6, MISSED = 32, FEW = 4 }; /* rounds in which lobes join; how many in each at most; so few make it the last one */
enum { SOME = 4 }; /* every fourth sample tells the median */
enum { SMOOTH = 8, SPACING = 5, LEVEL_RATIO = 4, LEVEL_MIN = 8, BRIDGED_AROUND = 16 };
static const double DENSITY = .4;       /* spacing ~ signal^-DENSITY */
static const double FLOOR = 1e-4;       /* of the maximum: below, the signal asks for no more lobes */
static const double WIDTH = .8;         /* sigma over the mean distance of the nearest centres */
static const double NARROW = .5;        /* the same of narrow ones: their sum is still flat to a thirtieth where it should be */
static const double GAP = 2, GAP_NONE = 1.6; /* sigmas that bridge a gap between samples; up to so many times that it is none */
static const double SIGMA_MIN = .0005, SIGMA_MAX = .6; /* narrower, the rounding of directions (1e-7) would be seen */
static const double RIDGE = 1e-5, RIDGE_MOST = .01, RIDGE_PEAK = 1e-4; /* of the mean diagonal; at most of a lobe's own; and of a peak's over faint haze */
static const float OUTLIER = 8, OUTLIER_MIN = .2f; /* times the spread of the fit's relative error; and at least */
static const double DARK = 1e-3;        /* of the maximum: below, no peak and nothing missed is looked for */
static const float FAINT = .1f;         /* of the mean of all directions: values below, and below DARK, count as this much: they are hardly any light */
static const float LEAST = 1e-8f;       /* of the maximum: in any case */
static const float LOW = 1e-6f;         /* of the maximum: what the smoothed signal is at least, or a tenth of what counts */

/* Working arrays of one incidence: what its fits share, and those of the last one. */
typedef struct rbf_fitting {
	const rbf_incidence *incidence;
	int channels;
	float lambertian[3];
	uint32_t hold;
	int paired;               /* samples are folded to y >= 0, and lobes have twins (twins.h) */
	size_t n;                 /* samples in use */
	rbf_tree tree;
	float (*w)[3];            /* directions: the tree's points */
	float *y[3];              /* DSF less the Lambertian part */
	uint32_t (*near)[RBF_NEAR];
	float *smooth, top;       /* geometric mean of the neighbours, mixed; the highest */
	float faint, bright;      /* what is fainter hardly counts; the most, with the Lambertian part */
	float *total;             /* the same with the Lambertian part, not below DARK: what noise is in proportion to */
	float *density;           /* of lobes that the signal asks for */
	float *miss, *sorted;     /* what the fit lacks, over what there is in all; scratch */
	float *weight;            /* of the squared difference, all samples */
	float *gap;               /* gap_at(), -1: not asked yet */
	float *area;              /* of the samples held out, NULL: not asked yet */
	uint8_t *outlier;         /* 1: not used */
	float mix[3];             /* of the channels, by which each counts alike */
	float *level;             /* y so mixed: lobes are placed where any channel has light */
	uint32_t lobes, peak[2];  /* of these the first found as a peak, and the one after the last */
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

static int room_for(work *k)
{
	for (int c = 0; c < k->channels; c++)
		k->y[c] = malloc((k->n + 1) * sizeof(float));
	k->near = malloc((k->n + 1) * sizeof *k->near);
	k->smooth = malloc((k->n + 1) * sizeof(float));
	k->total = malloc((k->n + 1) * sizeof(float));
	k->density = malloc((k->n + 1) * sizeof(float));
	k->miss = malloc((k->n + 1) * sizeof(float));
	k->sorted = malloc((k->n + 1) * sizeof(float));
	k->weight = malloc((k->n + 1) * sizeof(float));
	k->gap = malloc((k->n + 1) * sizeof(float));
	k->level = malloc((k->n + 1) * sizeof(float));
	k->outlier = calloc(k->n + 1, 1);
	return !k->y[0] || (k->channels == 3 && (!k->y[1] || !k->y[2])) || !k->near || !k->smooth || !k->total || !k->density || !k->miss || !k->sorted
		|| !k->weight || !k->gap || !k->level || !k->outlier ? -1 : 0;
}

/* Samples in use, in the order of a tree: near ones follow each other. */
static int gather(work *k, int between)
{
	const rbf_incidence *in = k->incidence;
	const size_t channels = (size_t)k->channels;
	float (*w)[3] = malloc((in->count + 1) * sizeof *w), *value[3] = {NULL, NULL, NULL};
	int failed = !w;
	for (size_t c = 0; c < channels; c++) {
		value[c] = malloc((in->count + 1) * sizeof(float));
		failed |= !value[c];
	}
	for (size_t i = 0; i < in->count && !failed; i++) {
		if (rbf_held_out(k->hold, i))
			continue;
		for (size_t a = 0; a < 3; a++)
			w[k->n][a] = (float)in->outgoing[3*i + a];
		w[k->n][1] = k->paired ? fabsf(w[k->n][1]) : w[k->n][1];
		for (size_t c = 0; c < channels; c++)
			value[c][k->n] = in->dsf[i * channels + c];
		k->n++;
	}
	failed = failed || (between && rbf_between_add(&k->n, &w, k->channels, value)) || room_for(k)
		|| rbf_tree_build(&k->tree, k->n, (const float (*)[3])w);
	for (size_t i = 0; i < k->n && !failed; i++) {
		const size_t sample = k->tree.index[i];
		k->tree.index[i] = (uint32_t)i;
		k->gap[i] = -1;
		for (size_t c = 0; c < channels; c++)
			k->y[c][i] = value[c][sample] - k->lambertian[c] * k->tree.point[i][2] * (float)(1 / RBF_PI);
	}
	k->w = k->tree.point;
	for (size_t c = 0; c < channels; c++)
		free(value[c]);
	free(w);
	return failed ? -1 : 0;
}

static float mixed(const work *k, const float value[3])
{
	float sum = 0;
	for (int c = 0; c < k->channels; c++)
		sum += k->mix[c] * value[c];
	return sum;
}

/* Each channel by as much as brings it to the luminance's sum: a blue beam is as much of a beam as a green one. */
static void mix(work *k)
{
	const uint32_t channels = (uint32_t)k->channels;
	double sum[3] = {0, 0, 0};
	uint32_t some = 0;
	for (uint32_t c = 0; c < channels; c++) {
		for (size_t i = 0; i < k->n; i++)
			sum[c] += (double)fmaxf(k->y[c][i], 0);
		some += sum[c] > 0;
	}
	for (uint32_t c = 0; c < channels; c++)
		k->mix[c] = channels == 1 ? 1 : sum[c] > 0 ? (float)(sum[rbf_luminance(channels)] / sum[c] / some) : 0;
	for (size_t i = 0; i < k->n; i++)
		k->level[i] = mixed(k, (float[3]){k->y[0][i], channels > 1 ? k->y[1][i] : 0, channels > 1 ? k->y[2][i] : 0});
}

static float lambertian_at(const work *k, size_t i)
{
	return mixed(k, k->lambertian) * k->w[i][2] * (float)(1 / RBF_PI);
}

/* What is so faint that it hardly counts, of all light: FAINT of the mean of all directions, or DARK of the maximum if that is less. *bright: that. */
static float faint_of(const work *k, const float *y, float *bright)
{
	double light = 0, all = 0;
	float top = 0;
	for (size_t i = 0; i < k->n; i++) {
		const float *near = k->w[k->near[i][RBF_NEAR - 1]];
		const float apart[3] = {near[0] - k->w[i][0], near[1] - k->w[i][1], near[2] - k->w[i][2]}, value = fmaxf(y[i] + lambertian_at(k, i), 0);
		const double area = (double)rbf_dot(apart, apart);
		light += area * (double)value;
		all += area;
		top = fmaxf(top, value);
	}
	*bright = top;
	return fmaxf(all > 0 ? fminf(FAINT * (float)(light / all), (float)DARK * top) : 0, LEAST * top);
}

/* Geometric mean of the nearest samples: a value that noise and outliers hardly move. */
static void smooth(work *k, const float *y)
{
	float top = 0;
	for (size_t i = 0; i < k->n; i++) {
		float distance[RBF_NEAR];
		for (int j = rbf_tree_nearest(&k->tree, k->w[i], RBF_NEAR, k->near[i], distance); j < RBF_NEAR; j++)
			k->near[i][j] = (uint32_t)i;
	}
	for (size_t i = 0; i < k->n; i++)
		top = fmaxf(top, y[i]);
	if (!(top > 0)) {
		memset(k->smooth, 0, k->n * sizeof *k->smooth);
		return;
	}
	float *logarithm = k->miss;
	k->faint = faint_of(k, y, &k->bright);
	const float low = fmaxf(fminf(LOW, .1f * k->faint / top), LEAST) * top;
	for (size_t i = 0; i < k->n; i++)
		logarithm[i] = logf(fmaxf(y[i], low));
	for (size_t i = 0; i < k->n; i++) {
		float sum = 0;
		for (int j = 0; j < SMOOTH; j++)
			sum += logarithm[k->near[i][j]];
		k->smooth[i] = expf(sum / SMOOTH);
	}
}

/* As rbf_tree_gap(). */
static float gap_at(work *k, size_t i)
{
	if (k->gap[i] < 0)
		k->gap[i] = rbf_tree_gap(&k->tree, k->w[i], k->incidence->lines != RBF_LINES_LEFT);
	return k->gap[i];
}

/* The farthest-point order is a hierarchy: its first quarter covers the same ground at twice the spacing. Each such level adds
 * its centres once more with the width of its own spacing, so that smooth parts can be carried by few wide lobes. narrow: the finest
 * once more, narrower, so that edges can be as sharp as centres are near. */
static int widths(work *k, int narrow)
{
	const uint32_t finest = k->lobes;
	for (uint32_t level = finest; level >= LEVEL_MIN || level == finest; level /= LEVEL_RATIO) {
		rbf_tree tree;
		if (k->paired ? rbf_twins_tree(level, (const float (*)[3])k->centre, &tree) : rbf_tree_build(&tree, level, (const float (*)[3])k->centre))
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
		for (uint32_t j = 0; j < level && level == finest && narrow; j++, k->lobes++) {
			memcpy(k->centre[k->lobes], k->centre[j], sizeof *k->centre);
			k->kappa[k->lobes] = fminf(k->kappa[j] * (float)(WIDTH * WIDTH / (NARROW * NARROW)), (float)(1 / (SIGMA_MIN * SIGMA_MIN)));
		}
		rbf_tree_free(&tree);
		if (!level)
			break;
	}
	return 0;
}

/* Density of lobes from the smoothed signal, and weights from it and the Lambertian part: their inverse, since the noisy signal would bias
 * the energy; down to what hardly is any light: a haze of a millionth of a narrow beam may be as much in all. Where scan lines are bridged, dense
 * ones would outvote those across them. */
static void weigh(work *k)
{
	for (size_t i = 0; i < k->n; i++)
		k->top = fmaxf(k->top, k->smooth[i]);
	for (size_t i = 0; i < k->n && k->top > 0; i++) {
		/* 1 / s; by f rather than DSF, if not wholly: near the horizon f is large where the DSF ends */
		const float signal = k->smooth[i] / k->top / sqrtf(fmaxf(k->w[i][2], .02f));
		k->density[i] = powf(fmaxf(signal, (float)FLOOR), (float)DENSITY);
		const float total = k->smooth[i] + lambertian_at(k, i);
		k->total[i] = fmaxf(total, (float)DARK * k->top);
		k->weight[i] = (k->incidence->lines ? sqrtf(rbf_tree_cap(&k->tree, k->w[i], BRIDGED_AROUND)) : 1) / fmaxf(total, k->faint);
	}
}

/* Farthest-point order in the density-adapted metric. */
static int place(work *k, uint32_t lobes, int narrow)
{
	if (lobes > k->n)
		lobes = (uint32_t)k->n;
	if (k->paired) /* one of each two, but all of those in the plane */
		lobes = (uint32_t)(.5 * lobes + .4 * sqrt((double)lobes));
	if (!(k->top > 0))
		lobes = 0; /* nothing but the Lambertian part */
	const size_t room = 3 * (size_t)lobes + RBF_PEAKS_MOST + MISSED * ROUNDS + 1;
	k->centre = malloc(room * sizeof *k->centre);
	k->kappa = malloc(room * sizeof *k->kappa);
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
	if ((k->paired && rbf_twins_settle_all(k->lobes, k->centre)) || widths(k, narrow))
		return -1;
	const rbf_peaks_samples samples = {&k->tree, (const uint32_t (*)[RBF_NEAR])k->near, k->level, k->smooth, (float)DARK * k->top};
	k->peak[0] = k->lobes;
	k->lobes += rbf_peaks_find(&samples, (double[2]){SIGMA_MIN, SIGMA_MAX}, k->centre + k->lobes, k->kappa + k->lobes);
	k->peak[1] = k->lobes;
	for (uint32_t j = k->peak[0]; j < k->peak[1] && k->paired; j++)
		rbf_twins_settle(1 / sqrtf(k->kappa[j]), k->centre[j]);
	return 0;
}

/* Adds a little to the diagonal, lobes `from` on, but never much of a lobe's own weight: narrow lobes on a peak would be shrunk. Least to
 * those that are peaks by themselves: what a beam lacks, wide lobes make up for, and a hundredth of it is more than the haze about it. */
static void add_ridge(work *k, size_t from)
{
	const size_t m = k->lobes;
	const double peak = fmax(RIDGE_MOST * (double)(k->faint / k->bright) / DARK, RIDGE_PEAK);
	double *gram = k->equations.gram, mean = 0;
	for (size_t j = 0; j < m; j++)
		mean += gram[j * m + j] / (double)m;
	for (size_t j = from; j < m; j++)
		gram[j * m + j] += fmin(RIDGE * mean, (j >= k->peak[0] && j < k->peak[1] ? peak : RIDGE_MOST) * gram[j * m + j]);
}

/* Weighted normal equations. */
static int equations(work *k, int channels)
{
	const size_t m = k->lobes;
	rbf_equations *e = &k->equations;
	*e = (rbf_equations){.samples = k->n, .direction = (const float (*)[3])k->w, .weight = k->weight, .value = {k->y[0], k->y[1], k->y[2]},
		.channels = channels, .lobes = m, .centre = (const float (*)[3])k->centre, .kappa = k->kappa, .paired = k->paired};
	k->amplitude = calloc(m * (size_t)channels + 1, sizeof *k->amplitude);
	if (!k->amplitude || rbf_equations_make(e))
		return -1;
	add_ridge(k, 0);
	return 0;
}

static int ascending(const void *a, const void *b)
{
	const float x = *(const float *)a, y = *(const float *)b;
	return x < y ? -1 : x > y;
}

/* Sets what the fit lacks; returns by how much noise spreads that. */
static float find_misses(work *k, const rbf_lobes *fitted)
{
	for (size_t i = 0; i < k->n; i++) {
		float value[3];
		rbf_lobes_sum(fitted, k->w[i], value);
		const float sum = mixed(k, value);
		k->miss[i] = (k->level[i] - sum) / fmaxf(sum + lambertian_at(k, i), k->total[i]);
	}
	const size_t some = (k->n + SOME - 1) / SOME;
	for (size_t i = 0; i < some; i++)
		k->sorted[i] = fabsf(k->miss[SOME * i]);
	qsort(k->sorted, some, sizeof *k->sorted, ascending);
	return 1.4826f * k->sorted[some / 2];
}

/* A sample that the fit misses by far while it meets those around it is a fault of the measurement (cosmic ray, dropout); where
 * several neighbours are missed, it is the fit that is at fault, and they stay. Returns how many are newly excluded. */
static size_t find_outliers(work *k, float spread)
{
	const float *miss = k->miss;
	size_t found = 0;
	for (size_t i = 0; i < k->n; i++) {
		const float much = fabsf(miss[i]);
		int missed = 0;
		if (k->outlier[i] || !(much > OUTLIER * spread) || !(much > OUTLIER_MIN))
			continue;
		for (int j = 0; j < RBF_NEAR; j++)
			missed += k->near[i][j] != i && fabsf(miss[k->near[i][j]]) > .4f * much;
		if (missed <= 1) {
			k->outlier[i] = 1;
			found++;
		}
	}
	return found;
}

/* Whether a lobe is there already, or one much like it: a second one would mend nothing, and hardly be told from it. */
static int is_there(const work *k, const float centre[3], float kappa)
{
	for (uint32_t j = 0; j < k->lobes; j++)
		if (!memcmp(k->centre[j], centre, sizeof *k->centre) && k->kappa[j] > .5f * kappa && k->kappa[j] < 2 * kappa)
			return 1;
	return 0;
}

/* Lobes join where the fit lacks most, the equations are extended and the solution so far is kept to start from. Returns
 * how many joined, or -1 when out of memory. */
static int add_missed(work *k, float spread)
{
	const rbf_misses misses = {&k->tree, (const uint32_t (*)[RBF_NEAR])k->near, k->miss, k->total, k->outlier, spread};
	const size_t former = k->lobes, channels = (size_t)k->channels;
	rbf_missed found[MISSED];
	const int count = rbf_missed_find(&misses, (double[2]){SIGMA_MIN, SIGMA_MAX}, MISSED, found);
	for (int f = 0; f < count; f++) {
		float centre[3];
		memcpy(centre, k->w[found[f].sample], sizeof centre);
		if (k->paired)
			rbf_twins_settle(1 / sqrtf(found[f].kappa), centre);
		if (is_there(k, centre, found[f].kappa))
			continue;
		memcpy(k->centre[k->lobes], centre, sizeof centre);
		k->kappa[k->lobes++] = found[f].kappa;
	}
	if (count < 0 || k->lobes == former)
		return count < 0 ? -1 : 0;
	double *amplitude = calloc(k->lobes * channels + 1, sizeof *amplitude);
	k->equations.lobes = k->lobes;
	if (!amplitude || rbf_equations_add(&k->equations, former, k->outlier)) {
		free(amplitude);
		return -1;
	}
	for (size_t c = 0; c < channels; c++)
		memcpy(amplitude + c * k->lobes, k->amplitude + c * former, former * sizeof *amplitude);
	free(k->amplitude);
	k->amplitude = amplitude;
	add_ridge(k, former);
	return (int)(k->lobes - former);
}

static int solve(work *k, rbf_lobes *out)
{
	const rbf_equations *e = &k->equations;
	for (int c = 0; c < k->channels; c++)
		if (rbf_nonnegative_solve(k->lobes, e->gram, e->right + (size_t)c * k->lobes, e->squares[c], e->count, k->amplitude + (size_t)c * k->lobes))
			return -1;
	return (k->paired ? rbf_twins_arrange : rbf_arrange)(k->lobes, (const float (*)[3])k->centre, k->kappa, k->amplitude, k->channels, out);
}

rbf_fitting *rbf_fit_begin(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t hold, int between)
{
	work *k = calloc(1, sizeof *k);
	if (!k)
		return NULL;
	k->incidence = incidence;
	k->channels = channels;
	memcpy(k->lambertian, lambertian, (size_t)channels * sizeof *lambertian);
	k->hold = hold;
	k->paired = incidence->paired && !between;
	if (gather(k, between)) {
		rbf_fit_end(k);
		return NULL;
	}
	mix(k);
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
	free(k->near);
	free(k->smooth);
	free(k->total);
	free(k->density);
	free(k->miss);
	free(k->sorted);
	free(k->weight);
	free(k->gap);
	free(k->level);
	free(k->area);
	free(k->outlier);
	free(k);
}

int rbf_fit_lobes(rbf_fitting *k, uint32_t lobes, rbf_lobes *out, float *error)
{
	memset(out, 0, sizeof *out);
	memset(k->outlier, 0, k->n);
	int failed = place(k, lobes & RBF_FIT_PLACES, (lobes & RBF_FIT_NARROW) != 0) || equations(k, k->channels) || solve(k, out);
	float spread = failed || !k->lobes ? 0 : find_misses(k, out);
	if (!failed && k->lobes && find_outliers(k, spread)) {
		rbf_lobes_free(out);
		failed = rbf_equations_leave_out(&k->equations, k->outlier) || solve(k, out);
		spread = failed ? 0 : find_misses(k, out);
	}
	for (int round = 0; round < ROUNDS && spread > 0; round++) {
		const int more = add_missed(k, spread);
		failed = more < 0;
		if (more <= 0)
			break;
		rbf_lobes_free(out);
		failed = solve(k, out);
		spread = failed || more < FEW ? 0 : find_misses(k, out);
	}
	if (!failed && error && k->hold > 1 && !k->area) {
		k->area = rbf_held_out_areas(k->incidence, k->hold, k->paired, &k->tree);
		failed = !k->area;
	}
	if (!failed && error)
		*error = rbf_held_out_error(k->incidence, k->channels, k->hold, k->lambertian, k->mix, k->area, out);
	forget(k);
	if (failed)
		rbf_lobes_free(out);
	return failed ? -1 : 0;
}

float rbf_fit_noise(const rbf_fitting *k, const rbf_lobes *lobes)
{
	return rbf_held_out_noise(k->incidence, k->channels, k->hold, k->lambertian, k->area, lobes);
}

int rbf_fit(const rbf_incidence *incidence, int channels, const float lambertian[3], uint32_t lobes, uint32_t hold,
	rbf_lobes *out, float *error)
{
	rbf_fitting *k = rbf_fit_begin(incidence, channels, lambertian, hold, (lobes & RBF_FIT_BETWEEN) != 0);
	memset(out, 0, sizeof *out);
	const int failed = !k || rbf_fit_lobes(k, lobes, out, error);
	rbf_fit_end(k);
	return failed ? -1 : 0;
}
