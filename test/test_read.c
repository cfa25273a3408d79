/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading of measurement files: what must be accepted, with the right result, and what must be refused, with file,
 * line and remedy. Every input is written here, to a folder of its own. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "measure.h"
#include "text.h"

#define HEAD "#format: theta phi BRDF\n#upphi 90\n#intheta 30\n#inphi 180\n"
#define ROWS "0 0 1\n10 0 2\n20 90 3\n30 180 4\n40 270 5\n50 10 6\n60 20 7\n70 30 8\n80 40 9\n5 5 1\n"

typedef struct fixture {
	char folder[64], path[96];
	bsdfrbf_context *context;
	bsdfrbf_data *data;
	int warnings;
	char warning[512];
} fixture;

static void warned(void *user, const char *text)
{
	fixture *f = user;
	f->warnings++;
	snprintf(f->warning, sizeof f->warning, "%s", text);
}

static int setup(void **state)
{
	fixture *f = calloc(1, sizeof *f);
	assert_non_null(f);
	strcpy(f->folder, "/tmp/test_read.XXXXXX");
	assert_non_null(mkdtemp(f->folder));
	snprintf(f->path, sizeof f->path, "%s/in.dat", f->folder);
	f->context = bsdfrbf_context_new();
	bsdfrbf_set_warning(f->context, warned, f);
	f->data = bsdfrbf_data_new(f->context);
	*state = f;
	return 0;
}

static int teardown(void **state)
{
	fixture *f = *state;
	unlink(f->path);
	rmdir(f->folder);
	bsdfrbf_data_free(f->data);
	bsdfrbf_context_free(f->context);
	free(f);
	return 0;
}

static void write_bytes(fixture *f, const char *bytes, size_t count)
{
	FILE *out = fopen(f->path, "wb");
	assert_non_null(out);
	assert_int_equal(fwrite(bytes, 1, count, out), count);
	assert_int_equal(fclose(out), 0);
}

static bsdfrbf_status read_text(fixture *f, const char *text)
{
	write_bytes(f, text, strlen(text));
	return bsdfrbf_data_read(f->context, f->data, f->path);
}

static void accept(fixture *f, const char *text)
{
	const bsdfrbf_status status = read_text(f, text);
	if (status)
		fail_msg("refused: %s", bsdfrbf_message(f->context));
}

static size_t samples(const fixture *f)
{
	size_t count = 0;
	for (int c = 0; c < 4; c++)
		for (size_t i = 0; i < f->data->component[c].count; i++)
			count += f->data->component[c].incidence[i].count;
	return count;
}

/* Refused with this status and these words, and the data are as they were. */
static void refuse(fixture *f, const char *text, bsdfrbf_status status, const char *words)
{
	const size_t before = samples(f), files = f->data->files;
	const int channels = f->data->channels;
	assert_int_equal(read_text(f, text), status);
	const char *message = bsdfrbf_message(f->context);
	if (!strstr(message, words))
		fail_msg("\"%s\" lacks \"%s\"", message, words);
	assert_non_null(strstr(message, "in.dat"));
	assert_int_equal(samples(f), before);
	assert_int_equal(f->data->files, files);
	assert_int_equal(f->data->channels, channels);
}

static const rbf_incidence *only(const fixture *f, int component)
{
	assert_int_equal(f->data->component[component].count, 1);
	return f->data->component[component].incidence;
}

static void near_vector(const double *v, double x, double y, double z)
{
	assert_true(fabs(v[0] - x) < 1e-9 && fabs(v[1] - y) < 1e-9 && fabs(v[2] - z) < 1e-9);
}

/* ---------------------------------------------------------------- accepted */

