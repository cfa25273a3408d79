/* SPDX-License-Identifier: BSD-3-Clause */
/* What trees and matrices share: options, and the mean of an incident direction's values. */
#ifndef RBF_RESAMPLE_H
#define RBF_RESAMPLE_H
#include "exitant.h"
#include "status.h"

/* Checks the options and the model; *wanted: bit per component that is to be written. */
bsdfrbf_status rbf_resample_check(bsdfrbf_context *context, const bsdfrbf_model *model,
	const bsdfrbf_resample_options *options, const char *who, unsigned *wanted);

int rbf_resample_threads(const bsdfrbf_resample_options *options);

/* Prepares a site, its DHR of the scattered part, and what a quadrature leaves alone there: `share` of the mean value. */
void rbf_resample_site(const rbf_component *component, const float incident[3], double share, rbf_site *site,
	double dhr[3], rbf_exitant *exitant);

/* Abscissas in [0, 1] and weights, sum 1, of the Gauss-Legendre rule with n points. What peaks give to a cell starts steeply at its
 * limits, where rules of even steps are poor. Abramowitz and Stegun 1964, 25.4.29. */
void rbf_resample_points(int n, double at[], double weight[]);

/* The factor that brings an integral to the DHR it should be; 1 where that makes no sense. */
double rbf_resample_correction(double dhr, double integral);
#endif
