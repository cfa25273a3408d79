/* SPDX-License-Identifier: BSD-3-Clause */
#include "carrier.h"
#include "check.h"
#include "pack.h"
#include "record.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* A file that is being opened. */
typedef struct reader {
	bsdfrbf_context *context;
	const char *path;
	const char *at;
	uint64_t bytes;
} reader;

#define HEADER(r) ((const rbf_record_header *)(r)->at)
#define DIRECTORY(r) ((const rbf_record_section *)(HEADER(r) + 1))

static const char *component_name(uint32_t component)
{
	return component < 4 ? rbf_record_component_name[component] : "the model";
}

static bsdfrbf_status damaged(const reader *r, const char *what)
{
	return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: damaged: %s; make it anew with mkrbf", r->path, what);
}

static bsdfrbf_status damaged_section(const reader *r, const rbf_record_section *s, const char *what)
{
	return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: damaged: section \"%s\" of %s: %s; make it anew with mkrbf",
		r->path, rbf_record_kind_name(s->kind), component_name(s->component), what);
}

static bsdfrbf_status map_file(reader *r)
{
	struct stat info;
	/* Without O_NONBLOCK a pipe would block until somebody writes to it. */
	const int file = open(r->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	if (file < 0)
		return rbf_fail(r->context, BSDFRBF_ERR_IO, "%s: cannot open: %s", r->path, strerror(errno));
	void *at = MAP_FAILED;
	bsdfrbf_status status = BSDFRBF_OK;
	if (fstat(file, &info) != 0)
		status = rbf_fail(r->context, BSDFRBF_ERR_IO, "%s: cannot read: %s", r->path, strerror(errno));
	else if (S_ISDIR(info.st_mode))
		status = rbf_fail(r->context, BSDFRBF_ERR_IO, "%s: is a folder", r->path);
	else if (!S_ISREG(info.st_mode))
		status = rbf_fail(r->context, BSDFRBF_ERR_IO, "%s: is not a regular file, which it must be to be mapped", r->path);
	else if (info.st_size == 0)
		status = rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: is empty", r->path);
	else if ((uint64_t)info.st_size > SIZE_MAX / 2)
		status = rbf_fail(r->context, BSDFRBF_ERR_MEMORY, "%s: is larger than the address space", r->path);
	else {
		at = mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_SHARED, file, 0);
		if (at == MAP_FAILED)
			status = rbf_fail(r->context, errno == ENOMEM ? BSDFRBF_ERR_MEMORY : BSDFRBF_ERR_IO, "%s: cannot map: %s",
				r->path, strerror(errno));
	}
	close(file);
	if (status == BSDFRBF_OK) {
		r->at = at;
		r->bytes = (uint64_t)info.st_size;
	}
	return status;
}

