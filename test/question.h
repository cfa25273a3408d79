/* SPDX-License-Identifier: BSD-3-Clause */
/* One incidence of a model, put to quadrature and to the chi-square test of its samples. Include after cmocka.h. */
#ifndef TEST_QUESTION_H
#define TEST_QUESTION_H
#include "bsdfrbf.h"
#include "model_fixture.h"
#include "quadrature.h"

typedef struct question {
	const bsdfrbf_model *model;
	float incident[3];
	int transmit;
	int below;           /* exitant z < 0 */
} question;

/* Density of quadrature.h: f |cos| of the scattered part. */
static inline void scattered(void *user, const float d[3], float value[3])
{
	const question *q = user;
	const float outgoing[3] = {d[0], d[1], q->below ? -d[2] : d[2]};
	bsdfrbf_eval_scatter(q->model, q->incident, outgoing, value);
	for (int n = 0; n < bsdfrbf_channels(q->model); n++)
		value[n] *= d[2];
}

/* The model's component, asked at this incidence. */
static inline question question_at(const bsdfrbf_model *model, double theta_deg, double phi_deg)
{
	question q = {.model = model};
	double d[3];
	fixture_component(model, &q.transmit);
	q.below = q.transmit;
	polar(theta_deg, phi_deg, d);
	for (int n = 0; n < 3; n++)
		q.incident[n] = (float)d[n];
	return q;
}

/* Upper quantile of the normal distribution, by bisection of the complementary error function. */
static inline double normal_quantile(double upper)
{
	double low = 0, high = 10;
	for (int i = 0; i < 80; i++) {
		const double middle = .5 * (low + high);
		if (.5 * erfc(middle / sqrt(2)) > upper)
			low = middle;
		else
			high = middle;
	}
	return low;
}

/* Each of `cases` may fail by chance so that any does with probability `significance` (Sidak). */
static inline double chi_square_limit(double significance, int cases)
{
	return normal_quantile(-expm1(log1p(-significance) / cases));
}

/* Samples over bins of equal probability: how many standard deviations chi-square is above its mean. The caller is to see
 * that enough were drawn: 5 a bin. */
static inline double chi_square_deviate(const question *q, const quadrature *cells, int samples, uint64_t seed, int *bins, int *drawn)
{
	enum { BINS = 256 };
	int *bin = malloc(cells->cells * sizeof *bin), count[BINS] = {0};
	double share[BINS], chi = 0;
	assert_non_null(bin);
	*bins = quadrature_bins(cells, 1. / 120, bin, share, BINS);
	*drawn = 0;
	for (int i = 0; i < samples; i++) {
		float d[3];
		if (!bsdfrbf_sample(q->model, q->incident, q->transmit, random_unit(&seed), d))
			continue;
		assert_true(q->below ? d[2] < 0 : d[2] > 0);
		assert_float_equal(rbf_dot(d, d), 1, 1e-5);
		d[2] = fabsf(d[2]);
		count[bin[quadrature_find(cells, d)]]++;
		++*drawn;
	}
	for (int i = 0; i < *bins; i++) {
		const double expected = share[i] * *drawn;
		chi += expected > 0 ? (count[i] - expected) * (count[i] - expected) / expected : 0;
	}
	free(bin);
	/* Wilson and Hilferty: the cube root of chi-square over its degrees of freedom is nearly normal */
	const double k = *bins - 1;
	return (cbrt(chi / k) - (1 - 2 / (9*k))) / sqrt(2 / (9*k));
}
#endif
