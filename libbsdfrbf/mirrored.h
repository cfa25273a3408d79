/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * An incidence in a mirror plane of its material is its own image. Where it was not measured, as where a device scans one side of the plane of incidence
 * alone, what was measured on the other side tells.
 */
#ifndef RBF_MIRRORED_H
#define RBF_MIRRORED_H
#include "measure.h"
#include "mesh.h"

/* Adds mirrored samples to such incidences where there are none, unless they were measured in one plane alone. owned: the measurements' arrays are
 * ours; else what changes has arrays of its own then, in `own`, to be freed by rbf_folded_free(). Isotropic: all are turned to azimuth 0. *most: the
 * largest share of the hemisphere that was not measured but mirrored, 0: none was. Opens an OpenMP region. Returns 0, or -1 when out of memory;
 * rbf_folded_free() in either case. */
int rbf_mirrored_add(rbf_symmetry symmetry, int channels, int owned, rbf_measured *measured, rbf_measured *own, float *most);

/* As measured again. */
void rbf_mirrored_drop(rbf_measured *measured);
#endif
