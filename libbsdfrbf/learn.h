/* SPDX-License-Identifier: BSD-3-Clause */
/* Learns how a beam moves with the incident direction, where no listed map says so. */
#ifndef RBF_LEARN_H
#define RBF_LEARN_H
#include "label.h"

typedef struct rbf_lesson rbf_lesson;

/* Probes of the fits, made once. NULL when out of memory. */
rbf_lesson *rbf_learn_begin(const rbf_fitted *fitted);
void rbf_learn_end(rbf_lesson *lesson);

/* Frames (indices of candidates; may be none) that are there already: a frame is learned from what they do not predict. Returns
 * the share of the energy that they predict. Opens OpenMP regions, as does the next. */
double rbf_learn_after(rbf_lesson *lesson, uint32_t frames, const uint32_t frame[]);

/* The share that another one besides predicts with them. */
double rbf_learn_with(rbf_lesson *lesson, uint32_t frame);

/* The linear beam under which neighbouring incidences predict each other best, together with those frames. With a start it is
 * refined, else searched for. map: a learned one. Returns the share that is then predicted. */
double rbf_learn(rbf_lesson *lesson, unsigned map, const rbf_linear *start, rbf_linear *found);

/* From now on beams are learned whose mirror images are others: of a mirrored pair, say. */
void rbf_learn_loosen(rbf_lesson *lesson);

/* The coefficients that symmetry leaves free, RBF_SIMPLEX_MAX at most, into x[]; returns how many. */
uint32_t rbf_learn_get(const rbf_lesson *lesson, unsigned map, const rbf_linear *linear, double x[]);

/* Puts them back: the others stay. */
void rbf_learn_set(const rbf_lesson *lesson, unsigned map, const double x[], rbf_linear *linear);

/* Non-zero once a process of the team gave up, or memory ran out, in the two above. */
int rbf_learn_failed(const rbf_lesson *lesson);
#endif
