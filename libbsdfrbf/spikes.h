/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples that stand alone far above all that is around them: what cosmic rays, sparks and stray reflections leave. */
#ifndef RBF_SPIKES_H
#define RBF_SPIKES_H
#include "faults.h"

/* Sets `rest` to a component's incidences without them, as rbf_faults_leave_out() does. Opens OpenMP regions. */
int rbf_spikes_leave_out(const rbf_measured *all, int channels, rbf_measured *rest, rbf_faults *found);
#endif
