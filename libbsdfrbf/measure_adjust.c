/* SPDX-License-Identifier: BSD-3-Clause */
/* What a user may have done to samples before they are fitted: options -t and -g of pabopto2bsdf(1). */
#include "measure.h"

#include <math.h>

#define DEGREES (180 / 3.14159265358979323846)

static double elevation_deg(const double d[3])
{
	return DEGREES * atan2(fabs(d[2]), hypot(d[0], d[1]));
}

void bsdfrbf_data_reverse(bsdfrbf_data *data)
{
	if (!data)
		return;
	/* Half turn about y: (x, y, z) -> (-x, y, -z). Components keep their vectors with z > 0, so the sign of z
	 * becomes the exchange of front and back. */
	for (int c = 0; c < 4; c += 2) {
		const rbf_measured front = data->component[c];
		data->component[c] = data->component[c + 1];
		data->component[c + 1] = front;
	}
	for (int c = 0; c < 4; c++)
		for (size_t i = 0; i < data->component[c].count; i++) {
			rbf_incidence *incidence = &data->component[c].incidence[i];
			incidence->direction[0] = -incidence->direction[0];
			for (size_t k = 0; k < incidence->count; k++)
				incidence->outgoing[3 * k] = -incidence->outgoing[3 * k];
			for (size_t k = 0; k < incidence->lobes; k++)
				incidence->lobe[k].centre[0] = -incidence->lobe[k].centre[0];
		}
}

/* The limit for one component, slightly lowered so that a sample at the very limit stays, whatever the rounding. */
static double limit_of(const rbf_measured *measured, double limit_deg)
{
	if (limit_deg < 0) {
		limit_deg = 90;
		for (size_t i = 0; i < measured->count; i++)
			limit_deg = fmin(limit_deg, elevation_deg(measured->incidence[i].direction));
	}
	return limit_deg - 1e-6;
}

static size_t kept(const rbf_incidence *incidence, double limit_deg)
{
	size_t count = 0;
	for (size_t k = 0; k < incidence->count; k++)
		count += elevation_deg(incidence->outgoing + 3 * k) >= limit_deg;
	return count;
}

bsdfrbf_status bsdfrbf_data_cull(bsdfrbf_context *context, bsdfrbf_data *data, double limit_deg, size_t *removed)
{
	if (removed)
		*removed = 0;
	if (!data || !(limit_deg <= 90))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "the limit to grazing must be an angle of 0 to 90 degrees");
	for (int c = 0; c < 4; c++) {
		const rbf_measured *measured = &data->component[c];
		const double limit = limit_of(measured, limit_deg);
		if (measured->ready)
			return rbf_fail(context, BSDFRBF_ERR_DATA, "%s comes from a finished interpolant (.sir): it has no samples of which some "
				"could be left out; omit the limit to grazing, or give the measurements", rbf_component_name(c));
		for (size_t i = 0; i < measured->count; i++) {
			const double *d = measured->incidence[i].direction;
			if (measured->incidence[i].count && !kept(&measured->incidence[i], limit))
				return rbf_fail(context, BSDFRBF_ERR_DATA, "%s, incidence at theta %.2f, phi %.2f: every sample is "
					"nearer than %.2f degrees to grazing; give a smaller limit", rbf_component_name(c),
					90 - elevation_deg(d), DEGREES * atan2(d[1], d[0]), limit + 1e-6);
		}
	}
	size_t total = 0;
	for (int c = 0; c < 4; c++) {
		const rbf_measured *measured = &data->component[c];
		const double limit = limit_of(measured, limit_deg);
		for (size_t i = 0; i < measured->count; i++) {
			rbf_incidence *incidence = &measured->incidence[i];
			size_t to = 0;
			for (size_t from = 0; from < incidence->count; from++) {
				if (elevation_deg(incidence->outgoing + 3 * from) < limit)
					continue;
				for (int x = 0; x < 3; x++)
					incidence->outgoing[3 * to + (size_t)x] = incidence->outgoing[3 * from + (size_t)x];
				for (int x = 0; x < data->channels; x++)
					incidence->dsf[to * (size_t)data->channels + (size_t)x] =
						incidence->dsf[from * (size_t)data->channels + (size_t)x];
				to++;
			}
			total += incidence->count - to;
			incidence->count = to;
		}
	}
	if (removed)
		*removed = total;
	return BSDFRBF_OK;
}