static void plain(void **state)
{
	fixture *f = *state;
	accept(f, "#sample_name \"my sample\"\n" HEAD ROWS);
	const rbf_incidence *in = only(f, BSDFRBF_RF);
	near_vector(in->direction, -.5, 0, sqrt(.75));
	assert_int_equal(in->count, 10);
	near_vector(in->outgoing + 6, 0, sin(M_PI / 9), cos(M_PI / 9)); /* theta 20 phi 90: up */
	assert_true(fabs(in->dsf[2] - 3 * cos(M_PI / 9)) < 1e-6);
	assert_string_equal(f->data->name, "my sample");
	assert_string_equal(f->data->source, f->path);
	assert_int_equal(f->data->channels, 1);
	assert_int_equal(f->warnings, 0);
}

static void up_is_phi_zero_by_default(void **state)
{
	fixture *f = *state;
	accept(f, "#incident_angle 90.5 90\n#format: theta phi DSF\n" ROWS);
	/* phi 90 from up (+Y), counter-clockwise, is -X; theta beyond 90 is the back, and rows are transmitted */
	const rbf_incidence *in = only(f, BSDFRBF_TB);
	near_vector(in->direction, -sin(90.5 * M_PI / 180), 0, -cos(90.5 * M_PI / 180));
	near_vector(in->outgoing + 3, 0, sin(M_PI / 18), cos(M_PI / 18));
	assert_true(in->dsf[1] == 2);
}

static void header_spellings(void **state)
{
	static const char *const head[] = {
		"# intheta 30\n# inphi 180\n# upphi 90\n# format theta phi BRDF\n",
		"#InTheta: 30\n#INPHI: 180\n#UpPhi: 90\n#Format: Theta Phi brdf\n",
		"#intheta\t30\n#inphi\t-180\n#upphi\t90\n#format:\ttheta\tphi\tBSDF\n",
		"#intheta = 30 deg\n#inphi = 540\n#upphi=90\n#format: theta phi BTDF\n",
		"  # intheta 30.000\n#incident_angle 30 180\n#upphi -270\n#colorimetry: CIE-Y\n#format: theta phi BSDF\n"};
	for (size_t i = 0; i < sizeof head / sizeof *head; i++) {
		fixture *f;
		char text[1024];
		setup((void **)&f);
		snprintf(text, sizeof text, "%s%s", head[i], ROWS);
		accept(f, text);
		near_vector(only(f, BSDFRBF_RF)->direction, -.5, 0, sqrt(.75));
		assert_int_equal(samples(f), 10);
		teardown((void **)&f);
	}
	(void)state;
}

static void comments_and_empty_lines_between_rows(void **state)
{
	fixture *f = *state;
	accept(f, HEAD "0 0 1\n# pause\n\n10 0 2 # good\n   \t\n#\n##\n20 90 3\n#intheta 30\n" ROWS);
	assert_int_equal(samples(f), 13);
}

static void line_ends_and_blanks(void **state)
{
	fixture *f = *state;
	accept(f, "\xef\xbb\xbf#format: theta phi BRDF\r\n#upphi 90\r#intheta 30\r\n#inphi 180\r\n\r\n"
		"\t0\t0\t1\r\n  10 0   2  \r20 -90 3\r\n30 370 +4.0e0\r\n40 0 .5E+1\r\n50 0 5.d-1\r\n60 0 7.");
	const rbf_incidence *in = only(f, BSDFRBF_RF);
	assert_int_equal(in->count, 7);
	near_vector(in->outgoing + 6, 0, -sin(M_PI / 9), cos(M_PI / 9));
	near_vector(in->outgoing + 9, .5 * cos(M_PI / 18), .5 * sin(M_PI / 18), sqrt(.75));
	assert_true(fabs(in->dsf[6] - 3.5) < 1e-6);
	assert_string_equal(strrchr(f->warning, ':'), ": only 7 samples off the horizon");
}

