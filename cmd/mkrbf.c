/* SPDX-License-Identifier: BSD-3-Clause */
/* mkrbf: measurement files in, recorded interpolant out. Options -n, -s, -t, -g mean what they mean in pabopto2bsdf(1). */
#include "common.h"
#include "summary.h"
#include "mpi/ranks.h"

#include <ctype.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

typedef struct options {
	bsdfrbf_build_options build;
	const char *output;
	const char *symmetry;  /* as given, or NULL */
	const char *grazing;   /* as given, or NULL */
	double grazing_deg;    /* < 0: automatic */
	int reverse, reciprocal, quiet;
	int bar;               /* -1: where stderr is a terminal */
} options;

/* Letter for bsdfrbf_build_options, 0 for "auto". Whole words or the beginnings of them, in any case. */
static char symmetry_letter(const char *text)
{
	static const char *const word[] = {"anisotropic", "auto", "isotropic", "quadrilateral", "bilateral", "up"};
	for (size_t i = 0; *text && i < sizeof word / sizeof *word; i++)
		if (!strncasecmp(text, word[i], strlen(text)))
			return i == 1 ? 0 : (char)toupper((unsigned char)word[i][0]);
	cmd_fail("option '-s' takes isotropic, quadrilateral, bilateral, up, anisotropic or auto, not '%s'", text);
}

static int read_options(int argc, char **argv, options *o)
{
	const char *word;
	int at;
	for (at = 1; (word = cmd_option(argc, argv, &at, "-")); at++)
		switch (word[1]) {
		case 'o':
			o->output = cmd_value(argc, argv, &at);
			break;
		case 'n':
			o->build.threads = (int)cmd_integer("-n", cmd_value(argc, argv, &at), 1, 1024);
			break;
		case 's':
			o->symmetry = cmd_value(argc, argv, &at);
			o->build.symmetry = symmetry_letter(o->symmetry);
			break;
		case 'g':
			o->grazing = cmd_value(argc, argv, &at);
			o->grazing_deg = toupper((unsigned char)o->grazing[0]) == 'A' ? -1 : cmd_real("-g", o->grazing, 0, 90);
			break;
		case 'l':
			o->build.lobes = (int)cmd_integer("-l", cmd_value(argc, argv, &at), 1, 100000);
			break;
		case 'p': /* -p alone is "none", as in bsdf2klems(1) */
			o->bar = word[2] ? (int)cmd_integer("-p", word + 2, 0, 400) : 0;
			break;
		case 't':
		case 'r':
		case 'q':
			if (word[2])
				cmd_unknown(word);
			if (word[1] == 't')
				o->reverse = !o->reverse;
			else if (word[1] == 'r')
				o->reciprocal = 1;
			else
				o->quiet = 1;
			break;
		default:
			cmd_unknown(word);
		}
	for (int i = at; i < argc; i++)
		if (argv[i][0] == '-' && argv[i][1] && access(argv[i], F_OK))
			cmd_misuse("option '%s' stands after a file: options come first", argv[i]);
	return at;
}

/* Finds out what can be known of the output before minutes are spent. */
static void check_output(const options *o, int files, char **file)
{
	struct stat out, in;
	if (!o->output || !*o->output)
		cmd_misuse("no output file: give -o out.rbf");
	const int exists = !stat(o->output, &out);
	if (exists && S_ISDIR(out.st_mode))
		cmd_fail("%s: is a directory; give the name of a file", o->output);
	for (int i = 0; exists && i < files; i++)
		if (!stat(file[i], &in) && in.st_dev == out.st_dev && in.st_ino == out.st_ino)
			cmd_fail("%s: is one of the measurement files; give another name for the output", o->output);
	char *copy = strdup(o->output);
	if (!copy)
		cmd_fail("out of memory");
	const char *folder = dirname(copy);
	if (access(folder, W_OK))
		cmd_fail("%s: cannot write into the directory %s", o->output, folder);
	free(copy);
}

/* Options that change the result, as a text to record. Not -n and -o: the same data give the same bytes. */
static void record_options(bsdfrbf_context *context, bsdfrbf_model *model, const options *o)
{
	char text[512] = "mkrbf";
	size_t at = strlen(text);
	if (o->build.symmetry)
		at += (size_t)snprintf(text + at, sizeof text - at, " -s %c", o->build.symmetry);
	if (o->reverse)
		at += (size_t)snprintf(text + at, sizeof text - at, " -t");
	if (o->reciprocal)
		at += (size_t)snprintf(text + at, sizeof text - at, " -r");
	if (o->grazing)
		at += (size_t)(o->grazing_deg < 0 ? snprintf(text + at, sizeof text - at, " -g A")
			: snprintf(text + at, sizeof text - at, " -g %g", o->grazing_deg));
	if (o->build.lobes)
		snprintf(text + at, sizeof text - at, " -l %d", o->build.lobes);
	bsdfrbf_set_text(context, model, "command", text);
}

