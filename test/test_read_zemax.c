/* SPDX-License-Identifier: BSD-3-Clause */
/* Zemax tabular BSDF text: where its angles point, what is not measured, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "measure.h"

#define BLOCK "Monochrome\nDataBegin\nTIS 0.1\n1 2 3\n1 4 5\n1 6 0\nDataEnd\n"
#define HEAD "# a comment\nSource\tMeasured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\n" \
	"SampleRotation 1\n0\n"
#define LISTS "AngleOfIncidence 1\n30\nScatterAzimuth 3\n0 90 180\nScatterRadial 3\n0 10 40\n\n"

typedef struct fixture {
	char path[64];
	bsdfrbf_context *context;
	bsdfrbf_data *data;
} fixture;

static int setup(void **state)
{
	fixture *f = calloc(1, sizeof *f);
	assert_non_null(f);
	strcpy(f->path, "/tmp/test_read_zemax.XXXXXX");
	const int file = mkstemp(f->path);
	assert_true(file >= 0);
	close(file);
	f->context = bsdfrbf_context_new();
	f->data = bsdfrbf_data_new(f->context);
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	fixture *f = *state;
	unlink(f->path);
	bsdfrbf_data_free(f->data);
	bsdfrbf_context_free(f->context);
	free(f);
	return 0;
}

static bsdfrbf_status read_text(fixture *f, const char *text)
{
	FILE *out = fopen(f->path, "wb");
	assert_non_null(out);
	fputs(text, out);
	assert_int_equal(fclose(out), 0);
	return bsdfrbf_data_read(f->context, f->data, f->path);
}

static void accept(fixture *f, const char *text)
{
	if (read_text(f, text))
		fail_msg("refused: %s", bsdfrbf_message(f->context));
}

/* The value (f, not DSF) of the sample at this direction, the sum if there are several; fails if there is none. */
static double value_at(const rbf_incidence *in, int channels, double theta, double phi)
{
	const double t = theta * M_PI / 180, p = phi * M_PI / 180;
	const double d[3] = {sin(t) * cos(p), sin(t) * sin(p), cos(t)};
	double value = 0;
	int found = 0;
	for (size_t i = 0; i < in->count; i++) {
		const double *o = in->outgoing + 3 * i;
		if (fabs(o[0] - d[0]) + fabs(o[1] - d[1]) + fabs(o[2] - d[2]) < 1e-6) {
			value += in->dsf[(size_t)channels * i] / o[2];
			found = 1;
		}
	}
	assert_true(found);
	return value;
}

static void about(double value, double wanted)
{
	assert_true(fabs(value - wanted) < 1e-5 * wanted);
}

/* Light from -Y at rotation 0; azimuth 0 points from the specular beam (theta 30, phi 90) to the normal. */
static void angles_about_the_specular_beam(void **state)
{
	fixture *f = *state;
	accept(f, HEAD LISTS BLOCK);
	assert_int_equal(f->data->component[BSDFRBF_RF].count, 1);
	const rbf_incidence *in = f->data->component[BSDFRBF_RF].incidence;
	assert_true(fabs(in->direction[0]) < 1e-12 && fabs(in->direction[1] + .5) < 1e-12);
	about(value_at(in, 1, 30, 90), 1);
	about(value_at(in, 1, 20, 90), 2);
	about(value_at(in, 1, 10, 270), 3); /* beyond the normal */
	about(value_at(in, 1, 40, 90), 6);
	assert_int_equal(in->count, 1 + 1 + 1 + 2 + 2 + 1); /* mirrored at azimuth 90; the zero left out */
	double across = 0;
	for (size_t i = 0; i < in->count; i++)
		across += in->outgoing[3 * i];
	assert_true(fabs(across) < 1e-12);
}

