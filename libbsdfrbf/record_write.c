/* SPDX-License-Identifier: BSD-3-Clause */
#include "check.h"
#include "pack.h"
#include "record.h"
#include "replace.h"

#include <stdlib.h>

/* A model that the reader would refuse is a defect of whatever built it: better said now than on opening. */
static bsdfrbf_status check_model(bsdfrbf_context *context, const bsdfrbf_model *model, const char *path)
{
	int components = 0;
	for (int i = 0; i < 4; i++) {
		const rbf_component *c = model->component + i;
		if (!c->present)
			continue;
		components++;
		const char *wrong = c->channels != model->channels ? "channels" : rbf_check_numbers(c);
		for (int row = 0; row < RBF_ARRAY_ROWS && !wrong; row++)
			if (!(rbf_array_row[row].holds & RBF_ARRAY_OPTIONAL) && rbf_array_entries(c, row) && !rbf_array_get(c, row))
				wrong = rbf_array_row[row].name;
		if (!wrong)
			wrong = rbf_check_arrays(c);
		if (wrong)
			return rbf_fail(context, BSDFRBF_ERR_INTERNAL, "%s: not written, as component %s contradicts itself: %s",
				path, rbf_record_component_name[i], wrong);
	}
	if (!components)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "%s: not written, as the model has no component", path);
	return BSDFRBF_OK;
}

/* Bytes of a file with these parts. */
static uint64_t bytes_of(const rbf_record_part *part, int parts)
{
	return part[parts - 1].section.offset + part[parts - 1].section.bytes;
}

static bsdfrbf_status write_parts(rbf_replace *replace, rbf_record_part *part, int parts)
{
	static const char zero[RBF_RECORD_ALIGN];
	rbf_record_section directory[RBF_RECORD_PARTS];
	rbf_record_header header = {.endian = RBF_RECORD_ENDIAN, .major = RBF_RECORD_MAJOR, .minor = RBF_RECORD_MINOR};
	const size_t directory_bytes = (size_t)parts * sizeof *directory;
	memcpy(header.magic, RBF_RECORD_MAGIC, RBF_RECORD_MAGIC_BYTES);
	for (int i = 0; i < parts; i++) {
		part[i].section.checksum = rbf_record_checksum(part[i].data, part[i].section.bytes);
		directory[i] = part[i].section;
	}
	header.sections = (uint32_t)parts;
	header.bytes = bytes_of(part, parts);
	header.directory_checksum = rbf_record_checksum(directory, directory_bytes);
	header.checksum = rbf_record_checksum(&header, offsetof(rbf_record_header, checksum));
	RBF_TRY(rbf_replace_write(replace, &header, sizeof header));
	RBF_TRY(rbf_replace_write(replace, directory, directory_bytes));
	uint64_t offset = sizeof header + directory_bytes;
	for (int i = 0; i < parts; i++) {
		RBF_TRY(rbf_replace_write(replace, zero, (size_t)(part[i].section.offset - offset)));
		RBF_TRY(rbf_replace_write(replace, part[i].data, (size_t)part[i].section.bytes));
		offset = part[i].section.offset + part[i].section.bytes;
	}
	return BSDFRBF_OK;
}

/* The components that can be, packed; stream[4]: to be freed. Returns 0, or -1 when out of memory. */
static int pack_components(bsdfrbf_model *model, uint8_t *stream[4])
{
	for (int i = 0; i < 4; i++) {
		rbf_component *c = &model->component[i];
		if (!c->present)
			continue;
		uint32_t bytes;
		if (rbf_pack(c, &stream[i], &bytes))
			return -1;
		c->packed = stream[i] ? bytes : 0;
		c->pack = stream[i];
	}
	return 0;
}

bsdfrbf_status bsdfrbf_save(bsdfrbf_context *context, const bsdfrbf_model *model, const char *path)
{
	rbf_record_part part[RBF_RECORD_PARTS];
	rbf_record_component header[4];
	rbf_replace replace;
	if (!model || !path)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_save: no %s", model ? "path" : "model");
	if (!rbf_record_little_endian())
		return rbf_fail(context, BSDFRBF_ERR_UNSUPPORTED, "%s: not written: only little-endian machines are supported", path);
	RBF_TRY(check_model(context, model, path));
	bsdfrbf_model record = *model;
	uint8_t *stream[4] = {NULL};
	int parts = rbf_record_plan(&record, part, header);
	bsdfrbf_status status = BSDFRBF_OK;
	if (bytes_of(part, parts) <= RBF_RECORD_VERIFY_BYTES) {
		status = pack_components(&record, stream) ? rbf_out_of_memory(context) : BSDFRBF_OK;
		parts = rbf_record_plan(&record, part, header);
	}
	if (status == BSDFRBF_OK)
		status = rbf_replace_begin(context, path, 0, &replace);
	if (status == BSDFRBF_OK)
		status = write_parts(&replace, part, parts);
	if (status == BSDFRBF_OK)
		status = rbf_replace_commit(&replace);
	for (int i = 0; i < 4; i++)
		free(stream[i]);
	return status;
}
