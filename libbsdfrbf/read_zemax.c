/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Zemax tabular BSDF text ("BSDF Data Interchange File Format", R. Rykowski, Zemax knowledge base): a header of
 * keywords and lists of angles in degrees, then one table for each sample rotation and incidence, a row for each
 * scatter azimuth, a column for each scatter radius. Values are BSDF in 1/sr, without the cosine.
 *
 * Scatter angles are counted from the specular beam (from the straight-through beam for BTDF): radius 0 is the beam,
 * azimuth 0 points from it towards the sample's normal, and grows counter-clockwise for who looks into the beam.
 * The sample rotation is the angle from the normal of the plane of incidence to the sample's X axis, counter-clockwise
 * as seen from the front (so it is drawn over the instrument in ua-loft/bsdf-tools, docs/instruments/rt300s; on
 * their IMX455 the other sense doubts reciprocity more). So at rotation 0 the plane of incidence holds Y. That light
 * then comes from -Y, not from +Y, is our choice: it is where the same data converted to Mountain text have it.
 *
 * Zeros mean "not measured": the table is a full rectangle, but part of it lies below the horizon.
 */
#include "read.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)
#define MAX_ANGLES 10000     /* in one list */
#define MAX_INCIDENCES 20000 /* rotations times angles of incidence */

enum { ROTATION, INCIDENCE, AZIMUTH, RADIUS, LISTS };
static const char *const list_name[LISTS] = {"SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"};

typedef struct numbers {
	double *value;
	size_t count, capacity;
} numbers;

typedef struct table {
	numbers list[LISTS];
	int mirrored;         /* PlaneSymmetrical: azimuths beyond 180 follow from those below */
	int transmission;     /* BTDF */
	int channels;
	int seen_symmetry, seen_type, seen_content;
	numbers channel[3];   /* in file order: rotation, incidence, azimuth, radius */
	unsigned char repeated[MAX_ANGLES]; /* azimuth is that of an earlier row */
} table;

static bsdfrbf_status push(const rbf_text *text, numbers *n, double value)
{
	if (n->count == n->capacity) {
		const size_t capacity = n->capacity ? 2 * n->capacity : 64;
		double *grown = realloc(n->value, capacity * sizeof *grown);
		if (!grown)
			return rbf_fail(text->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
		n->value = grown;
		n->capacity = capacity;
	}
	n->value[n->count++] = value;
	return BSDFRBF_OK;
}

/* Next line that is neither empty nor a comment. */
static bsdfrbf_status next_line(rbf_text *text, const char *wanted, int *more)
{
	for (;;) {
		RBF_TRY(rbf_text_line(text, more));
		if (!*more && wanted)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "the file ends where %s should follow: "
				"it is incomplete", wanted);
		const char c = text->line[strspn(text->line, " \t\v\f")];
		if (!*more || (c && c != '#'))
			return BSDFRBF_OK;
	}
}

/* "Keyword N" with N angles on the next line or lines. */
static bsdfrbf_status read_list(rbf_text *text, table *t, int which, const char *cursor)
{
	numbers *list = &t->list[which];
	const char *name = list_name[which];
	rbf_word word;
	double wanted, angle;
	int more;

	if (list->count)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s is given twice", name);
	if (!rbf_word_next(&cursor, &word))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s lacks the number of angles", name);
	RBF_TRY(rbf_text_number(text, word, name, &wanted));
	if (!(wanted >= 1 && wanted <= MAX_ANGLES && wanted == floor(wanted)))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s must be followed by the number of angles, "
			"1 to %d", name, MAX_ANGLES);
	while (list->count < wanted) {
		RBF_TRY(next_line(text, name, &more));
		cursor = text->line;
		while (rbf_word_next(&cursor, &word)) {
			RBF_TRY(rbf_text_number(text, word, name, &angle));
			if (!(fabs(angle) <= 720))
				return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "%s beyond 720 degrees", name);
			RBF_TRY(push(text, list, angle));
		}
		if (list->count > wanted)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s has more angles than announced", name);
	}
	return BSDFRBF_OK;
}