/* Azimuth grows counter-clockwise for who looks into the beam: at normal incidence, as seen from above. */
static void sense_of_azimuth_and_rotation(void **state)
{
	fixture *f = *state;
	accept(f, "Source Measured\nSymmetry Asymmetrical4D\nSpectralContent Monochrome\nScatterType BRDF\nSampleRotation 3\n"
		"0 90 360\nAngleOfIncidence 2\n0 45\nScatterAzimuth 4\n0 90 270 360\nScatterRadial 2\n0 10\n\nMonochrome\nDataBegin\n"
		"1 2\n1 3\n1 4\n1 2\n" "1 5\n1 6\n1 7\n1 5\n" "1 8\n1 9\n1 0\n1 8\n" "1 10\n1 11\n1 12\n1 10\n"
		"9 9\n9 9\n9 9\n9 9\n" "9 9\n9 9\n9 9\n9 9\n" "DataEnd\n");
	const rbf_measured *rf = &f->data->component[BSDFRBF_RF];
	assert_int_equal(rf->count, 3); /* normal, from -Y, and from -X after a quarter turn of the sample */
	assert_true(rf->incidence[0].direction[2] == 1);
	assert_int_equal(rf->incidence[0].count, 4 + 3);
	about(value_at(&rf->incidence[0], 1, 10, 0), 3); /* light from -Y, azimuth 0 points to -Y: 90 is +X */
	about(value_at(&rf->incidence[0], 1, 10, 180), 4 + 8);
	about(value_at(&rf->incidence[0], 1, 10, 270), 2 + 9);
	assert_true(fabs(rf->incidence[1].direction[1] + sqrt(.5)) < 1e-9);
	assert_true(fabs(rf->incidence[2].direction[0] + sqrt(.5)) < 1e-9);
	about(value_at(&rf->incidence[2], 1, 35, 0), 10);
}

static void transmission_and_colour(void **state)
{
	fixture *f = *state;
	accept(f, "Source Measured\nSymmetry Asymmetrical\nSpectralContent XYZ\nScatterType BTDF\nSampleRotation 1\n0\n" LISTS
		"TristimulusX\nDataBegin\nTIS 1\n1 0 3\n1 4 5\n1 6 7\nDataEnd\n"
		"TristimulusY\nDataBegin\nTIS 1\n1 0 3\n1 4 5\n1 6 7\nDataEnd\n"
		"Tristimulus Z\nDataBegin\nTIS 1\n1 0 3\n1 4 5\n1 6 7\nDataEnd\n");
	assert_int_equal(f->data->channels, 3);
	const rbf_incidence *in = f->data->component[BSDFRBF_TF].incidence;
	assert_int_equal(f->data->component[BSDFRBF_TF].count, 1);
	about(value_at(in, 3, 30, 90), 1);
	about(value_at(in, 3, 10, 270), 3);
	about(value_at(in, 3, 40, 90), 6);
	assert_int_equal(in->count, 6);
}

static void refusals(void **state)
{
	static const struct { const char *text, *words; bsdfrbf_status status; } cases[] = {
		{HEAD LISTS, "the file ends where a block of data should follow", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\nTIS 0.1\n1 2 3\n1 4", ":19: fewer than the 3 values", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\nTIS 0.1\n1 2 3\n1 4 5\n", "the file ends where a row", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 3\n1 4 5\n1 6 0.0", "where DataEnd should", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 3\n1 4 5\nDataEnd\n", "table 1 of 1 has 2 rows, but ScatterAzimuth announces 3",
			BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 3\n1 4 5\n1 6 7\n1 8 9\n", "DataEnd is missing", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 nan\n", ":17: value is 'nan'", BSDFRBF_ERR_DATA},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 1e30\n", ":17: value '1e30'", BSDFRBF_ERR_DATA},
		{HEAD LISTS "Monochrome\nDataBegin\n1 2 3,5\n", ":17: value is '3,5': write", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "Monochrome\nDataBegin\n0 0 0\n0 0 0\n0 0 0\nDataEnd\n", "all values are zero", BSDFRBF_ERR_DATA},
		{HEAD LISTS BLOCK BLOCK, "appears twice", BSDFRBF_ERR_SYNTAX},
		{HEAD LISTS "TristimulusY\n", "does not fit SpectralContent", BSDFRBF_ERR_SYNTAX},
		{HEAD BLOCK, "the header lacks AngleOfIncidence", BSDFRBF_ERR_SYNTAX},
		{"Source Measured\n" LISTS BLOCK, "the header lacks Symmetry", BSDFRBF_ERR_SYNTAX},
		{HEAD "AngleOfIncidence 1\n90\nScatterAzimuth 1\n0\nScatterRadial 1\n0\n" BLOCK, "AngleOfIncidence is outside",
			BSDFRBF_ERR_DATA},
		{HEAD "AngleOfIncidence 99999999999\n1\n", "number of angles, 1 to", BSDFRBF_ERR_SYNTAX},
		{HEAD "AngleOfIncidence 2\n1 2 3\n", "more angles than announced", BSDFRBF_ERR_SYNTAX},
		{HEAD "AngleOfIncidence 2\n1\nScatterAzimuth 3\n", "AngleOfIncidence is 'ScatterAzimuth': not a number",
			BSDFRBF_ERR_SYNTAX},
		{HEAD "Wavelength 650\n", "unknown keyword 'Wavelength'", BSDFRBF_ERR_SYNTAX},
		{"Source Measured\nSymmetry Odd\n", ":2: Symmetry 'Odd' is unknown", BSDFRBF_ERR_SYNTAX},
		{"Source Measured\nScatterType BSDF\n", "ScatterType 'BSDF' is unknown", BSDFRBF_ERR_SYNTAX}};
	fixture *f = *state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		assert_int_equal(read_text(f, cases[i].text), cases[i].status);
		if (!strstr(bsdfrbf_message(f->context), cases[i].words))
			fail_msg("\"%s\" lacks \"%s\"", bsdfrbf_message(f->context), cases[i].words);
		assert_int_equal(f->data->channels, 0);
		assert_null(f->data->source);
	}
}

