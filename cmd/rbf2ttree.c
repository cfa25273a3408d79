/* SPDX-License-Identifier: BSD-3-Clause */
/* rbf2ttree: a recorded interpolant as a tensor tree in BSDF XML; options follow bsdf2ttree and genBSDF of Radiance. */
#include "xml_options.h"

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
	bsdfrbf_resample_options options;
	const char *word;
	int at;
	xml_start(argc, argv, &options);
	for (at = 1; (word = cmd_option(argc, argv, &at, "-+")); at++) {
		if (!strcmp(word, "+a") || !strcmp(word, "-a"))
			options.reciprocal = word[0] == '+';
		else if (word[0] == '+')
			cmd_unknown(word);
		else if (xml_option(argc, argv, &at, &options))
			continue;
		else if (word[1] == 'g')
			options.log2 = (int)cmd_integer("-g", cmd_value(argc, argv, &at), 2, 8);
		else if (word[1] == 'e')
			options.error = cmd_real("-e", cmd_value(argc, argv, &at), 0, 1);
		else if (word[1] == 't')
			options.cull = cmd_real("-t", cmd_value(argc, argv, &at), 0, 99.9);
		else
			cmd_unknown(word);
	}
	if (argc - at != 1)
		cmd_misuse("exactly one .rbf file is needed");
	bsdfrbf_context *context = cmd_context();
	bsdfrbf_model *model = cmd_open(context, argv[at]);
	const int status = xml_write(context, argv[at], model, bsdfrbf_write_tree, &options);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return status;
}
