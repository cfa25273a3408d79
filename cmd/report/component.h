/* SPDX-License-Identifier: BSD-3-Clause */
/* What the report's page needs to know of one component. */
#ifndef REPORT_COMPONENT_H
#define REPORT_COMPONENT_H
#include <stdio.h>

#include "bsdfrbf.h"

/* Writes one JSON object. data: measurements, or NULL. words: how many 16-bit codes the pictures may have in all.
 * *matched: incidences of the model that `data` has samples of. 0 when out of memory. */
int report_component(FILE *out, const bsdfrbf_model *model, bsdfrbf_component component, const bsdfrbf_data *data,
	size_t words, int *matched);
#endif
