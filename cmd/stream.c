/* SPDX-License-Identifier: BSD-3-Clause */
#include "stream.h"
#include "common.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { BUFFER = 1 << 17, TOKEN = 256, MOST_NUMBERS = 8 };

struct cmd_reader {
	char format;
	int width;                  /* numbers a record */
	int have;                   /* numbers of the record under way */
	float record[MOST_NUMBERS];
	unsigned long long records; /* complete ones so far */
	size_t at, end;             /* unread part of the buffer */
	int finished;
	char buffer[BUFFER];
};

/* 10^k for k from -64 to 64: far enough for every float. */
static double power_of_ten(int k)
{
	static double table[129];
	if (table[0] == 0)
		for (int i = -64; i <= 64; i++)
			table[i + 64] = pow(10, i);
	return table[(k < -64 ? -64 : k > 64 ? 64 : k) + 64];
}

cmd_reader *cmd_reader_new(char format, int numbers_per_record)
{
	cmd_reader *reader = calloc(1, sizeof *reader);
	if (!reader || numbers_per_record > MOST_NUMBERS)
		cmd_fail("out of memory");
	reader->format = format;
	reader->width = numbers_per_record;
	return reader;
}

void cmd_reader_free(cmd_reader *reader)
{
	free(reader);
}

/* Reads on behind what is left; sets `finished` at the end of the input. */
static void refill(cmd_reader *reader)
{
	memmove(reader->buffer, reader->buffer + reader->at, reader->end - reader->at);
	reader->end -= reader->at;
	reader->at = 0;
	for (;;) {
		const ssize_t got = read(STDIN_FILENO, reader->buffer + reader->end, BUFFER - reader->end);
		if (got > 0) {
			reader->end += (size_t)got;
			return;
		}
		if (got == 0) {
			reader->finished = 1;
			return;
		}
		if (errno != EINTR)
			cmd_fail("standard input: %s", strerror(errno));
	}
}

static int blank(char c)
{
	return c == ' ' || (c >= '\t' && c <= '\r');
}

/* Value of the token. Plain decimals of up to 15 digits are exact in two operations (Clinger 1990); strtod does the rest. */
static double token_value(const cmd_reader *reader, const char *token, size_t length)
{
	const char *p = token, *const end = token + length;
	const int negative = *p == '-';
	p += *p == '-' || *p == '+';
	unsigned long long mantissa = 0;
	int digits = 0, exponent = 0;
	for (; p < end && *p >= '0' && *p <= '9'; p++, digits++)
		mantissa = 10 * mantissa + (unsigned)(*p - '0');
	if (p < end && *p == '.')
		for (p++; p < end && *p >= '0' && *p <= '9'; p++, digits++, exponent--)
			mantissa = 10 * mantissa + (unsigned)(*p - '0');
	if (p == end && digits > 0 && digits <= 15) {
		const double value = exponent ? (double)mantissa / power_of_ten(-exponent) : (double)mantissa;
		return negative ? -value : value;
	}
	char text[TOKEN + 1], *rest = text;
	memcpy(text, token, length);
	text[length] = 0;
	const double value = strtod(text, &rest);
	if (rest == text || *rest)
		cmd_fail("standard input, record %llu: '%s' is not a number (a record has %d)", reader->records + 1, text, reader->width);
	return value;
}

/* The next number; 0 if the buffer holds no complete one. */
static int next_number(cmd_reader *reader, double *value)
{
	if (reader->format != 'a') {
		const size_t size = reader->format == 'd' ? sizeof(double) : sizeof(float);
		if (reader->end - reader->at < size)
			return 0;
		if (reader->format == 'd') {
			memcpy(value, reader->buffer + reader->at, size);
		} else {
			float number;
			memcpy(&number, reader->buffer + reader->at, size);
			*value = number;
		}
		reader->at += size;
		return 1;
	}
	while (reader->at < reader->end && blank(reader->buffer[reader->at]))
		reader->at++;
	size_t stop = reader->at;
	while (stop < reader->end && !blank(reader->buffer[stop]))
		stop++;
	const size_t length = stop - reader->at;
	if (length > TOKEN)
		cmd_fail("standard input, record %llu: not a number (binary input needs -ff or -fd)", reader->records + 1);
	if (!length || (stop == reader->end && !reader->finished))
		return 0;
	*value = token_value(reader, reader->buffer + reader->at, length);
	reader->at = stop;
	return 1;
}

