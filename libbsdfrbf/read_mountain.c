/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * "Mountain" text of pab advanced technologies' goniophotometers, as the manual page pabopto2bsdf(1) describes it:
 * lines "#key value", then rows "theta phi value", or "theta phi X Y Z", in degrees. theta is counted from the front
 * normal (0 to 180), phi counter-clockwise as seen from the front; #upphi tells which phi points up (+Y), 0 if absent.
 * More is accepted than the page says: any capitals, blanks after '#', colons anywhere or nowhere, comments and empty
 * lines between rows, "phi theta" order, and theta below 0, on the other side of the normal, as a scan of a plane goes on: it is taken as that
 * program takes an incident one, theta -30 phi 0 being theta 30 phi 180.
 */
#include "read.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_COLUMNS 8
#define FEW_SAMPLES 10
#define ANGLE_TOLERANCE_DEG 0.1 /* between #incident_angle and #intheta, #inphi, which may be rounded */

/* Header entries that are numbers. */
enum { IN_THETA, IN_PHI, UP_PHI, POINTS, NUMBERS };

typedef struct header {
	double number[NUMBERS];
	size_t number_line[NUMBERS]; /* 0: absent */
	size_t format_line, colour_line;
	int dsf, phi_first, channels;
	char claim;                  /* 'R' if the format says BRDF, 'T' if BTDF, else 0 */
	double largest[2];           /* theta and |phi| of the rows */
	char *name;
} header;

/* The same direction with theta from 0. */
static void turn_negative(double *theta, double *phi)
{
	if (!(*theta < 0))
		return;
	*theta = -*theta;
	*phi += 180;
}

/* Splits "# key: value" into key and what follows; 0 if there is no key. */
static int split_key(const char *c, rbf_word *key, const char **value)
{
	while (*c == '#' || *c == ' ' || *c == '\t')
		c++;
	key->start = c;
	while (*c && *c != ':' && *c != '=' && *c != ' ' && *c != '\t')
		c++;
	key->length = (size_t)(c - key->start);
	while (*c == ':' || *c == '=' || *c == ' ' || *c == '\t')
		c++;
	*value = c;
	return key->length > 0;
}

static int is_unit(rbf_word word)
{
	return rbf_word_is(word, "deg") || rbf_word_is(word, "degree") || rbf_word_is(word, "degrees") ||
		rbf_word_is(word, "[deg]") || rbf_word_is(word, "(deg)") || rbf_word_is(word, "\xc2\xb0");
}

/* An angle in the header; a second statement must agree with the first. */
static bsdfrbf_status set_number(const rbf_text *text, header *h, int which, const char *name, const char **value)
{
	rbf_word word;
	double number;
	char shown[48];
	if (!rbf_word_next(value, &word))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#%s has no value", name);
	RBF_TRY(rbf_text_number(text, word, name, &number));
	if (!(fabs(number) <= 720))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "%s is '%s': not an angle in degrees", name,
			rbf_word_show(word, shown));
	if (h->number_line[which] && fabs(h->number[which] - number) > ANGLE_TOLERANCE_DEG)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s differs from the one in line %zu: "
			"a file describes one incident direction; split it, or delete the wrong line", name, h->number_line[which]);
	h->number[which] = number;
	h->number_line[which] = text->number;
	return BSDFRBF_OK;
}

static bsdfrbf_status end_of_entry(const rbf_text *text, const char *name, const char *value)
{
	rbf_word word;
	char shown[48];
	while (rbf_word_next(&value, &word) && word.start[0] != '#')
		if (!is_unit(word))
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "'%s' after the value of #%s: "
				"angles are in degrees, one number an angle", rbf_word_show(word, shown), name);
	return BSDFRBF_OK;
}

