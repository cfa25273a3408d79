/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * An image of an incidence, where no other was measured, is told by interpolation, which errs. By how much it does if the material is symmetric is known
 * from incidences that were left out: linearly with the distance at worst, and the fits' errors come on top. A faint beam on one side alone adds
 * little to that; but images that fall close to an incidence are told without interpolation: a straight line through all images' errors over
 * their distance meets distance 0 at what they truly differ by. And two mirror planes make half a turn: a material has all three of these symmetries, or
 * one, or none. What asks for one alone must tell it from the others.
 */
#include "images.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST = 8 }; /* incidences that tell */
static const double MOST = 2; /* that one counts */
static const double FITS = 1.4; /* times what fits are expected to err by */
static const double NOISE = 1.25; /* times that of two fits, that images may differ by for sure */
static const double SMALL = .15; /* or this much of the leave-one-out error */
static const double CLEARLY = .6; /* of other images' error, if one symmetry holds but not all do */

/* Errors over distances. */
typedef struct told {
	uint32_t count;
	double error, squares, bend; /* means */
	double here;                 /* error at distance 0, at most: a standard error is added */
} told;

static told tell(uint32_t bases, const rbf_span *span, const float *error)
{
	told t = {0};
	double x = 0, xx = 0, xy = 0, rest = 0;
	for (uint32_t b = 0; b < bases; b++) {
		if (span[b].bend < 0 || error[b] < 0)
			continue;
		const double e = fmin((double)error[b], MOST), distance = sqrt((double)span[b].bend);
		t.count++;
		t.error += e;
		t.squares += (double)span[b].squares;
		t.bend += (double)span[b].bend;
		x += distance;
		xx += distance * distance;
		xy += distance * e;
	}
	if (t.count < LEAST)
		return t;
	const double n = t.count, spread = n * xx - x * x;
	const int sloped = spread > 1e-6 * n * n;
	const double slope = sloped ? (n * xy - x * t.error) / spread : 0, start = (t.error - slope * x) / n;
	for (uint32_t b = 0; b < bases; b++)
		if (!(span[b].bend < 0 || error[b] < 0))
			rest += pow(fmin((double)error[b], MOST) - start - slope * sqrt((double)span[b].bend), 2);
	t.here = start + sqrt(rest / (n - 2) * (sloped ? xx / spread : 1 / n));
	t.error /= n;
	t.squares /= n;
	t.bend /= n;
	return t;
}

/* Images of incidences by an operation. span: room, [bases]. */
static bsdfrbf_status ask(bsdfrbf_context *context, rbf_fitted *m, float lambertian, unsigned op, const rbf_choice *choice, rbf_span *span, told *t)
{
	rbf_left_out b = {0};
	rbf_choice asked = *choice; /* labels are borrowed */
	asked.base_error = NULL;
	bsdfrbf_status status = rbf_left_out_images(context, m, lambertian, op, &b);
	if (status == BSDFRBF_OK && rbf_left_out_error(&b, &asked, NULL))
		status = rbf_out_of_memory(context);
	if (status == BSDFRBF_OK) {
		rbf_left_out_spans(&b, span);
		*t = tell(m->bases, span, asked.base_error);
	}
	free(asked.base_error);
	rbf_left_out_free(&b);
	return status;
}

/* noise: error of the fits. */
static int explained(const told *own, const told *image, double noise)
{
	const double fit = fmin(noise, own->error / sqrt(1 + own->squares)); /* it cannot err by more than all there is */
	const double bent = sqrt(fmax(own->error * own->error - fit * fit * (1 + own->squares), 0));
	const double most = hypot(FITS * fit * sqrt(1 + image->squares), bent * sqrt(own->bend > 0 ? image->bend / own->bend : 1));
	return image->count >= LEAST && image->error < most && image->here < fmax(NOISE * fit * sqrt(2), SMALL * own->error);
}

bsdfrbf_status rbf_images_find(bsdfrbf_context *context, const rbf_left_out *left_out, float lambertian, const rbf_choice *choice, const float *scatter,
	rbf_symmetry *found, float *difference)
{
	rbf_fitted *const m = left_out->fitted;
	static const rbf_symmetry alone[4] = {RBF_ANISOTROPIC, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP};
	rbf_span *span = malloc(((size_t)m->bases + 1) * sizeof *span);
	told own = {0}, image[4] = {{0}};
	double noise = 0, sum = 0;
	int has[4], all = 1;
	unsigned asked = 0, best = 0;
	*found = m->symmetry;
	const int had = rbf_symmetry_ops(m->symmetry, has);
	bsdfrbf_status status = span ? BSDFRBF_OK : rbf_out_of_memory(context);
	if (span) {
		rbf_left_out_spans(left_out, span);
		own = tell(m->bases, span, choice->base_error);
	}
	for (uint32_t b = 0; b < m->bases && status == BSDFRBF_OK; b++)
		if (!(span[b].bend < 0))
			noise += (double)scatter[b] / own.count;
	for (unsigned op = RBF_OP_X; op <= RBF_OP_XY && status == BSDFRBF_OK && had < 4 && own.count >= LEAST; op++) {
		if (had > 1 && (asked || (int)op == has[1])) /* the third is these two */
			continue;
		status = ask(context, m, lambertian, op, choice, span, &image[op]);
		const int holds = status == BSDFRBF_OK && explained(&own, &image[op], noise);
		all &= holds;
		sum += image[op].error;
		asked++;
		if (holds && (!best || image[op].error < image[best].error))
			best = op;
	}
	free(span);
	for (unsigned op = RBF_OP_X; op <= RBF_OP_XY && !all; op++)
		if (best && op != best && (had > 1 || !(image[best].error < CLEARLY * image[op].error)))
			best = 0;
	if (best) {
		*found = all ? RBF_QUADRILATERAL : alone[best];
		*difference = (float)(all ? sum / asked : image[best].error);
	}
	return status;
}
