/* SPDX-License-Identifier: BSD-3-Clause */
#include "xml_options.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int bar;             /* characters */
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

static void set_text(const char *text, const char *usage, bsdfrbf_resample_options *options)
{
	if (!text[0] || text[1] != '=')
		cmd_fail("option '-s' takes n=, m=, t=, w= or h= with a text or a number, not '%s'\nUsage: %s %s", text, cmd_name(), usage);
	switch (text[0]) {
	case 'n': options->name = text + 2; break;
	case 'm': options->manufacturer = text + 2; break;
	case 't': options->thickness = cmd_real("-s t=", text + 2, 0, 1e3); break;
	case 'w': options->width = cmd_real("-s w=", text + 2, 0, 1e3); break;
	case 'h': options->height = cmd_real("-s h=", text + 2, 0, 1e3); break;
	default: cmd_fail("option '-s' knows n, m, t, w and h, not '%c'", text[0]);
	}
}

int xml_option(int argc, char **argv, int *at, const char *usage, bsdfrbf_resample_options *options)
{
	const char *word = argv[*at];
	if (word[1] == 'c')
		options->components = components_of(cmd_value(argc, argv, at, usage));
	else if (word[1] == 'o')
		options->path = cmd_value(argc, argv, at, usage);
	else if (word[1] == 's')
		set_text(cmd_value(argc, argv, at, usage), usage, options);
	else if (word[1] == 'n')
		options->threads = (int)cmd_integer("-n", cmd_value(argc, argv, at, usage), 1, 1024);
	else if (word[1] == 'p')
		bar = word[2] ? (int)cmd_integer("-p", word + 2, 1, 400) : 0;
	else
		return 0;
	return 1;
}

int xml_isotropic(const bsdfrbf_model *model, unsigned components)
{
	for (int n = 0; n < 4; n++) {
		bsdfrbf_component_info info;
		if ((!components || components >> n & 1) && bsdfrbf_get_component_info(model, (bsdfrbf_component)n, &info) == BSDFRBF_OK
				&& info.symmetry != 'I')
			return 0;
	}
	return 1;
}

int xml_write(bsdfrbf_context *context, const bsdfrbf_model *model,
	bsdfrbf_status (*write)(bsdfrbf_context *, const bsdfrbf_model *, const bsdfrbf_resample_options *),
	bsdfrbf_resample_options *options)
{
	cmd_progress(context, bar);
	cmd_catch_signals();
	const bsdfrbf_status status = write(context, model, options);
	cmd_progress_clear();
	if (status == BSDFRBF_ERR_CANCELLED && cmd_interrupted())
		cmd_end_by_signal();
	if (status != BSDFRBF_OK)
		cmd_fail("%s", bsdfrbf_message(context));
	if (!options->path && fflush(stdout))
		cmd_fail("standard output: write error");
	return 0;
}
