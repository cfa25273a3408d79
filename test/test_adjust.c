/* SPDX-License-Identifier: BSD-3-Clause */
/* Reversing a sample and culling samples near grazing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "measure.h"

#define RADIANS (3.14159265358979323846 / 180)

static void direction(double theta, double phi, double d[3])
{
	d[0] = sin(theta * RADIANS) * cos(phi * RADIANS);
	d[1] = sin(theta * RADIANS) * sin(phi * RADIANS);
	d[2] = cos(theta * RADIANS);
}

/* Incident at (theta, phi), outgoing at 10, 20 .. 80 degrees on both sides, values that count. */
static void add(bsdfrbf_context *context, bsdfrbf_data *data, double theta, double phi)
{
	double incident[3], outgoing[16][3], values[16][3];
	direction(theta, phi, incident);
	for (int k = 0; k < 16; k++) {
		direction(k < 8 ? 10 * (k + 1) : 180 - 10 * (k - 7), 30, outgoing[k]);
		for (int c = 0; c < 3; c++)
			values[k][c] = 1 + k + 100 * c;
	}
	assert_int_equal(bsdfrbf_data_add(context, data, incident, 16, outgoing[0], values[0], 3, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
}

static void reverse(void **unused)
{
	(void)unused;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	add(context, data, 40, 25);
	assert_int_equal(data->component[BSDFRBF_RF].count, 1);
	assert_int_equal(data->component[BSDFRBF_TF].count, 1);
	bsdfrbf_data_reverse(data);
	assert_int_equal(data->component[BSDFRBF_RF].count, 0);
	assert_int_equal(data->component[BSDFRBF_TF].count, 0);
	const rbf_measured *rb = &data->component[BSDFRBF_RB], *tb = &data->component[BSDFRBF_TB];
	assert_int_equal(rb->count, 1);
	assert_int_equal(tb->count, 1);
	double incident[3], outgoing[3];
	direction(40, 180 - 25, incident);
	direction(30, 180 - 30, outgoing);
	for (int x = 0; x < 3; x++) {
		assert_true(fabs(rb->incidence->direction[x] - incident[x]) < 1e-12);
		assert_true(fabs(rb->incidence->outgoing[3 * 2 + x] - outgoing[x]) < 1e-12);
	}
	assert_true(rb->incidence->dsf[3 * 2] == 3 && tb->incidence->dsf[3 * 2] == 11);

	double before[3];
	memcpy(before, rb->incidence->direction, sizeof before);
	bsdfrbf_data_reverse(data);
	bsdfrbf_data_reverse(data); /* twice is not at all */
	assert_memory_equal(before, data->component[BSDFRBF_RB].incidence->direction, sizeof before);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

static void cull(void **unused)
{
	(void)unused;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	add(context, data, 40, 25);
	add(context, data, 65, 25);
	size_t removed = 99;
	assert_int_equal(bsdfrbf_data_cull(context, data, 5, &removed), BSDFRBF_OK);
	assert_int_equal(removed, 0);
	assert_int_equal(bsdfrbf_data_cull(context, data, 10, &removed), BSDFRBF_OK); /* just at the limit: stays */
	assert_int_equal(removed, 0);
	assert_int_equal(bsdfrbf_data_cull(context, data, 85, &removed), BSDFRBF_ERR_DATA); /* nothing would be left */
	assert_int_equal(removed, 0);
	assert_non_null(strstr(bsdfrbf_message(context), "85"));
	assert_int_equal(data->component[BSDFRBF_RF].incidence[0].count, 8);
	assert_int_equal(bsdfrbf_data_cull(context, data, 91, NULL), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_cull(context, data, NAN, NULL), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_cull(context, NULL, 5, NULL), BSDFRBF_ERR_ARGUMENT);

	/* automatic: 25 degrees, by the incidence at 65; 70 and 80 degrees go, on both sides, in both incidences */
	assert_int_equal(bsdfrbf_data_cull(context, data, -1, &removed), BSDFRBF_OK);
	assert_int_equal(removed, 8);
	for (int c = 0; c < 4; c += 2)
		for (int i = 0; i < 2; i++) {
			const rbf_incidence *incidence = &data->component[c].incidence[i];
			assert_int_equal(incidence->count, 6);
			assert_true(fabs(incidence->outgoing[3 * 5 + 2] - cos(60 * RADIANS)) < 1e-12);
			assert_true(incidence->dsf[3 * 5 + 1] == (c == BSDFRBF_RF ? 106 : 114));
		}
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(reverse), cmocka_unit_test(cull)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
