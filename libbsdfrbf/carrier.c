/* SPDX-License-Identifier: BSD-3-Clause */
#include "carrier.h"

#include <string.h>

int rbf_carrier_is_xml(const char *text, uint64_t bytes)
{
	uint64_t at = bytes >= 3 && !memcmp(text, "\xef\xbb\xbf", 3) ? 3 : 0;
	while (at < bytes && at < 256 && strchr(" \t\r\n", text[at]) && text[at])
		at++;
	return at < bytes && text[at] == '<';
}

static int hex_digit(char c)
{
	return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* "name=value" at *at, up to a blank; moves behind it. Returns the value's length, 0 if that is not what stands there. */
static size_t field(const char **at, const char *end, const char *name, const char **value)
{
	const size_t length = strlen(name);
	if ((size_t)(end - *at) <= length || memcmp(*at, name, length))
		return 0;
	*value = *at + length;
	const char *stop = memchr(*value, ' ', (size_t)(end - *value));
	if (!stop)
		return 0;
	*at = stop + 1;
	return (size_t)(stop - *value);
}

static int unescape(const char *text, size_t length, char *path)
{
	size_t used = 0;
	for (size_t i = 0; i < length; i++) {
		char c = text[i];
		if (c == '%') {
			const int high = i + 2 < length ? hex_digit(text[i + 1]) : -1, low = i + 2 < length ? hex_digit(text[i + 2]) : -1;
			if (high < 0 || low < 0)
				return 0;
			c = (char)(16 * high + low);
			i += 2;
		}
		if (!c || used + 1 >= RBF_CARRIER_PATH)
			return 0;
		path[used++] = c;
	}
	path[used] = 0;
	return used > 0;
}

int rbf_carrier_find(const char *text, uint64_t bytes, rbf_carrier *c)
{
	const size_t mark_bytes = sizeof RBF_CARRIER_MARK - 1;
	const char *end = text + bytes, *from = bytes > RBF_CARRIER_TAIL ? end - RBF_CARRIER_TAIL : text, *value;
	memset(c, 0, sizeof *c);
	for (const char *next; (next = memmem(from, (size_t)(end - from), RBF_CARRIER_MARK, mark_bytes)); from = next + 1)
		c->mark = next;
	if (!c->mark)
		return 0;
	const char *at = c->mark + mark_bytes;
	size_t length = field(&at, end, "file=", &value);
	if (length && !unescape(value, length, c->file))
		return 0;
	length = field(&at, end, "bytes=", &value);
	for (size_t i = 0; i < length; i++) {
		if (value[i] < '0' || value[i] > '9' || i > 15)
			return 0;
		c->bytes = 10 * c->bytes + (uint64_t)(value[i] - '0');
	}
	length = field(&at, end, "checksum=", &value);
	for (size_t i = 0; i < length; i++) {
		const int digit = hex_digit(value[i]);
		if (digit < 0)
			return 0;
		c->checksum = c->checksum << 4 | (uint64_t)digit;
	}
	return c->bytes > 0 && length == 16;
}

static int sextet(char c)
{
	return c >= 'A' && c <= 'Z' ? c - 'A' : c >= 'a' && c <= 'z' ? c - 'a' + 26 : c >= '0' && c <= '9' ? c - '0' + 52
		: c == '+' ? 62 : c == '/' ? 63 : -1;
}

int rbf_carrier_decode(const char *text, const rbf_carrier *c, unsigned char *record)
{
	/* back over blanks and the comment's end to its last digit, then to where the comment starts */
	const char *end = c->mark;
	while (end > text && end[-1] != '>')
		end--;
	if (end - text < 4 || memcmp(end - 3, "-->", 3))
		return 0;
	end -= 3;
	const char *start = memrchr(text, '<', (size_t)(end - text));
	const size_t opening = sizeof RBF_CARRIER_DATA - 2; /* the line's end may have become another */
	if (!start || (size_t)(end - start) < opening || memcmp(start, RBF_CARRIER_DATA, opening))
		return 0;
	uint64_t used = 0;
	uint32_t bits = 0;
	int count = 0;
	for (const char *at = start + opening; at < end; at++) {
		const int digit = sextet(*at);
		if (digit < 0) {
			if (*at != '\n' && *at != '\r' && *at != ' ' && *at != '\t' && *at != '=')
				return 0;
			continue;
		}
		bits = bits << 6 | (uint32_t)digit;
		count += 6;
		if (count >= 8) {
			if (used == c->bytes)
				return 0;
			count -= 8;
			record[used++] = (unsigned char)(bits >> count);
		}
	}
	return used == c->bytes;
}
