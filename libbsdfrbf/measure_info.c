/* SPDX-License-Identifier: BSD-3-Clause */
/* Measurements read back, for reports and tools. */
#include "scan_lines.h"
#include "seen.h"

#include <string.h>

int bsdfrbf_data_channels(const bsdfrbf_data *data)
{
	return data ? data->channels : 0;
}

size_t bsdfrbf_data_incidences(const bsdfrbf_data *data, bsdfrbf_component component)
{
	return data && (unsigned)component < 4 ? data->component[component].count : 0;
}

bsdfrbf_status bsdfrbf_data_get(const bsdfrbf_data *data, bsdfrbf_component component, size_t index, bsdfrbf_samples *samples)
{
	if (!samples || index >= bsdfrbf_data_incidences(data, component))
		return BSDFRBF_ERR_ARGUMENT;
	const rbf_incidence *incidence = data->component[component].incidence + index;
	memcpy(samples->direction, incidence->direction, sizeof samples->direction);
	samples->count = incidence->count;
	samples->outgoing = incidence->outgoing;
	samples->dsf = incidence->dsf;
	return BSDFRBF_OK;
}

int bsdfrbf_data_in_plane(const bsdfrbf_data *data, bsdfrbf_component component, size_t index)
{
	double normal[3];
	return index < bsdfrbf_data_incidences(data, component) && rbf_scan_plane(data->component[component].incidence + index, normal);
}

double bsdfrbf_data_unmeasured(const bsdfrbf_data *data, bsdfrbf_component component, size_t index)
{
	rbf_seen seen;
	if (index >= bsdfrbf_data_incidences(data, component) || data->component[component].ready)
		return 0;
	const double share = rbf_seen_make(data->component[component].incidence + index, &seen) ? 0 : (double)seen.share;
	rbf_seen_free(&seen);
	return share;
}
