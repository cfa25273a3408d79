/* SPDX-License-Identifier: BSD-3-Clause */
/* What the incidences around one show of it, where it was not measured itself: their frames carry it there. */
#ifndef RBF_OUTLOOK_H
#define RBF_OUTLOOK_H
#include "left_out.h"
#include "seen.h"

/* How a turn carries light. */
enum rbf_carry { RBF_CARRY_DSF, RBF_CARRY_F, RBF_CARRIES };

/* The fits, and where they are backed by samples. */
typedef struct rbf_sources {
	const rbf_fitted *fitted;
	const rbf_seen *seen;            /* [bases] */
	uint32_t frames;
	const uint32_t *frame;           /* indices of candidates */
	rbf_lobes *part[RBF_MAX_FRAMES]; /* what belongs to each */
} rbf_sources;

/* All else is borrowed. Returns 0, or -1 when out of memory; to be freed in any case. */
int rbf_sources_make(const rbf_fitted *fitted, const rbf_seen *seen, const rbf_choice *choice, rbf_sources *sources);
void rbf_sources_free(rbf_sources *sources);

/* What is taken to be unseen for a trial: what lies in the band, at all incidences; or some directions of this one, which its images have then not seen either. */
enum rbf_hidden { RBF_HIDDEN_NOTHING, RBF_HIDDEN_BAND, RBF_HIDDEN_HERE };

/* Of one incidence. */
typedef struct rbf_outlook {
	const rbf_sources *of;
	uint32_t base, around;
	enum rbf_carry carry;
	enum rbf_hidden hidden;
	const rbf_lobes *inner;          /* a fit without the samples that are hidden; NULL: nothing is */
	const rbf_tree *beside;          /* samples that it may be compared with */
	float *compared;                 /* [beside->count][2]: what it is there, and what is predicted; -1: not asked yet */
	rbf_vertex *neighbour;           /* in the mesh; and the incidence's own images where symmetry has them in the same place */
	float *near;                     /* by how much each counts */
	rbf_warp *warp;                  /* [frames][around] */
} rbf_outlook;

/* beside, inner: as above, to borrow. Returns 0, or -1 when out of memory, as does rbf_outlook_samples(); to be freed in any case. One thread at a time,
 * as all that follows. */
int rbf_outlook_make(const rbf_sources *sources, uint32_t base, enum rbf_carry carry, const rbf_tree *beside, enum rbf_hidden hidden,
	const rbf_lobes *inner, rbf_outlook *outlook);
void rbf_outlook_free(rbf_outlook *outlook);

/* DSF in direction p without the Lambertian part, all channels, and how certain that is: from 1, as measured, down to 0: nothing is known. It is what the
 * others predict, times what the incidence is over what they predict next to p; of frames of which none tells, its own. */
float rbf_outlook_value(rbf_outlook *outlook, const float p[3], float value[3]);

/* Directions in which the incidence was not measured, but others were: of each direction, the samples of the one that tells most. *direction: to be
 * freed. */
int rbf_outlook_samples(const rbf_outlook *outlook, float (**direction)[3], uint32_t *count);
#endif
