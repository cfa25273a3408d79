/* SPDX-License-Identifier: BSD-3-Clause */
/* What the commands share: options, messages, the progress bar, signals. */
#ifndef CMD_COMMON_H
#define CMD_COMMON_H
#include <stddef.h>

#include "bsdfrbf.h"

/* Remembers the name that messages start with, and readies standard streams. First call of every main(). */
void cmd_start(const char *argv0);
const char *cmd_name(void);

/* "name: message" on stderr; the second one exits with 1. */
void cmd_say(const char *format, ...) __attribute__((format(printf, 1, 2)));
_Noreturn void cmd_fail(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* For one of several processes that work together: whether it shows messages, and a function that is called before it exits because
 * of an error, and answers whether it is the one to tell. */
void cmd_share_output(int shows, int (*tells)(void));
int cmd_shows(void);

/* A mistake in the options: message and usage, exit 1. */
_Noreturn void cmd_misuse(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* What the command's manual page says: usage behind the name, and the options (doc/man/man2help.c). */
extern const char cmd_usage[], cmd_help[];

/* The option at argv[*at], or NULL where the files begin; "--" is passed over. `lead`: characters that an option may start
 * with, "-" or "-+". Answers --help and --version itself, and exits. */
const char *cmd_option(int argc, char **argv, int *at, const char *lead);
_Noreturn void cmd_unknown(const char *word);

/* The value of the option at argv[*at]: attached ("-n4") or the next word ("-n 4"). Exits if there is none. */
const char *cmd_value(int argc, char **argv, int *at);

/* Numbers within [low, high]; anything else exits with a message that names the option. */
long cmd_integer(const char *option, const char *text, long low, long high);
double cmd_real(const char *option, const char *text, double low, double high);

/* Exits with a message if what was printed did not all get out. */
void cmd_finish_output(void);

/* A context whose warnings go to stderr as "name: warning - text". Exits if out of memory. */
bsdfrbf_context *cmd_context(void);

/* Opens an .rbf file or exits with the library's message. */
bsdfrbf_model *cmd_open(bsdfrbf_context *context, const char *path);

/* How many triangles (or segments) hold a cut-off, and the disagreement of each, if wanted. */
int cmd_cutoffs(const bsdfrbf_model *model, bsdfrbf_component component, int triangles, float *disagreement);

/* Bar of `length` characters on stderr for as long as the context works; 0 for none. */
void cmd_progress(bsdfrbf_context *context, int length);
void cmd_progress_clear(void);

/* From now on SIGINT, SIGTERM and SIGHUP ask the work to stop at its next progress report; a second one ends at once. */
void cmd_catch_signals(void);
int cmd_interrupted(void);
/* Ends as the signal would have, so that shells and make see it. */
_Noreturn void cmd_end_by_signal(void);
#endif
