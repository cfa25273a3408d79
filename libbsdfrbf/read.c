/* SPDX-License-Identifier: BSD-3-Clause */
#include "read.h"

#include <string.h>

static int starts(const unsigned char *head, size_t count, const char *with, size_t length)
{
	return count >= length && !memcmp(head, with, length);
}

#define STARTS(with) starts(head, count, with, sizeof(with) - 1)

/* What a file that is no measurement text is, and what to do; NULL if it may be one. */
static const char *foreign(const unsigned char *head, size_t count)
{
	if (STARTS("\x8fRBF"))
		return "this is a finished .rbf model, not a measurement: use it as it is";
	if (STARTS("\xff\xfe") || STARTS("\xfe\xff"))
		return "this is UTF-16 text: save it as UTF-8 or ASCII";
	if (STARTS("PK\x03\x04") || STARTS("\xd0\xcf\x11\xe0"))
		return "this is a spreadsheet or an archive: export the measurement as text";
	if (STARTS("\x1f\x8b") || STARTS("BZh") || STARTS("\xfd" "7zXZ") || STARTS("\x28\xb5\x2f\xfd"))
		return "this is a compressed file: decompress it first";
	if (STARTS("\xef\xbb\xbf")) {
		head += 3;
		count -= 3;
	}
	while (count && (*head == ' ' || *head == '\t' || *head == '\r' || *head == '\n')) {
		head++;
		count--;
	}
	if (STARTS("<"))
		return "this is XML (a resampled BSDF?), not a measurement: give the measurement files it was made from";
	if (memchr(head, 0, count))
		return "this is a binary file, not measurement text";
	return NULL;
}

#undef STARTS

/* Zemax text starts with a keyword, after comments; Mountain text has none outside comments. */
static int looks_like_zemax(const unsigned char *head, size_t count)
{
	static const char *const keyword[] = {"source", "symmetry", "spectralcontent", "scattertype", "samplerotation",
		"angleofincidence", "scatterazimuth", "scatterradial"};
	size_t i = starts(head, count, "\xef\xbb\xbf", 3) ? 3 : 0;
	while (i < count) {
		while (i < count && strchr(" \t\r\n\v\f", head[i]))
			i++;
		if (i < count && head[i] != '#')
			break;
		while (i < count && head[i] != '\n' && head[i] != '\r')
			i++;
	}
	rbf_word word = {(const char *)head + i, 0};
	while (i + word.length < count && !strchr(" \t\r\n\v\f", head[i + word.length]))
		word.length++;
	for (size_t k = 0; k < sizeof keyword / sizeof *keyword; k++)
		if (rbf_word_is(word, keyword[k]))
			return 1;
	return 0;
}

bsdfrbf_status bsdfrbf_data_read(bsdfrbf_context *context, bsdfrbf_data *data, const char *path)
{
	if (!data || !path)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_read: no data or path");
	rbf_text text;
	bsdfrbf_status status = rbf_text_open(context, &text, path);
	if (!status) {
		size_t count;
		const unsigned char *head = rbf_text_peek(&text, &count);
		const int sir = starts(head, count, "#?RADIANCE", 10);
		const char *what = sir ? NULL : foreign(head, count);
		if (what)
			status = rbf_text_fail(&text, 0, BSDFRBF_ERR_SYNTAX, "%s", what);
		else if (sir)
			status = rbf_read_sir(&text, data, path);
		else if (looks_like_zemax(head, count))
			status = rbf_read_zemax(&text, data, path);
		else
			status = rbf_read_mountain(&text, data, path);
	}
	rbf_text_close(&text);
	return status;
}
