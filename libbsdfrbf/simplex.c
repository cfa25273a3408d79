/* SPDX-License-Identifier: BSD-3-Clause */
#include "simplex.h"

#include <math.h>
#include <string.h>

double rbf_simplex(rbf_simplex_function *function, void *data, uint32_t d, double x[], double step, uint32_t rounds, double tolerance)
{
	double corner[RBF_SIMPLEX_MAX + 1][RBF_SIMPLEX_MAX], value[RBF_SIMPLEX_MAX + 1];
	const size_t row = d * sizeof *x;
	uint32_t best = 0;
	for (uint32_t i = 0; i <= d; i++) {
		memcpy(corner[i], x, row);
		if (i)
			corner[i][i - 1] += step;
		value[i] = function(data, corner[i]);
	}
	for (uint32_t round = 0; round <= rounds; round++) {
		uint32_t worst = best = 0;
		for (uint32_t i = 1; i <= d; i++) {
			best = value[i] < value[best] ? i : best;
			worst = value[i] >= value[worst] ? i : worst;
		}
		if (round == rounds || !(value[worst] - value[best] > tolerance * fabs(value[best])))
			break;
		double second = value[best], middle[RBF_SIMPLEX_MAX] = {0}, reflected[RBF_SIMPLEX_MAX], other[RBF_SIMPLEX_MAX];
		for (uint32_t i = 0; i <= d; i++)
			if (i != worst) {
				second = fmax(second, value[i]);
				for (uint32_t n = 0; n < d; n++)
					middle[n] += corner[i][n] / d;
			}
		for (uint32_t n = 0; n < d; n++)
			reflected[n] = 2 * middle[n] - corner[worst][n];
		const double first = function(data, reflected);
		const double by = first < value[best] ? 2 : first < value[worst] ? .5 : -.5; /* expand, contract outside or inside */
		const int taken = first < second;
		if (first < value[best] || !taken) {
			for (uint32_t n = 0; n < d; n++)
				other[n] = middle[n] + by * (reflected[n] - middle[n]);
			const double next = function(data, other);
			if (next < fmin(first, value[worst])) {
				memcpy(corner[worst], other, row);
				value[worst] = next;
				continue;
			}
		}
		if (taken) {
			memcpy(corner[worst], reflected, row);
			value[worst] = first;
			continue;
		}
		for (uint32_t i = 0; i <= d; i++)
			if (i != best) {
				for (uint32_t n = 0; n < d; n++)
					corner[i][n] = .5 * (corner[i][n] + corner[best][n]);
				value[i] = function(data, corner[i]);
			}
	}
	memcpy(x, corner[best], row);
	return value[best];
}