/* As instruments that scan a plane write them: the other side of the normal. */
static void negative_theta(void **state)
{
	fixture *f = *state;
	accept(f, "#format: theta phi BRDF\n#upphi 90\n#intheta -30\n#inphi 0\n-10 0 2\n10 0 3\n-20 -90 4\n-170 0 5\n");
	const rbf_incidence *in = only(f, BSDFRBF_RF);
	near_vector(in->direction, -.5, 0, sqrt(.75));
	assert_int_equal(in->count, 3);
	near_vector(in->outgoing, -sin(M_PI / 18), 0, cos(M_PI / 18));
	near_vector(in->outgoing + 3, sin(M_PI / 18), 0, cos(M_PI / 18));
	near_vector(in->outgoing + 6, 0, sin(M_PI / 9), cos(M_PI / 9));
	near_vector(only(f, BSDFRBF_TF)->outgoing, -sin(M_PI / 18), 0, cos(M_PI / 18));
	accept(f, "#format: theta phi BRDF\n#upphi 90\n#incident_angle -120 180\n120 0 2\n");
	near_vector(only(f, BSDFRBF_RB)->direction, sqrt(.75), 0, .5);
}

static void both_sides_in_one_file(void **state)
{
	fixture *f = *state;
	accept(f, HEAD "0 0 1\n");
	assert_string_equal(strrchr(f->warning, ':'), ": only 1 sample off the horizon");
	bsdfrbf_data_free(f->data);
	f->data = bsdfrbf_data_new(f->context);
	accept(f, HEAD "10 0 2\n170 0 3\n90 0 4\n89.999 0 5\n");
	near_vector(only(f, BSDFRBF_RF)->outgoing, sin(M_PI / 18), 0, cos(M_PI / 18));
	near_vector(only(f, BSDFRBF_TF)->outgoing, sin(M_PI / 18), 0, cos(M_PI / 18));
	assert_int_equal(samples(f), 2); /* the horizon is neither side */
}

static void all_four_components(void **state)
{
	fixture *f = *state;
	accept(f, HEAD "10 0 2\n170 0 3\n");
	accept(f, "#format: theta phi DSF\n#incident_angle 150 0\n20 0 4\n160 0 5\n");
	for (int c = 0; c < 4; c++)
		assert_int_equal(only(f, c)->count, 1);
	assert_true(only(f, BSDFRBF_RB)->dsf[0] == 5 && only(f, BSDFRBF_TB)->dsf[0] == 4);
	bsdfrbf_data_reverse(f->data);
	assert_true(only(f, BSDFRBF_RF)->dsf[0] == 5 && only(f, BSDFRBF_TF)->dsf[0] == 4);
	near_vector(only(f, BSDFRBF_RB)->direction, .5, 0, sqrt(.75));
	near_vector(only(f, BSDFRBF_RB)->outgoing, -sin(M_PI / 18), 0, cos(M_PI / 18));
}

static void files_of_one_incidence_merge(void **state)
{
	fixture *f = *state;
	accept(f, HEAD ROWS);
	accept(f, "#format: theta phi BRDF\n#upphi 90\n#incident_angle 30.005 180.01\n" ROWS);
	assert_int_equal(only(f, BSDFRBF_RF)->count, 20);
	accept(f, "#format: theta phi BRDF\n#upphi 90\n#incident_angle 30.2 180\n" ROWS);
	assert_int_equal(f->data->component[BSDFRBF_RF].count, 2);
	assert_int_equal(f->data->files, 3);
}

static void normal_incidence_has_no_azimuth(void **state)
{
	fixture *f = *state;
	accept(f, "#format: theta phi BRDF\n#incident_angle 0.015 0\n" ROWS);
	accept(f, "#format: theta phi BRDF\n#incident_angle 0.015 180\n" ROWS);
	accept(f, "#format: theta phi BRDF\n#incident_angle 0 77\n" ROWS);
	near_vector(only(f, BSDFRBF_RF)->direction, 0, 0, 1);
	accept(f, "#format: theta phi BRDF\n#incident_angle 0.4 77\n" ROWS);
	assert_int_equal(f->data->component[BSDFRBF_RF].count, 2);
}

