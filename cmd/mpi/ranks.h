/* SPDX-License-Identifier: BSD-3-Clause */
/* A command as one of several processes that an MPI launcher started: mpi.c, or alone.c where there is no MPI. */
#ifndef CMD_RANKS_H
#define CMD_RANKS_H
#include "bsdfrbf.h"

/* First call of main() after cmd_start(). The processes that were started together, or NULL if this one is alone; then nothing is
 * done, so that it starts as quickly as without MPI. Only rank 0 shows anything; when some fail, so do all, and the lowest of those
 * that failed tells why. */
const bsdfrbf_team *ranks_start(void);

/* Last call: waits for all of them. Returns non-zero if one failed. */
int ranks_end(void);
#endif
