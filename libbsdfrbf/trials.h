/* SPDX-License-Identifier: BSD-3-Clause */
/* A few incidences that stand for all: what is costly is tried at them, and the others go by those next to them. */
#ifndef RBF_TRIALS_H
#define RBF_TRIALS_H
#include <stddef.h>
#include <stdint.h>

enum { RBF_TRIALS_MOST = 8 };

typedef struct rbf_trials {
	uint32_t count;                 /* at most RBF_TRIALS_MOST, and a third of the incidences */
	uint32_t at[RBF_TRIALS_MOST];   /* places in `order`, rising */
	uint32_t bases;
	uint32_t *order;                /* [bases] incidences by rising polar angle */
} rbf_trials;

/* Spreads the trials over the polar angle. direction: bases x 3, unit. Returns 0, or -1 when out of memory. */
int rbf_trials_make(rbf_trials *trials, size_t bases, const double *direction);
void rbf_trials_free(rbf_trials *trials);

/* The incidence of a trial. */
static inline uint32_t rbf_trial_base(const rbf_trials *trials, uint32_t trial)
{
	return trials->order[trials->at[trial]];
}

/* The trials on both sides of a place in `order`: the same one twice at a trial, and beyond the first and the last. */
void rbf_trials_around(const rbf_trials *trials, uint32_t place, uint32_t *before, uint32_t *after);
#endif
