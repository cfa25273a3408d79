/* SPDX-License-Identifier: BSD-3-Clause */
/* What rbf2ttree and rbf2klems share. */
#ifndef CMD_XML_OPTIONS_H
#define CMD_XML_OPTIONS_H
#include "common.h"

void xml_start(int argc, char **argv, bsdfrbf_resample_options *options);

/* Takes one of the options above. 0: it is none of them. To be asked before those of one letter that a command has itself. */
int xml_option(int argc, char **argv, int *at, bsdfrbf_resample_options *options);

/* Writes, with progress bar and signals; exits with a message on failure. file: where the model is. The answer is for the shell. */
int xml_write(bsdfrbf_context *context, const char *file, const bsdfrbf_model *model,
	bsdfrbf_status (*write)(bsdfrbf_context *, const bsdfrbf_model *, const bsdfrbf_resample_options *),
	bsdfrbf_resample_options *options);
#endif
