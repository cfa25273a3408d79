/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples between samples: lobes as narrow as samples are apart would leave it dark there, or anything. */
#ifndef RBF_BETWEEN_H
#define RBF_BETWEEN_H
#include <stddef.h>

/* Adds the middle between each two samples that are next to each other, with their mean, behind the *count that there are: directions w and values of
 * each channel, all malloc'ed. Returns 0, or -1 when out of memory: what is there stays. */
int rbf_between_add(size_t *count, float (**w)[3], int channels, float *value[3]);
#endif
