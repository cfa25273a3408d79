/* SPDX-License-Identifier: BSD-3-Clause */
#include "clones.h"
#include "dhr_grid.h"

#include <string.h>

/* Cell that holds u, of `cells`, and the rest; also for what is not a number. */
static inline uint32_t cell_of(float u, uint32_t cells, float *rest)
{
	const float most = (float)cells, low = rbf_max(u, 0.f), at = rbf_min(low, most);
	const uint32_t whole = (uint32_t)(int32_t)at, cell = whole < cells ? whole : cells - 1;
	*rest = at - (float)cell;
	return cell;
}

static inline float number(uint16_t node)
{
	return (float)(int32_t)(node & ~RBF_DHR_MARK);
}

static inline float unit_of(const rbf_component *c, uint32_t channel)
{
	float unit;
	memcpy(&unit, &c->dhr_unit[channel], sizeof unit);
	return unit;
}

/* channels: those of the component, a constant where it is inlined */
static inline __attribute__((always_inline)) int along_line(const rbf_component *c, uint32_t channels, const float incident[3], float value[3])
{
	float t;
	const uint32_t cells = c->dhr_cells;
	const uint32_t cell = cell_of(sqrtf(rbf_max(1 - incident[2], 0.f)) * (float)cells, cells, &t);
	const uint16_t *a = c->dhr_grid + (size_t)cell * channels, *b = a + channels;
	for (uint32_t n = 0; n < channels; n++)
		value[n] = unit_of(c, n) * (number(a[n]) * (1 - t) + number(b[n]) * t);
	return !(a[0] & RBF_DHR_MARK);
}

static inline __attribute__((always_inline)) int on_disc(const rbf_component *c, uint32_t channels, const float incident[3], float value[3])
{
	float d[3], x, y;
	const uint32_t columns = rbf_dhr_columns(c), rows = rbf_dhr_rows(c);
	const float step = (float)c->dhr_cells / sqrtf(1 + incident[2]);
	rbf_mirror((unsigned)rbf_symmetry_fold(c->mesh.symmetry, incident), incident, d);
	const uint32_t column = cell_of(d[0] * step + (float)rbf_dhr_before_x(c), columns, &x);
	const uint32_t row = cell_of(d[1] * step + (float)rbf_dhr_before_y(c), rows, &y);
	const uint16_t *a = c->dhr_grid + ((size_t)row * (columns + 1) + column) * channels, *b = a + (size_t)(columns + 1) * channels;
	for (uint32_t n = 0; n < channels; n++) {
		const float low = number(a[n]) * (1 - x) + number(a[n + channels]) * x, high = number(b[n]) * (1 - x) + number(b[n + channels]) * x;
		value[n] = unit_of(c, n) * (low * (1 - y) + high * y);
	}
	return !(a[0] & RBF_DHR_MARK);
}

RBF_CLONES static int look_up(const rbf_component *c, const float incident[3], float value[3])
{
	if (c->mesh.symmetry == RBF_ISOTROPIC)
		return c->channels == 1 ? along_line(c, 1, incident, value) : along_line(c, 3, incident, value);
	return c->channels == 1 ? on_disc(c, 1, incident, value) : on_disc(c, 3, incident, value);
}

int rbf_dhr_from_grid(const rbf_component *c, const float incident[3], float value[3])
{
	return look_up(c, incident, value);
}
