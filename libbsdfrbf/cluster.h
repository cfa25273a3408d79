/* SPDX-License-Identifier: BSD-3-Clause */
/* Which lobes share a block: those that matter in the same directions, so that few blocks matter in any of them. */
#ifndef RBF_CLUSTER_H
#define RBF_CLUSTER_H
#include "model.h"

/* Puts the lobes of a set into blocks; was, unless NULL: takes for each lane in use which one it was, of the component. Returns 0, or -1 when
 * out of memory. */
int rbf_cluster(const rbf_component *component, const rbf_set *set, rbf_block *block, rbf_amplitude *amplitude, uint32_t *was);
#endif
