/* SPDX-License-Identifier: BSD-3-Clause */
#include "xml_options.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int bar;             /* characters */
static int link_wanted;     /* -link */
static char linked[PATH_MAX];
static char command[2048];  /* for the XML's comment */

static int to_stdout(void *unused, const void *data, size_t bytes)
{
	(void)unused;
	return fwrite(data, 1, bytes, stdout) != bytes;
}

void xml_start(int argc, char **argv, bsdfrbf_resample_options *options)
{
	cmd_start(argv[0]);
	bsdfrbf_resample_defaults(options);
	options->write = to_stdout;
	size_t used = 0;
	for (int n = 0; n < argc && used < sizeof command; n++)
		used += (size_t)snprintf(command + used, sizeof command - used, "%s%s", n ? " " : "", n ? argv[n] : cmd_name());
	options->comment = command;
	bar = isatty(2) ? 79 : 0;
}

static unsigned components_of(const char *list)
{
	static const char *const name[4] = {"rf", "rb", "tf", "tb"};
	unsigned bits = 0;
	for (const char *at = list; *at;) {
		const size_t length = strcspn(at, ",");
		unsigned n = 0;
		while (n < 4 && (length != 2 || strncmp(at, name[n], 2)))
			n++;
		if (n == 4)
			cmd_fail("option '-c' takes a list of rf, rb, tf, tb, such as tf,rb, not '%s'", list);
		bits |= 1u << n;
		at += length + (at[length] == ',');
	}
	return bits;
}

static void set_text(const char *text, bsdfrbf_resample_options *options)
{
	if (!text[0] || text[1] != '=')
		cmd_misuse("option '-s' takes n=, m=, t=, w= or h= with a text or a number, not '%s'", text);
	switch (text[0]) {
	case 'n': options->name = text + 2; break;
	case 'm': options->manufacturer = text + 2; break;
	case 't': options->thickness = cmd_real("-s t=", text + 2, 0, 1e3); break;
	case 'w': options->width = cmd_real("-s w=", text + 2, 0, 1e3); break;
	case 'h': options->height = cmd_real("-s h=", text + 2, 0, 1e3); break;
	default: cmd_fail("option '-s' knows n, m, t, w and h, not '%c'", text[0]);
	}
}

int xml_option(int argc, char **argv, int *at, bsdfrbf_resample_options *options)
{
	const char *word = argv[*at];
	if (!strcmp(word, "-embed"))
		options->embed = 1;
	else if (!strcmp(word, "-link"))
		link_wanted = 1;
	else if (word[1] == 'c')
		options->components = components_of(cmd_value(argc, argv, at));
	else if (word[1] == 'o')
		options->path = cmd_value(argc, argv, at);
	else if (word[1] == 's')
		set_text(cmd_value(argc, argv, at), options);
	else if (word[1] == 'n')
		options->threads = (int)cmd_integer("-n", cmd_value(argc, argv, at), 1, 1024);
	else if (word[1] == 'p')
		bar = word[2] ? (int)cmd_integer("-p", word + 2, 1, 400) : 0;
	else
		return 0;
	return 1;
}

/* The path that the XML points to: the file's name if both are in one folder, so that they can move together, else all of it. */
static const char *path_from(const char *xml, const char *file)
{
	char folder[PATH_MAX], real_folder[PATH_MAX];
	if (!bsdfrbf_is_rbf(file))
		cmd_fail("%s: '-link' needs an .rbf file to point to", file);
	if (!realpath(file, linked))
		cmd_fail("%s: cannot find where it is", file);
	char *slash = strrchr(linked, '/');
	snprintf(folder, sizeof folder, "%s", xml ? xml : ".");
	if (xml) {
		char *end = strrchr(folder, '/');
		if (end)
			end[end == folder] = 0;
		else
			strcpy(folder, ".");
	}
	if (realpath(folder, real_folder) && strlen(real_folder) == (size_t)(slash - linked)
			&& !strncmp(real_folder, linked, (size_t)(slash - linked)))
		return slash + 1;
	return linked;
}

int xml_write(bsdfrbf_context *context, const char *file, const bsdfrbf_model *model,
	bsdfrbf_status (*write)(bsdfrbf_context *, const bsdfrbf_model *, const bsdfrbf_resample_options *),
	bsdfrbf_resample_options *options)
{
	if (link_wanted)
		options->link = path_from(options->path, file);
	cmd_progress(context, bar);
	cmd_catch_signals();
	const bsdfrbf_status status = write(context, model, options);
	cmd_progress_clear();
	if (status == BSDFRBF_ERR_CANCELLED && cmd_interrupted())
		cmd_end_by_signal();
	if (!options->path)
		cmd_finish_output();
	if (status != BSDFRBF_OK)
		cmd_fail("%s", bsdfrbf_message(context));
	return 0;
}
