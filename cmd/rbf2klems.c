/* SPDX-License-Identifier: BSD-3-Clause */
/* rbf2klems: a recorded interpolant as Klems matrices in BSDF XML, for Radiance or for WINDOW. */
#include "xml_options.h"

#include <stdio.h>
#include <string.h>

static const char usage[] = "[-b basis][-w [-solar file.rbf|visible]]" XML_USAGE " file.rbf";
static const char help[] =
	"Writes Klems matrices as XML on standard output.\n"
	"  -b name  basis: full (default), half or quarter; or -f, -h, -q as with bsdf2klems\n"
	"  -w       for WINDOW: all four components, full basis; needs the thickness, -s t=.003\n"
	"  -solar f Solar data for WINDOW: from another .rbf file, or `visible' for a copy of the visible data\n" XML_HELP;

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
	int at;
	xml_start(argc, argv, &options);
	for (at = 1; at < argc && argv[at][0] == '-' && argv[at][1]; at++) {
		const char *word = argv[at];
		if (!strcmp(word, "--")) {
			at++;
			break;
		}
		if (word[1] == '-')
			cmd_long_option(word, usage, help);
		else if (!strcmp(word, "-solar")) {
			if (++at >= argc)
				cmd_fail("option '-solar' needs a value\nUsage: %s %s", cmd_name(), usage);
			solar = argv[at];
		} else if (!strcmp(word, "-w"))
			options.window = 1;
		else if (!strcmp(word, "-h") || !strcmp(word, "-q") || !strcmp(word, "-f"))
			options.basis = basis_of(word + 1);
		else if (word[1] == 'b')
			options.basis = basis_of(cmd_value(argc, argv, &at, usage));
		else if (!xml_option(argc, argv, &at, usage, &options))
			cmd_unknown(word, usage);
	}
	if (argc - at != 1)
		cmd_fail("exactly one .rbf file is needed\nUsage: %s %s", cmd_name(), usage);
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
