/* SPDX-License-Identifier: BSD-3-Clause */
/* Gains of incidences, as their DHR tells. */
#ifndef RBF_UNSTEADY_H
#define RBF_UNSTEADY_H
#include "mesh.h"

/* Standard deviation of ln of the gains that whole scans have, by how far DHR (dhr[bases]) stands apart from what is smooth around; 0 where
 * too few tell. direction: bases x 3. Returns -1 when out of memory. */
double rbf_unsteady(rbf_symmetry symmetry, uint32_t bases, const double *direction, const float *dhr);
#endif
