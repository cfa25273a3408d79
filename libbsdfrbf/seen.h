/* SPDX-License-Identifier: BSD-3-Clause */
/* In which exitant directions an incidence was measured. */
#ifndef RBF_SEEN_H
#define RBF_SEEN_H
#include "measure.h"
#include "neighbours.h"

/* A direction is seen where the nearest sample is hardly farther away than samples are from each other there. */
typedef struct rbf_seen {
	int bridged;         /* 1: what lies between scan lines is measured */
	rbf_tree measured;     /* directions of the samples; its index is its own order, as that of the next */
	uint32_t *sample;      /* of the incidence, which each is from */
	uint8_t *band;         /* of each: 1 where something unseen is near */
	float *gap;            /* of those in the band, as rbf_tree_gap(); else negative */
	float share;           /* of the hemisphere that is unseen */
	float upper;           /* of what is within 60 degrees of the normal */
	rbf_tree hole;         /* directions that are unseen, until the band is set */
	rbf_tree filled;       /* directions that were filled */
	float *certainty;      /* of those */
} rbf_seen;

/* From the samples; their band is not set yet. Returns 0, or -1 when out of memory, as the next three. To be freed in any case. Thread-safe. */
int rbf_seen_make(const rbf_incidence *incidence, rbf_seen *seen);
void rbf_seen_free(rbf_seen *seen);

/* Sets the share more exactly, once. */
int rbf_seen_refine(rbf_seen *seen);

/* Then sets the band, once. */
int rbf_seen_band(rbf_seen *seen);

/* Directions that were filled, in place of former ones. */
int rbf_seen_fill(rbf_seen *seen, uint32_t count, const float (*direction)[3], const float *certainty);

/* How much what was filled from others that were measured there counts to what was measured. */
#define RBF_SECOND_HAND .25f
/* How much what was filled at a direction counts; 0: nothing was. */
float rbf_seen_filled(const rbf_seen *seen, const float direction[3]);

/* Whether a direction was measured. */
int rbf_seen_is(const rbf_seen *seen, const float direction[3]);

/* Shares of the hemisphere that were measured by both, or one alone: one incidence, and another's image: rows of a
 * rotation or mirror operation that takes directions of the first to those of the second. */
typedef struct rbf_seen_shares { float both, first, second; } rbf_seen_shares;
rbf_seen_shares rbf_seen_compare(const rbf_seen *first, const rbf_seen *second, const float image[9]);

/* Less than this share of the hemisphere is no hole that counts: one of 7 degrees is as large. */
#define RBF_SEEN_LEAST .0075f
/* Nor on one side alone less than this one: what devices leave out at the horizon is as much. */
#define RBF_SEEN_ONE_SIDED .02f

/* The share of what is within 60 degrees of the normal that was neither measured nor filled. */
float rbf_seen_unknown(const rbf_seen *seen);

/* Whether a sample would fill something: a direction outside the measured ones, be it only next to them. */
int rbf_seen_lacks(const rbf_seen *seen, const float direction[3]);

/* How much what is known at a direction may tell: 1 where it was measured, 0 where nothing is known. inner: as if what lies in the band were
 * unseen, and nothing filled. */
float rbf_seen_certainty(const rbf_seen *seen, const float direction[3], int inner);
#endif
