/* SPDX-License-Identifier: BSD-3-Clause */
/* Whatever a process does next, to gather, to end or to fail, it first tells the others: so none waits for one that is gone. */
#include "ranks.h"
#include "common.h"

#include <limits.h>
#include <mpi.h>
#include <stdlib.h>

static bsdfrbf_team team;
static int parted; /* a process failed: nothing more is said to each other */

/* Processes that a launcher says it started: Open MPI's, MPICH's and others', SLURM's. */
static long launched(void)
{
	static const char *const size[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"};
	for (size_t n = 0; n < sizeof size / sizeof *size; n++)
		if (getenv(size[n]))
			return strtol(getenv(size[n]), NULL, 10);
	return getenv("PMIX_RANK") && getenv("SLURM_STEP_NUM_TASKS") ? strtol(getenv("SLURM_STEP_NUM_TASKS"), NULL, 10) : 1;
}

/* Lowest rank that fails, or `size` if none does. */
static int meet(int failing)
{
	int mine = failing ? team.rank : team.size, lowest;
	MPI_Allreduce(&mine, &lowest, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
	parted |= lowest < team.size;
	return lowest;
}

static int gather(void *unused, void *blocks, const size_t *bytes)
{
	(void)unused;
	if (parted || meet(0) < team.size)
		return -1;
	int *count = malloc(2 * (size_t)team.size * sizeof *count);
	size_t total = 0;
	if (!count)
		cmd_fail("out of memory");
	int *at = count + team.size;
	for (int r = 0; r < team.size; r++) {
		at[r] = (int)total;
		count[r] = (int)bytes[r];
		total += bytes[r];
	}
	const int fits = total <= INT_MAX; /* the same everywhere */
	if (fits)
		MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_BYTE, blocks, count, at, MPI_BYTE, MPI_COMM_WORLD);
	free(count);
	return fits ? 0 : -1;
}

static int speaks_last(void)
{
	return !parted && meet(1) == team.rank;
}

static void finalize(void)
{
	MPI_Finalize();
}

const bsdfrbf_team *ranks_start(void)
{
	if (launched() < 2)
		return NULL;
	int level;
	MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
	MPI_Comm_rank(MPI_COMM_WORLD, &team.rank);
	MPI_Comm_size(MPI_COMM_WORLD, &team.size);
	team.gather = gather;
	atexit(finalize);
	cmd_share_output(team.rank == 0, speaks_last);
	return &team;
}

int ranks_end(void)
{
	return team.size && (parted || meet(0) < team.size);
}
