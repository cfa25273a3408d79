/* SPDX-License-Identifier: BSD-3-Clause */
/* rbf2ttree: a recorded interpolant as a tensor tree in BSDF XML; options follow bsdf2ttree and genBSDF of Radiance. */
#include "xml_options.h"

#include <stdio.h>
#include <string.h>

static const char usage[] = "[-g log2][-e error][-t pct][+a|-a]" XML_USAGE " file.rbf";
static const char help[] =
	"Writes a tensor tree (variable-resolution BSDF) as XML on standard output.\n"
	"  -g log2  finest resolution, 2^log2 cells a side (default 5; isotropic 6)\n"
	"  -e error differences that are averaged out add at most this share to the error (default .03)\n"
	"  -t pct   save at least this percentage of the finest cells, as bsdf2ttree does\n"
	"  +a, -a   mean with the reversed directions (reciprocity), or not (default)\n" XML_HELP;

int main(int argc, char **argv)
{
	bsdfrbf_resample_options options;
	int at;
	xml_start(argc, argv, &options);
	for (at = 1; at < argc && (argv[at][0] == '-' || argv[at][0] == '+') && argv[at][1]; at++) {
		const char *word = argv[at];
		if (!strcmp(word, "--")) {
			at++;
			break;
		}
		if (!strcmp(word, "+a") || !strcmp(word, "-a"))
			options.reciprocal = word[0] == '+';
		else if (word[0] == '+')
			cmd_unknown(word, usage);
		else if (word[1] == '-')
			cmd_long_option(word, usage, help);
		else if (xml_option(argc, argv, &at, usage, &options))
			continue;
		else if (word[1] == 'g')
			options.log2 = (int)cmd_integer("-g", cmd_value(argc, argv, &at, usage), 2, 8);
		else if (word[1] == 'e')
			options.error = cmd_real("-e", cmd_value(argc, argv, &at, usage), 0, 1);
		else if (word[1] == 't')
			options.cull = cmd_real("-t", cmd_value(argc, argv, &at, usage), 0, 99.9);
		else
			cmd_unknown(word, usage);
	}
	if (argc - at != 1)
		cmd_fail("exactly one .rbf file is needed\nUsage: %s %s", cmd_name(), usage);
	bsdfrbf_context *context = cmd_context();
	bsdfrbf_model *model = cmd_open(context, argv[at]);
	const int status = xml_write(context, argv[at], model, bsdfrbf_write_tree, &options);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return status;
}
