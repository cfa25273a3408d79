/* SPDX-License-Identifier: BSD-3-Clause */
#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int view_start(view *v, const bsdfrbf_model *model, bsdfrbf_component component)
{
	memset(v, 0, sizeof *v);
	v->model = model;
	v->component = component;
	v->channels = bsdfrbf_channels(model);
	v->luminance = v->channels == 3;
	v->transmit = component == BSDFRBF_TF || component == BSDFRBF_TB;
	v->side_in = component == BSDFRBF_RF || component == BSDFRBF_TF ? 1 : -1;
	v->side_out = v->transmit ? -v->side_in : v->side_in;
	return bsdfrbf_get_component_info(model, component, &v->info) == BSDFRBF_OK;
}

void view_eval(const view *v, const float incident[3], size_t count, const float *outgoing, float *f)
{
	const float in[3] = {incident[0], incident[1], v->side_in * incident[2]};
	enum { BLOCK = 256 };
	float out[3 * BLOCK], value[3 * BLOCK];
	for (size_t at = 0; at < count; at += BLOCK) {
		const size_t n = count - at < BLOCK ? count - at : BLOCK;
		for (size_t i = 0; i < n; i++) {
			memcpy(out + 3*i, outgoing + 3*(at + i), 3 * sizeof *out);
			out[3*i + 2] *= v->side_out;
		}
		bsdfrbf_eval_exitant(v->model, in, n, out, value);
		for (size_t i = 0; i < n; i++)
			f[at + i] = value[(size_t)v->channels * i + (size_t)v->luminance];
	}
}

double view_dhr(const view *v, const float incident[3])
{
	const float in[3] = {incident[0], incident[1], v->side_in * incident[2]};
	float value[3] = {0};
	bsdfrbf_dhr(v->model, in, v->transmit, value);
	return value[v->luminance];
}

void view_direction(double theta, double phi, float direction[3])
{
	theta *= REPORT_DEGREE;
	phi *= REPORT_DEGREE;
	direction[0] = (float)(sin(theta) * cos(phi));
	direction[1] = (float)(sin(theta) * sin(phi));
	direction[2] = (float)cos(theta);
}

double view_theta(const float d[3])
{
	return atan2(hypot(d[0], d[1]), d[2]) / REPORT_DEGREE;
}

double view_phi(const float d[3])
{
	if (hypot(d[0], d[1]) < 1e-6)
		return 0;
	const double phi = atan2(d[1], d[0]) / REPORT_DEGREE;
	return phi < -1e-4 ? phi + 360 : fabs(phi);
}

size_t disc_directions(int size, float *direction)
{
	size_t count = 0;
	for (int row = 0; row < size; row++)
		for (int column = 0; column < size; column++) {
			/* whole numbers, so that the page finds the same pixels */
			const int x = 2 * column + 1 - size, y = size - 1 - 2 * row;
			if (x * x + y * y >= size * size)
				continue;
			if (direction) {
				const double r = sqrt(x * x + y * y), theta = r / size * (REPORT_PI / 2);
				direction[3*count] = (float)(r > 0 ? sin(theta) * x / r : 0);
				direction[3*count + 1] = (float)(r > 0 ? sin(theta) * y / r : 0);
				direction[3*count + 2] = (float)cos(theta);
			}
			count++;
		}
	return count;
}

/* ---------------------------------------------------------------------- peak */

static double dsf_at(const view *v, const float incident[3], const float direction[3])
{
	float f;
	view_eval(v, incident, 1, direction, &f);
	return f * direction[2];
}

/* Climbs to the top from `at` by ever smaller steps across the direction. */
static double climb(const view *v, const float incident[3], float at[3])
{
	double best = dsf_at(v, incident, at);
	for (double step = 3; step > .005; step *= .6)
		for (int tries = 0, better = 1; better && tries < 8; tries++) {
			better = 0;
			const float from[3] = {at[0], at[1], at[2]};
			/* two unit vectors across `from`: the first along its meridian */
			const double s = hypot(from[0], from[1]), c = s > 1e-9 ? from[0] / s : 1, q = s > 1e-9 ? from[1] / s : 0;
			for (int n = 0; n < 8; n++) {
				const double a = n * REPORT_PI / 4, t = tan(step * REPORT_DEGREE) * cos(a), u = tan(step * REPORT_DEGREE) * sin(a);
				const double x = from[0] + t * from[2] * c - u * q, y = from[1] + t * from[2] * q + u * c, z = from[2] - t * s;
				const double length = sqrt(x*x + y*y + z*z);
				const float tried[3] = {(float)(x / length), (float)(y / length), (float)(z / length)};
				if (!(tried[2] > .01))
					continue;
				const double here = dsf_at(v, incident, tried);
				if (here > best) {
					best = here;
					memcpy(at, tried, sizeof tried);
					better = 1;
				}
			}
		}
	return best;
}

int view_find_peak(const view *v, const float incident[3], size_t count, const float *grid, const float *f, view_peak *peak)
{
	float start[3] = {0, 0, 1};
	double best = -1;
	for (size_t i = 0; i < count; i++)
		if (f[i] * grid[3*i + 2] > best) {
			best = f[i] * grid[3*i + 2];
			memcpy(start, grid + 3*i, sizeof start);
		}
	/* a peak that falls between the pixels is met by samples */
	const float in[3] = {incident[0], incident[1], v->side_in * incident[2]};
	for (int n = 0; n < 32; n++) {
		float d[3];
		if (!bsdfrbf_sample(v->model, in, v->transmit, (n + .5) / 32, d))
			break;
		d[2] = fabsf(d[2]);
		const double here = d[2] > .01f ? dsf_at(v, incident, d) : 0;
		if (here > best) {
			best = here;
			memcpy(start, d, sizeof start);
		}
	}
	memcpy(peak->direction, start, sizeof start);
	peak->f = climb(v, incident, peak->direction) / fmax(peak->direction[2], 1e-6);
	return best > 0;
}