static void colour(void **state)
{
	fixture *f = *state;
	accept(f, "#colorimetry: CIE-XYZ\n" HEAD "0 0 1 2 3\n10 0 4 5 6\n");
	assert_int_equal(f->data->channels, 3);
	assert_true(only(f, BSDFRBF_RF)->dsf[2] == 3);
	refuse(f, HEAD ROWS, BSDFRBF_ERR_DATA, "one value (CIE Y) a sample, but three values (CIE X, Y, Z) in /tmp/");
}

static void phi_column_first(void **state)
{
	fixture *f = *state;
	accept(f, "#format: phi theta DSF\n#incident_angle 0 0\n#upphi 90\n90 20 1\n");
	near_vector(only(f, BSDFRBF_RF)->outgoing, 0, sin(M_PI / 9), cos(M_PI / 9));
}

static void long_lines_and_names(void **state)
{
	fixture *f = *state;
	const size_t length = 3000000;
	char *text = malloc(length + 1000);
	assert_non_null(text);
	strcpy(text, "#sample_name \"");
	memset(text + 14, 'x', length);
	strcpy(text + 14 + length, "\"\n" HEAD ROWS);
	accept(f, text);
	assert_int_equal(strlen(f->data->name), 1000);
	memset(text, '9', length); /* digits without end are a number, or beyond double: never a crash */
	text[length] = 0;
	double value;
	assert_int_equal(rbf_word_number((rbf_word){text, length}, &value), RBF_NUMBER_NOT_FINITE);
	free(text);
}

static void numbers(void **state)
{
	static const struct { const char *text; double value; } good[] = {{"0", 0}, {"-0.0", 0}, {"1", 1}, {"+1.5", 1.5},
		{".5", .5}, {"5.", 5}, {"1e-5", 1e-5}, {"123456789.125", 123456789.125}, {"1E3", 1000}, {"1D-2", .01},
		{"0.1", .1}, {"2.2250738585072014e-308", 2.2250738585072014e-308}, {"1e308", 1e308}, {"1e-400", 0},
		{"0.00000000000000000000000000000000000000012345", 1.2345e-40}, {"12345678901234567890123", 1.2345678901234568e22},
		{"0e999999999999", 0}};
	static const struct { const char *text; rbf_number_kind kind; } bad[] = {{"", RBF_NUMBER_NONE}, {"-", RBF_NUMBER_NONE},
		{".", RBF_NUMBER_NONE}, {"e5", RBF_NUMBER_NONE}, {"1e", RBF_NUMBER_NONE}, {"0x10", RBF_NUMBER_NONE},
		{"1.2.3", RBF_NUMBER_NONE}, {"1,5", RBF_NUMBER_COMMA}, {"1;", RBF_NUMBER_COMMA}, {"nan", RBF_NUMBER_NOT_FINITE},
		{"-NaN(1)", RBF_NUMBER_NOT_FINITE}, {"Infinity", RBF_NUMBER_NOT_FINITE}, {"1.#INF", RBF_NUMBER_NOT_FINITE},
		{"1e309", RBF_NUMBER_NOT_FINITE}};
	for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
		double value = -1;
		assert_int_equal(rbf_word_number((rbf_word){good[i].text, strlen(good[i].text)}, &value), RBF_NUMBER_OK);
		if (!(fabs(value - good[i].value) <= 4e-16 * fabs(good[i].value)))
			fail_msg("%s became %.17g", good[i].text, value);
	}
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		double value;
		assert_int_equal(rbf_word_number((rbf_word){bad[i].text, strlen(bad[i].text)}, &value), bad[i].kind);
	}
	(void)state;
}

