/* SPDX-License-Identifier: BSD-3-Clause */
#include "text.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define BUFFER_BYTES 65536
#define LINE_MAX_BYTES (16u << 20) /* far beyond any real line; keeps a hostile file from taking all memory */

static void show_path(const char *path, char *shown, size_t size)
{
	const size_t length = strlen(path);
	if (length < size)
		memcpy(shown, path, length + 1);
	else
		snprintf(shown, size, "...%s", path + length - (size - 4));
	for (char *c = shown; *c; c++)
		if ((unsigned char)*c < ' ')
			*c = '?';
}

static bsdfrbf_status refill(rbf_text *text)
{
	text->before += text->fill;
	text->next = 0;
	text->fill = fread(text->buffer, 1, BUFFER_BYTES, text->file);
	if (text->fill < BUFFER_BYTES) {
		if (ferror(text->file))
			return rbf_fail(text->context, BSDFRBF_ERR_IO, "%s: cannot read: %s", text->name, strerror(errno));
		text->ended = text->fill == 0;
	}
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_text_open(bsdfrbf_context *context, rbf_text *text, const char *path)
{
	memset(text, 0, sizeof *text);
	text->context = context;
	show_path(path, text->name, sizeof text->name);
	text->file = fopen(path, "rb");
	if (!text->file)
		return rbf_fail(context, BSDFRBF_ERR_IO, "%s: cannot open: %s", text->name, strerror(errno));
	text->buffer = malloc(BUFFER_BYTES);
	text->capacity = 256;
	text->line = malloc(text->capacity);
	if (!text->buffer || !text->line)
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
	text->line[0] = 0;
	return refill(text);
}

void rbf_text_close(rbf_text *text)
{
	if (text->file)
		fclose(text->file);
	free(text->buffer);
	free(text->line);
	memset(text, 0, sizeof *text);
}

const unsigned char *rbf_text_peek(const rbf_text *text, size_t *count)
{
	*count = text->fill - text->next;
	return text->buffer + text->next;
}

static bsdfrbf_status append(rbf_text *text, const unsigned char *bytes, size_t count)
{
	if (count > LINE_MAX_BYTES - text->length)
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "line longer than %u MB: not a measurement file",
			LINE_MAX_BYTES >> 20);
	if (text->length + count + 1 > text->capacity) {
		const size_t capacity = 2 * (text->length + count + 1);
		char *grown = realloc(text->line, capacity);
		if (!grown)
			return rbf_fail(text->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", text->name);
		text->line = grown;
		text->capacity = capacity;
	}
	memcpy(text->line + text->length, bytes, count);
	text->length += count;
	text->line[text->length] = 0;
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_text_line(rbf_text *text, int *more)
{
	*more = 0;
	text->length = 0;
	text->line[0] = 0;
	for (;;) {
		if (text->next == text->fill && !text->ended)
			RBF_TRY(refill(text));
		if (text->ended)
			break;
		if (!*more) {
			*more = 1;
			if (text->number++ == 0 && text->fill >= 3 && !memcmp(text->buffer, "\xef\xbb\xbf", 3))
				text->next = 3;
		}
		size_t end = text->next;
		while (end < text->fill && text->buffer[end] != '\n' && text->buffer[end] != '\r' && text->buffer[end])
			end++;
		RBF_TRY(append(text, text->buffer + text->next, end - text->next));
		text->next = end;
		if (end == text->fill)
			continue;
		if (!text->buffer[end])
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX,
				"NUL byte: this is not a text file, or a damaged one");
		text->next++;
		if (text->buffer[end] == '\r') {
			if (text->next == text->fill)
				RBF_TRY(refill(text));
			if (!text->ended && text->buffer[text->next] == '\n')
				text->next++;
		}
		break;
	}
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_text_bytes(rbf_text *text, void *bytes, size_t count, uint64_t *offset)
{
	*offset = text->before + text->next;
	for (size_t done = 0; done < count; ) {
		if (text->next == text->fill && !text->ended)
			RBF_TRY(refill(text));
		if (text->ended)
			return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "ends at byte %llu, in the middle of an entry: the file is cut off; "
				"make or copy it anew", (unsigned long long)(text->before + text->next));
		const size_t left = text->fill - text->next, part = count - done < left ? count - done : left;
		memcpy((char *)bytes + done, text->buffer + text->next, part);
		text->next += part;
		done += part;
	}
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_text_fail(const rbf_text *text, size_t line, bsdfrbf_status status, const char *format, ...)
{
	char message[700];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(message, sizeof message, format, arguments);
	va_end(arguments);
	if (line)
		return rbf_fail(text->context, status, "%s:%zu: %s", text->name, line, message);
	return rbf_fail(text->context, status, "%s: %s", text->name, message);
}

static int blank(char c)
{
	return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

int rbf_word_next(const char **cursor, rbf_word *word)
{
	const char *c = *cursor;
	while (blank(*c))
		c++;
	word->start = c;
	while (*c && !blank(*c))
		c++;
	word->length = (size_t)(c - word->start);
	*cursor = c;
	return word->length > 0;
}

static char lower(char c)
{
	return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

int rbf_word_is(rbf_word word, const char *text)
{
	size_t i = 0;
	while (i < word.length && text[i] && lower(word.start[i]) == lower(text[i]))
		i++;
	return i == word.length && !text[i];
}

const char *rbf_word_show(rbf_word word, char shown[48])
{
	const size_t count = word.length < 44 ? word.length : 44;
	for (size_t i = 0; i < count; i++)
		shown[i] = word.start[i] >= ' ' && word.start[i] <= '~' ? word.start[i] : '?';
	memcpy(shown + count, count < word.length ? "..." : "", count < word.length ? 4 : 1);
	return shown;
}

/* m 10^e. Exact where both are exact in double (Clinger, How to read floating point numbers accurately, 1990),
 * elsewhere within a unit or two in the last place, which is far below what any instrument resolves. */
static double scaled(uint64_t m, long e)
{
	static const double power[] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14,
		1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
	if (m == 0)
		return 0;
	if (m < (1ull << 53) && e >= -22 && e <= 22)
		return e < 0 ? (double)m / power[-e] : (double)m * power[e];
	double value = (double)m;
	while (e > 0 && value < HUGE_VAL) {
		const int step = e < 22 ? (int)e : 22;
		value *= power[step];
		e -= step;
	}
	while (e < 0 && value > 0) {
		const int step = e > -22 ? (int)-e : 22;
		value /= power[step];
		e += step;
	}
	return value;
}

static int spells(rbf_word word, size_t at, const char *start)
{
	for (; *start; start++, at++)
		if (at >= word.length || lower(word.start[at]) != *start)
			return 0;
	return 1;
}

rbf_number_kind rbf_word_number(rbf_word word, double *value)
{
	const char *const s = word.start;
	const size_t n = word.length;
	size_t i = 0;
	int negative = 0, digits = 0;
	long exponent = 0;
	uint64_t mantissa = 0;

	if (i < n && (s[i] == '+' || s[i] == '-'))
		negative = s[i++] == '-';
	if (spells(word, i, "nan") || spells(word, i, "inf") || spells(word, i, "1.#"))
		return RBF_NUMBER_NOT_FINITE;
	for (int fraction = 0; i < n; i++) {
		if (s[i] == '.' && !fraction) {
			fraction = 1;
		} else if (s[i] >= '0' && s[i] <= '9') {
			digits = 1;
			if (mantissa < 1000000000000000000ull) { /* 18 digits are kept, the rest only counts */
				mantissa = 10 * mantissa + (uint64_t)(s[i] - '0');
				exponent -= fraction;
			} else {
				exponent += !fraction;
			}
		} else {
			break;
		}
	}
	if (digits && i < n && (lower(s[i]) == 'e' || lower(s[i]) == 'd')) { /* d: Fortran */
		size_t j = i + 1;
		int minus = 0;
		long power = 0;
		if (j < n && (s[j] == '+' || s[j] == '-'))
			minus = s[j++] == '-';
		if (j < n && s[j] >= '0' && s[j] <= '9') {
			for (; j < n && s[j] >= '0' && s[j] <= '9'; j++)
				if (power < 100000)
					power = 10 * power + (s[j] - '0');
			exponent += minus ? -power : power;
			i = j;
		}
	}
	if (i < n)
		return memchr(s, ',', n) || memchr(s, ';', n) ? RBF_NUMBER_COMMA : RBF_NUMBER_NONE;
	if (!digits)
		return RBF_NUMBER_NONE;
	const double result = scaled(mantissa, exponent);
	if (!isfinite(result))
		return RBF_NUMBER_NOT_FINITE;
	*value = negative ? -result : result;
	return RBF_NUMBER_OK;
}

bsdfrbf_status rbf_text_number(const rbf_text *text, rbf_word word, const char *what, double *value)
{
	char shown[48];
	switch (rbf_word_number(word, value)) {
	case RBF_NUMBER_OK:
		return BSDFRBF_OK;
	case RBF_NUMBER_COMMA:
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s is '%s': write numbers with a decimal point "
			"and separate them by blanks or tabs, not by commas or semicolons", what, rbf_word_show(word, shown));
	case RBF_NUMBER_NOT_FINITE:
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_DATA, "%s is '%s': not a finite number; "
			"delete the row if it was not measured", what, rbf_word_show(word, shown));
	default:
		return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "%s is '%s': not a number",
			what, rbf_word_show(word, shown));
	}
}
