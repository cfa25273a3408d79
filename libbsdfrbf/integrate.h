/* SPDX-License-Identifier: BSD-3-Clause */
/* DHR of what evaluate.h evaluates, by quadrature: where its table comes from. */
#ifndef RBF_INTEGRATE_H
#define RBF_INTEGRATE_H
#include "evaluate.h"

/* DHR of the scattered part by quadrature over the lobes, per channel, without the site's scale. */
void rbf_site_dhr(const rbf_site *site, double value[3]);
#endif
