/* SPDX-License-Identifier: BSD-3-Clause */
/* Streams of numbers on stdin and stdout, for commands that answer millions of queries. */
#ifndef CMD_STREAM_H
#define CMD_STREAM_H
#include <stddef.h>

/* Vectors from stdin. format: 'a' ASCII, 'f' float, 'd' double, in the machine's byte order. */
typedef struct cmd_reader cmd_reader;
cmd_reader *cmd_reader_new(char format, int numbers_per_record);
void cmd_reader_free(cmd_reader *reader);
/* Reads up to `capacity` records into records; waits only for the first. 0 at the end. A number that is none, one that is
 * not finite, and an incomplete record at the end exit with a message that counts records. */
size_t cmd_read(cmd_reader *reader, float *records, size_t capacity);

/* Writes rows of numbers to stdout; exits on failure. Nothing is held back: a following cmd_read may wait. */
typedef struct cmd_writer cmd_writer;
cmd_writer *cmd_writer_new(char format);
void cmd_writer_free(cmd_writer *writer);
void cmd_write(cmd_writer *writer, const float *numbers, size_t rows, size_t columns);
#endif
