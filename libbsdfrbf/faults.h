/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples that are faults of the measurement are left out. */
#ifndef RBF_FAULTS_H
#define RBF_FAULTS_H
#include "measure.h"

typedef struct rbf_faults {
	size_t samples;    /* so many are left out, */
	size_t incidences; /* at so many incidences, */
	size_t first;      /* the first of which is this one */
} rbf_faults;

/* Sets `rest` to a component's incidences, with their samples: those that are put in their place are freed by the release. Returns as the next. */
int rbf_faults_borrow(const rbf_measured *all, rbf_measured *rest);

/* Sets `rest` to a component's incidences without the samples whose state[incidence][sample] is `fault` (NULL: there is none): borrowed where nothing is left out. To be released
 * in any case, as long as `all` is there. Returns 0, or -1 when out of memory. */
int rbf_faults_leave_out(const rbf_measured *all, int channels, uint8_t *const *state, uint8_t fault, rbf_measured *rest, rbf_faults *found);
void rbf_faults_release(const rbf_measured *all, rbf_measured *rest);

/* The step of numbers so coarse that the second smallest above zero is about twice the smallest; 0: they are fine. over: of what is left when each is divided by
 * the cosine of its direction; NULL: of themselves. */
float rbf_faults_step(const float *value, const float (*over)[3], size_t count);
#endif
