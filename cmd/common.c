/* SPDX-License-Identifier: BSD-3-Clause */
#include "common.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const char *program = "bsdfrbf";
static int bar_length;        /* 0: no bar */
static double bar_started, bar_last; /* seconds */
static char bar_shown[512];   /* what stands on the terminal, "" if nothing */
static volatile sig_atomic_t caught;
static int hidden;            /* another process shows what this one would */
static int (*tells_failure)(void);

/* ---------------------------------------------------------------- messages */

/* A standard stream that the caller closed must not become the file that is written. What is read or printed there fails, messages
 * vanish. */
static void fill_standard_streams(void)
{
	static const int mode[3] = {O_WRONLY, O_RDONLY, O_WRONLY};
	for (int file = 0; file < 3; file++)
		if (fcntl(file, F_GETFD) < 0 && open("/dev/null", mode[file]) != file)
			_exit(1);
}

void cmd_start(const char *argv0)
{
	const char *slash = argv0 ? strrchr(argv0, '/') : NULL;
	if (argv0 && *argv0)
		program = slash ? slash + 1 : argv0;
	fill_standard_streams();
	signal(SIGXFSZ, SIG_IGN); /* a file beyond the shell's limit is an error with a message, as on a full disk */
}

const char *cmd_name(void)
{
	return program;
}

void cmd_share_output(int shows, int (*tells)(void))
{
	hidden = !shows;
	tells_failure = tells;
}

int cmd_shows(void)
{
	return !hidden;
}

static void say(const char *kind, const char *format, va_list arguments)
{
	if (hidden)
		return;
	cmd_progress_clear();
	fprintf(stderr, "%s: %s", program, kind);
	vfprintf(stderr, format, arguments);
	fputc('\n', stderr);
}

void cmd_say(const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	say("", format, arguments);
	va_end(arguments);
}

/* Whether this process tells of a failure, its own. */
static void before_failure(void)
{
	if (tells_failure)
		hidden = !tells_failure();
}

void cmd_fail(const char *format, ...)
{
	va_list arguments;
	before_failure();
	va_start(arguments, format);
	say("", format, arguments);
	va_end(arguments);
	exit(1);
}

void cmd_misuse(const char *format, ...)
{
	va_list arguments;
	before_failure();
	va_start(arguments, format);
	say("", format, arguments);
	va_end(arguments);
	if (!hidden)
		fprintf(stderr, "Usage: %s %s\n", program, cmd_usage);
	exit(1);
}

static void warn(void *unused, const char *text)
{
	(void)unused;
	if (hidden)
		return;
	cmd_progress_clear();
	fprintf(stderr, "%s: warning - %s\n", program, text);
}

void cmd_finish_output(void)
{
	if (fflush(stdout) || ferror(stdout))
		cmd_fail("standard output: cannot write");
}

bsdfrbf_context *cmd_context(void)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	if (!context)
		cmd_fail("out of memory");
	bsdfrbf_set_warning(context, warn, NULL);
	return context;
}

bsdfrbf_model *cmd_open(bsdfrbf_context *context, const char *path)
{
	bsdfrbf_model *model = NULL;
	if (bsdfrbf_open(context, path, &model) != BSDFRBF_OK)
		cmd_fail("%s", bsdfrbf_message(context));
	return model;
}

int cmd_cutoffs(const bsdfrbf_model *model, bsdfrbf_component component, int triangles, float *disagreement)
{
	int count = 0;
	for (int t = 0; t < triangles; t++) {
		const float one = bsdfrbf_get_disagreement(model, component, t);
		count += one > BSDFRBF_CUTOFF;
		if (disagreement)
			disagreement[t] = one;
	}
	return count;
}

/* ----------------------------------------------------------------- options */

const char *cmd_option(int argc, char **argv, int *at, const char *lead)
{
	const char *word = *at < argc ? argv[*at] : "";
	if (!word[0] || !strchr(lead, word[0]) || !word[1])
		return NULL;
	if (!strcmp(word, "--")) {
		++*at;
		return NULL;
	}
	if (!strcmp(word, "--help")) {
		if (!hidden)
			printf("Usage: %s %s\n%sExit status: 0, or 1 after an error. More: man %s\n", program, cmd_usage, cmd_help, program);
		cmd_finish_output();
		exit(0);
	}
	if (!strcmp(word, "--version")) {
		if (!hidden)
			printf("%s %s\n", program, bsdfrbf_version());
		cmd_finish_output();
		exit(0);
	}
	return word;
}

