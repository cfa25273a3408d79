/* SPDX-License-Identifier: BSD-3-Clause */
/* Many directions at once between a corner and a site: the maps of map.h in loops that the compiler turns into vector code. */
#ifndef RBF_CARRY_H
#define RBF_CARRY_H
#include "evaluate.h"

#define RBF_CARRY 256 /* at most */
#define RBF_CARRY_STEP 8

/* One number of each direction. Rows are read and written up to a multiple of RBF_CARRY_STEP. */
typedef float rbf_carry_row[RBF_CARRY + RBF_CARRY_STEP];

/* From a corner, p (mirrored as its vertex is), to the site, e (folded). factor: as rbf_warp_inverse() returns. */
void rbf_carry_back(const rbf_site *site, uint32_t corner, uint32_t frame, int count, const rbf_carry_row p[3], rbf_carry_row e[3],
	rbf_carry_row factor);

/* The corner's shares there (shares.h). */
void rbf_carry_shares(const rbf_site *site, uint32_t corner, uint32_t frame, int count, const rbf_carry_row e[3], rbf_carry_row share);
#endif
