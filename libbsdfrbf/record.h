/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The recorded file (.rbf), version 1.3.
 *
 *   offset 0     header, 64 bytes
 *   offset 64    directory: `sections` entries of 40 bytes
 *   then         sections, in the order of the directory, each at the next multiple of 64 behind the one before
 *
 * All numbers are little-endian, floats IEEE 754. Bytes that align sections are 0. The file ends with its last
 * section. Sections are the arrays of struct rbf_component as they are in memory, to be used in a read-only mapping, of
 * which only the pages that a query needs are ever read; but for the larger ones of files that would otherwise have up
 * to RBF_RECORD_VERIFY_BYTES: these are read as a whole anyway, and unpacked then (pack.h).
 *
 * Versions. A reader refuses another major version. A higher minor version may add sections and numbers; a reader
 * skips kinds that it does not know, unless they carry RBF_RECORD_MUST: then what it would answer without them is
 * wrong, and it refuses the file. It also refuses flags that it does not know, and entries of another size.
 *
 * Trust. The header, the directory, texts and component headers are checked each time a file is opened. Files up to
 * RBF_RECORD_VERIFY_BYTES are then checked in full: checksums, alignment bytes, every index, every float. Larger files
 * are not, as that would read them whole (opening 1 GB must take under 1 ms); what reads their indices goes through
 * bounds.h, so that damage gives wrong values, never a crash. rbf_record_verify() checks any file in full.
 * As with every mapped file, somebody who shortens it while it is open makes readers fail with SIGBUS;
 * bsdfrbf_save() never does that, it replaces files.
 */
#ifndef RBF_RECORD_H
#define RBF_RECORD_H
#include "arrays.h"

/* The first byte starts no UTF-8 text and has no character in Windows-1252; line ends and Ctrl-Z show damage
 * by transfer as text (the idea is that of the PNG specification, 5.2). */
#define RBF_RECORD_MAGIC "\x8fRBF\r\n\x1a\n"
#define RBF_RECORD_MAGIC_BYTES 8
#define RBF_RECORD_ENDIAN 0x01020304u
#define RBF_RECORD_MAJOR 1
#define RBF_RECORD_MINOR 3
#define RBF_RECORD_ALIGN 64
#define RBF_RECORD_MAX_SECTIONS 1024
#define RBF_RECORD_MAX_TEXT (1u << 20)
#define RBF_RECORD_VERIFY_BYTES (16u << 20)

typedef struct rbf_record_header {
	unsigned char magic[RBF_RECORD_MAGIC_BYTES];
	uint32_t endian;
	uint16_t major, minor;
	uint64_t bytes;              /* of the file */
	uint32_t sections;
	uint32_t reserved;           /* 0 */
	uint64_t directory_checksum; /* of the directory */
	uint64_t reserved_too[2];    /* 0 */
	uint64_t checksum;           /* of the 56 bytes before */
} rbf_record_header;
_Static_assert(sizeof(rbf_record_header) == 64, "recorded layout");

#define RBF_RECORD_MUST 1u           /* flag: a reader that does not know this kind must refuse the file */
#define RBF_RECORD_WHOLE 0xffffffffu /* component of sections that belong to the whole model */

/* Kinds beside those of RBF_ARRAYS. */
enum { RBF_RECORD_COMPONENT = 1, RBF_RECORD_TEXT = 2 };

typedef struct rbf_record_section {
	uint32_t kind;
	uint32_t component;          /* bsdfrbf_component, or RBF_RECORD_WHOLE */
	uint64_t offset, bytes;
	uint64_t checksum;           /* XXH3 with 64 bits, seed 0, of the section's bytes */
	uint32_t flags;
	uint32_t entry;              /* bytes an entry */
} rbf_record_section;
_Static_assert(sizeof(rbf_record_section) == 40, "recorded layout");

typedef struct rbf_record_component {
	uint32_t number[RBF_NUMBERS_MAX]; /* RBF_NUMBERS, the others 0 */
	float lambertian[3];
	uint32_t reserved;                /* 0 */
	rbf_facts facts;
} rbf_record_component;
_Static_assert(sizeof(rbf_record_component) == 4 * RBF_NUMBERS_MAX + 16 + sizeof(rbf_facts)
	&& sizeof(rbf_facts) == 4 * RBF_MAX_FRAMES + 16 + 160, "no hidden padding");

/* Recorded entries have no hidden padding, as it would be neither the same nor checked. */
_Static_assert(sizeof(rbf_vertex) == 20 && sizeof(rbf_element) == 48 && sizeof(rbf_set) == 24
	&& sizeof(rbf_base_info) == 32, "no hidden padding");

/* A section and where its bytes are. */
typedef struct rbf_record_part {
	rbf_record_section section;
	const void *data;
} rbf_record_part;
#define RBF_RECORD_PARTS (1 + 4 * (1 + RBF_ARRAY_ROWS))

/* Lists the sections of a model, with offsets but without checksums, into part[RBF_RECORD_PARTS]; `header` takes the
 * component headers. Returns how many. */
int rbf_record_plan(const bsdfrbf_model *model, rbf_record_part *part, rbf_record_component header[4]);

/* Name of a kind, for people. */
const char *rbf_record_kind_name(uint32_t kind);
extern const char *const rbf_record_component_name[4];

uint64_t rbf_record_checksum(const void *data, size_t bytes);
int rbf_record_little_endian(void);

static inline uint64_t rbf_record_align(uint64_t offset)
{
	return (offset + RBF_RECORD_ALIGN - 1) & ~(uint64_t)(RBF_RECORD_ALIGN - 1);
}

/* Entries of an array as version 1.`minor` recorded it. */
uint64_t rbf_record_former_entries(const rbf_component *component, uint32_t minor, int row);

/* A component as version 1.0 recorded it, made into one of today: *made takes what it needs beside the mapping, to be freed. Reads it
 * whole. Returns NULL, or what is wrong. */
const char *rbf_record_former(rbf_component *component, void **made);

#define RBF_RECORD_FORMER_PACKED 39u /* kind of "packed" in versions 1.1 and 1.2, whose streams were others */

/* Kinds that only former versions had, up to this one, of no use any more. */
int rbf_record_former_kind(uint32_t minor, uint32_t kind);

/* bsdfrbf_open() with another limit for the full check. */
bsdfrbf_status rbf_record_open(bsdfrbf_context *context, const char *path, uint64_t verify_bytes, bsdfrbf_model **model);

/* Full check of an opened model, of any size. `path` is for the message. Errors: FORMAT, ARGUMENT (not an opened one). */
bsdfrbf_status rbf_record_verify(bsdfrbf_context *context, const char *path, const bsdfrbf_model *model);
#endif
