/* SPDX-License-Identifier: BSD-3-Clause */
#include "division.h"
#include "shirley_chiu.h"

#include <stdlib.h>
#include <string.h>

int rbf_division_make(rbf_division *d, int parts, int (*find)(const void *user, const float d[3]), const void *user)
{
	const uint32_t size = 1u << RBF_DIVISION_LEVEL;
	memset(d, 0, sizeof *d);
	d->parts = parts;
	int good = (d->area = calloc((size_t)parts, sizeof *d->area)) != NULL;
	for (int level = 0; level <= RBF_DIVISION_LEVEL; level++)
		good &= (d->part[level] = malloc(sizeof *d->part[level] << 2 * level)) != NULL;
	if (!good) {
		rbf_division_free(d);
		return 0;
	}
	for (uint32_t y = 0; y < size; y++)
		for (uint32_t x = 0; x < size; x++) {
			float direction[3];
			rbf_direction_from_cell((x + .5) / size, (y + .5) / size, direction);
			const int part = find(user, direction);
			d->part[RBF_DIVISION_LEVEL][y << RBF_DIVISION_LEVEL | x] = (uint16_t)part;
			d->area[part] += RBF_PI / ((double)size * size);
		}
	for (int level = RBF_DIVISION_LEVEL - 1; level >= 0; level--)
		for (uint32_t y = 0; y < 1u << level; y++)
			for (uint32_t x = 0; x < 1u << level; x++) {
				const uint16_t *below = &d->part[level + 1][(2*y) << (level + 1) | 2*x], *next = below + ((size_t)2 << level);
				const int same = below[0] == below[1] && below[0] == next[0] && below[0] == next[1];
				d->part[level][y << level | x] = same ? below[0] : RBF_DIVISION_MIXED;
			}
	return 1;
}

void rbf_division_free(rbf_division *d)
{
	free(d->area);
	for (int level = 0; level <= RBF_DIVISION_LEVEL; level++)
		free(d->part[level]);
	memset(d, 0, sizeof *d);
}

/* f of a leaf as a function of the place in it, from -1 to 1 in u and v: mean + u du + v dv + u v duv */
typedef struct plane {
	double mean, du, dv, duv;
} plane;

typedef struct adding {
	const rbf_division *division;
	uint32_t channels;
	double share;
	plane f[3];
	double *sum;
} adding;

static void add(const adding *a, int level, uint32_t x, uint32_t y, double u, double v, double half)
{
	const rbf_division *d = a->division;
	const uint16_t part = d->part[level][y << level | x];
	if (part == RBF_DIVISION_MIXED) {
		for (uint32_t n = 0; n < 4; n++)
			add(a, level + 1, 2*x + (n & 1), 2*y + (n >> 1), u + (n & 1 ? half : -half) / 2, v + (n >> 1 ? half : -half) / 2, half / 2);
		return;
	}
	const double area = a->share * RBF_PI / (double)(1u << 2 * level);
	for (uint32_t c = 0; c < a->channels; c++) {
		const plane *f = &a->f[c];
		a->sum[c * (size_t)d->parts + part] += area * (f->mean + u * f->du + v * (f->dv + u * f->duv));
	}
}

void rbf_division_add(const rbf_division *division, const rbf_exitant_leaf *leaf, uint32_t channels, double share, double *sum)
{
	adding a = {.division = division, .channels = channels, .share = share, .sum = sum};
	const double scale = sqrt(3.); /* the leaf's Gauss points lie at 1 / sqrt(3) */
	for (uint32_t c = 0; c < channels; c++) {
		const double v0 = (double)leaf->value[0][c], v1 = (double)leaf->value[1][c], v2 = (double)leaf->value[2][c],
			v3 = (double)leaf->value[3][c];
		a.f[c] = (plane){.25 * (v0 + v1 + v2 + v3), .25 * scale * (v1 + v3 - v0 - v2), .25 * scale * (v2 + v3 - v0 - v1),
			.25 * scale * scale * (v0 + v3 - v1 - v2)};
	}
	add(&a, leaf->level, leaf->x, leaf->y, 0, 0, 1);
}
