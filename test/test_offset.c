/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples that are turned on their mount, and incident azimuths counted from elsewhere, are told by how much; also those counted from the other side, or
 * the other way round. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"

static double turned, turned_incidence; /* degrees, from the instrument's frame to the material's */
static int clockwise;                   /* so incident azimuths are counted */
static const struct material *material;
static char last_warning[600], last_question[600];

static void turn(double degrees, const double d[3], double out[3])
{
	const double c = cos(degrees * DEGREE), s = sin(degrees * DEGREE), x = d[0], y = d[1];
	out[0] = c * x - s * y;
	out[1] = s * x + c * y;
	out[2] = d[2];
}

static void turned_material(const double in[3], const double out[3], double xyz[3])
{
	double o[3];
	const double counted[3] = {in[0], clockwise ? -in[1] : in[1], in[2]};
	double i[3];
	turn(turned + turned_incidence, counted, i);
	turn(turned, out, o);
	material->f(i, o, xyz);
}

static int turned_beams(const double in[3], double beam[][3])
{
	const double counted[3] = {in[0], clockwise ? -in[1] : in[1], in[2]};
	double i[3];
	turn(turned + turned_incidence, counted, i);
	const int count = material->beams(i, beam);
	for (int b = 0; b < count; b++)
		turn(-turned, beam[b], beam[b]);
	return count;
}

static void keep_warning(void *user, const char *text)
{
	(void)user;
	if (strstr(text, "differ from their images by"))
		snprintf(last_warning, sizeof last_warning, "%s", text);
	if (strstr(text, "nearly all light"))
		snprintf(last_question, sizeof last_question, "%s", text);
}

/* Builds, with the warning kept; returns the status. */
static bsdfrbf_status build(const plan *p, char symmetry)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	material = material_find(p->material);
	bsdfrbf_data *data = fixture_data(context, turned_material, material->beams ? turned_beams : NULL, material->transmits, 1, p);
	bsdfrbf_build_options options;
	bsdfrbf_model *m;
	bsdfrbf_build_defaults(&options);
	options.lobes = p->lobes;
	options.symmetry = symmetry;
	last_warning[0] = last_question[0] = 0;
	bsdfrbf_set_warning(context, keep_warning, NULL);
	const bsdfrbf_status status = bsdfrbf_build(context, data, &options, &m);
	if (status != BSDFRBF_OK)
		print_message("%s\n", bsdfrbf_message(context));
	bsdfrbf_close(m);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return status;
}

static void the_turn_is_told(void **state)
{
	(void)state;
	static const plan quarter = {"brushed", 4, 7, {0, 25, 50, 75}, 0, 15, 100}, half = {"sawtooth", 4, 7, {0, 20, 40, 60}, 0, 30, 100},
		one = {"satin", 4, 1, {10, 30, 50, 70}, 0, 0, 100};
	static const struct { const plan *plan; double all, incidence; } of[] = {
		{&quarter, 0, 0}, {&quarter, 2, 0}, {&quarter, -1.5, 0}, {&quarter, 0, 2}, {&half, 1.5, 0}, {&half, 0, -2}, {&one, 0, 4}
	};
	for (size_t n = 0; n < sizeof of / sizeof *of; n++) {
		turned = of[n].all;
		turned_incidence = of[n].incidence;
		assert_int_equal(build(of[n].plan, 0), BSDFRBF_OK);
		print_message("%s turned by %g and %g: %s\n", of[n].plan->material, turned, turned_incidence, last_warning);
		if (turned == 0 && turned_incidence == 0) {
			assert_string_equal(last_warning, "");
			continue;
		}
		const char *key = turned_incidence == 0 ? "change #upphi by " : "change #inphi by ", *told = strstr(last_warning, key);
		assert_non_null(told);
		const double expected = turned_incidence == 0 ? -turned : turned_incidence, found = atof(told + strlen(key));
		if (!(fabs(found - expected) <= .2))
			fail_msg("%.1f instead of %.1f", found, expected);
	}
}

/* No turn makes a mirror image of what has no mirror plane. */
static void no_turn_is_told(void **state)
{
	(void)state;
	static const plan askew = {"askew", 4, 7, {0, 25, 50, 75}, 0, 30, 80};
	turned = turned_incidence = 0;
	for (const char *symmetry = "BU"; *symmetry; symmetry++) {
		assert_int_equal(build(&askew, *symmetry), BSDFRBF_OK);
		print_message("askew as %c: %s\n", *symmetry, last_warning);
		assert_null(strstr(last_warning, "#upphi"));
		assert_null(strstr(last_warning, "#inphi"));
	}
}

/* What turns against the source, or goes back to it, is asked about. */
static void other_counts_are_told(void **state)
{
	(void)state;
	static const plan quarter = {"brushed", 4, 7, {0, 25, 50, 75}, 0, 15, 100}, one = {"varnish", 4, 1, {10, 30, 50, 70}, 0, 0, 100};
	turned = turned_incidence = 0;
	for (clockwise = 0; clockwise < 2; clockwise++) {
		assert_int_equal(build(&quarter, 0), BSDFRBF_OK);
		print_message("%s\n", last_question);
		assert_int_equal(strstr(last_question, "counted the other way round") != NULL, clockwise);
	}
	clockwise = 0;
	for (turned_incidence = 0; turned_incidence < 181; turned_incidence += 180) {
		assert_int_equal(build(&one, 0), BSDFRBF_OK);
		print_message("%s\n", last_question);
		assert_int_equal(strstr(last_question, "add 180 to #inphi") != NULL, turned_incidence > 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = { cmocka_unit_test(the_turn_is_told), cmocka_unit_test(no_turn_is_told), cmocka_unit_test(other_counts_are_told) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
