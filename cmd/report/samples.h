/* SPDX-License-Identifier: BSD-3-Clause */
/* Measured samples of one incidence, found by direction. */
#ifndef REPORT_SAMPLES_H
#define REPORT_SAMPLES_H
#include "view.h"

typedef struct samples {
	size_t count;
	float *direction;  /* count x 3, z > 0 */
	float *f;          /* luminance, sr^-1 */
	int *cell, *next;  /* buckets over x and y */
} samples;

/* Those of the measured incidence that the model's incidence `index` was fitted to; none (count 0) if `data` does not
 * have it. Turned to azimuth 0 for an isotropic component, as the model is. 0 when out of memory. */
int samples_take(samples *s, const view *v, const bsdfrbf_data *data, int index);
void samples_free(samples *s);

/* Sample nearest to a direction; -1 if there is none nearer than the samples around it are from each other. */
long samples_nearest(const samples *s, const float direction[3]);

/* Samples closest to the plane through the normal at azimuth phi (degrees): at most `capacity` indices. *band_deg: half
 * the width of the band that they were taken from. */
size_t samples_near_plane(const samples *s, double phi, size_t capacity, size_t *index, double *band_deg);
#endif
