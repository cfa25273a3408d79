/* SPDX-License-Identifier: BSD-3-Clause */
/* rbfreport: one self-contained HTML page about a recorded interpolant and the measurements that it was made from. */
#include "common.h"
#include "report/component.h"
#include "report/json.h"
#include "report/page.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const component_name[4] = {"front reflection", "back reflection", "front transmission", "back transmission"};

enum { PAGE_BYTES = 5000000 };

/* 16-bit codes that the pictures of one component may have: what text, mesh and numbers leave of the page, shared.
 * A code takes 8/3 characters. */
static size_t words_for_pictures(const bsdfrbf_model *model)
{
	size_t text = 500000, components = 0;
	for (int c = 0; c < 4; c++) {
		bsdfrbf_component_info info;
		if (bsdfrbf_get_component_info(model, (bsdfrbf_component)c, &info) != BSDFRBF_OK)
			continue;
		components++;
		text += 300 * (size_t)info.incidences + 50 * (size_t)info.vertices + 25 * (size_t)info.triangles;
	}
	return (text < PAGE_BYTES / 2 ? PAGE_BYTES - text : PAGE_BYTES / 2) * 3 / 8 / (components ? components : 1);
}

/* Prints `text` up to `mark`; returns what follows it. */
static const char *until(const char *text, const char *mark)
{
	const char *at = strstr(text, mark);
	fwrite(text, 1, (size_t)(at - text), stdout);
	return at + strlen(mark);
}

static int has_option(const char *command, const char *option)
{
	const char *at = strstr(command, option);
	return at && (at[strlen(option)] == ' ' || !at[strlen(option)]);
}

static bsdfrbf_data *read_measurements(bsdfrbf_context *context, int files, char **file, int reverse)
{
	if (!files)
		return NULL;
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	if (!data)
		cmd_fail("out of memory");
	for (int i = 0; i < files; i++)
		if (bsdfrbf_data_read(context, data, file[i]) != BSDFRBF_OK)
			cmd_fail("%s", bsdfrbf_message(context));
	if (reverse)
		bsdfrbf_data_reverse(data);
	return data;
}

static void write_text(const bsdfrbf_model *model, const char *key)
{
	printf("\"%s\":", key);
	json_text(stdout, bsdfrbf_get_text(model, key));
	putchar(',');
}

int main(int argc, char **argv)
{
	const char *word;
	int at, reverse = 0, quiet = 0;
	cmd_start(argv[0]);
	for (at = 1; (word = cmd_option(argc, argv, &at, "-")); at++) {
		if (!strcmp(word, "-t"))
			reverse = 1;
		else if (!strcmp(word, "-q"))
			quiet = 1;
		else
			cmd_unknown(word);
	}
	if (at == argc)
		cmd_misuse("no .rbf file");
	bsdfrbf_context *context = cmd_context();
	bsdfrbf_model *model = cmd_open(context, argv[at]);
	reverse |= has_option(bsdfrbf_get_text(model, "command"), " -t");
	bsdfrbf_data *data = read_measurements(context, argc - at - 1, argv + at + 1, reverse);
	if (data && bsdfrbf_data_channels(data) != bsdfrbf_channels(model))
		cmd_fail("%s: has %d channels and the measurements %d: they are not what it was made from", argv[at],
			bsdfrbf_channels(model), bsdfrbf_data_channels(data));

	const size_t words = words_for_pictures(model);
	const char *file = strrchr(argv[at], '/'), *page = until(report_html, "@CSS@");
	fputs(report_css, stdout);
	page = until(page, "@DATA@");
	printf("{\"version\":\"%s\",\"channels\":%d,\"measured\":%s,\"file\":", bsdfrbf_version(), bsdfrbf_channels(model),
		data ? "true" : "false");
	json_text(stdout, file ? file + 1 : argv[at]);
	putchar(',');
	write_text(model, "name");
	write_text(model, "command");
	write_text(model, "source");
	printf("\"components\":[");
	for (int c = 0, written = 0; c < 4; c++) {
		const bsdfrbf_component component = (bsdfrbf_component)c;
		bsdfrbf_component_info info;
		int matched = 0;
		if (bsdfrbf_get_component_info(model, component, &info) != BSDFRBF_OK) {
			if (bsdfrbf_data_incidences(data, component) && !quiet)
				cmd_say("warning - the measurements have a %s, %s does not", component_name[c], argv[at]);
			continue;
		}
		if (written++)
			putchar(',');
		if (!report_component(stdout, model, component, data, words, &matched))
			cmd_fail("out of memory");
		if (data && matched < info.incidences && !quiet)
			cmd_say("warning - %s: no measurement of %d of the %d incident directions", component_name[c],
				info.incidences - matched, info.incidences);
	}
	printf("]}");
	page = until(page, "@JS@");
	fputs(report_js, stdout);
	fputs(page, stdout);
	cmd_finish_output();
	bsdfrbf_data_free(data);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return 0;
}