/* Names of the files without their folders, one a line, as far as a text may go. */
static void record_sources(bsdfrbf_context *context, bsdfrbf_model *model, int files, char **file)
{
	enum { MOST = 65535 };
	char *text = malloc(MOST + 1), *at = text;
	if (!text || *bsdfrbf_get_text(model, "source")) {
		free(text);
		return;
	}
	*at = 0;
	for (int i = 0; i < files; i++) {
		const char *slash = strrchr(file[i], '/'), *name = slash ? slash + 1 : file[i];
		if (strlen(name) + 2 >= (size_t)(text + MOST - at))
			break;
		at += sprintf(at, "%s%s", i ? "\n" : "", name);
	}
	bsdfrbf_set_text(context, model, "source", text);
	free(text);
}

/* Mean over the incidences. < 0: cannot be told. */
static double reciprocity(const bsdfrbf_model *model, bsdfrbf_component component, int incidences)
{
	double sum = 0;
	for (int i = 0; i < incidences; i++)
		sum += bsdfrbf_get_reciprocity(model, component, i);
	return incidences ? sum / incidences : -1;
}

static void print_size(const char *path, double seconds)
{
	struct stat status;
	if (!stat(path, &status))
		fprintf(stderr, "%s: %.1f MB in %.1f s\n", path, 1e-6 * (double)status.st_size, seconds);
}

