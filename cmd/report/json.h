/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers and texts as the report's page reads them: JSON, and base64 of packed codes. */
#ifndef REPORT_JSON_H
#define REPORT_JSON_H
#include <stddef.h>
#include <stdio.h>

/* Any bytes as a JSON string that may stand within <script>; what is not UTF-8 becomes '?'. */
void json_text(FILE *out, const char *text);

/* Bytes that grow. A failed allocation sets `failed`, and the rest is dropped. */
typedef struct codes {
	unsigned char *byte;
	size_t count, capacity;
	int failed;
} codes;

/* A value in sr^-1 in 16 bits: 0 for none (<= 0 or not a number), else a logarithm from CODE_LOW to CODE_HIGH in
 * CODE_STEPS steps, which is good to 0.02 %. The page has the same three numbers. */
#define CODE_LOW 1e-6
#define CODE_HIGH 1e6
#define CODE_STEPS 65534
unsigned code_of(double value);

void codes_clear(codes *c);
void codes_byte(codes *c, unsigned byte);
void codes_word(codes *c, unsigned word); /* 16 bits, little-endian */
void codes_value(codes *c, double value); /* code_of() */
void codes_unit(codes *c, double value);  /* from [-1, 1], 16 bits */

/* The bytes as a JSON string. */
void json_codes(FILE *out, const codes *c);
#endif
