/* SPDX-License-Identifier: BSD-3-Clause */
#include "json.h"

#include <math.h>
#include <stdlib.h>

/* Bytes of the UTF-8 character at `at`, 0 if it is none (RFC 3629, without its finer points on surrogates). */
static int utf8_length(const unsigned char *at)
{
	const int length = at[0] < 0x80 ? 1 : at[0] >= 0xc2 && at[0] < 0xe0 ? 2 : at[0] >= 0xe0 && at[0] < 0xf0 ? 3
		: at[0] >= 0xf0 && at[0] < 0xf5 ? 4 : 0;
	for (int n = 1; n < length; n++)
		if ((at[n] & 0xc0) != 0x80)
			return 0;
	return length;
}

void json_text(FILE *out, const char *text)
{
	putc('"', out);
	for (const unsigned char *at = (const unsigned char *)text; *at;) {
		const int length = utf8_length(at);
		if (length == 0)
			putc('?', out), at++;
		else if (length > 1)
			fwrite(at, 1, (size_t)length, out), at += length;
		else {
			if (*at < 32 || *at == '"' || *at == '\\' || *at == '<' || *at == '>' || *at == '&' || *at == 127)
				fprintf(out, "\\u%04x", *at);
			else
				putc(*at, out);
			at++;
		}
	}
	putc('"', out);
}

unsigned code_of(double value)
{
	if (!(value > 0))
		return 0;
	const double at = (log(value) - log(CODE_LOW)) / (log(CODE_HIGH) - log(CODE_LOW));
	return 1 + (unsigned)lrint(fmin(fmax(at, 0), 1) * CODE_STEPS);
}

void codes_clear(codes *c)
{
	c->count = 0;
}

void codes_byte(codes *c, unsigned byte)
{
	if (c->count == c->capacity) {
		const size_t capacity = c->capacity ? 2 * c->capacity : 4096;
		unsigned char *grown = realloc(c->byte, capacity);
		if (!grown) {
			c->failed = 1;
			return;
		}
		c->byte = grown;
		c->capacity = capacity;
	}
	c->byte[c->count++] = (unsigned char)byte;
}

void codes_word(codes *c, unsigned word)
{
	codes_byte(c, word & 255);
	codes_byte(c, word >> 8 & 255);
}

void codes_value(codes *c, double value)
{
	codes_word(c, code_of(value));
}

void codes_unit(codes *c, double value)
{
	codes_word(c, (unsigned)lrint((fmin(fmax(value, -1), 1) + 1) * .5 * 65535));
}

void json_codes(FILE *out, const codes *c)
{
	static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	putc('"', out);
	for (size_t i = 0; i < c->count; i += 3) {
		const size_t left = c->count - i;
		const unsigned a = c->byte[i], b = left > 1 ? c->byte[i + 1] : 0, d = left > 2 ? c->byte[i + 2] : 0;
		putc(digit[a >> 2], out);
		putc(digit[(a & 3) << 4 | b >> 4], out);
		putc(left > 1 ? digit[(b & 15) << 2 | d >> 6] : '=', out);
		putc(left > 2 ? digit[d & 63] : '=', out);
	}
	putc('"', out);
}
