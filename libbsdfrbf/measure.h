/* SPDX-License-Identifier: BSD-3-Clause */
/* Measured samples in memory: what readers produce and the builder consumes. */
#ifndef RBF_MEASURE_H
#define RBF_MEASURE_H
#include "status.h"

/* A Gaussian lobe that was fitted elsewhere (a .sir file): DSF(w) = dsf exp(kappa (centre . w - 1)). */
typedef struct rbf_ready_lobe {
	double centre[3];           /* unit, z >= 0 */
	double kappa;
	float dsf[3];               /* as many as channels */
} rbf_ready_lobe;

/* What gaps between scan lines are to fits that are much wider than samples are apart along them. */
typedef enum rbf_lines {
	RBF_LINES_LEFT,             /* dark, and filled from other incidences if these tell */
	RBF_LINES_BRIDGED,          /* as smooth as can be, and measured */
	RBF_LINES_FILLED            /* as smooth as can be, and filled */
} rbf_lines;

/* All samples of one component at one incident direction.
 * Coordinates are those of the component's own half space: both incident and outgoing vectors are turned to
 * z > 0 by flipping the sign of z alone (x and y are kept), so that the later stages know nothing of sides. */
typedef struct rbf_incidence {
	double direction[3];        /* unit, z >= 0 */
	size_t count;
	double *outgoing;           /* count x 3, unit, z > 0 */
	float *dsf;                 /* count x channels: f |cos(theta_o)|, sr^-1; may be negative (noise) */
	rbf_lines lines;
	size_t file;                /* line of bsdfrbf_data's source that its first samples are from; 0: of none */
	size_t guessed;             /* of the samples, the last so many (one_plane.h) */
	size_t mirrored;            /* likewise (mirrored.h); one of the two is 0 */
	int paired;                 /* 1: both sides of the plane y = 0 are alike, and fitted so (twins.h) */
	size_t lobes;               /* lobes instead of samples; 0 where the component was measured */
	rbf_ready_lobe *lobe;
} rbf_incidence;

typedef struct rbf_measured {   /* one component */
	size_t count;
	rbf_incidence *incidence;
	int ready;                  /* 1: all incidences have lobes, none has samples */
	int isotropic;              /* 1: so the file that the lobes are from says */
} rbf_measured;

struct bsdfrbf_data {
	int channels;               /* 0 while empty, then 1 or 3 (X, Y, Z) */
	rbf_measured component[4];  /* by bsdfrbf_component */
	char *name;                 /* first sample name met, or NULL */
	char *source;               /* newline-separated file names, or NULL */
	size_t files;
};

/* "front reflection (rf)" and so on, for messages. */
const char *rbf_component_name(int component);

/* Is there enough to build from? Error DATA if there is nothing, or a component without any value above zero;
 * warnings about incidences without one, or with fewer than 10 samples. */
bsdfrbf_status rbf_data_check(bsdfrbf_context *context, const bsdfrbf_data *data);

/* Room for so many samples, at least one. Returns 0, or -1 when out of memory: what is there stays. */
int rbf_incidence_reserve(rbf_incidence *incidence, size_t channels, size_t count);

/* Appends the samples of another incidence to those that one has of its own, by realloc(). Returns 0, or -1 when out of memory. */
int rbf_incidence_append(rbf_incidence *to, const rbf_incidence *other, size_t channels);
#endif
