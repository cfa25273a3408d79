/* SPDX-License-Identifier: BSD-3-Clause */
/* The readers of measurements: all or nothing, and what was accepted is finite and in its half space. */
#include "fuzz.h"
#include "measure.h"

#include <math.h>

static size_t samples(const bsdfrbf_data *data)
{
	size_t count = 0;
	for (int c = 0; c < 4; c++)
		for (size_t i = 0; i < data->component[c].count; i++) {
			const rbf_incidence *in = &data->component[c].incidence[i];
			if (!(in->direction[2] > 0))
				fuzz_finding("an incidence below the surface");
			for (size_t k = 0; k < in->count; k++)
				if (!(in->outgoing[3 * k + 2] > 0))
					fuzz_finding("a sample below the surface");
			for (size_t k = 0; k < in->count * (size_t)data->channels; k++)
				if (!isfinite(in->dsf[k]))
					fuzz_finding("a sample that is not finite");
			for (size_t k = 0; k < in->lobes; k++) {
				const rbf_ready_lobe *lobe = &in->lobe[k];
				if (!(lobe->centre[2] >= 0) || !(lobe->kappa > 0) || !isfinite(lobe->kappa))
					fuzz_finding("a lobe below the surface, or without a width");
				for (int a = 0; a < data->channels; a++)
					if (!isfinite(lobe->dsf[a]) || lobe->dsf[a] < 0)
						fuzz_finding("a lobe that is negative or not finite");
			}
			count += in->count + in->lobes;
		}
	return count;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	const char *path = fuzz_file(bytes, size);
	/* twice: the second reading merges with the first, or is refused where the first was a finished interpolant */
	for (int i = 0; i < 2; i++) {
		const size_t before = samples(data);
		const bsdfrbf_status status = bsdfrbf_data_read(context, data, path);
		if (status != BSDFRBF_OK && (samples(data) != before || !bsdfrbf_message(context)[0]))
			fuzz_finding("a refused file left something, or no message");
		if (status == BSDFRBF_OK && samples(data) == before)
			fuzz_finding("an accepted file added nothing");
		if (status == BSDFRBF_ERR_INTERNAL || status == BSDFRBF_ERR_ARGUMENT)
			fuzz_finding(bsdfrbf_message(context));
	}
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return 0;
}
