/* SPDX-License-Identifier: BSD-3-Clause */
/* Lobes of one incidence put into the order that evaluation and sampling want. */
#ifndef RBF_ARRANGE_H
#define RBF_ARRANGE_H
#include "lobes.h"
#include "measure.h"

/* Keeps the lobes that matter, by width and then along a Hilbert curve. amplitude: channels x lobes. Returns 0, or -1 when out
 * of memory. */
int rbf_arrange(uint32_t lobes, const float (*centre)[3], const float *kappa, const double *amplitude, int channels,
	rbf_lobes *out);

/* The same for an incidence whose lobes were fitted elsewhere. */
int rbf_arrange_ready(const rbf_incidence *incidence, int channels, rbf_lobes *out);
#endif