static bsdfrbf_status set_format(const rbf_text *text, header *h, const char *value)
{
	rbf_word word[3] = {{0}};
	size_t count = 0;
	while (count < 3 && rbf_word_next(&value, &word[count]))
		count++;
	const int phi_first = rbf_word_is(word[0], "phi") && rbf_word_is(word[1], "theta");
	const int known = count == 3 && (phi_first || (rbf_word_is(word[0], "theta") && rbf_word_is(word[1], "phi")));
	const int dsf = known && rbf_word_is(word[2], "DSF");
	const char claim = known && rbf_word_is(word[2], "BRDF") ? 'R' : known && rbf_word_is(word[2], "BTDF") ? 'T' : 0;
	if (!known || (!dsf && !claim && !rbf_word_is(word[2], "BSDF")))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "unknown #format: it must be \"theta phi DSF\" "
			"(with the cosine of the outgoing angle) or \"theta phi BSDF\" (without; also BRDF, BTDF)");
	if (h->format_line && (h->dsf != dsf || h->phi_first != phi_first))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#format differs from the one in line %zu",
			h->format_line);
	h->format_line = text->number;
	h->dsf = dsf;
	h->phi_first = phi_first;
	h->claim = claim;
	return BSDFRBF_OK;
}

static bsdfrbf_status set_colour(const rbf_text *text, header *h, const char *value)
{
	rbf_word word;
	char shown[48];
	if (!rbf_word_next(&value, &word))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#colorimetry has no value");
	const int channels = rbf_word_is(word, "CIE-XYZ") ? 3 : rbf_word_is(word, "CIE-Y") ? 1 : 0;
	if (!channels)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#colorimetry '%s' is unknown: "
			"CIE-Y (one value a row) and CIE-XYZ (three) are read", rbf_word_show(word, shown));
	if (h->colour_line && channels != h->channels)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#colorimetry differs from the one in line %zu",
			h->colour_line);
	h->colour_line = text->number;
	h->channels = channels;
	return BSDFRBF_OK;
}

static bsdfrbf_status set_name(const rbf_text *text, header *h, const char *value)
{
	const char *start = *value == '"' ? value + 1 : value;
	size_t length = *value == '"' ? strcspn(start, "\"") : strlen(start);
	while (length && (start[length - 1] == ' ' || start[length - 1] == '\t'))
		length--;
	if (!length)
		return BSDFRBF_OK;
	if (length > 1000)
		length = 1000; /* a name, not a report: it is recorded with the model */
	char *name = malloc(length + 1);
	if (!name)
		return rbf_fail(text->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
	memcpy(name, start, length);
	name[length] = 0;
	free(h->name);
	h->name = name;
	return BSDFRBF_OK;
}

/* A line whose first character is '#', at `start`: an entry, or a comment. After the first row an entry may only
 * repeat what was said. */
static bsdfrbf_status header_line(const rbf_text *text, const char *start, header *h, size_t first_row)
{
	rbf_word key;
	const char *value;
	const header before = *h;
	char shown[48];

	if (!split_key(start, &key, &value))
		return BSDFRBF_OK;
	if (rbf_word_is(key, "intheta")) {
		RBF_TRY(set_number(text, h, IN_THETA, "intheta", &value));
		RBF_TRY(end_of_entry(text, "intheta", value));
	} else if (rbf_word_is(key, "inphi")) {
		RBF_TRY(set_number(text, h, IN_PHI, "inphi", &value));
		RBF_TRY(end_of_entry(text, "inphi", value));
	} else if (rbf_word_is(key, "incident_angle")) {
		RBF_TRY(set_number(text, h, IN_THETA, "incident_angle (theta)", &value));
		RBF_TRY(set_number(text, h, IN_PHI, "incident_angle (phi)", &value));
		RBF_TRY(end_of_entry(text, "incident_angle", value));
	} else if (rbf_word_is(key, "upphi")) {
		RBF_TRY(set_number(text, h, UP_PHI, "upphi", &value));
		RBF_TRY(end_of_entry(text, "upphi", value));
	} else if (rbf_word_is(key, "format")) {
		RBF_TRY(set_format(text, h, value));
	} else if (rbf_word_is(key, "colorimetry")) {
		RBF_TRY(set_colour(text, h, value));
	} else if (rbf_word_is(key, "datapoints_in_file")) {
		rbf_word word;
		double points;
		if (rbf_word_next(&value, &word) && rbf_word_number(word, &points) == RBF_NUMBER_OK) {
			h->number[POINTS] = points;
			h->number_line[POINTS] = text->number;
		}
	} else if (rbf_word_is(key, "sample_name")) {
		RBF_TRY(set_name(text, h, value));
	} else {
		return BSDFRBF_OK;
	}
	if (first_row) {
		if (h->channels != before.channels || fabs(h->number[UP_PHI] - before.number[UP_PHI]) > ANGLE_TOLERANCE_DEG)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "#%s after the first row (line %zu): "
				"the header must come before the rows", rbf_word_show(key, shown), first_row);
		h->number[UP_PHI] = before.number[UP_PHI];
	}
	return BSDFRBF_OK;
}

