/* SPDX-License-Identifier: BSD-3-Clause */
/* Where a beam ends between measured incidences: what the corners of an element say about its middle. */
#ifndef RBF_DISAGREEMENT_H
#define RBF_DISAGREEMENT_H
#include "model.h"

/* Mean relative difference, by the light there, between what one corner says alone and what all say together: that of the corner where it
 * is largest. See bsdfrbf_get_disagreement(). */
float rbf_disagreement(const rbf_component *component, uint32_t element);
#endif
