/* SPDX-License-Identifier: BSD-3-Clause */
/* What writing, reading and listing a record share. */
#include "record.h"

/* The checksum is compiled in, so that the library needs no other one at run time. */
#define XXH_INLINE_ALL
#include <xxhash.h>

const char *const rbf_record_component_name[4] = {"rf", "rb", "tf", "tb"};

uint64_t rbf_record_checksum(const void *data, size_t bytes)
{
	return XXH3_64bits(data, bytes);
}

int rbf_record_little_endian(void)
{
	const uint32_t mark = RBF_RECORD_ENDIAN;
	unsigned char first;
	memcpy(&first, &mark, 1);
	return first == 4;
}

const char *rbf_record_kind_name(uint32_t kind)
{
	const int row = rbf_array_find(kind);
	if (row >= 0)
		return rbf_array_row[row].name;
	return kind == RBF_RECORD_COMPONENT ? "component" : kind == RBF_RECORD_TEXT ? "text" : kind == RBF_RECORD_FORMER_PACKED ? "packed" : "unknown";
}

static void add(rbf_record_part *part, int *parts, uint32_t kind, uint32_t component, uint32_t flags,
	const void *data, uint64_t entries, uint32_t entry)
{
	if (!data || !entries)
		return;
	rbf_record_part *p = part + (*parts)++;
	memset(p, 0, sizeof *p);
	p->section.kind = kind;
	p->section.component = component;
	p->section.bytes = entries * entry;
	p->section.flags = flags;
	p->section.entry = entry;
	p->data = data;
}

int rbf_record_plan(const bsdfrbf_model *model, rbf_record_part *part, rbf_record_component header[4])
{
	int parts = 0;
	/* Small ones first: opening a file reads these and nothing else. */
	for (uint32_t i = 0; i < 4; i++) {
		const rbf_component *c = model->component + i;
		if (!c->present)
			continue;
		memset(header + i, 0, sizeof header[i]);
		rbf_numbers_get(c, header[i].number);
		memcpy(header[i].lambertian, c->lambertian, sizeof c->lambertian);
		header[i].facts = c->facts;
		add(part, &parts, RBF_RECORD_COMPONENT, i, RBF_RECORD_MUST, header + i, 1, sizeof header[i]);
	}
	add(part, &parts, RBF_RECORD_TEXT, RBF_RECORD_WHOLE, 0, model->text, model->text_bytes, 1);
	for (uint32_t i = 0; i < 4; i++) {
		const rbf_component *c = model->component + i;
		for (int row = 0; row < RBF_ARRAY_ROWS && c->present; row++) {
			const rbf_array *array = rbf_array_row + row;
			add(part, &parts, array->kind, i, array->holds & RBF_ARRAY_OPTIONAL ? 0 : RBF_RECORD_MUST,
				rbf_array_get(c, row), rbf_array_entries(c, row), array->entry);
		}
	}
	uint64_t offset = sizeof(rbf_record_header) + (uint64_t)parts * sizeof(rbf_record_section);
	for (int i = 0; i < parts; i++) {
		part[i].section.offset = rbf_record_align(offset);
		offset = part[i].section.offset + part[i].section.bytes;
	}
	return parts;
}

int bsdfrbf_get_section(const bsdfrbf_model *model, int index, const char **name, int *component, uint64_t *bytes)
{
	rbf_record_part part[RBF_RECORD_PARTS];
	rbf_record_component header[4];
	const rbf_record_section *section = NULL;
	int sections;
	if (!model)
		return 0;
	if (model->mapping) {
		sections = (int)((const rbf_record_header *)model->mapping)->sections;
		if (index >= 0 && index < sections)
			section = (const rbf_record_section *)((const rbf_record_header *)model->mapping + 1) + index;
	} else {
		sections = rbf_record_plan(model, part, header);
		if (index >= 0 && index < sections)
			section = &part[index].section;
	}
	if (section) {
		if (name)
			*name = rbf_record_kind_name(section->kind);
		if (component)
			*component = section->component < 4 ? (int)section->component : -1;
		if (bytes)
			*bytes = section->bytes;
	}
	return sections;
}