/* The record within an XML text, in memory of its own. */
static bsdfrbf_status unpack(reader *r, const rbf_carrier *carrier)
{
	if (carrier->bytes > r->bytes)
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: the interpolant that it carries is damaged", r->path);
	void *at = mmap(NULL, (size_t)carrier->bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
	if (at == MAP_FAILED)
		return rbf_fail(r->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", r->path);
	const int whole = rbf_carrier_decode(r->at, carrier, at);
	munmap((void *)r->at, (size_t)r->bytes);
	r->at = at;
	r->bytes = carrier->bytes;
	if (!whole)
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: the interpolant that it carries is damaged", r->path);
	mprotect(at, (size_t)carrier->bytes, PROT_READ);
	return BSDFRBF_OK;
}

/* The record in the file that an XML text points to. linked: room for its path, for messages. */
static bsdfrbf_status follow(reader *r, const rbf_carrier *carrier, char linked[2 * RBF_CARRIER_PATH])
{
	const char *slash = *carrier->file == '/' ? NULL : strrchr(r->path, '/');
	const size_t folder = slash ? (size_t)(slash - r->path) + 1 : 0;
	munmap((void *)r->at, (size_t)r->bytes);
	r->at = NULL;
	if (folder >= RBF_CARRIER_PATH)
		return rbf_fail(r->context, BSDFRBF_ERR_IO, "%s: path is too long", r->path);
	memcpy(linked, r->path, folder);
	strcpy(linked + folder, carrier->file);
	r->path = linked;
	return map_file(r);
}

/* Where the file is BSDF XML: to the record that it carries or points to. */
static bsdfrbf_status enter_xml(reader *r, char linked[2 * RBF_CARRIER_PATH])
{
	rbf_carrier carrier;
	if (!rbf_carrier_is_xml(r->at, r->bytes))
		return BSDFRBF_OK;
	if (!rbf_carrier_find(r->at, r->bytes, &carrier))
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: is not an .rbf file, nor XML that carries one (as rbf2ttree -embed writes)", r->path);
	RBF_TRY(*carrier.file ? follow(r, &carrier, linked) : unpack(r, &carrier));
	if (r->bytes != carrier.bytes || r->bytes < sizeof(rbf_record_header) || HEADER(r)->checksum != carrier.checksum)
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: is not what the XML was made with: make it anew with rbf2ttree or rbf2klems",
			r->path);
	return BSDFRBF_OK;
}

static bsdfrbf_status check_header(const reader *r)
{
	const rbf_record_header *h = HEADER(r);
	if (r->bytes < RBF_RECORD_MAGIC_BYTES || memcmp(r->at, RBF_RECORD_MAGIC, RBF_RECORD_MAGIC_BYTES) != 0) {
		if (r->bytes >= 4 && memcmp(r->at, RBF_RECORD_MAGIC, 4) == 0)
			return damaged(r, "its first bytes have changed, as in a transfer as text");
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: is not an .rbf file", r->path);
	}
	if (r->bytes < sizeof *h)
		return damaged(r, "it ends within its header");
	if (h->endian == __builtin_bswap32(RBF_RECORD_ENDIAN))
		return rbf_fail(r->context, BSDFRBF_ERR_UNSUPPORTED,
			"%s: has the other byte order: files and machines must be little-endian", r->path);
	if (h->endian != RBF_RECORD_ENDIAN)
		return damaged(r, "its header");
	/* Versions come before the checksum, which another version may compute otherwise. */
	if (h->major != RBF_RECORD_MAJOR)
		return rbf_fail(r->context, BSDFRBF_ERR_VERSION, "%s: has version %u.%u, this library reads %d.x: use the library"
			" that made it, or make it anew with mkrbf", r->path, h->major, h->minor, RBF_RECORD_MAJOR);
	if (h->checksum != rbf_record_checksum(h, offsetof(rbf_record_header, checksum)))
		return damaged(r, "its header");
	if (h->reserved || h->reserved_too[0] || h->reserved_too[1])
		return rbf_fail(r->context, BSDFRBF_ERR_VERSION, "%s: uses something of a later version (%u.%u)",
			r->path, h->major, h->minor);
	if (h->bytes != r->bytes)
		return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: damaged: has %llu bytes instead of %llu; copy it again",
			r->path, (unsigned long long)r->bytes, (unsigned long long)h->bytes);
	return BSDFRBF_OK;
}

/* Every section lies where the layout puts it, within the file, and overlaps no other. */
static bsdfrbf_status check_directory(const reader *r)
{
	const rbf_record_header *h = HEADER(r);
	const rbf_record_section *directory = DIRECTORY(r);
	if (h->sections < 1 || h->sections > RBF_RECORD_MAX_SECTIONS)
		return damaged(r, "number of sections");
	const uint64_t directory_bytes = h->sections * sizeof *directory;
	if (directory_bytes > r->bytes - sizeof *h)
		return damaged(r, "it ends within its directory");
	if (h->directory_checksum != rbf_record_checksum(directory, (size_t)directory_bytes))
		return damaged(r, "its directory");
	uint64_t offset = sizeof *h + directory_bytes;
	for (uint32_t i = 0; i < h->sections; i++) {
		const rbf_record_section *s = directory + i;
		const int known = s->kind == RBF_RECORD_COMPONENT || s->kind == RBF_RECORD_TEXT || s->kind == RBF_RECORD_FORMER_PACKED
			|| rbf_array_find(s->kind) >= 0;
		if (s->offset != rbf_record_align(offset) || s->offset > r->bytes || s->bytes > r->bytes - s->offset || !s->bytes)
			return damaged_section(r, s, "place or size");
		offset = s->offset + s->bytes;
		if (!known && s->flags & RBF_RECORD_MUST && !rbf_record_former_kind(h->minor, s->kind))
			return rbf_fail(r->context, BSDFRBF_ERR_VERSION, "%s: version %u.%u of the format, with a part (kind %u) that this"
				" library does not know and may not ignore: use a later one", r->path, h->major, h->minor, s->kind);
		if (known && s->flags & ~RBF_RECORD_MUST)
			return rbf_fail(r->context, BSDFRBF_ERR_VERSION, "%s: section \"%s\" is stored in a way (flags %x) that this library"
				" does not know: use a later one", r->path, rbf_record_kind_name(s->kind), s->flags);
		if (known && (s->kind == RBF_RECORD_TEXT ? s->component != RBF_RECORD_WHOLE : s->component > 3))
			return damaged_section(r, s, "component");
		for (uint32_t k = 0; k < i && known; k++)
			if (directory[k].kind == s->kind && directory[k].component == s->component)
				return damaged_section(r, s, "is there twice");
	}
	if (offset != r->bytes)
		return damaged(r, "bytes behind its last section");
	return BSDFRBF_OK;
}

