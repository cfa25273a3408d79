/* SPDX-License-Identifier: BSD-3-Clause */
/* A recorded file in memory, to be damaged. */
#ifndef TEST_IMAGE_H
#define TEST_IMAGE_H
#include "record.h"

typedef struct image {
	char *at;      /* aligned for the structs of record.h */
	size_t bytes;
} image;

static inline rbf_record_header *image_header(const image *file)
{
	return (rbf_record_header *)file->at;
}

/* First section of a kind, or NULL. */
static inline rbf_record_section *image_section(const image *file, uint32_t kind)
{
	rbf_record_section *s = (rbf_record_section *)(image_header(file) + 1);
	for (uint32_t i = 0; i < image_header(file)->sections; i++)
		if (s[i].kind == kind)
			return s + i;
	return NULL;
}

/* Makes all checksums right again, as somebody does who means harm. */
static inline void image_seal(const image *file)
{
	rbf_record_header *h = image_header(file);
	rbf_record_section *s = (rbf_record_section *)(h + 1);
	if (file->bytes < sizeof *h)
		return;
	const size_t sections = h->sections;
	if (sections <= (file->bytes - sizeof *h) / sizeof *s) {
		for (size_t i = 0; i < sections; i++)
			if (s[i].offset <= file->bytes && s[i].bytes <= file->bytes - s[i].offset)
				s[i].checksum = rbf_record_checksum(file->at + s[i].offset, (size_t)s[i].bytes);
		h->directory_checksum = rbf_record_checksum(s, sections * sizeof *s);
	}
	h->checksum = rbf_record_checksum(h, offsetof(rbf_record_header, checksum));
}
#endif
