/* SPDX-License-Identifier: BSD-3-Clause */
/* Writing BSDF XML (WindowElement, LBNL's BSDF-v1.4 schema): a buffered sink, and the parts that trees and matrices share. */
#ifndef RBF_XML_WRITE_H
#define RBF_XML_WRITE_H
#include "replace.h"

typedef struct rbf_xml {
	bsdfrbf_context *context;
	int (*write)(void *user, const void *data, size_t bytes);
	void *user;
	rbf_replace replace;
	int to_path;            /* `replace` is open */
	bsdfrbf_status status;  /* the first failure; nothing is written after it */
	size_t used;
	char buffer[1 << 16];
} rbf_xml;

/* Opens options->path, or takes options->write. */
bsdfrbf_status rbf_xml_begin(bsdfrbf_context *context, const bsdfrbf_resample_options *options, rbf_xml *xml);
/* Writes what is held back and puts the file in place. */
bsdfrbf_status rbf_xml_finish(rbf_xml *xml);

void rbf_xml_put(rbf_xml *xml, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A number with six digits and a decimal point, whatever the host's locale is. rbf_xml_put() must not be given any but whole ones. */
void rbf_xml_number(rbf_xml *xml, double value);

/* From the XML declaration to the end of <Material> and <Geometry>; `facts`: lines for the comment, may be "". */
void rbf_xml_head(rbf_xml *xml, const bsdfrbf_model *model, const bsdfrbf_resample_options *options, const char *facts);
/* To the end, with the interpolant or where it is (carrier.h) if the options ask for it. */
void rbf_xml_tail(rbf_xml *xml, const bsdfrbf_model *model, const bsdfrbf_resample_options *options);

/* Opens a <WavelengthData> with the block of one component; `basis` is its complete AngleBasis lines. The caller writes the
 * numbers and closes it. what: "Visible", "Solar", "CIE-X", "CIE-Z", "CIE-u" or "CIE-v". */
void rbf_xml_data_begin(rbf_xml *xml, bsdfrbf_component component, const char *what, const char *basis);
void rbf_xml_data_end(rbf_xml *xml);
#endif