static void odd_but_allowed(void **state)
{
	fixture *f = *state;
	accept(f, "#datapoints_in_file: 11\n" HEAD ROWS);
	assert_non_null(strstr(f->warning, "is the file complete?"));
	accept(f, HEAD "100 0 1\n110 0 2\n120 0 3\n130 0 4\n140 0 5\n150 0 6\n160 0 1\n170 0 1\n175 0 1\n180 0 1\n");
	assert_non_null(strstr(f->warning, "#format says BRDF, but all samples are on the transmitted side"));
}

/* ----------------------------------------------------------------- refused */

static void refusals(void **state)
{
	static const struct { const char *text, *words; bsdfrbf_status status; } cases[] = {
		{"", "the file is empty", BSDFRBF_ERR_SYNTAX},
		{HEAD, "only a header", BSDFRBF_ERR_SYNTAX},
		{"0 0 1\n", "in.dat:1: before the first row the header lacks #intheta #inphi #format", BSDFRBF_ERR_SYNTAX},
		{"#intheta 3\n#format: theta phi DSF\n0 0 1\n", "in.dat:3: before the first row the header lacks #inphi",
			BSDFRBF_ERR_SYNTAX},
		{HEAD "0 0 1\n0 0 nan\n", "in.dat:6: value is 'nan': not a finite number", BSDFRBF_ERR_DATA},
		{HEAD "0 0 -inf\n", "in.dat:5: value is '-inf'", BSDFRBF_ERR_DATA},
		{HEAD "nan 0 1\n", "in.dat:5: theta is 'nan'", BSDFRBF_ERR_DATA},
		{HEAD "0 0 1e30\n", "in.dat:5: value '1e30' is beyond 1e12", BSDFRBF_ERR_DATA},
		{HEAD "0 0 0,5\n", "in.dat:5: value is '0,5': write numbers with a decimal point", BSDFRBF_ERR_SYNTAX},
		{HEAD "10,20,0.5\n", "in.dat:5: theta is '10,20,0.5': write numbers with a decimal point", BSDFRBF_ERR_SYNTAX},
		{HEAD "10;20;0.5\n", "by commas or semicolons", BSDFRBF_ERR_SYNTAX},
		{HEAD "10, 20, 0.5\n", "by commas or semicolons", BSDFRBF_ERR_SYNTAX},
		{"#intheta 12,5\n" ROWS, "in.dat:1: intheta is '12,5': write", BSDFRBF_ERR_SYNTAX},
		{HEAD "0 0\n", "in.dat:5: 2 columns instead of 3", BSDFRBF_ERR_SYNTAX},
		{HEAD "0 0 1\n1 1 1 1 1\n", "in.dat:6: 5 columns instead of 3 (theta, phi, value): if the values are X, Y, Z, add",
			BSDFRBF_ERR_SYNTAX},
		{"#colorimetry: CIE-XYZ\n" HEAD "0 0 1\n", "3 columns instead of 5", BSDFRBF_ERR_SYNTAX},
		{"#colorimetry: RGB\n" HEAD ROWS, "in.dat:1: #colorimetry 'RGB' is unknown", BSDFRBF_ERR_SYNTAX},
		{"#format: theta phi lux\n", "in.dat:1: unknown #format", BSDFRBF_ERR_SYNTAX},
		{"#format: phi alpha DSF\n", "unknown #format", BSDFRBF_ERR_SYNTAX},
		{HEAD "-181 0 1\n", "in.dat:5: theta is '-181': outside -180 to 180 degrees", BSDFRBF_ERR_DATA},
		{HEAD "181 0 1\n", "theta is '181'", BSDFRBF_ERR_DATA},
		{HEAD "10 4000 1\n", "phi is '4000'", BSDFRBF_ERR_DATA},
		{HEAD "theta phi value\n" ROWS, "in.dat:5: the line begins with 'theta': not a number, and not with #", BSDFRBF_ERR_SYNTAX},
		{HEAD "0 0 1\n-- pause\n" ROWS, "in.dat:6: the line begins with '--': not a number, and not with #", BSDFRBF_ERR_SYNTAX},
		{"% ours\n" HEAD ROWS, "in.dat:1: the line begins with '%': not a number, and not with #", BSDFRBF_ERR_SYNTAX},
		{HEAD "0 x 1\n", "in.dat:5: phi is 'x': not a number", BSDFRBF_ERR_SYNTAX},
		{HEAD "90 0 1\n90 10 1\n", "all samples lie on the horizon", BSDFRBF_ERR_DATA},
		{"#format: theta phi DSF\n#incident_angle 90 0\n" ROWS, "in.dat:2: incident theta of 90", BSDFRBF_ERR_DATA},
		{"#format: theta phi DSF\n#incident_angle -190 0\n" ROWS, "in.dat:2: incident theta is outside", BSDFRBF_ERR_DATA},
		{"#intheta .5 rad\n", "in.dat:1: 'rad' after the value", BSDFRBF_ERR_SYNTAX},
		{"#inphi 1e5\n", "in.dat:1: inphi is '1e5': not an angle", BSDFRBF_ERR_DATA},
		{"#intheta\n", "in.dat:1: #intheta has no value", BSDFRBF_ERR_SYNTAX},
		{"#incident_angle 30\n", "in.dat:1: #incident_angle (phi) has no value", BSDFRBF_ERR_SYNTAX},
		{"#incident_angle 30 0\n#intheta 40\n", "in.dat:2: intheta differs from the one in line 1", BSDFRBF_ERR_SYNTAX},
		{HEAD ROWS "#intheta 40\n" ROWS, "in.dat:15: intheta differs from the one in line 3", BSDFRBF_ERR_SYNTAX},
		{"#format: theta phi DSF\n#incident_angle 30 0\n" ROWS "#upphi 90\n", "after the first row (line 3)",
			BSDFRBF_ERR_SYNTAX},
		{HEAD ROWS "#colorimetry: CIE-XYZ\n", "after the first row (line 5)", BSDFRBF_ERR_SYNTAX},
		{"\x8fRBF\r\n", "finished .rbf model", BSDFRBF_ERR_SYNTAX},
		{"#?RADIANCE\nSYMMETRY=0\n", "ends within its header", BSDFRBF_ERR_SYNTAX},
		{"\xef\xbb\xbf<?xml version=\"1.0\"?>\n", "this is XML", BSDFRBF_ERR_SYNTAX},
		{"PK\x03\x04", "spreadsheet or an archive", BSDFRBF_ERR_SYNTAX},
		{"\xff\xfe#", "UTF-16", BSDFRBF_ERR_SYNTAX},
		{"\x1f\x8b\x08", "compressed", BSDFRBF_ERR_SYNTAX},
		{"hello world\n", "not a Mountain file", BSDFRBF_ERR_SYNTAX}};
	fixture *f = *state;
	for (int filled = 0; filled < 2; filled++) {
		for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
			refuse(f, cases[i].text, cases[i].status, cases[i].words);
		accept(f, HEAD ROWS);
	}
}

