/* SPDX-License-Identifier: BSD-3-Clause */
/* rbf2klems: a recorded interpolant as Klems matrices in BSDF XML, for Radiance or for WINDOW. */
#include "xml_options.h"

#include <stdio.h>
#include <string.h>

static bsdfrbf_basis basis_of(const char *text)
{
	static const char *const name[3] = {"full", "half", "quarter"};
	for (int n = 0; n < 3; n++)
		if (*text && !strncmp(text, name[n], strlen(text)))
			return (bsdfrbf_basis)n;
	cmd_fail("option '-b' takes full, half or quarter, not '%s'", text);
}

int main(int argc, char **argv)
{
	bsdfrbf_resample_options options;
	const char *solar = NULL;
	const char *word;
	int at;
	xml_start(argc, argv, &options);
	for (at = 1; (word = cmd_option(argc, argv, &at, "-")); at++) {
		if (!strcmp(word, "-solar")) {
			if (++at >= argc)
				cmd_misuse("option '-solar' needs a value");
			solar = argv[at];
		} else if (!strcmp(word, "-w"))
			options.window = 1;
		else if (!strcmp(word, "-h") || !strcmp(word, "-q") || !strcmp(word, "-f"))
			options.basis = basis_of(word + 1);
		else if (word[1] == 'b')
			options.basis = basis_of(cmd_value(argc, argv, &at));
		else if (!xml_option(argc, argv, &at, &options))
			cmd_unknown(word);
	}
	if (argc - at != 1)
		cmd_misuse("exactly one .rbf file is needed");
	bsdfrbf_context *context = cmd_context();
	bsdfrbf_model *model = cmd_open(context, argv[at]), *second = NULL;
	if (solar && strcmp(solar, "visible"))
		second = cmd_open(context, solar);
	if (solar)
		options.solar = second ? second : model;
	const int status = xml_write(context, argv[at], model, bsdfrbf_write_klems, &options);
	bsdfrbf_close(second);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return status;
}
