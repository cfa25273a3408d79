/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * BSDF XML that carries a record, or points to one, beside its tree or matrix. Readers of XML see comments at the end of the
 * root element; whoever knows them finds the interpolant itself.
 *
 *   <!-- bsdfrbf record
 *   lines of base64 (RFC 4648, 4): an .rbf file
 *   -->
 *   <!-- bsdfrbf interpolant: bytes=N checksum=16 hexadecimal digits -->
 *   </WindowElement>
 *
 * or, for a record in a file of its own, the last comment alone, with file=PATH before bytes=. PATH is relative to the folder of
 * the XML unless it starts with a slash; all but letters, digits and . _ / are written as % and two hexadecimal digits (RFC 3986,
 * 2.1), as two hyphens would end the comment. The checksum is that of the record's header, which covers the directory's, which
 * covers those of the sections: all content, known without reading it.
 */
#ifndef RBF_CARRIER_H
#define RBF_CARRIER_H
#include "status.h"

#include <stdint.h>

#define RBF_CARRIER_DATA "<!-- bsdfrbf record\n"
#define RBF_CARRIER_MARK "<!-- bsdfrbf interpolant: "
enum { RBF_CARRIER_PATH = 4096, RBF_CARRIER_TAIL = 3 * RBF_CARRIER_PATH + 256 /* the mark is within so many bytes of the end */ };

typedef struct rbf_carrier {
	char file[RBF_CARRIER_PATH]; /* "" if the record is inside */
	uint64_t bytes, checksum;    /* of the record */
	const char *mark;            /* where the mark starts */
} rbf_carrier;

/* 1 if the text looks like XML. */
int rbf_carrier_is_xml(const char *text, uint64_t bytes);

/* Looks for the mark in an XML text of which at least the last RBF_CARRIER_TAIL bytes (or all) are given. 0: it carries nothing. */
int rbf_carrier_find(const char *text, uint64_t bytes, rbf_carrier *carrier);

/* Decodes the record within an XML text into carrier->bytes bytes. 0: it is damaged. */
int rbf_carrier_decode(const char *text, const rbf_carrier *carrier, unsigned char *record);
#endif