/* A line of text among rows, as other programs' comments or names of columns. */
static bsdfrbf_status refuse_words(const rbf_text *text, rbf_word word, int known)
{
	char shown[48];
	return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "the line begins with '%s': not a number, and not with #, as lines of the header and "
		"comments do%s", rbf_word_show(word, shown), known ? "" : "; not a Mountain file as pabopto2bsdf(1) describes it, nor Zemax tabular BSDF");
}

/* Is everything there that rows need? Sets the incident direction. */
static bsdfrbf_status header_done(const rbf_text *text, header *h, rbf_gather *gather)
{
	const int no_theta = !h->number_line[IN_THETA], no_phi = !h->number_line[IN_PHI];
	if (!h->format_line || no_theta || no_phi)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "before the first row the header lacks%s%s%s "
			"(#incident_angle THETA PHI serves as well): not a Mountain file as pabopto2bsdf(1) describes it, nor Zemax "
			"tabular BSDF", no_theta ? " #intheta" : "", no_phi ? " #inphi" : "",
			h->format_line ? "" : " #format: theta phi DSF|BSDF");
	double theta = h->number[IN_THETA], phi = h->number[IN_PHI];
	if (!(fabs(theta) <= 180))
		return rbf_text_fail(text, h->number_line[IN_THETA], BSDFRBF_ERR_DATA, "incident theta is outside -180 to 180 "
			"degrees: up to 90 from the normal is the front, beyond it the back");
	turn_negative(&theta, &phi);
	double incident[3];
	rbf_direction_from_angles(theta, phi - h->number[UP_PHI] + 90, incident);
	if (!rbf_gather_start(gather, incident, h->channels))
		return rbf_text_fail(text, h->number_line[IN_THETA], BSDFRBF_ERR_DATA,
			"incident theta of 90 degrees lies in the plane of the surface");
	return BSDFRBF_OK;
}

static bsdfrbf_status row(const rbf_text *text, header *h, rbf_gather *gather, const rbf_word *word, size_t count)
{
	static const char *const colour[3] = {"X", "Y", "Z"};
	const size_t wanted = 2 + (size_t)h->channels;
	double number[MAX_COLUMNS];
	char shown[48];

	if (rbf_word_number(word[0], &number[0]) == RBF_NUMBER_NONE)
		return refuse_words(text, word[0], 1);
	for (size_t i = 0; i < count; i++)
		RBF_TRY(rbf_text_number(text, word[i], i == (size_t)h->phi_first ? "theta" : i < 2 ? "phi" :
			h->channels == 3 && i < 5 ? colour[i - 2] : "value", &number[i]));
	if (count != wanted)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%zu columns%s instead of %zu (theta, phi, %s)%s",
			count, count == MAX_COLUMNS ? " or more" : "", wanted, h->channels == 3 ? "X, Y, Z" : "value",
			count == 5 && wanted == 3 ? ": if the values are X, Y, Z, add \"#colorimetry: CIE-XYZ\" to the header" :
			count == 3 && wanted == 5 ? ": #colorimetry says CIE-XYZ" : "");

	double theta = number[h->phi_first], phi = number[!h->phi_first];
	if (!(fabs(theta) <= 180))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "theta is '%s': outside -180 to 180 degrees, counted from the "
			"front normal%s", rbf_word_show(word[h->phi_first], shown), fabs(phi) <= 180 && fabs(theta) <= 360
			? "; are the columns of theta and phi swapped (#format: phi theta)?" : "");
	if (!(fabs(phi) <= 720))
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "phi is '%s': not an angle in degrees",
			rbf_word_show(word[!h->phi_first], shown));
	for (size_t i = 2; i < count; i++)
		if (fabs(number[i]) > RBF_VALUE_MAX)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "value '%s' is beyond 1e12 per sr: "
				"delete the row if it was not measured", rbf_word_show(word[i], shown));

	h->largest[0] = fmax(h->largest[0], fabs(theta));
	h->largest[1] = fmax(h->largest[1], fabs(phi));
	turn_negative(&theta, &phi);
	double outgoing[3];
	rbf_direction_from_angles(theta, phi - h->number[UP_PHI] + 90, outgoing);
	if (!rbf_gather_add(gather, outgoing, number + 2, h->dsf ? BSDFRBF_QUANTITY_DSF : BSDFRBF_QUANTITY_BSDF))
		return rbf_fail(text->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
	return BSDFRBF_OK;
}