static void nul_bytes(void **state)
{
	fixture *f = *state;
	write_bytes(f, HEAD "0 0 1\0\n", sizeof(HEAD "0 0 1\0\n") - 1);
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, f->path), BSDFRBF_ERR_SYNTAX);
	assert_non_null(strstr(bsdfrbf_message(f->context), "binary"));
	/* beyond what is looked at for recognition */
	char text[90000];
	memset(text, '\n', sizeof text);
	memcpy(text, HEAD "0 0 1\n", sizeof(HEAD "0 0 1\n") - 1);
	text[80000] = 0;
	write_bytes(f, text, sizeof text);
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, f->path), BSDFRBF_ERR_SYNTAX);
	assert_non_null(strstr(bsdfrbf_message(f->context), "NUL byte"));
	assert_int_equal(samples(f), 0);
}

static void files_that_cannot_be_read(void **state)
{
	fixture *f = *state;
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, "/nowhere/x.dat"), BSDFRBF_ERR_IO);
	assert_non_null(strstr(bsdfrbf_message(f->context), "/nowhere/x.dat: cannot open: No such file"));
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, f->folder), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, NULL), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_read(NULL, f->data, "/nowhere/x.dat"), BSDFRBF_ERR_IO);
	char path[5000];
	memset(path, 'a', sizeof path - 1);
	path[sizeof path - 1] = 0;
	assert_int_equal(bsdfrbf_data_read(f->context, f->data, path), BSDFRBF_ERR_IO);
	assert_non_null(strstr(bsdfrbf_message(f->context), "cannot open"));
}