/* ------------------------------------------------- files that nobody here made */

static int shared(char path[512], const char *name)
{
	const char *folder = getenv("SHARED_DIR");
	snprintf(path, 512, "%.400s/data/rt300s/%s", folder ? folder : "../shared", name);
	if (access(path, R_OK)) {
		print_message("%s is not here\n", path);
		return 0;
	}
	return 1;
}

/* The same measurement in both formats, converted by others: every sample must be found in the other one. */
static void agrees_with_the_converted_steel(void **state)
{
	static const char *const part[4] = {"AnoBlackNiTEonSteel_t10.dat", "AnoBlackNiTEonSteel_t30.dat",
		"AnoBlackNiTEonSteel_t50.dat", "AnoBlackNiTEonSteel_t70.dat"};
	fixture *f = *state;
	bsdfrbf_data *converted = bsdfrbf_data_new(f->context);
	char path[512];
	int here = shared(path, "AnoBlackNiTEonSteel.bsdf");
	if (here)
		assert_int_equal(bsdfrbf_data_read(f->context, f->data, path), BSDFRBF_OK);
	for (int i = 0; i < 4 && here; i++) {
		here = shared(path, part[i]);
		if (here)
			assert_int_equal(bsdfrbf_data_read(f->context, converted, path), BSDFRBF_OK);
	}
	const rbf_measured *a = &f->data->component[BSDFRBF_RF], *b = &converted->component[BSDFRBF_RF];
	for (size_t i = 0; i < 4 && here; i++) {
		assert_int_equal(a->count, 4);
		assert_int_equal(b->count, 4);
		assert_int_equal(a->incidence[i].count, b->incidence[i].count);
		for (int k = 0; k < 3; k++)
			assert_true(fabs(a->incidence[i].direction[k] - b->incidence[i].direction[k]) < 1e-9);
		for (size_t k = 0; k < a->incidence[i].count; k++) {
			const double *o = a->incidence[i].outgoing + 3 * k;
			size_t found = 0;
			for (size_t l = 0; l < b->incidence[i].count; l++) {
				const double *p = b->incidence[i].outgoing + 3 * l;
				const double far = hypot(hypot(o[0] - p[0], o[1] - p[1]), o[2] - p[2]);
				found += far < 2e-4 && fabs(a->incidence[i].dsf[k] / b->incidence[i].dsf[l] - 1) < 2e-3;
			}
			assert_int_equal(found, 1);
		}
	}
	bsdfrbf_data_free(converted);
	if (!here)
		skip();
}

static void reads_the_lenslet_array(void **state)
{
	fixture *f = *state;
	char path[512];
	if (!shared(path, "IMX455.bsdf"))
		skip();
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, path), BSDFRBF_OK);
	assert_int_equal(f->data->component[BSDFRBF_RF].count, 36 * 4); /* rotation 360 repeats 0 */
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {TEST(angles_about_the_specular_beam), TEST(sense_of_azimuth_and_rotation),
		TEST(transmission_and_colour), TEST(refusals), TEST(agrees_with_the_converted_steel), TEST(reads_the_lenslet_array)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
