/* SPDX-License-Identifier: BSD-3-Clause */
#include "reciprocal.h"
#include "sample.h"
#include "shirley_chiu.h"

#include <string.h>

enum { START = 16, DEPTH = 5 };

static void value_at(const rbf_component *c, const float exitant[3], float x, float y, float value[3])
{
	float d[3];
	rbf_site site;
	rbf_direction_from_cell((double)x, (double)y, d);
	rbf_site_locate(c, d, &site);
	rbf_site_eval(&site, exitant, value);
}

/* Takes the value in the middle of the cell; returns its energy. */
static double measure(const rbf_component *c, const float exitant[3], rbf_reciprocal *t, uint32_t n)
{
	const float half = t->cell[n].size / 2;
	value_at(c, exitant, t->cell[n].x + half, t->cell[n].y + half, t->cell[n].value);
	t->cell[n].energy = t->cell[n].value[rbf_luminance(c->channels)] * t->cell[n].size * t->cell[n].size;
	return (double)t->cell[n].energy;
}

/* A cell is split while its energy is a large share of the whole, level by level. */
void rbf_reciprocal_make(const rbf_component *c, const float exitant[3], rbf_reciprocal *t)
{
	double total = 0, running = 0;
	t->cells = 0;
	memset(t->dhr, 0, sizeof t->dhr);
	for (int j = 0; j < START; j++)
		for (int i = 0; i < START; i++) {
			t->cell[t->cells].x = (float)i / START;
			t->cell[t->cells].y = (float)j / START;
			t->cell[t->cells].size = 1.f / START;
			total += measure(c, exitant, t, t->cells++);
		}
	for (int level = 0; level < DEPTH && total > 0; level++) {
		const uint32_t end = t->cells;
		const double limit = total / (double)(RBF_RECIPROCAL_CELLS / 4);
		for (uint32_t n = 0; n < end && t->cells + 3 <= RBF_RECIPROCAL_CELLS; n++) {
			if ((double)t->cell[n].energy < limit)
				continue;
			const float size = t->cell[n].size / 2, x = t->cell[n].x, y = t->cell[n].y;
			total -= (double)t->cell[n].energy;
			for (int q = 0; q < 4; q++) {
				const uint32_t at = q ? t->cells++ : n;
				t->cell[at].x = x + (float)(q & 1) * size;
				t->cell[at].y = y + (float)(q >> 1) * size;
				t->cell[at].size = size;
				total += measure(c, exitant, t, at);
			}
		}
	}
	for (uint32_t n = 0; n < t->cells; n++) {
		for (uint32_t k = 0; k < c->channels; k++)
			t->dhr[k] += RBF_PI * (double)(t->cell[n].value[k] * t->cell[n].size * t->cell[n].size);
		t->cell[n].energy = (float)(running += (double)t->cell[n].energy);
	}
}

int rbf_reciprocal_sample(const rbf_reciprocal *t, double u, float incident[3])
{
	const double total = t->cells ? (double)t->cell[t->cells - 1].energy : 0;
	incident[0] = incident[1] = incident[2] = 0;
	if (!(total > 0))
		return 0;
	u = u > 0 ? u < 1 ? u * total : total * (1 - 0x1p-53) : 0;
	uint32_t low = 0, high = t->cells - 1;
	while (low < high) {
		const uint32_t middle = (low + high) / 2;
		if ((double)t->cell[middle].energy > u)
			high = middle;
		else
			low = middle + 1;
	}
	const double from = low ? (double)t->cell[low - 1].energy : 0, step = (double)t->cell[low].energy - from;
	double a, b;
	rbf_split_number(step > 0 ? fmin(fmax((u - from) / step, 0), 1 - 0x1p-53) : .5, &a, &b);
	rbf_direction_from_cell((double)t->cell[low].x + a * (double)t->cell[low].size, (double)t->cell[low].y + b * (double)t->cell[low].size,
		incident);
	return 1;
}
