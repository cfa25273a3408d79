/* SPDX-License-Identifier: BSD-3-Clause */
/* Which samples a fit is kept from, to be judged by. */
#ifndef RBF_HELD_OUT_H
#define RBF_HELD_OUT_H
#include <stddef.h>
#include <stdint.h>

/* Every hold-th sample. hold: 0 or 1: none. */
static inline int rbf_held_out(uint32_t hold, size_t i)
{
	return hold > 1 && i % hold == hold / 2;
}
#endif
