/* SPDX-License-Identifier: BSD-3-Clause */
/* Normal equations of a sum of lobes with given centres and widths against weighted samples. */
#ifndef RBF_EQUATIONS_H
#define RBF_EQUATIONS_H
#include <stddef.h>
#include <stdint.h>

typedef struct rbf_equations {
	/* given */
	size_t samples;
	const float (*direction)[3]; /* [samples], in an order that keeps near ones together */
	const float *weight;         /* [samples], of the squared difference; 0: does not count */
	const float *value[3];       /* [channels][samples] */
	int channels;
	size_t lobes;
	const float (*centre)[3], *kappa;
	int paired;                  /* 1: samples and centres have y >= 0, and each lobe with y > 0 counts with its image at -y */
	/* found */
	double *gram, *right;        /* [lobes][lobes], [channels][lobes]; set by rbf_equations_make(), to be freed */
	double squares[3], count;    /* weighted squares of the values; samples that count */
} rbf_equations;

/* Returns 0, or -1 when out of memory. */
int rbf_equations_make(rbf_equations *equations);

/* Leaves out the samples i with out[i] = 1, whose weights must be as they were: much less work than all anew where they are few. What the
 * caller has added to the diagonal stays. Returns 0, or -1 when out of memory. */
int rbf_equations_leave_out(rbf_equations *equations, const uint8_t *out);

/* The same after lobes were added behind the `former` first ones. What the caller has added to the diagonal stays, and none is added for new
 * lobes. out: those left out, or NULL. Returns 0, or -1 when out of memory: nothing is changed then. */
int rbf_equations_add(rbf_equations *equations, size_t former, const uint8_t *out);
void rbf_equations_free(rbf_equations *equations);
#endif
