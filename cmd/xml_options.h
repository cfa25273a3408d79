/* SPDX-License-Identifier: BSD-3-Clause */
/* What rbf2ttree and rbf2klems share. */
#ifndef CMD_XML_OPTIONS_H
#define CMD_XML_OPTIONS_H
#include "common.h"

#define XML_USAGE "[-embed|-link][-c components][-o file.xml][-s name=text][-n threads][-pN]"
#define XML_HELP \
	"  -embed   the XML also carries the interpolant, which patched Radiance evaluates in place of what is resampled\n" \
	"  -link    or it points to the .rbf file, which must then stay where and as it is\n" \
	"  -c list  components, of rf, rb, tf, tb, separated by commas (default: all that the file has)\n" \
	"  -o file  write to a file, which is replaced when all is done, instead of standard output\n" \
	"  -s x=y   text or size for the XML: n=name, m=manufacturer, t=thickness, w=width, h=height; sizes in metres\n" \
	"  -n N     threads\n" \
	"  -p[N]    progress bar of N characters (default 79 on a terminal); bare -p: none\n"

void xml_start(int argc, char **argv, bsdfrbf_resample_options *options);

/* Takes one of the options above. 0: it is none of them. To be asked before those of one letter that a command has itself. */
int xml_option(int argc, char **argv, int *at, const char *usage, bsdfrbf_resample_options *options);

/* Writes, with progress bar and signals; exits with a message on failure. file: where the model is. The answer is for the shell. */
int xml_write(bsdfrbf_context *context, const char *file, const bsdfrbf_model *model,
	bsdfrbf_status (*write)(bsdfrbf_context *, const bsdfrbf_model *, const bsdfrbf_resample_options *),
	bsdfrbf_resample_options *options);
#endif
