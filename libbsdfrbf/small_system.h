/* SPDX-License-Identifier: BSD-3-Clause */
#ifndef RBF_SMALL_SYSTEM_H
#define RBF_SMALL_SYSTEM_H

/* Solves a positive definite system of a few unknowns in place, a[n][n] in rows, by elimination; what was the right side becomes the solution. Returns 0, the
 * solution undefined, where what is left of a diagonal element is less than `singular` of it. */
static inline int rbf_small_system_solve(int n, double *a, double *x, double singular)
{
	for (int i = 0; i < n; i++) {
		if (!(a[i * n + i] > 0))
			return 0;
		for (int j = i + 1; j < n; j++) {
			const double part = a[j * n + i] / a[i * n + i], whole = a[j * n + j];
			for (int k = i; k < n; k++)
				a[j * n + k] -= part * a[i * n + k];
			x[j] -= part * x[i];
			if (!(a[j * n + j] > singular * whole))
				return 0;
		}
	}
	for (int i = n - 1; i >= 0; i--) {
		for (int k = i + 1; k < n; k++)
			x[i] -= a[i * n + k] * x[k];
		x[i] /= a[i * n + i];
	}
	return 1;
}

#endif
