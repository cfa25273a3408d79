/* SPDX-License-Identifier: BSD-3-Clause */
/* Does more light leave a surface than arrives? Told, never mended. */
#ifndef RBF_ENERGY_H
#define RBF_ENERGY_H
#include "evaluate.h"

/* DHR at a measured incidence, luminance: of its component and of the other one, if there is one, that is lit from the same side. */
float rbf_energy_total(const bsdfrbf_model *model, int component, uint32_t base);

/* Number of a component's incidences where that exceeds 1 by BSDFRBF_EXCESS at least. *worst: the largest total, *base: where; either
 * may be NULL. */
int rbf_energy_excess(const bsdfrbf_model *model, int component, float *worst, uint32_t *base);

/* One warning for each component with such incidences, with what to do: a peak that samples are too coarse for has its own remedy. Errors:
 * MEMORY. */
bsdfrbf_status rbf_energy_warn(bsdfrbf_context *context, const bsdfrbf_model *model, const bsdfrbf_data *data);
#endif