/* Channel that a block is for, or -1. */
static int block_channel(rbf_word word, const char *cursor)
{
	static const char *const name[3] = {"TristimulusX", "TristimulusY", "TristimulusZ"};
	static const char *const letter[3] = {"X", "Y", "Z"};
	rbf_word next;
	if (rbf_word_is(word, "Monochrome"))
		return 0;
	for (int c = 0; c < 3; c++)
		if (rbf_word_is(word, name[c]))
			return c;
	if (rbf_word_is(word, "Tristimulus") && rbf_word_next(&cursor, &next))
		for (int c = 0; c < 3; c++)
			if (rbf_word_is(next, letter[c]))
				return c;
	return -1;
}

/* Everything up to the first block, whose channel is returned. */
static bsdfrbf_status read_header(rbf_text *text, table *t, int *channel)
{
	for (;;) {
		rbf_word word, value = {"", 0};
		char shown[48];
		int more, which = 0;
		RBF_TRY(next_line(text, "a block of data", &more));
		const char *cursor = text->line;
		rbf_word_next(&cursor, &word);
		*channel = block_channel(word, cursor);
		if (*channel >= 0)
			return BSDFRBF_OK;
		while (which < LISTS && !rbf_word_is(word, list_name[which]))
			which++;
		if (which < LISTS) {
			RBF_TRY(read_list(text, t, which, cursor));
			continue;
		}
		rbf_word_next(&cursor, &value);
		if (rbf_word_is(word, "Source"))
			continue;
		if (rbf_word_is(word, "Symmetry")) {
			t->mirrored = rbf_word_is(value, "PlaneSymmetrical");
			if (!t->mirrored && !rbf_word_is(value, "Asymmetrical") && !rbf_word_is(value, "Asymmetrical4D"))
				return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "Symmetry '%s' is unknown: "
					"PlaneSymmetrical, Asymmetrical and Asymmetrical4D are read", rbf_word_show(value, shown));
			t->seen_symmetry = 1;
		} else if (rbf_word_is(word, "SpectralContent")) {
			t->channels = rbf_word_is(value, "XYZ") ? 3 : 1;
			if (t->channels == 1 && !rbf_word_is(value, "Monochrome"))
				return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "SpectralContent '%s' is unknown: "
					"Monochrome and XYZ are read", rbf_word_show(value, shown));
			t->seen_content = 1;
		} else if (rbf_word_is(word, "ScatterType")) {
			t->transmission = rbf_word_is(value, "BTDF");
			if (!t->transmission && !rbf_word_is(value, "BRDF"))
				return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "ScatterType '%s' is unknown: "
					"BRDF and BTDF are read", rbf_word_show(value, shown));
			t->seen_type = 1;
		} else {
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "unknown keyword '%s' in the header of a Zemax "
				"BSDF file", rbf_word_show(word, shown));
		}
	}
}

static bsdfrbf_status check_header(const rbf_text *text, const table *t)
{
	const char *lacks = !t->seen_symmetry ? "Symmetry" : !t->seen_type ? "ScatterType" :
		!t->seen_content ? "SpectralContent" : NULL;
	for (int k = 0; k < LISTS && !lacks; k++)
		if (!t->list[k].count)
			lacks = list_name[k];
	if (lacks)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "the header lacks %s", lacks);
	if (t->list[ROTATION].count * t->list[INCIDENCE].count > MAX_INCIDENCES)
		return rbf_text_fail(text, 0, BSDFRBF_ERR_UNSUPPORTED, "more than %d incident directions", MAX_INCIDENCES);
	for (size_t i = 0; i < t->list[INCIDENCE].count; i++)
		if (!(t->list[INCIDENCE].value[i] >= 0 && t->list[INCIDENCE].value[i] <= 89.99))
			return rbf_text_fail(text, 0, BSDFRBF_ERR_DATA, "AngleOfIncidence is outside 0 to 89.99 degrees");
	for (size_t i = 0; i < t->list[RADIUS].count; i++)
		if (!(t->list[RADIUS].value[i] >= 0 && t->list[RADIUS].value[i] <= 180))
			return rbf_text_fail(text, 0, BSDFRBF_ERR_DATA, "ScatterRadial is outside 0 to 180 degrees");
	return BSDFRBF_OK;
}

