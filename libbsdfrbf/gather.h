/* SPDX-License-Identifier: BSD-3-Clause */
/* Gathers samples before they join a bsdfrbf_data: a reader that fails half-way leaves no trace. */
#ifndef RBF_GATHER_H
#define RBF_GATHER_H
#include "measure.h"

/* Directions closer than this are one incidence: goniometers repeat their positions to about 0.01 degrees. */
#define RBF_SAME_INCIDENCE_DEG 0.02

/* |z| below this is the horizon: neither side, and f = DSF/|z| is noise. */
#define RBF_HORIZON_Z 1e-4

/* Beyond any physical value in sr^-1: the full beam of a laser spread over 1e-12 sr. */
#define RBF_VALUE_MAX 1e12

typedef struct rbf_batch {
	size_t count, capacity;
	double *outgoing;     /* count x 3, z > 0 */
	float *dsf;           /* count x channels */
} rbf_batch;

/* Samples at one incident direction. */
typedef struct rbf_gather {
	double direction[3];  /* unit, z > 0 */
	int back;             /* 1: incident from the back */
	int channels;
	rbf_batch side[2];    /* reflected, transmitted */
} rbf_gather;

/* World coordinates, degrees; theta from +Z, phi counter-clockwise from +X. */
void rbf_direction_from_angles(double theta, double phi, double direction[3]);

/* Starts with a unit incident direction in world coordinates. 0 if it lies in the surface's plane. */
int rbf_gather_start(rbf_gather *gather, const double incident[3], int channels);

/* Adds one sample: unit outgoing direction in world coordinates, finite values; on the horizon it is dropped.
 * Returns 0 when out of memory. */
int rbf_gather_add(rbf_gather *gather, const double outgoing[3], const double *values, bsdfrbf_quantity quantity);

void rbf_gather_free(rbf_gather *gather);

/* Joins the gathered samples to `data`, all or nothing; the gathers stay the caller's to free. All have the same
 * number of channels. path: file they come from, or NULL; name: of the sample, or NULL. Errors: DATA, MEMORY. */
bsdfrbf_status rbf_data_join(bsdfrbf_context *context, bsdfrbf_data *data, size_t count, rbf_gather *gathers,
	const char *path, const char *name);

/* A component that was fitted elsewhere becomes `data`'s, all or nothing: on success *ready is emptied. It must be new to
 * `data`. path: file it comes from; name: of the sample, or NULL. Errors: DATA, MEMORY. */
bsdfrbf_status rbf_data_join_ready(bsdfrbf_context *context, bsdfrbf_data *data, int component, int channels,
	rbf_measured *ready, const char *path, const char *name);

void rbf_measured_free(rbf_measured *measured);
#endif
