/* SPDX-License-Identifier: BSD-3-Clause */
/* Which samples a fit is kept from, to be judged by. */
#ifndef RBF_HELD_OUT_H
#define RBF_HELD_OUT_H
#include <stddef.h>
#include <stdint.h>

/* One of each `hold` samples that follow each other, by chance which one: every so many would be whole columns of many tables. hold: 0 or 1: none. */
static inline int rbf_held_out(uint32_t hold, size_t i)
{
	if (hold < 2)
		return 0;
	uint32_t chance = (uint32_t)(i / hold) * 0x9e3779b1u;
	chance = (chance ^ chance >> 15) * 0x85ebca6bu;
	return i % hold == (chance ^ chance >> 13) % hold;
}
#endif
