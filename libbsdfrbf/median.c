/* SPDX-License-Identifier: BSD-3-Clause */
#include "median.h"

#include <stdlib.h>

static int by_value(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return x < y ? -1 : x > y;
}

double rbf_median(double *list, size_t count)
{
	if (!count)
		return 0;
	qsort(list, count, sizeof *list, by_value);
	return .5 * (list[(count - 1) / 2] + list[count / 2]);
}
