/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * What an isotropic material sends in its plane of incidence, y = 0, is the same on both sides of it: an incidence is fitted in y >= 0, with
 * lobes that have a twin at -y each, unless they are in that plane. So every sample tells of both sides, and half the lobes need recording.
 */
#ifndef RBF_TWINS_H
#define RBF_TWINS_H
#include "lobes.h"
#include "neighbours.h"

/* Whether a centre has a twin. */
static inline int rbf_twins_has(const float centre[3])
{
	return centre[1] > 0;
}

/* Puts a centre, y >= 0, into the plane if its twin would be so near for a lobe of that width that the two could hardly be told apart. */
void rbf_twins_settle(float spread, float centre[3]);

/* The same for several, whose width will be as far as they are apart. Returns 0, or -1 when out of memory. */
int rbf_twins_settle_all(uint32_t count, float (*centre)[3]);

/* A tree of centres and their twins. Returns 0, or -1 when out of memory. */
int rbf_twins_tree(uint32_t count, const float (*centre)[3], rbf_tree *tree);

/* rbf_arrange() of lobes and their twins. */
int rbf_twins_arrange(uint32_t lobes, const float (*centre)[3], const float *kappa, const double *amplitude, int channels, rbf_lobes *out);
#endif