static double now(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Ends the program if a call failed: by the signal that cancelled it, or with the library's message. */
static void expect(bsdfrbf_context *context, bsdfrbf_status status)
{
	if (cmd_interrupted())
		cmd_end_by_signal();
	if (status != BSDFRBF_OK)
		cmd_fail("%s", bsdfrbf_message(context));
}

/* What came of a step of option -r in one component. Returns 1 if its incidences are predicted worse. */
static int judge(int component, const char *step, const char *instead, const bsdfrbf_model *model, const bsdfrbf_model *made, int quiet)
{
	static const float WORSE = 1.05f;
	bsdfrbf_component_info before, after;
	if (bsdfrbf_get_component_info(model, (bsdfrbf_component)component, &before) != BSDFRBF_OK
		|| bsdfrbf_get_component_info(made, (bsdfrbf_component)component, &after) != BSDFRBF_OK)
		return 0;
	const double was = reciprocity(model, (bsdfrbf_component)component, before.incidences);
	const int worse = after.loo_error > WORSE * before.loo_error;
	if (!cmd_shows() || was < 0 || (quiet && !worse))
		return worse;
	cmd_progress_clear();
	if (worse)
		cmd_say("warning - %s: %s, left-out incidences would be predicted with an error of %.3f instead of %.3f; %s: check the sample's orientation",
			summary_name[component], step, after.loo_error, before.loo_error, instead);
	else
		cmd_say("%s: difference between f(a, b) and f(b, a) %.3f, was %.3f; leave-one-out error %.3f, was %.3f", summary_name[component],
			reciprocity(made, (bsdfrbf_component)component, after.incidences), was, after.loo_error, before.loo_error);
	return worse;
}

static void keep_better(bsdfrbf_model **model, bsdfrbf_model *made, int refused)
{
	bsdfrbf_close(refused ? made : *model);
	if (!refused)
		*model = made;
}

/* Divides scans by their gains, or multiplies them again if `back`. */
static void divide(bsdfrbf_context *context, bsdfrbf_data *data, float *const gain[4], int back)
{
	for (int c = 0; c < 4; c++)
		for (size_t i = 0; gain[c] && i < bsdfrbf_data_incidences(data, (bsdfrbf_component)c); i++)
			expect(context, bsdfrbf_data_scale(context, data, (bsdfrbf_component)c, i, back ? (double)gain[c][i] : 1 / (double)gain[c][i]));
}

static void tell_gains(int component, size_t scans, const float *gain)
{
	size_t off = 0;
	float least = 1, most = 1;
	for (size_t i = 0; i < scans; i++) {
		off += gain[i] < 1 || gain[i] > 1;
		least = gain[i] < least ? gain[i] : least;
		most = gain[i] > most ? gain[i] : most;
	}
	cmd_progress_clear();
	cmd_say("%s: %zu of %zu scans divided by gains that reciprocity tells, %.3f to %.3f", summary_name[component], off, scans, least, most);
}

/* Option -r, first: where whole scans are off by a factor, they are divided by it and all is built anew, unless incidences would be predicted
 * worse. */
static void remove_gains(bsdfrbf_context *context, bsdfrbf_data *data, const options *o, bsdfrbf_model **model)
{
	float *gain[4] = {NULL};
	bsdfrbf_model *made = NULL;
	int off = 0, refused = 0;
	for (int c = 0; c < 4; c++)
		off += summary_gains(*model, data, c, &gain[c]);
	if (off) {
		divide(context, data, gain, 0);
		expect(context, bsdfrbf_build(context, data, &o->build, &made));
		for (int c = 0; c < 4; c++)
			if (gain[c]) {
				if (cmd_shows() && !o->quiet)
					tell_gains(c, bsdfrbf_data_incidences(data, (bsdfrbf_component)c), gain[c]);
				refused |= judge(c, "divided by such gains", "they are left as measured", *model, made, o->quiet);
			}
		if (refused)
			divide(context, data, gain, 1);
		keep_better(model, made, refused);
	}
	for (int c = 0; c < 4; c++)
		free(gain[c]);
}

/* Option -r, then: builds anew from samples that meet their opposites half way, unless incidences would be predicted worse. */
static void symmetrize(bsdfrbf_context *context, bsdfrbf_data *data, const options *o, bsdfrbf_model **model)
{
	bsdfrbf_model *made = NULL;
	int refused = 0, known = 0;
	for (int c = 0; c < 4; c++) {
		if (!bsdfrbf_has(*model, (bsdfrbf_component)c))
			continue;
		const int both = bsdfrbf_get_reciprocity(*model, (bsdfrbf_component)c, 0) >= 0;
		known |= both;
		if (!both && cmd_shows())
			cmd_say("warning - %s: only one side was measured; nothing to make reciprocal", summary_name[c]);
	}
	if (!known)
		return;
	expect(context, bsdfrbf_data_symmetrize(context, data, *model));
	expect(context, bsdfrbf_build(context, data, &o->build, &made));
	for (int c = 0; c < 4; c++)
		refused |= judge(c, "made reciprocal", "that is not followed", *model, made, o->quiet);
	keep_better(model, made, refused);
}

int main(int argc, char **argv)
{
	const double start = now();
	options o = {.bar = -1};
	cmd_start(argv[0]);
	bsdfrbf_build_defaults(&o.build);
	o.build.team = ranks_start();
	const int at = read_options(argc, argv, &o), files = argc - at;
	if (files < 1)
		cmd_misuse("no measurement files");
	check_output(&o, files, argv + at);

	bsdfrbf_context *context = cmd_context();
	if (o.bar < 0)
		o.bar = isatty(STDERR_FILENO) && !o.quiet ? 79 : 0;
	cmd_progress(context, o.bar);

	bsdfrbf_data *data = bsdfrbf_data_new(context);
	expect(context, data ? BSDFRBF_OK : BSDFRBF_ERR_MEMORY);
	for (int i = 0; i < files; i++)
		expect(context, bsdfrbf_data_read(context, data, argv[at + i]));
	if (o.grazing) {
		size_t removed;
		expect(context, bsdfrbf_data_cull(context, data, o.grazing_deg, &removed));
		if (!o.quiet)
			cmd_say("left out %zu samples near grazing", removed);
	}
	if (o.reverse)
		bsdfrbf_data_reverse(data);

	bsdfrbf_model *model = NULL;
	expect(context, bsdfrbf_build(context, data, &o.build, &model));
	if (o.reciprocal) {
		remove_gains(context, data, &o, &model);
		symmetrize(context, data, &o, &model);
	}
	if (cmd_shows()) {
		record_options(context, model, &o);
		record_sources(context, model, files, argv + at);
		cmd_catch_signals(); /* from here on there is a temporary file to remove; before, a signal may end the program at once */
		if (bsdfrbf_save(context, model, o.output) != BSDFRBF_OK)
			expect(context, BSDFRBF_ERR_IO); /* a signal that came once the file is whole is too late */
		cmd_progress_clear();
		summary_warn(model);
		if (!o.reciprocal)
			summary_warn_gains(model, data);
		if (!o.quiet) {
			summary_print(model, data);
			print_size(o.output, now() - start);
		}
	}
	const int failed = ranks_end();
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return failed;
}
