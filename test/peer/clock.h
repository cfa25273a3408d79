/* SPDX-License-Identifier: BSD-3-Clause */
/* What the timed programs share: processor time, and numbers that are the same in every run. */
#ifndef PEER_CLOCK_H
#define PEER_CLOCK_H
#include <stdint.h>
#include <time.h>

static double now(void)
{
	struct timespec t;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double uniform(void)
{
	static uint64_t state = 1; /* Knuth's MMIX generator */
	state = state * 6364136223846793005u + 1442695040888963407u;
	return (double)(state >> 11) * 0x1p-53;
}
#endif
