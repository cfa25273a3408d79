/* SPDX-License-Identifier: BSD-3-Clause */
/* A record of 1 GB: opening it and reading what one query needs costs neither time nor memory. */
#include "bounds.h"
#include "cull.h"
#include "record.h"
#include "synthetic.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

/* 30,000 incidences of 300 lobes, mirrored, with residual transport. */
static const synthetic large = {1, RBF_BILATERAL_Y, 30000, 60000, 60000, 300, 120000, 1, 1, 42, 8, 1};

#ifndef ROW
#define ROW 8
#endif
static char path[64];

static double now(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Kilobytes of mappings of `path` that are resident. */
static long resident(void)
{
	FILE *f = fopen("/proc/self/smaps", "r");
	char line[512];
	long sum = 0, kilobytes;
	int ours = 0;
	while (f && fgets(line, sizeof line, f)) {
		if (strchr(line, '-') && strchr(line, '-') < strchr(line, ' '))
			ours = strstr(line, path) != NULL;
		else if (ours && sscanf(line, "Rss: %ld", &kilobytes) == 1)
			sum += kilobytes;
	}
	if (f)
		fclose(f);
	return sum;
}

/* As replace.c does it. */
static int put(int file, const char *data, uint64_t bytes, uint64_t offset)
{
	const size_t chunk = 64 << 10;
	for (uint64_t i = 0; i < bytes; i += chunk) {
		const size_t n = bytes - i < chunk ? (size_t)(bytes - i) : chunk;
		if (pwrite(file, data + i, n, (off_t)(offset + i)) != (ssize_t)n)
			return 0;
	}
	return 1;
}

/* Writes the index arrays, leaves holes for lobes and shifts. */
static int make_large(void **state)
{
	static char hole;
	static bsdfrbf_model model;
	rbf_component *c = model.component + BSDFRBF_RF;
	rbf_record_part part[RBF_RECORD_PARTS];
	rbf_record_component component[4];
	rbf_record_section directory[RBF_RECORD_PARTS];
	rbf_record_header h = {.endian = RBF_RECORD_ENDIAN, .major = RBF_RECORD_MAJOR, .minor = RBF_RECORD_MINOR};
	uint64_t seed = 3;
	(void)state;
	model.channels = large.channels;
	synthetic_numbers(&large, c);
	c->limited = 0;
	c->shifts = c->blocks * 6; /* towards six neighbours each */
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		rbf_array_set(c, row, row == RBF_ARRAY_ROW_25 ? NULL : rbf_array_row[row].holds & RBF_ARRAY_INDEX
			? calloc(1, (size_t)(rbf_array_entries(c, row) * rbf_array_row[row].entry)) : &hole);
	c->limit = NULL; /* read by what counts the entries of others */
	synthetic_indices(&large, c, &seed);
	/* Cells list neighbouring elements, and elements have neighbouring corners, recorded near each other. */
	for (uint32_t i = 0; i < c->mesh.cell_entries; i++)
		c->mesh.cell_element[i] = i / 2;
	for (uint32_t i = 0; i < c->mesh.elements; i++)
		for (uint32_t k = 0; k < 3; k++)
			c->mesh.element[i].v[k] = (i + (k == 2 ? ROW : k)) % c->mesh.bases;
	for (uint32_t i = 0; i < 6 * c->mesh.elements; i++)
		((uint32_t *)c->shift_of)[i] = c->mesh.vertex[c->mesh.element[i / 6].v[i % 6 / 2]].base * 6 * 38 + i % 6 * 38;
	const int parts = rbf_record_plan(&model, part, component);
	strcpy(path, "/tmp/rbf-large-XXXXXX");
	const int file = mkstemp(path);
	if (file < 0)
		return 1;
	for (int i = 0; i < parts; i++) {
		rbf_record_section *s = &part[i].section;
		if (part[i].data != &hole) {
			s->checksum = rbf_record_checksum(part[i].data, (size_t)s->bytes);
			if (!put(file, part[i].data, s->bytes, s->offset))
				return 1;
		}
		directory[i] = *s;
		h.bytes = s->offset + s->bytes;
	}
	memcpy(h.magic, RBF_RECORD_MAGIC, sizeof h.magic);
	h.sections = (uint32_t)parts;
	h.directory_checksum = rbf_record_checksum(directory, (size_t)parts * sizeof *directory);
	h.checksum = rbf_record_checksum(&h, offsetof(rbf_record_header, checksum));
	for (int row = 0; row < RBF_ARRAY_ROWS; row++)
		if (rbf_array_get(c, row) == &hole)
			rbf_array_set(c, row, NULL);
	const int wrong = pwrite(file, &h, sizeof h, 0) != (ssize_t)sizeof h
		|| pwrite(file, directory, (size_t)parts * sizeof *directory, sizeof h) < 0
		|| ftruncate(file, (off_t)h.bytes) != 0;
	rbf_component_free(c);
	return wrong || close(file) != 0;
}

static int remove_large(void **state)
{
	(void)state;
	return unlink(path) != 0;
}

/* What one pair of directions reads: the cell, its elements, three corners with their sets, lobes and shifts. */
static float query(const rbf_component *c, uint32_t cell)
{
	uint32_t first, last;
	float sum = 0;
	rbf_bound_cell(&c->mesh, cell, &first, &last);
	for (uint32_t e = first; e < last; e++)
		sum += c->mesh.element[rbf_bound_entry(&c->mesh, c->mesh.cell_element[e]) & ~RBF_MESH_BORDER].inverse[0][0];
	const uint32_t element = rbf_bound_entry(&c->mesh, c->mesh.cell_element[first]) & ~RBF_MESH_BORDER;
	for (uint32_t k = 0; k < 3; k++) {
		const uint32_t base = rbf_bound_base(c, c->mesh.vertex + rbf_bound_vertex(&c->mesh, c->mesh.element[element].v[k]));
		const rbf_set *set = rbf_bound_set(c, base);
		sum += (float)(rbf_cull_read(rbf_cull_at(c->cull, c->cull_wide, base, set, cell % 576)) & 1);
		for (uint32_t n = 0; n < 2; n++) {
			const rbf_shift *shift = rbf_bound_shift(c, c->shift_of[6 * element + 2 * k + n], base);
			for (uint32_t b = 0; b < set->blocks; b++)
				sum += c->block[set->first + b].x[0] + c->amplitude[set->first + b].a[0] + (shift ? shift[b].x[0] : 0);
		}
	}
	return sum;
}

static void test_open_and_query(void **state)
{
	struct stat info;
	(void)state;
	assert_int_equal(stat(path, &info), 0);
	double best = 1, best_open = 1;
	long most = 0;
	volatile float sum = 0;
	for (uint32_t i = 0; i < 30; i++) {
		bsdfrbf_model *model;
		for (int warm = 0; warm < 2; warm++) {
			const double start = now();
			assert_int_equal(bsdfrbf_open(NULL, path, &model), BSDFRBF_OK);
			const double opened = now();
			sum += query(model->component + BSDFRBF_RF, 100 * i + 77);
			const double end = now();
			if (warm) {
				best_open = fmin(best_open, opened - start);
				best = fmin(best, end - start);
				most = resident() > most ? resident() : most;
			}
			bsdfrbf_close(model);
		}
	}
	print_message("%.2f GB: open %.0f us, open and one query %.0f us, %ld kB resident\n", (double)info.st_size * 1e-9,
		best_open * 1e6, best * 1e6, most);
	assert_true(info.st_size > 1000000000);
	assert_true(best < 1e-3);
	assert_true(most > 0 && most < 1024);
}

static void test_verify(void **state)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_model *model;
	(void)state;
	assert_int_equal(bsdfrbf_open(context, path, &model), BSDFRBF_OK);
	assert_int_equal(rbf_record_verify(context, path, model), BSDFRBF_ERR_FORMAT); /* the holes have no checksums */
	assert_non_null(strstr(bsdfrbf_message(context), "checksum"));
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_open_and_query), cmocka_unit_test(test_verify)};
	return cmocka_run_group_tests(tests, make_large, remove_large);
}
