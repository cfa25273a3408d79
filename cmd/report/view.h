/* SPDX-License-Identifier: BSD-3-Clause */
/* One component as the report sees it: luminance, and all vectors with z > 0, seen from the component's own sides. */
#ifndef REPORT_VIEW_H
#define REPORT_VIEW_H
#include "bsdfrbf.h"

#define REPORT_PI 3.14159265358979323846
#define REPORT_DEGREE (REPORT_PI / 180)

typedef struct view {
	const bsdfrbf_model *model;
	bsdfrbf_component component;
	bsdfrbf_component_info info;
	int channels, luminance;  /* index of the luminance channel */
	int transmit;
	float side_in, side_out;  /* sign of z */
} view;

/* 0 if the model does not have the component. */
int view_start(view *v, const bsdfrbf_model *model, bsdfrbf_component component);

/* f, sr^-1, at `count` outgoing directions. */
void view_eval(const view *v, const float incident[3], size_t count, const float *outgoing, float *f);

double view_dhr(const view *v, const float incident[3]);

/* Direction from polar angle and azimuth, degrees. */
void view_direction(double theta, double phi, float direction[3]);
double view_theta(const float direction[3]);
double view_phi(const float direction[3]); /* [0, 360) */

/* The pictures' pixels: `size` a side over the disc whose radius is theta = 90 degrees, x to the right, y up, rows from
 * the top; those with their centre within the disc. Writes 3 numbers each, if direction is not NULL; returns how many. */
size_t disc_directions(int size, float *direction);

/* Where f |cos| is largest. `grid`: directions to start from. */
typedef struct view_peak {
	float direction[3];
	double f;
} view_peak;
int view_find_peak(const view *v, const float incident[3], size_t count, const float *grid, const float *f, view_peak *peak);
#endif