void cmd_unknown(const char *word)
{
	cmd_misuse("unknown option '%s'", word);
}

const char *cmd_value(int argc, char **argv, int *at)
{
	if (argv[*at][2])
		return argv[*at] + 2;
	if (*at + 1 >= argc)
		cmd_misuse("option '%s' needs a value", argv[*at]);
	return argv[++*at];
}

long cmd_integer(const char *option, const char *text, long low, long high)
{
	char *end;
	errno = 0;
	const long value = strtol(text, &end, 10);
	if (end == text || *end || errno || value < low || value > high)
		cmd_fail("option '%s' takes a whole number from %ld to %ld, not '%s'", option, low, high, text);
	return value;
}

double cmd_real(const char *option, const char *text, double low, double high)
{
	char *end;
	const double value = strtod(text, &end);
	if (end == text || *end || !(value >= low && value <= high))
		cmd_fail("option '%s' takes a number from %g to %g, not '%s'", option, low, high, text);
	return value;
}

/* ---------------------------------------------------------------- progress */

static double seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Time that is left if the rest goes as what is done, once that can be told: "  1:05 left". */
static void time_left(char *text, size_t room, double elapsed, double done)
{
	const double left = done > 0 ? elapsed / done - elapsed : 0;
	if (elapsed < 2 || done < .02 || done > .995 || left > 359999)
		snprintf(text, room, "%10s", "");
	else if (left < 3600)
		snprintf(text, room, "%2d:%02d left", (int)left / 60, (int)left % 60);
	else
		snprintf(text, room, "%3d h left", (int)(left / 3600 + .5));
}

static int show(void *unused, const char *stage, double done)
{
	(void)unused;
	if (bar_length > 0 && !caught) {
		enum { FIXED = 38 }; /* stage, brackets, per cent, time */
		char text[sizeof bar_shown], left[32];
		const double time = seconds();
		const int room = bar_length - FIXED > 4 ? bar_length - FIXED : 4;
		const int full = (int)(done * room + .5);
		int at = snprintf(text, sizeof text, "%-18.18s [", stage);
		for (int i = 0; i < room && at < (int)sizeof text - 24; i++)
			text[at++] = i < full ? '=' : ' ';
		time_left(left, sizeof left, time - bar_started, done);
		snprintf(text + at, sizeof text - (size_t)at, "] %3.0f %% %.10s", 100 * done, left);
		/* Ten times a second is enough for the eye, and cheap however often the library reports. */
		if (strcmp(text, bar_shown) && (time - bar_last > .1 || !bar_shown[0] || done >= 1)) {
			fprintf(stderr, "\r%s", text);
			fflush(stderr);
			strcpy(bar_shown, text);
			bar_last = time;
		}
	}
	return caught != 0;
}

void cmd_progress(bsdfrbf_context *context, int length)
{
	bar_length = hidden ? 0 : length > 400 ? 400 : length;
	bar_started = seconds();
	bsdfrbf_set_progress(context, show, NULL);
}

void cmd_progress_clear(void)
{
	if (!bar_shown[0])
		return;
	fprintf(stderr, "\r%*s\r", (int)strlen(bar_shown), "");
	bar_shown[0] = 0;
}

/* ----------------------------------------------------------------- signals */

static void on_signal(int number)
{
	caught = number;
}

void cmd_catch_signals(void)
{
	const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
	for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
		struct sigaction action, old;
		memset(&action, 0, sizeof action);
		action.sa_handler = on_signal;
		action.sa_flags = (int)SA_RESETHAND; /* no restart: a read that waits for a pipe ends too */
		/* what nohup or a background shell ignores stays ignored */
		if (!sigaction(numbers[i], NULL, &old) && old.sa_handler != SIG_IGN)
			sigaction(numbers[i], &action, NULL);
	}
}

int cmd_interrupted(void)
{
	return caught;
}

void cmd_end_by_signal(void)
{
	const int number = caught ? caught : SIGINT;
	cmd_progress_clear();
	signal(number, SIG_DFL);
	raise(number);
	_exit(1);
}
