/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Adaptive quadrature over the exitant hemisphere at one incident direction. The hemisphere is the unit square of
 * shirley_chiu.h, cut into quarters from above. No peak is missed, since the interpolant is a sum of lobes that are known:
 * where a lobe lies, cells are cut until they are about as wide as it, before anything is evaluated.
 */
#ifndef RBF_EXITANT_H
#define RBF_EXITANT_H
#include "evaluate.h"

enum { RBF_EXITANT_LEVELS = 11 };

/* A cell of 2^-level a side at (x, y) 2^-level, and values of f (Lambertian part not included) at its four Gauss points. */
typedef struct rbf_exitant_leaf {
	int level;
	uint32_t x, y;
	float direction[4][3], value[4][3];
} rbf_exitant_leaf;

typedef struct rbf_exitant {
	int first;      /* level to start from */
	int finest;     /* down to this level, cells are cut while their values differ too much */
	int deepest;    /* down to this level, they are cut where lobes are narrower still */
	float spread[3]; /* largest difference of the values of an uncut cell above the finest level; set for each site */
	double energy;  /* DHR, luminance, of which a lobe must hold a share to be integrated beyond the finest level */
	int points;     /* 1: the middle alone stands for a cell that is narrow beside the lobes in it; 4: always four points */
	void (*leaf)(void *user, const rbf_exitant_leaf *leaf);
	void *user;
	const rbf_site *site;
	uint8_t *need[RBF_EXITANT_LEVELS]; /* per level up to finest and cell: level of the narrowest lobe there */
} rbf_exitant;

/* Reserves what the levels first <= finest <= deepest need. 0: out of memory. */
int rbf_exitant_begin(rbf_exitant *e, int first, int finest, int deepest);
void rbf_exitant_end(rbf_exitant *e);

/* Calls leaf() for cells that cover the hemisphere, each once. spread[], leaf() and user are set by the caller. */
void rbf_exitant_run(rbf_exitant *e, const rbf_site *site);

/* Spread of the lobes seen from a site, radians: 1 / sqrt(mean kappa weighted by energy). */
double rbf_exitant_width(const rbf_site *site);
#endif
