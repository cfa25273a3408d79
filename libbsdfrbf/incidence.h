/* SPDX-License-Identifier: BSD-3-Clause */
/* Answers at one incident direction. What they have in common is worked out when it is first needed. */
#ifndef RBF_INCIDENCE_H
#define RBF_INCIDENCE_H
#include "reciprocal.h"
#include "sample.h"

/* One side of the surface: reflection or transmission. */
typedef struct rbf_side {
	const bsdfrbf_model *model;
	const rbf_component *component; /* NULL: nothing answers */
	int swapped;        /* the component is the reverse one, by reciprocity */
	int below;          /* outgoing vectors have z < 0 */
	int located, limited, ready; /* whether the site is set, its scale, and the sampler */
	int known;          /* whether dhr is */
	float local[3];     /* incident direction in the component's half space (exitant if swapped) */
	float dhr[3];
	int measured;       /* whether width is known, at: */
	float exitant[3], width[2]; /* of rbf_site_width() */
	rbf_spot spot;
	rbf_site site;
	rbf_sampler sampler;
} rbf_side;

void rbf_side_set(const bsdfrbf_model *model, const float incident[3], int transmit, rbf_side *side);

/* f without the Lambertian part; outgoing: unit, in the side's half space but for the sign of z, which counts as if it were. */
void rbf_side_eval(rbf_side *side, const float outgoing[3], float *value);

/* The same, and notes how wide the lobes are that are seen there: a renderer asks for that next, and the lobes are the same. */
void rbf_side_eval_width(rbf_side *side, const float outgoing[3], float *value);

/* DHR of the scattered part. */
void rbf_side_dhr(rbf_side *side, float *value);

enum { RBF_SIDES = 8 }; /* at most, in: */

/* Makes several ready for samples, step by step, each for all of them: quicker than one after the other. */
void rbf_sides_prepare(uint32_t sides, rbf_side side[]);
int rbf_side_sample(rbf_side *side, double u, float outgoing[3]);
size_t rbf_side_sample_many(rbf_side *side, size_t count, const double *u, float outgoing[][3]); /* returns how many were drawn */
void rbf_side_add_lambertian(const rbf_side *side, float scale, float *value);

typedef struct rbf_incidence {
	const bsdfrbf_model *model;
	float incident[3];
	int set[2];
	rbf_side side[2];   /* reflected, transmitted */
} rbf_incidence;

void rbf_incidence_set(const bsdfrbf_model *model, const float incident[3], rbf_incidence *at);
float rbf_incidence_pdf(rbf_incidence *at, const float outgoing[3]);
void rbf_incidence_resolution(rbf_incidence *at, const float *outgoing, int transmit, float *smallest, float *largest);
#endif