static void memory_samples(void **state)
{
	fixture *f = *state;
	const double in[3] = {0, 3, 4}, out[6] = {0, 0, 2, 0, -3, -4}, value[6] = {1, 2, 3, 4, 5, 6};
	const double flat[3] = {1, 0, 0}, bad[2] = {1, NAN};
	assert_int_equal(bsdfrbf_data_add(f->context, f->data, in, 2, out, value, 3, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	assert_true(only(f, BSDFRBF_RF)->dsf[2] == 3 && fabs(only(f, BSDFRBF_TF)->dsf[0] - 3.2) < 1e-6);
	near_vector(only(f, BSDFRBF_TF)->outgoing, 0, -.6, .8);
	assert_int_equal(bsdfrbf_data_add(f->context, f->data, in, 2, out, value, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_ERR_DATA);
	assert_int_equal(bsdfrbf_data_add(f->context, f->data, in, 2, out, value, 2, BSDFRBF_QUANTITY_BSDF),
		BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_data_add(f->context, f->data, flat, 2, out, value, 3, BSDFRBF_QUANTITY_BSDF),
		BSDFRBF_ERR_DATA);
	assert_int_equal(bsdfrbf_data_add(f->context, f->data, in, 2, out, bad, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_ERR_DATA);
	assert_int_equal(samples(f), 2);
}

static void check_before_building(void **state)
{
	fixture *f = *state;
	assert_int_equal(rbf_data_check(f->context, f->data), BSDFRBF_ERR_DATA);
	accept(f, HEAD "0 0 0\n10 0 -1\n");
	assert_int_equal(rbf_data_check(f->context, f->data), BSDFRBF_ERR_DATA);
	assert_non_null(strstr(bsdfrbf_message(f->context), "front reflection (rf): no value is above zero"));
	accept(f, "#format: theta phi BRDF\n#incident_angle 40.2 90\n" ROWS);
	f->warnings = 0;
	assert_int_equal(rbf_data_check(f->context, f->data), BSDFRBF_OK);
	assert_int_equal(f->warnings, 2);
	assert_non_null(strstr(f->warning, "fewer than 10 samples at 1 of 2 incidences, the first at theta 30.0 phi 180.0"));
}

static void many_files(void **state)
{
	fixture *f = *state;
	char text[400];
	for (int i = 0; i < 1000; i++) {
		snprintf(text, sizeof text, "#format: theta phi DSF\n#incident_angle %d.%d %d\n" ROWS, i % 80, i / 100, i % 360);
		accept(f, text);
	}
	assert_int_equal(f->data->files, 1000);
	assert_int_equal(samples(f), 10000);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {TEST(plain), TEST(up_is_phi_zero_by_default), TEST(header_spellings),
		TEST(comments_and_empty_lines_between_rows), TEST(line_ends_and_blanks), TEST(negative_theta), TEST(both_sides_in_one_file),
		TEST(all_four_components), TEST(files_of_one_incidence_merge), TEST(normal_incidence_has_no_azimuth), TEST(colour),
		TEST(phi_column_first), TEST(long_lines_and_names), TEST(numbers),
		TEST(odd_but_allowed), TEST(refusals), TEST(nul_bytes), TEST(files_that_cannot_be_read), TEST(memory_samples),
		TEST(check_before_building), TEST(many_files)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
