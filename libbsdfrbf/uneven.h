/* SPDX-License-Identifier: BSD-3-Clause */
/* What is not known of light between incidences, as it changes unevenly there. */
#ifndef RBF_UNEVEN_H
#define RBF_UNEVEN_H
#include "mesh.h"

/* Share of its DHR that the middle of each element of a chain may be off by, unknown[elements]: 0 of triangles. light: DHR of each base. */
void rbf_uneven(const rbf_mesh *mesh, const float light[], float unknown[]);
#endif
