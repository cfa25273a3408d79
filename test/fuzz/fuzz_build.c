/* SPDX-License-Identifier: BSD-3-Clause */
/* From text to a recorded file and back: whatever the readers accept, the builder answers with a model that holds, or
 * with a status. Files of one sample are separated by a line "--- file". */
#include "fuzz.h"
#include "measure.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MOST_INCIDENCES 12 /* keeps an execution short */
#define MOST_SAMPLES 400
static const char separator[] = "--- file\n";


static int small_enough(const bsdfrbf_data *data)
{
	size_t incidences = 0, samples = 0;
	for (int c = 0; c < 4; c++)
		for (size_t i = 0; i < data->component[c].count; i++, incidences++)
			samples += data->component[c].incidence[i].count + data->component[c].incidence[i].lobes;
	return incidences <= MOST_INCIDENCES && samples <= MOST_SAMPLES;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	for (const uint8_t *at = bytes, *end = bytes + size; at < end;) {
		const uint8_t *next = memmem(at, (size_t)(end - at), separator, sizeof separator - 1);
		bsdfrbf_data_read(context, data, fuzz_file(at, (size_t)((next ? next : end) - at)));
		at = next ? next + sizeof separator - 1 : end;
	}
	bsdfrbf_build_options options;
	bsdfrbf_build_defaults(&options);
	options.threads = 1;
	bsdfrbf_model *model = NULL, *back = NULL;
	if (small_enough(data)) {
		const bsdfrbf_status status = bsdfrbf_build(context, data, &options, &model);
		if (status == BSDFRBF_OK ? !model : model || (status != BSDFRBF_ERR_DATA && status != BSDFRBF_ERR_UNSUPPORTED))
			fuzz_finding(bsdfrbf_message(context));
	}
	if (model) {
		static char path[64];
		snprintf(path, sizeof path, "/dev/shm/rbf-fuzz-%d", (int)getpid());
		fuzz_look(model, 1);
		if (bsdfrbf_save(context, model, path) != BSDFRBF_OK || bsdfrbf_open(context, path, &back) != BSDFRBF_OK)
			fuzz_finding(bsdfrbf_message(context));
		remove(path);
		bsdfrbf_close(back);
		bsdfrbf_close(model);
	}
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return 0;
}
