/* SPDX-License-Identifier: BSD-3-Clause */
/* How well a choice of frames and residual motion tells incidences that are left out. */
#ifndef RBF_LEFT_OUT_H
#define RBF_LEFT_OUT_H
#include "label.h"

typedef struct rbf_choice {
	uint32_t frames, frame[RBF_MAX_FRAMES]; /* indices of candidates */
	float share[RBF_MAX_FRAMES];
	rbf_belief belief; /* that labels were made with */
	float *label;      /* as from rbf_label(); owned */
	float limit[RBF_MAX_FRAMES]; /* of each frame's shares (model.h); 0: that of its map */
	uint32_t even;     /* how far levels are evened (model.h) */
	int slopes;        /* 1: with slopes */
	int tune;          /* light is tuned to the DHR that is expected: 1, 2: with slopes, or 3: by a network (network.h) */
	float cap;         /* of residual motion (advect.h); 0: none */
	float error;       /* mean leave-one-out L1, of which each counts 2 at most; < 0: could not be measured */
	float *base_error; /* [bases], < 0: not measured; owned */
} rbf_choice;

void rbf_choice_free(rbf_choice *choice);

/* Labels a choice that has none; frames that get no lobe go. Opens OpenMP regions. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_choice_label(const rbf_fitted *fitted, rbf_choice *choice);

/* The same for a choice that is to be settled widely, and for what it then has before the last sweep: the labels of another, that is but settled, if these
 * are the same; else that one gets none. */
int rbf_choice_label_widely(const rbf_fitted *fitted, rbf_choice *wide, rbf_choice *once);

/* Incidences that are left out in turn: those inside the mesh of the others, if there are any but normal incidence. */
typedef struct rbf_left_out {
	rbf_fitted *fitted;
	uint32_t trials;
	struct rbf_left_out_trial *trial;
	float *arrived;  /* as rbf_levels_arrived() */
	float *value;    /* as rbf_tune_arrived() */
	int outside;       /* of the mesh of the others are all, but normal incidence: they tell little */
} rbf_left_out;

/* lambertian: luminance of the Lambertian part. across: those between which an incidence lies are left out with it, so that what it is predicted
 * from lies the other way: of rings, at other azimuths. To be freed in any case. Errors: MEMORY, INTERNAL. */
bsdfrbf_status rbf_left_out_make(bsdfrbf_context *context, rbf_fitted *fitted, float lambertian, int across, rbf_left_out *left_out);

/* Incidences whose image by a mirror operation (mesh.h) is inside the mesh: each is told there, from what was measured around its image. None is
 * left out. For choices that even and tune nothing. To be freed, and errors, as above. */
bsdfrbf_status rbf_left_out_images(bsdfrbf_context *context, rbf_fitted *fitted, float lambertian, unsigned op, rbf_left_out *left_out);
void rbf_left_out_free(rbf_left_out *left_out);

/* How far a trial is from what it is told from. */
typedef struct rbf_span {
	float bend;     /* what linear interpolation errs by, but for the second derivative: sum over pairs of corners w_i w_j |e_ij|^2; < 0: no trial */
	float squares;  /* of their errors, as far as these are independent: sum w^2 */
} rbf_span;
void rbf_left_out_spans(const rbf_left_out *left_out, rbf_span *span); /* [bases] */

/* Labels a choice, unless it has labels, and measures its error. If `best` is given, a few trials are made first, and the others only if the choice is not
 * clearly worse there: otherwise its error is INFINITY. Opens an OpenMP region. Returns 0, or -1 when out of memory or a process gave up. */
int rbf_left_out_error(const rbf_left_out *left_out, rbf_choice *choice, const rbf_choice *best);

/* The same of a few choices that differ by `tune` alone, and have labels: what there is before light is tuned is worked out once. */
int rbf_left_out_tuned(const rbf_left_out *left_out, uint32_t choices, rbf_choice *const choice[]);
#endif
