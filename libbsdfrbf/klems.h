/* SPDX-License-Identifier: BSD-3-Clause */
/* Klems' angle bases: rings of patches over the hemisphere. Klems 1994, A new method for predicting the solar heat gain of complex
 * fenestration systems; limits and counts as published with LBNL's WINDOW and in Radiance's common/bsdf_m.c. */
#ifndef RBF_KLEMS_H
#define RBF_KLEMS_H
#include "bsdfrbf.h"

enum { RBF_KLEMS_RINGS = 9, RBF_KLEMS_PATCHES = 145 };

typedef struct rbf_klems {
	const char *name;
	int patches, rings;
	double theta[RBF_KLEMS_RINGS + 1]; /* limits, degrees */
	int count[RBF_KLEMS_RINGS];        /* patches around; the first one's middle is at azimuth 0 */
} rbf_klems;

const rbf_klems *rbf_klems_basis(bsdfrbf_basis basis);

/* Ring of a patch and its number in it. */
int rbf_klems_ring(const rbf_klems *basis, int patch, int *within);

/* Ring of a direction with z > 0, and its azimuth in turns. */
int rbf_klems_place(const rbf_klems *basis, const float d[3], double *turn);

/* Patch of a ring at an azimuth in turns. */
int rbf_klems_at(const rbf_klems *basis, int ring, double turn);

/* Patch of a direction with z > 0. */
int rbf_klems_find(const rbf_klems *basis, const float d[3]);

/* A point of a patch, u and v in [0, 1]: uniform in projected solid angle. */
void rbf_klems_point(const rbf_klems *basis, int patch, double u, double v, float d[3]);

/* Projected solid angle, sr. */
double rbf_klems_omega(const rbf_klems *basis, int patch);

/* The patch where a direction of this patch goes when x (op bit 0) and y (bit 1) change their signs, or when it turns by `quarters`
 * of a turn. All counts are multiples of 4, so that patches go to patches; the axis is a patch of its own. */
int rbf_klems_mirror(const rbf_klems *basis, int patch, unsigned op);
int rbf_klems_turn(const rbf_klems *basis, int patch, int quarters);
#endif
