/* SPDX-License-Identifier: BSD-3-Clause */
/* Levels (model.h) of measured incidences, and their slopes, as the incidences around each tell. */
#ifndef RBF_LEVELS_H
#define RBF_LEVELS_H
#include "label.h"

/* Fourth roots of the luminance that each incidence's lobes send, and of the part of it above the horizon, its DHR without the Lambertian part: over
 * fitted->scale, [bases], to be freed. NULL: out of memory. The latter opens an OpenMP region. */
float *rbf_levels_sent(const rbf_fitted *fitted);
float *rbf_levels_arrived(const rbf_fitted *fitted);

/* Level of one incidence, from such roots. out: as rbf_mesh_build() takes it. */
void rbf_level_of(const rbf_fitted *fitted, const float root[], const unsigned char *out, uint32_t base, rbf_level *level);

/* As if no incidence around told anything. */
static inline void rbf_level_flatten(rbf_level *level)
{
	level->slope[0] = level->slope[1] = level->slope[2] = 0;
}

/* Levels of all incidences as measured, [bases], with slopes or not, to be freed. root: as above; NULL: out of memory, as the answer is then. Opens
 * an OpenMP region. */
rbf_level *rbf_levels_all(const rbf_fitted *fitted, const float *root, int slopes);

/* The root where a site has such corners: levels and directions of the vertices, weights that sum to 1. */
float rbf_level_between(uint32_t corners, const rbf_level level[], const rbf_vertex vertex[], const float weight[]);

/* level->kept and half, of a base of a component that has its sets. direction: the base's. */
void rbf_level_carried(const rbf_component *component, const float direction[3], uint32_t base, rbf_level *level);

/* Levels of all, for a choice that evens them by `even` halves, with slopes or not: of the component, whose arrays they join. Opens an OpenMP
 * region. Returns 0, or -1 when out of memory. */
int rbf_levels_make(const rbf_fitted *fitted, uint32_t even, int slopes, rbf_component *component);
#endif
