/* SPDX-License-Identifier: BSD-3-Clause */
/* A build that leaves out faults of the measurement, and says so. */
#ifndef TEST_SPOILT_H
#define TEST_SPOILT_H
#include "bsdfrbf.h"

typedef struct spoilt_warning {
	const char *as;   /* how the warning says it: "they count as .., and are left out" */
	int warned;
} spoilt_warning;

static void note_left_out(void *user, const char *text)
{
	spoilt_warning *l = user;
	l->warned |= strstr(text, l->as) != NULL;
}

/* DHR of a model of front reflection; told: whether a warning and the text `key` have to say that something was left out. Frees the data. */
static float dhr_without(bsdfrbf_data *data, const char *as, const char *key, int told)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	spoilt_warning l = {as, 0};
	bsdfrbf_build_options options;
	bsdfrbf_model *model;
	float dhr;
	bsdfrbf_build_defaults(&options);
	options.symmetry = 'I';
	options.lobes = 60;
	bsdfrbf_set_warning(context, note_left_out, &l);
	assert_int_equal(bsdfrbf_build(context, data, &options, &model), BSDFRBF_OK);
	assert_int_equal(l.warned, told);
	assert_int_equal(strncmp(bsdfrbf_get_text(model, key), "front reflection (rf) ", 22) == 0, told);
	bsdfrbf_dhr(model, (float[3]){.3f, 0, .954f}, 0, &dhr);
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return dhr;
}
#endif
