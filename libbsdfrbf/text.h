/* SPDX-License-Identifier: BSD-3-Clause */
/* Reads text line by line and takes numbers out of it, whatever the host's locale is. */
#ifndef RBF_TEXT_H
#define RBF_TEXT_H
#include "status.h"

#include <stdint.h>
#include <stdio.h>

/* A text file being read. Lines end with LF, CR LF or CR; a byte order mark of UTF-8 is skipped. */
typedef struct rbf_text {
	bsdfrbf_context *context;
	FILE *file;
	char name[256];       /* as shown in messages: a long path keeps its end */
	size_t number;        /* of the line last read, from 1 */
	char *line;           /* that line, without its end, closed by NUL */
	size_t length, capacity;
	unsigned char *buffer;
	size_t next, fill;
	uint64_t before;      /* bytes of the file before the buffer */
	int ended;
} rbf_text;

/* Opens the file. Also on failure, rbf_text_close() is allowed and harmless. Errors: IO, MEMORY. */
bsdfrbf_status rbf_text_open(bsdfrbf_context *context, rbf_text *text, const char *path);
void rbf_text_close(rbf_text *text);

/* The first bytes of the file, before any line was read. */
const unsigned char *rbf_text_peek(const rbf_text *text, size_t *count);

/* Next line; *more is 0 at the end of the file. Errors: IO, SYNTAX (NUL byte, endless line), MEMORY. */
bsdfrbf_status rbf_text_line(rbf_text *text, int *more);

/* The next `count` bytes as they are, behind the lines read so far. *offset: where in the file they start, for messages.
 * Errors: IO, SYNTAX (the file ends before). */
bsdfrbf_status rbf_text_bytes(rbf_text *text, void *bytes, size_t count, uint64_t *offset);

/* Fails with "file:line: " before the message; without the line if line is 0. */
bsdfrbf_status rbf_text_fail(const rbf_text *text, size_t line, bsdfrbf_status status, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* A word between blanks. */
typedef struct rbf_word {
	const char *start;
	size_t length;
} rbf_word;

/* Next word at *cursor, which moves behind it; 0 if there is none. */
int rbf_word_next(const char **cursor, rbf_word *word);

/* 1 if the word is `text`, capitals or not. */
int rbf_word_is(rbf_word word, const char *text);

/* The word, cut to size and printable, for a message. */
const char *rbf_word_show(rbf_word word, char shown[48]);

typedef enum rbf_number_kind {
	RBF_NUMBER_OK,
	RBF_NUMBER_NONE,      /* not a number */
	RBF_NUMBER_COMMA,     /* a decimal comma, or comma-separated columns */
	RBF_NUMBER_NOT_FINITE /* nan, inf, or beyond the range of double */
} rbf_number_kind;

/* The whole word as a number, with a decimal point. *value is set only if it is OK. */
rbf_number_kind rbf_word_number(rbf_word word, double *value);

/* The same, with a message that names `what`. Errors: SYNTAX, DATA (not finite). */
bsdfrbf_status rbf_text_number(const rbf_text *text, rbf_word word, const char *what, double *value);
#endif