size_t cmd_read(cmd_reader *reader, float *records, size_t capacity)
{
	size_t count = 0;
	while (count < capacity) {
		double value;
		if (!next_number(reader, &value)) {
			if (count > 0)
				break; /* answer these before waiting for more */
			if (reader->finished) {
				if (reader->have > 0 || reader->at < reader->end)
					cmd_fail("standard input ends within record %llu (a record has %d numbers)", reader->records + 1,
						reader->width);
				break;
			}
			refill(reader);
			continue;
		}
		const float number = (float)value;
		if (!isfinite(number))
			cmd_fail("standard input, record %llu: a number that is not finite", reader->records + 1);
		reader->record[reader->have++] = number;
		if (reader->have == reader->width) {
			memcpy(records + count++ * (size_t)reader->width, reader->record, (size_t)reader->width * sizeof *records);
			reader->have = 0;
			reader->records++;
		}
	}
	return count;
}

struct cmd_writer {
	char format;
	size_t used;
	char buffer[BUFFER];
};

cmd_writer *cmd_writer_new(char format)
{
	cmd_writer *writer = calloc(1, sizeof *writer);
	if (!writer)
		cmd_fail("out of memory");
	writer->format = format;
	return writer;
}

void cmd_writer_free(cmd_writer *writer)
{
	free(writer);
}

static void flush(cmd_writer *writer)
{
	for (size_t at = 0; at < writer->used; ) {
		const ssize_t put = write(STDOUT_FILENO, writer->buffer + at, writer->used - at);
		if (put < 0 && errno != EINTR)
			cmd_fail("standard output: %s", strerror(errno));
		at += put > 0 ? (size_t)put : 0;
	}
	writer->used = 0;
}

/* As printf's "%.6e", five times as fast. */
static size_t print(char *to, float number)
{
	const double size = fabs((double)number);
	if (!isfinite(number) || number == 0)
		return (size_t)sprintf(to, "%.6e", number);
	int exponent = (int)floor(log10(size));
	long digits = lrint(size * power_of_ten(6 - exponent));
	if (digits < 1000000)
		digits = lrint(size * power_of_ten(6 - --exponent));
	if (digits > 9999999)
		digits = lrint(size * power_of_ten(6 - ++exponent));
	char *p = to;
	if (number < 0)
		*p++ = '-';
	for (int i = 7; i > 1; i--, digits /= 10)
		p[i] = (char)('0' + digits % 10);
	p[1] = '.';
	p[0] = (char)('0' + digits);
	p += 8;
	*p++ = 'e';
	*p++ = exponent < 0 ? '-' : '+';
	const int e = abs(exponent);
	*p++ = (char)('0' + e / 10);
	*p++ = (char)('0' + e % 10);
	return (size_t)(p - to);
}

void cmd_write(cmd_writer *writer, const float *numbers, size_t rows, size_t columns)
{
	for (size_t i = 0; i < rows * columns; i++) {
		if (writer->used > BUFFER - 32)
			flush(writer);
		char *to = writer->buffer + writer->used;
		if (writer->format == 'a') {
			const size_t length = print(to, numbers[i]);
			to[length] = (i + 1) % columns ? ' ' : '\n';
			writer->used += length + 1;
		} else if (writer->format == 'd') {
			const double number = numbers[i];
			memcpy(to, &number, sizeof number);
			writer->used += sizeof number;
		} else {
			memcpy(to, &numbers[i], sizeof numbers[i]);
			writer->used += sizeof numbers[i];
		}
	}
	flush(writer);
}