static bsdfrbf_status read_row(rbf_text *text, const table *t, numbers *channel)
{
	const size_t wanted = t->list[RADIUS].count;
	const char *cursor = text->line;
	size_t count = 0;
	rbf_word word;
	char shown[48];
	double value;
	while (rbf_word_next(&cursor, &word)) {
		RBF_TRY(rbf_text_number(text, word, "value", &value));
		if (fabs(value) > RBF_VALUE_MAX)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "value '%s' is beyond 1e12 per sr: "
				"write 0 if it was not measured", rbf_word_show(word, shown));
		if (++count > wanted)
			break;
		RBF_TRY(push(text, channel, value));
	}
	if (count != wanted)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s than the %zu values that ScatterRadial announces",
			count > wanted ? "more" : "fewer", wanted);
	return BSDFRBF_OK;
}

/* From "DataBegin" to "DataEnd". */
static bsdfrbf_status read_block(rbf_text *text, const table *t, numbers *channel)
{
	const size_t tables = t->list[ROTATION].count * t->list[INCIDENCE].count, rows = t->list[AZIMUTH].count;
	rbf_word word;
	int more;

	RBF_TRY(next_line(text, "DataBegin", &more));
	const char *cursor = text->line;
	rbf_word_next(&cursor, &word);
	if (!rbf_word_is(word, "DataBegin"))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "DataBegin is missing");
	for (size_t i = 0; i < tables; i++)
		for (size_t k = 0; k < rows; k++) {
			for (int header = 1; header;) {
				RBF_TRY(next_line(text, "a row of data", &more));
				cursor = text->line;
				rbf_word_next(&cursor, &word);
				header = k == 0 && rbf_word_is(word, "TIS"); /* total integrated scatter: follows from the table */
			}
			if (rbf_word_is(word, "TIS") || rbf_word_is(word, "DataEnd"))
				return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "table %zu of %zu has %zu rows, but "
					"ScatterAzimuth announces %zu", i + 1, tables, k, rows);
			RBF_TRY(read_row(text, t, channel));
		}
	RBF_TRY(next_line(text, "DataEnd", &more));
	cursor = text->line;
	rbf_word_next(&cursor, &word);
	if (!rbf_word_is(word, "DataEnd"))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "DataEnd is missing after %zu tables of %zu rows",
			tables, rows);
	return BSDFRBF_OK;
}

static bsdfrbf_status read_all(rbf_text *text, table *t)
{
	int channel, more;
	RBF_TRY(read_header(text, t, &channel));
	RBF_TRY(check_header(text, t));
	for (;;) {
		if (channel < 0 || channel >= t->channels)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "a block of data does not fit SpectralContent: "
				"Monochrome has one block of that name, XYZ has TristimulusX, TristimulusY, TristimulusZ");
		if (t->channel[channel].count)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "a block of data appears twice");
		RBF_TRY(read_block(text, t, &t->channel[channel]));
		RBF_TRY(next_line(text, NULL, &more));
		if (!more)
			break;
		rbf_word word;
		const char *cursor = text->line;
		rbf_word_next(&cursor, &word);
		channel = block_channel(word, cursor);
	}
	for (int c = 0; c < t->channels; c++)
		if (!t->channel[c].count)
			return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "the block Tristimulus%c is missing", "XYZ"[c]);
	return BSDFRBF_OK;
}