static const rbf_record_section *find(const reader *r, uint32_t kind, uint32_t component)
{
	for (uint32_t i = 0; i < HEADER(r)->sections; i++)
		if (DIRECTORY(r)[i].kind == kind && DIRECTORY(r)[i].component == component)
			return DIRECTORY(r) + i;
	return NULL;
}

static int intact(const reader *r, const rbf_record_section *s)
{
	return s->checksum == rbf_record_checksum(r->at + s->offset, (size_t)s->bytes);
}

static bsdfrbf_status read_text(const reader *r, bsdfrbf_model *model)
{
	const rbf_record_section *s = find(r, RBF_RECORD_TEXT, RBF_RECORD_WHOLE);
	if (!s)
		return BSDFRBF_OK;
	if (s->bytes > RBF_RECORD_MAX_TEXT)
		return damaged_section(r, s, "size");
	if (!intact(r, s))
		return damaged_section(r, s, "checksum");
	const char *text = r->at + s->offset;
	unsigned ends = 0;
	for (uint64_t i = 0; i < s->bytes; i++)
		ends += text[i] == 0;
	if (ends % 2 || text[s->bytes - 1] != 0)
		return damaged_section(r, s, "content");
	model->text = (char *)text;
	model->text_bytes = (uint32_t)s->bytes;
	return BSDFRBF_OK;
}

static bsdfrbf_status read_component(const reader *r, uint32_t index, bsdfrbf_model *model)
{
	rbf_component *c = &model->component[index];
	const int former = HEADER(r)->minor == 0, former_pack = HEADER(r)->minor <= 2;
	const rbf_record_section *s = find(r, RBF_RECORD_COMPONENT, index);
	if (!s) {
		for (uint32_t i = 0; i < HEADER(r)->sections; i++)
			if (DIRECTORY(r)[i].component == index && rbf_array_find(DIRECTORY(r)[i].kind) >= 0)
				return damaged_section(r, DIRECTORY(r) + i, "belongs to no component");
		return BSDFRBF_OK;
	}
	const rbf_record_component *header = (const rbf_record_component *)(r->at + s->offset);
	if (s->bytes != sizeof *header || s->entry != sizeof *header)
		return damaged_section(r, s, "size");
	if (!intact(r, s))
		return damaged_section(r, s, "checksum");
	if (header->reserved)
		return damaged_section(r, s, "content");
	rbf_numbers_set(c, header->number);
	memcpy(c->lambertian, header->lambertian, sizeof c->lambertian);
	c->facts = header->facts;
	const char *wrong = rbf_check_numbers(c);
	if (wrong)
		return damaged_section(r, s, wrong);
	for (int row = 0; row < RBF_ARRAY_ROWS; row++) {
		const rbf_array *array = rbf_array_row + row;
		const uint64_t entries = rbf_record_former_entries(c, HEADER(r)->minor, row);
		const rbf_record_section *a = find(r, row == RBF_ARRAY_ROW_40 && former_pack ? RBF_RECORD_FORMER_PACKED : array->kind, index);
		if (!a && entries && !(array->holds & RBF_ARRAY_OPTIONAL))
			return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: damaged: section \"%s\" of %s is missing",
				r->path, array->name, component_name(index));
		if (!a)
			continue;
		if (a->entry != array->entry || a->bytes / array->entry != entries || a->bytes % array->entry)
			return damaged_section(r, a, "size");
		rbf_array_set(c, row, r->at + a->offset);
	}
	c->present = 1;
	const rbf_record_section *pack = c->packed ? find(r, former_pack ? RBF_RECORD_FORMER_PACKED : rbf_array_row[RBF_ARRAY_ROW_40].kind, index) : NULL;
	if (pack && (former || !intact(r, pack)))
		return damaged_section(r, pack, "checksum");
	wrong = former ? rbf_record_former(c, &model->made[index]) : pack ? rbf_unpack(c, former_pack, &model->made[index]) : NULL;
	if (wrong == rbf_unpack_memory)
		return rbf_fail(r->context, BSDFRBF_ERR_MEMORY, "%s: out of memory", r->path);
	return wrong ? damaged_section(r, s, wrong) : BSDFRBF_OK;
}

static bsdfrbf_status read_model(const reader *r, bsdfrbf_model *model)
{
	RBF_TRY(check_header(r));
	RBF_TRY(check_directory(r));
	RBF_TRY(read_text(r, model));
	for (uint32_t i = 0; i < 4; i++) {
		rbf_component *c = model->component + i;
		RBF_TRY(read_component(r, i, model));
		if (!c->present)
			continue;
		if (model->channels && model->channels != c->channels)
			return damaged(r, "components with different numbers of channels");
		model->channels = c->channels;
	}
	if (!model->channels)
		return damaged(r, "it has no component");
	return BSDFRBF_OK;
}

