/* SPDX-License-Identifier: BSD-3-Clause */
#include "samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CELLS = 48, AROUND = 5 };     /* buckets a side over [-1, 1]; neighbours that tell the spacing */
static const double SAME_DEG = .3;   /* the builder takes incidences closer than .25 degrees as one */
static const double GAP_DEG = 4;     /* a hole is at least twice that wide */

static int cell_of(double x)
{
	const int cell = (int)floor((x + 1) * (CELLS * .5));
	return cell < 0 ? 0 : cell >= CELLS ? CELLS - 1 : cell;
}

/* Index of the measured incidence, the one with most samples if there are several; -1: none. */
static long find_incidence(const view *v, const bsdfrbf_data *data, const float direction[3])
{
	long found = -1;
	size_t most = 0;
	for (size_t n = 0; n < bsdfrbf_data_incidences(data, v->component); n++) {
		bsdfrbf_samples in;
		if (bsdfrbf_data_get(data, v->component, n, &in) != BSDFRBF_OK)
			continue;
		double d[3] = {in.direction[0], in.direction[1], in.direction[2]};
		if (v->info.symmetry == 'I') {
			d[0] = hypot(d[0], d[1]);
			d[1] = 0;
		}
		const double x = d[0] - direction[0], y = d[1] - direction[1], z = d[2] - direction[2];
		if (sqrt(x*x + y*y + z*z) < SAME_DEG * REPORT_DEGREE && in.count > most) {
			most = in.count;
			found = (long)n;
		}
	}
	return found;
}

int samples_take(samples *s, const view *v, const bsdfrbf_data *data, int index)
{
	memset(s, 0, sizeof *s);
	bsdfrbf_incidence_info incidence;
	bsdfrbf_samples in;
	if (!data || bsdfrbf_get_incidence_info(v->model, v->component, index, &incidence) != BSDFRBF_OK)
		return 1;
	const long found = find_incidence(v, data, incidence.direction);
	if (found < 0 || bsdfrbf_data_get(data, v->component, (size_t)found, &in) != BSDFRBF_OK)
		return 1;
	s->direction = malloc(in.count * 3 * sizeof *s->direction);
	s->f = malloc(in.count * sizeof *s->f);
	s->cell = malloc(CELLS * CELLS * sizeof *s->cell);
	s->next = malloc(in.count * sizeof *s->next);
	if (!s->direction || !s->f || !s->cell || !s->next) {
		samples_free(s);
		return 0;
	}
	s->count = in.count;
	double c = 1, q = 0;
	const double sine = hypot(in.direction[0], in.direction[1]);
	if (v->info.symmetry == 'I' && sine > 0) {
		c = in.direction[0] / sine;
		q = in.direction[1] / sine;
	}
	for (int n = 0; n < CELLS * CELLS; n++)
		s->cell[n] = -1;
	for (size_t i = 0; i < in.count; i++) {
		const double *o = in.outgoing + 3*i;
		const double x = c * o[0] + q * o[1], y = c * o[1] - q * o[0];
		s->direction[3*i] = (float)x;
		s->direction[3*i + 1] = (float)y;
		s->direction[3*i + 2] = (float)o[2];
		s->f[i] = in.dsf[i * (size_t)v->channels + (size_t)v->luminance] / (float)o[2];
		int *cell = s->cell + cell_of(y) * CELLS + cell_of(x);
		s->next[i] = *cell;
		*cell = (int)i;
	}
	return 1;
}

void samples_free(samples *s)
{
	free(s->direction);
	free(s->f);
	free(s->cell);
	free(s->next);
	memset(s, 0, sizeof *s);
}

/* The `most` nearest samples by chord, nearest first; returns how many. Rings of buckets are added until what they
 * could still hold is farther than what was found: a chord is at least as long as its projection. */
static int nearest(const samples *s, const float direction[3], int most, long found[], double chord2[])
{
	int count = 0;
	const int cx = cell_of(direction[0]), cy = cell_of(direction[1]);
	for (int ring = 0; ring < CELLS; ring++) {
		const double beyond = (ring - 1) * (2. / CELLS);
		if (count == most && beyond > 0 && beyond * beyond > chord2[count - 1])
			break;
		for (int y = cy - ring; y <= cy + ring; y++)
			for (int x = cx - ring; x <= cx + ring; x++) {
				if (x < 0 || y < 0 || x >= CELLS || y >= CELLS || (abs(x - cx) != ring && abs(y - cy) != ring))
					continue;
				for (int i = s->cell[y * CELLS + x]; i >= 0; i = s->next[i]) {
					double d2 = 0;
					for (int n = 0; n < 3; n++)
						d2 += pow(s->direction[3*i + n] - direction[n], 2);
					int at = count < most ? count++ : most;
					for (; at > 0 && chord2[at - 1] > d2; at--)
						if (at < most) {
							chord2[at] = chord2[at - 1];
							found[at] = found[at - 1];
						}
					if (at < most) {
						chord2[at] = d2;
						found[at] = i;
					}
				}
			}
	}
	return count;
}

long samples_nearest(const samples *s, const float direction[3])
{
	long one[1], around[AROUND];
	double chord2[1], spacing2[AROUND];
	if (!s->count || !nearest(s, direction, 1, one, chord2))
		return -1;
	if (chord2[0] < pow(GAP_DEG * REPORT_DEGREE, 2))
		return one[0];
	const int count = nearest(s, s->direction + 3 * one[0], AROUND, around, spacing2);
	return chord2[0] < 2.25 * spacing2[count - 1] ? one[0] : -1;
}

size_t samples_near_plane(const samples *s, double phi, size_t capacity, size_t *index, double *band_deg)
{
	static const double band[] = {.5, 1, 2, 4};
	enum { ENOUGH = 24 };
	const double nx = -sin(phi * REPORT_DEGREE), ny = cos(phi * REPORT_DEGREE);
	size_t count = 0;
	for (size_t b = 0; b < sizeof band / sizeof *band; b++) {
		const double limit = sin(band[b] * REPORT_DEGREE);
		count = 0;
		for (size_t i = 0; i < s->count; i++)
			count += fabs(nx * s->direction[3*i] + ny * s->direction[3*i + 1]) <= limit;
		if (count < ENOUGH && b + 1 < sizeof band / sizeof *band)
			continue;
		/* evenly thinned if there are too many */
		size_t seen = 0, taken = 0;
		for (size_t i = 0; i < s->count; i++)
			if (fabs(nx * s->direction[3*i] + ny * s->direction[3*i + 1]) <= limit
					&& (count <= capacity || seen++ * capacity / count >= taken) && taken < capacity)
				index[taken++] = i;
		*band_deg = band[b];
		return taken;
	}
	return 0;
}