/* Incident light at azimuth `from`; `azimuth` and `radius` about the specular or straight-through beam. */
static void scatter_direction(double incidence, double from, double azimuth, double radius, int transmission,
	double direction[3])
{
	const double ci = cos(incidence * DEGREE), si = sin(incidence * DEGREE);
	const double x = sin(radius * DEGREE) * cos(azimuth * DEGREE), y = sin(radius * DEGREE) * sin(azimuth * DEGREE);
	const double z = cos(radius * DEGREE);
	/* along the beam's projection on the surface, across it (90 degrees counter-clockwise from above), and up */
	const double along = z * si - x * ci, across = transmission ? y : -y, up = z * ci + x * si;
	const double c = -cos(from * DEGREE), s = -sin(from * DEGREE);
	direction[0] = along * c - across * s;
	direction[1] = along * s + across * c;
	direction[2] = transmission ? -up : up;
}

/* Is the angle that of an earlier entry, a whole turn apart? */
static int repeats(const numbers *list, size_t index)
{
	for (size_t k = 0; k < index; k++)
		if (fabs(remainder(list->value[k] - list->value[index], 360)) < 1e-6)
			return 1;
	return 0;
}

static int gather_table(const table *t, size_t rotation, size_t incidence, rbf_gather *gather)
{
	const numbers *azimuths = &t->list[AZIMUTH], *radii = &t->list[RADIUS];
	const double from = 270 - t->list[ROTATION].value[rotation], theta = t->list[INCIDENCE].value[incidence];
	double direction[3], value[3];
	size_t at = (rotation * t->list[INCIDENCE].count + incidence) * azimuths->count * radii->count;

	rbf_direction_from_angles(theta, from, direction);
	rbf_gather_start(gather, direction, t->channels);
	for (size_t a = 0; a < azimuths->count; a++) {
		const double azimuth = azimuths->value[a];
		const int mirrored = t->mirrored && azimuth > 0 && azimuth < 180;
		for (size_t r = 0; r < radii->count; r++, at++) {
			const double radius = radii->value[r];
			int measured = 0;
			for (int c = 0; c < t->channels; c++) {
				value[c] = t->channel[c].value[at];
				measured |= value[c] != 0;
			}
			/* at radius 0 and 180 all azimuths are one direction, which every row repeats */
			if (!measured || t->repeated[a] || (a > 0 && (radius == 0 || radius == 180)))
				continue;
			for (int side = 0; side <= mirrored; side++) {
				scatter_direction(theta, from, side ? -azimuth : azimuth, radius, t->transmission, direction);
				if ((direction[2] < 0) == t->transmission &&
						!rbf_gather_add(gather, direction, value, BSDFRBF_QUANTITY_BSDF))
					return 0;
			}
		}
	}
	return 1;
}

static bsdfrbf_status join(const rbf_text *text, table *t, bsdfrbf_data *data, const char *path)
{
	const size_t incidences = t->list[INCIDENCE].count, count = t->list[ROTATION].count * incidences;
	rbf_gather *gathers = calloc(count, sizeof *gathers);
	int room = gathers != NULL;
	size_t samples = 0;
	for (size_t a = 0; a < t->list[AZIMUTH].count; a++)
		t->repeated[a] = (unsigned char)repeats(&t->list[AZIMUTH], a);
	for (size_t g = 0; g < count && room; g++) {
		gathers[g].channels = t->channels;
		if (!repeats(&t->list[ROTATION], g / incidences))
			room = gather_table(t, g / incidences, g % incidences, &gathers[g]);
		samples += gathers[g].side[t->transmission].count;
	}
	bsdfrbf_status status;
	if (!room)
		status = rbf_fail(text->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
	else if (!samples)
		status = rbf_text_fail(text, 0, BSDFRBF_ERR_DATA, "all values are zero, or below the horizon");
	else
		status = rbf_data_join(text->context, data, count, gathers, path, NULL);
	for (size_t g = 0; g < count && gathers; g++)
		rbf_gather_free(&gathers[g]);
	free(gathers);
	return status;
}

bsdfrbf_status rbf_read_zemax(rbf_text *text, bsdfrbf_data *data, const char *path)
{
	table t = {.channels = 1};
	bsdfrbf_status status = read_all(text, &t);
	if (!status)
		status = join(text, &t, data, path);
	for (int k = 0; k < LISTS; k++)
		free(t.list[k].value);
	for (int c = 0; c < 3; c++)
		free(t.channel[c].value);
	return status;
}