static bsdfrbf_status verify(const reader *r, const bsdfrbf_model *model)
{
	uint64_t end = sizeof(rbf_record_header) + HEADER(r)->sections * sizeof(rbf_record_section);
	for (uint32_t i = 0; i < HEADER(r)->sections; i++) {
		const rbf_record_section *s = DIRECTORY(r) + i;
		for (; end < s->offset; end++)
			if (r->at[end])
				return damaged_section(r, s, "bytes before it");
		if (!intact(r, s))
			return damaged_section(r, s, "checksum");
		end = s->offset + s->bytes;
	}
	for (uint32_t i = 0; i < 4; i++) {
		const char *wrong = model->component[i].present ? rbf_check_arrays(model->component + i) : NULL;
		if (wrong)
			return rbf_fail(r->context, BSDFRBF_ERR_FORMAT, "%s: damaged: %s contradicts itself: %s; make it anew with mkrbf",
				r->path, component_name(i), wrong);
	}
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_record_verify(bsdfrbf_context *context, const char *path, const bsdfrbf_model *model)
{
	if (!model || !model->mapping)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: only an opened file can be verified", path ? path : "model");
	const reader r = {context, path ? path : "model", model->mapping, model->mapping_bytes};
	return verify(&r, model);
}

bsdfrbf_status rbf_record_open(bsdfrbf_context *context, const char *path, uint64_t verify_bytes, bsdfrbf_model **result)
{
	reader r = {context, path, NULL, 0};
	if (!result)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_open: nowhere to put the model");
	*result = NULL;
	if (!path || !*path)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "no file name to open");
	if (!rbf_record_little_endian())
		return rbf_fail(context, BSDFRBF_ERR_UNSUPPORTED, "%s: only little-endian machines are supported", path);
	bsdfrbf_model *model = rbf_model_new();
	if (!model)
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "%s: out of memory", path);
	char linked[2 * RBF_CARRIER_PATH];
	bsdfrbf_status status = map_file(&r);
	if (status == BSDFRBF_OK)
		status = enter_xml(&r, linked);
	if (r.at) {
		model->mapping = (void *)r.at;
		model->mapping_bytes = (size_t)r.bytes;
	}
	if (status == BSDFRBF_OK)
		status = read_model(&r, model);
	if (status == BSDFRBF_OK && r.bytes <= verify_bytes)
		status = verify(&r, model);
	if (status != BSDFRBF_OK) {
		bsdfrbf_close(model);
		return status;
	}
	*result = model;
	return BSDFRBF_OK;
}

bsdfrbf_status bsdfrbf_open(bsdfrbf_context *context, const char *path, bsdfrbf_model **model)
{
	return rbf_record_open(context, path, RBF_RECORD_VERIFY_BYTES, model);
}

/* First and last bytes of a regular file; the last ones only if it looks like XML. How many, 0 if it cannot be read. */
static ssize_t ends_of(const char *path, char first[RBF_CARRIER_TAIL], char last[RBF_CARRIER_TAIL], ssize_t *first_bytes)
{
	struct stat info;
	ssize_t last_bytes = 0;
	*first_bytes = 0;
	const int file = path ? open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK) : -1;
	if (file < 0)
		return 0;
	if (fstat(file, &info) == 0 && S_ISREG(info.st_mode)) {
		*first_bytes = read(file, first, last ? 300 : RBF_RECORD_MAGIC_BYTES);
		if (last && *first_bytes > 0 && rbf_carrier_is_xml(first, (uint64_t)*first_bytes))
			last_bytes = pread(file, last, RBF_CARRIER_TAIL, info.st_size > RBF_CARRIER_TAIL ? info.st_size - RBF_CARRIER_TAIL : 0);
	}
	close(file);
	return last_bytes;
}

int bsdfrbf_is_rbf(const char *path)
{
	char start[RBF_CARRIER_TAIL];
	ssize_t bytes;
	ends_of(path, start, NULL, &bytes);
	return bytes == RBF_RECORD_MAGIC_BYTES && !memcmp(start, RBF_RECORD_MAGIC, RBF_RECORD_MAGIC_BYTES);
}

int bsdfrbf_is_carrier(const char *path)
{
	char start[RBF_CARRIER_TAIL], end[RBF_CARRIER_TAIL];
	ssize_t bytes;
	const ssize_t last = ends_of(path, start, end, &bytes);
	rbf_carrier carrier;
	return last > 0 && rbf_carrier_find(end, (uint64_t)last, &carrier);
}

uint64_t bsdfrbf_checksum(const bsdfrbf_model *model)
{
	return model && model->mapping ? ((const rbf_record_header *)model->mapping)->checksum : 0;
}