static bsdfrbf_status read_all(rbf_text *text, header *h, rbf_gather *gather, size_t *rows)
{
	size_t first_row = 0;
	int more;
	for (;;) {
		RBF_TRY(rbf_text_line(text, &more));
		if (!more)
			break;
		rbf_word word[MAX_COLUMNS];
		const char *cursor = text->line;
		size_t count = 0;
		while (count < MAX_COLUMNS && rbf_word_next(&cursor, &word[count]) && word[count].start[0] != '#')
			count++;
		if (!count) {
			const char *start = text->line + strspn(text->line, " \t");
			if (*start == '#')
				RBF_TRY(header_line(text, start, h, first_row));
			continue;
		}
		if (!first_row) {
			double ignored;
			first_row = text->number;
			if (rbf_word_number(word[0], &ignored) == RBF_NUMBER_NONE)
				return refuse_words(text, word[0], h->format_line && h->number_line[IN_THETA] && h->number_line[IN_PHI]);
			RBF_TRY(header_done(text, h, gather));
		}
		RBF_TRY(row(text, h, gather, word, count));
		++*rows;
	}
	if (!first_row)
		return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "%s: no rows \"theta phi value\"",
			text->number ? "only a header" : "the file is empty");
	return BSDFRBF_OK;
}

/* Things that are allowed but rarely meant. */
static void warn_oddities(const rbf_text *text, const header *h, const rbf_gather *gather, size_t rows)
{
	const size_t reflected = gather->side[0].count, transmitted = gather->side[1].count;
	if (h->number_line[POINTS] && h->number[POINTS] != (double)rows)
		rbf_warn(text->context, "%s:%zu: #datapoints_in_file differs from the %zu rows found: is the file complete?",
			text->name, h->number_line[POINTS], rows);
	if ((h->claim == 'R' && !reflected) || (h->claim == 'T' && !transmitted))
		rbf_warn(text->context, "%s:%zu: #format says B%cDF, but all samples are on the %s side",
			text->name, h->format_line, h->claim, reflected ? "reflected" : "transmitted");
	if (reflected + transmitted < FEW_SAMPLES)
		rbf_warn(text->context, "%s: only %zu sample%s off the horizon", text->name, reflected + transmitted,
			reflected + transmitted > 1 ? "s" : "");
	if (rows >= 100 && h->largest[0] < 3.2 && h->largest[1] < 6.4 && fabs(h->number[IN_THETA]) < 3.2)
		rbf_warn(text->context, "%s: no theta exceeds 3.2 and no phi 6.4: are the angles in radians? "
			"They are taken as degrees", text->name);
}

bsdfrbf_status rbf_read_mountain(rbf_text *text, bsdfrbf_data *data, const char *path)
{
	header h = {.channels = 1};
	rbf_gather gather = {0};
	size_t rows = 0;

	bsdfrbf_status status = read_all(text, &h, &gather, &rows);
	if (!status && gather.side[0].count + gather.side[1].count == 0)
		status = rbf_text_fail(text, 0, BSDFRBF_ERR_DATA, "all samples lie on the horizon (theta 90)");
	if (!status) {
		warn_oddities(text, &h, &gather, rows);
		status = rbf_data_join(text->context, data, 1, &gather, path, h.name);
	}
	rbf_gather_free(&gather);
	free(h.name);
	return status;
}
