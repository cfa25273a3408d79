/* SPDX-License-Identifier: BSD-3-Clause */
/* The recorded file: what is written comes back, and nothing damaged or hostile does any harm. */
#include "bounds.h"
#include "cull.h"
#include "dhr_grid.h"
#include "image.h"
#include "synthetic.h"

#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#if defined(__SANITIZE_ADDRESS__)
#define SANITIZED 1
#else
#define SANITIZED 0
#endif

static char path[64];

static int new_path(void **state)
{
	strcpy(path, "/dev/shm/rbf-record-XXXXXX"); /* in memory where there is such a folder: much is written */
	int file = mkstemp(path);
	if (file < 0) {
		strcpy(path, "/tmp/rbf-record-XXXXXX");
		file = mkstemp(path);
	}
	*state = bsdfrbf_context_new();
	return file < 0 || close(file) != 0;
}

static int remove_path(void **state)
{
	bsdfrbf_context_free(*state);
	return unlink(path) != 0;
}

static image read_image(void)
{
	struct stat info;
	FILE *f = fopen(path, "rb");
	assert_non_null(f);
	assert_int_equal(fstat(fileno(f), &info), 0);
	image file = {malloc((size_t)info.st_size), (size_t)info.st_size};
	assert_int_equal(fread(file.at, 1, file.bytes, f), file.bytes);
	fclose(f);
	return file;
}

static void write_image(const image *file)
{
	FILE *f = fopen(path, "wb");
	assert_non_null(f);
	assert_int_equal(fwrite(file->at, 1, file->bytes, f), file->bytes);
	assert_int_equal(fclose(f), 0);
}

static image small_image(const synthetic *want)
{
	bsdfrbf_model *model = rbf_model_new();
	model->channels = want->channels;
	synthetic_component(want, 7, model->component + BSDFRBF_TF);
	assert_int_equal(bsdfrbf_set_text(NULL, model, "name", "a small one"), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_save(NULL, model, path), BSDFRBF_OK);
	bsdfrbf_close(model);
	return read_image();
}

/* Touches all that an evaluator would, through bounds.h. */
static double walk(const bsdfrbf_model *model)
{
	double sum = 0;
	for (int i = 0; i < 4; i++) {
		const rbf_component *c = model->component + i;
		if (!c->present)
			continue;
		for (int i = 0; i < 50 && c->dhr_grid; i++) {
			const double z = i / 49., r = sqrt(1 - z*z);
			float dhr[3];
			rbf_dhr_from_grid(c, (float[]){(float)(r * cos(i)), (float)(r * sin(i)), (float)z}, dhr);
			sum += (double)dhr[0];
		}
		for (uint32_t cell = 0; cell < rbf_mesh_cells(&c->mesh); cell += 97) {
			uint32_t first, last;
			rbf_bound_cell(&c->mesh, cell, &first, &last);
			for (uint32_t e = first; e < last && e < first + 50; e++) {
				const uint32_t entry = rbf_bound_entry(&c->mesh, c->mesh.cell_element[e]);
				const int border = entry & RBF_MESH_BORDER ? 1 : 0;
				const uint32_t *corner = border ? c->mesh.border[entry & ~RBF_MESH_BORDER] : c->mesh.element[entry].v;
				for (int k = 0; k < 2; k++) {
					const uint32_t base = rbf_bound_base(c, c->mesh.vertex + rbf_bound_vertex(&c->mesh, corner[k]));
					const rbf_shift *shift = c->shift_of && !border
						? rbf_bound_shift(c, c->shift_of[6 * (size_t)entry + (size_t)k], base) : NULL;
					for (uint32_t f = 0; f < c->frames; f++) {
						const rbf_set *set = rbf_bound_set(c, (size_t)base * c->frames + f);
						const uint32_t start = set->blocks ? set->first - c->set[base * c->frames].first : 0;
						const size_t s = (size_t)base * c->frames + f;
						for (uint32_t n = 0; n < RBF_CULL_CELLS && set->blocks && (c->cull || c->cull_wide); n += 261)
							sum += (double)rbf_cull_read(rbf_cull_at(c->cull, c->cull_wide, s, set, n));
						for (uint32_t b = 0; b < set->blocks && b < 50; b++)
							sum += c->block[set->first + b].k[7] + c->amplitude[set->first + b].a[7]
								+ (shift ? shift[start + b].z[7] : 0);
					}
				}
			}
		}
	}
	return sum;
}

static void assert_same(const rbf_component *a, const rbf_component *b)
{
	uint32_t na[RBF_NUMBERS_MAX], nb[RBF_NUMBERS_MAX];
	rbf_numbers_get(a, na);
	rbf_numbers_get(b, nb);
	assert_memory_equal(na, nb, sizeof na);
	assert_int_equal(a->present, b->present);
	assert_memory_equal(a->lambertian, b->lambertian, sizeof a->lambertian);
	assert_memory_equal(&a->facts, &b->facts, sizeof a->facts);
	for (int row = 0; row < RBF_ARRAY_ROWS && a->present; row++) {
		const void *x = rbf_array_get(a, row), *y = rbf_array_get(b, row);
		assert_int_equal(!x, !y);
		if (x) {
			assert_memory_equal(x, y, (size_t)(rbf_array_entries(a, row) * rbf_array_row[row].entry));
			assert_int_equal((uintptr_t)y % RBF_RECORD_ALIGN, 0);
		}
	}
}

static void test_round_trip(void **state)
{
	static const synthetic want[] = {
		{1, RBF_BILATERAL_Y, 2, 3, 1, 2, 5, 1, 1, 1, 2, 0},
		{3, RBF_ISOTROPIC, 7, 7, 6, 2, 9000, 2, 0, 3, 32, 1},
		{3, RBF_QUADRILATERAL, 5, 20, 30, 1, 5000, 4, 1, 70, 6, 2},
		{1, RBF_ANISOTROPIC, 1, 1, 0, 1, 4096, 1, 0, 0, 2, 1}, /* one incidence, no lobe at all */
	};
	for (unsigned mask = 1; mask < 16; mask++)
		for (int three = 0; three < 2; three++) {
			bsdfrbf_model *model = rbf_model_new(), *back = NULL;
			const char *name;
			int component, sections;
			uint64_t bytes, back_bytes;
			model->channels = three ? 3 : 1;
			for (int i = 0; i < 4; i++) {
				synthetic w = want[(i + (int)mask) % 4];
				w.channels = model->channels;
				if (mask >> i & 1)
					synthetic_component(&w, mask + 100, model->component + i);
			}
			bsdfrbf_set_text(*state, model, "name", "glass");
			bsdfrbf_set_text(*state, model, "source", "");
			assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_OK);
			assert_int_equal(bsdfrbf_is_rbf(path), 1);
			assert_int_equal(bsdfrbf_open(*state, path, &back), BSDFRBF_OK);
			assert_int_equal(bsdfrbf_channels(back), model->channels);
			for (int i = 0; i < 4; i++) {
				assert_same(model->component + i, back->component + i);
				assert_int_equal(bsdfrbf_has(back, (bsdfrbf_component)i), mask >> i & 1);
			}
			assert_string_equal(bsdfrbf_get_text(back, "name"), "glass");
			assert_string_equal(bsdfrbf_get_text(back, "source"), "");
			assert_string_equal(bsdfrbf_get_text(back, "none"), "");
			assert_int_equal(bsdfrbf_set_text(*state, back, "name", "x"), BSDFRBF_ERR_ARGUMENT);
			assert_int_equal(rbf_record_verify(*state, path, back), BSDFRBF_OK);
			sections = bsdfrbf_get_section(model, 0, &name, &component, &bytes);
			assert_int_equal(bsdfrbf_get_section(back, -1, NULL, NULL, NULL), sections);
			for (int i = 0; i < sections; i++) {
				bsdfrbf_get_section(model, i, &name, &component, &bytes);
				bsdfrbf_get_section(back, i, &name, &component, &back_bytes);
				assert_int_equal(bytes, back_bytes);
				assert_string_not_equal(name, "unknown");
			}
			bsdfrbf_close(back);
			bsdfrbf_close(model);
		}
}

static void test_texts(void **state)
{
	bsdfrbf_model *model = rbf_model_new();
	char *large = malloc(65537);
	memset(large, 'a', 65536);
	large[65536] = 0;
	assert_int_equal(bsdfrbf_set_text(*state, model, "k", large), BSDFRBF_ERR_ARGUMENT);
	large[65535] = 0;
	assert_int_equal(bsdfrbf_set_text(*state, model, "k", large), BSDFRBF_OK);
	assert_string_equal(bsdfrbf_get_text(model, "k"), large);
	assert_int_equal(bsdfrbf_set_text(*state, model, "other", "b"), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_set_text(*state, model, "k", "c"), BSDFRBF_OK);
	assert_string_equal(bsdfrbf_get_text(model, "k"), "c");
	assert_string_equal(bsdfrbf_get_text(model, "other"), "b");
	assert_string_equal(bsdfrbf_get_text(model, "b"), ""); /* a value is no key */
	assert_int_equal(model->text_bytes, 4 + 8);
	assert_int_equal(bsdfrbf_set_text(*state, model, "", "c"), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_ARGUMENT); /* no component */
	free(large);
	bsdfrbf_close(model);
}

static void test_info(void **state)
{
	(void)state;
	bsdfrbf_model *model = rbf_model_new();
	bsdfrbf_component_info info;
	bsdfrbf_incidence_info incidence;
	float value[3] = {9, 9, 9};
	model->channels = 1;
	synthetic_component(&synthetic_small, 7, model->component + BSDFRBF_TF);
	assert_int_equal(bsdfrbf_get_component_info(model, BSDFRBF_RF, &info), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_get_component_info(model, (bsdfrbf_component)9, &info), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_get_component_info(model, BSDFRBF_TF, &info), BSDFRBF_OK);
	assert_int_equal(info.symmetry, 'B');
	assert_string_equal(info.symmetry_text, "made up");
	assert_int_equal(info.incidences, 2);
	assert_int_equal(info.lobes, 16);
	assert_string_equal(info.frame_name[0], "mirror");
	assert_int_equal(bsdfrbf_get_incidence_info(model, BSDFRBF_TF, 2, &incidence), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_get_incidence_info(model, BSDFRBF_TF, 1, &incidence), BSDFRBF_OK);
	assert_int_equal(incidence.lobes, 8);
	bsdfrbf_lambertian(model, BSDFRBF_TB, value); /* by reciprocity */
	assert_true(value[0] == .125f && value[1] == 9);
	bsdfrbf_lambertian(model, BSDFRBF_RB, value);
	assert_true(value[0] == 0);
	bsdfrbf_close(model);
	bsdfrbf_close(NULL);
}

static bsdfrbf_status open_and_walk(bsdfrbf_context *context, uint64_t verify_bytes)
{
	bsdfrbf_model *model = (bsdfrbf_model *)&path; /* must be set to NULL on failure */
	const bsdfrbf_status status = rbf_record_open(context, path, verify_bytes, &model);
	if (status == BSDFRBF_OK) {
		volatile double sum = walk(model);
		(void)sum;
		bsdfrbf_close(model);
	} else
		assert_null(model);
	return status;
}

static void test_truncated(void **state)
{
	image file = small_image(&synthetic_small);
	assert_int_equal(open_and_walk(*state, UINT64_MAX), BSDFRBF_OK);
	for (size_t bytes = file.bytes; bytes-- > 0;) {
		assert_int_equal(truncate(path, (off_t)bytes), 0);
		assert_int_equal(open_and_walk(*state, bytes % 2 ? UINT64_MAX : 0), BSDFRBF_ERR_FORMAT);
		assert_non_null(strstr(bsdfrbf_message(*state), path));
	}
	file.at = realloc(file.at, file.bytes + 1);
	file.at[file.bytes++] = 0;
	write_image(&file);
	assert_int_equal(open_and_walk(*state, UINT64_MAX), BSDFRBF_ERR_FORMAT);
	free(file.at);
}

static void test_flipped(void **state)
{
	image file = small_image(&synthetic_small);
	const int f = open(path, O_WRONLY | O_CLOEXEC);
	const size_t structure = image_section(&file, 16)->offset + 64;
	for (size_t i = 0; i < file.bytes; i++)
		for (unsigned bit = 0; bit < 9; bit++) {
			const char flipped = (char)(file.at[i] ^ (bit < 8 ? 1 << bit : 0xff));
			if ((SANITIZED || i > structure) && bit % 8 != i % 8)
				continue;
			assert_int_equal(pwrite(f, &flipped, 1, (off_t)i), 1);
			assert_int_not_equal(open_and_walk(*state, UINT64_MAX), BSDFRBF_OK);
			open_and_walk(*state, 0); /* as a file too large to be checked */
			assert_int_equal(pwrite(f, file.at + i, 1, (off_t)i), 1);
		}
	close(f);
	assert_int_equal(open_and_walk(*state, UINT64_MAX), BSDFRBF_OK);
	free(file.at);
}

/* Every 32-bit number of header, directory, component header and index arrays is set to what may overflow, with right
 * checksums. Refused or not: no crash, no hang, and nothing of the file's sizes is ever allocated. */
static void test_hostile_numbers(void **state)
{
	static const uint32_t evil[] = {0, 1, 2, 7, 63, 64, 65, 0x7fffffff, 0x80000000, 0xffffffff, 0xffffffc0, 0x7fc00000};
	const image file = small_image(&synthetic_small);
	const size_t cells = image_section(&file, 16)->offset + 64, behind_cells = image_section(&file, 17)->offset - 64;
	int accepted = 0;
	for (size_t at = 0; at < file.bytes; at += 4) {
		if (at > cells && at < behind_cells && at % 256) /* not each of the 4097 cells */
			continue;
		for (size_t k = 0; k < sizeof evil / sizeof *evil; k++) {
			image copy = {malloc(file.bytes), file.bytes};
			memcpy(copy.at, file.at, file.bytes);
			memcpy(copy.at + at, evil + k, 4);
			image_seal(&copy);
			write_image(&copy);
			accepted += open_and_walk(*state, UINT64_MAX) == BSDFRBF_OK;
			open_and_walk(*state, 0);
			free(copy.at);
		}
	}
	assert_true(accepted > 0); /* floats that are fine */
	free(file.at);
}

/* Several random changes at once, resealed. */
static void test_mutated(void **state)
{
	const image either[2] = {small_image(&(synthetic){3, RBF_ANISOTROPIC, 3, 4, 3, 3, 40, 2, 1, 2, 4, 1}),
		small_image(&(synthetic){3, RBF_ANISOTROPIC, 3, 4, 3, 3, 40, 2, 1, 2, 4, 2})};
	uint64_t seed = 11;
	for (int round = 0; round < (SANITIZED ? 4000 : 20000); round++) {
		const image file = either[round / 2 % 2];
		const size_t start = image_section(&file, 16)->offset;
		image copy = {malloc(file.bytes), file.bytes};
		memcpy(copy.at, file.at, file.bytes);
		for (uint32_t n = synthetic_random(&seed) % 6 + 1; n > 0; n--) {
			/* mostly where the structure is */
			const size_t range = synthetic_random(&seed) % 4 ? start : file.bytes;
			const size_t at = synthetic_random(&seed) % (range - 8);
			const uint32_t value = synthetic_random(&seed) >> synthetic_random(&seed) % 31;
			memcpy(copy.at + (at & ~(size_t)3), &value, synthetic_random(&seed) % 4 + 1);
		}
		image_seal(&copy);
		write_image(&copy);
		open_and_walk(*state, round % 2 ? UINT64_MAX : 0);
		free(copy.at);
	}
	free(either[0].at);
	free(either[1].at);
}

static void expect(bsdfrbf_context *context, const image *file, bsdfrbf_status status, const char *words)
{
	image_seal(file);
	write_image(file);
	assert_int_equal(open_and_walk(context, UINT64_MAX), status);
	if (!strstr(bsdfrbf_message(context), words))
		fail_msg("\"%s\" lacks \"%s\"", bsdfrbf_message(context), words);
}

static void test_versions(void **state)
{
	const image file = small_image(&synthetic_small);
	rbf_record_header *h = image_header(&file);
	h->major = 2;
	expect(*state, &file, BSDFRBF_ERR_VERSION, "version 2.3");
	h->major = 1;
	h->minor = 7;
	expect(*state, &file, BSDFRBF_OK, "");
	h->reserved = 1;
	expect(*state, &file, BSDFRBF_ERR_VERSION, "later version");
	h->reserved = 0;
	h->endian = 0x04030201;
	expect(*state, &file, BSDFRBF_ERR_UNSUPPORTED, "little-endian");
	h->endian = RBF_RECORD_ENDIAN;
	file.at[4] = '\n';
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "as text");
	memcpy(file.at, "<?xml ve", 8);
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "not an .rbf file");
	assert_int_equal(bsdfrbf_is_rbf(path), 0);
	free(file.at);
}

static void test_sections(void **state)
{
	const image file = small_image(&synthetic_small);
	rbf_record_section *s = image_section(&file, RBF_RECORD_TEXT);
	s->kind = 4000; /* one that this reader does not know */
	expect(*state, &file, BSDFRBF_OK, "");
	s->component = 77;
	expect(*state, &file, BSDFRBF_OK, "");
	s->flags = 6;
	expect(*state, &file, BSDFRBF_OK, "");
	s->flags = RBF_RECORD_MUST;
	expect(*state, &file, BSDFRBF_ERR_VERSION, "kind 4000");
	s->flags = 0;
	s = image_section(&file, 26);
	s->flags = RBF_RECORD_MUST | 2; /* say, compressed */
	expect(*state, &file, BSDFRBF_ERR_VERSION, "lobes");
	s->flags = RBF_RECORD_MUST;
	s->entry += 4;
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "lobes");
	s->entry -= 4;
	s->component = BSDFRBF_RF;
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "belongs to no component");
	s->component = 4;
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "component");
	s->component = BSDFRBF_TF;
	s->kind = 27;
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "twice");
	s->kind = 4000;
	s->flags = 0;
	expect(*state, &file, BSDFRBF_ERR_FORMAT, "\"lobes\" of tf is missing");
	free(file.at);
}

/* Packed masks of sets of all sizes: one behind the other, each within the eight bytes that are read, and these within the array. */
static void test_packed_masks(void **state)
{
	enum { SETS = 140 };
	rbf_set set[SETS] = {{0}};
	uint64_t end = 0;
	uint32_t blocks = 0;
	(void)state;
	for (uint32_t s = 0; s < SETS; s++) {
		set[s].first = blocks;
		set[s].blocks = SETS - 1 - s; /* one block at last, and none */
		blocks += set[s].blocks;
	}
	static const uint64_t room[1024];
	for (uint32_t b = 1; b <= 64; b++) { /* sets of one block: what is read of the last one goes furthest */
		const rbf_cull_mask last = rbf_cull_packed(room, &(rbf_set){.first = b - 1, .blocks = 1}, RBF_CULL_CELLS - 1);
		assert_true((uint64_t)(last.at - (const char *)room) + 8 <= 8 * rbf_cull_words(b));
	}
	const size_t words = (size_t)rbf_cull_words(blocks);
	uint64_t *packed = calloc(words, sizeof *packed), seed = 5;
	for (uint32_t s = 0; s < SETS - 1; s++) {
		const uint32_t group = (set[s].blocks + 63) / 64, groups = (set[s].blocks + group - 1) / group;
		for (uint32_t cell = 0; cell < RBF_CULL_CELLS; cell++) {
			const rbf_cull_mask m = rbf_cull_packed(packed, &set[s], cell);
			const uint64_t begin = (uint64_t)(m.at - (const char *)packed) * 8 + m.shift;
			assert_true(begin >= end && m.shift + groups <= 64 && (size_t)(m.at - (const char *)packed) + 8 <= words * sizeof *packed);
			end = begin + groups;
		}
	}
	for (int reading = 0; reading < 2; reading++, seed = 5)
		for (uint32_t s = 0; s < SETS - 1; s++)
			for (uint32_t cell = 0; cell < RBF_CULL_CELLS; cell++) {
				const uint32_t group = (set[s].blocks + 63) / 64, groups = (set[s].blocks + group - 1) / group;
				const uint64_t some = (uint64_t)synthetic_random(&seed) << 33 ^ (uint64_t)synthetic_random(&seed) << 11 ^ synthetic_random(&seed);
				const uint64_t mask = groups < 64 ? some & (((uint64_t)1 << groups) - 1) : some;
				if (!reading)
					rbf_cull_write(packed, &set[s], cell, mask);
				else if ((rbf_cull_read(rbf_cull_packed(packed, &set[s], cell)) ^ mask) << (64 - groups))
					fail_msg("mask of cell %u of a set of %u blocks", cell, set[s].blocks);
			}
	free(packed);
}

/* Masks of another number than the blocks call for are refused: none is ever looked for outside. */
static void test_masks_missing(void **state)
{
	for (int optional = 1; optional < 3; optional++) {
		const image file = small_image(&(synthetic){1, RBF_ANISOTROPIC, 1, 1, 0, 1, 30, 1, 0, 2, 2, optional});
		rbf_record_section *s = image_section(&file, optional == 1 ? 33 : 25);
		assert_non_null(s);
		assert_null(image_section(&file, optional == 1 ? 25 : 33));
		const uint64_t bytes = s->bytes;
		assert_int_equal(bytes, optional == 1 ? (824 * 2 + 63) / 64 * 8 + 8 : 28 * 28 * 8);
		s->bytes = bytes - 8;
		expect(*state, &file, BSDFRBF_ERR_FORMAT, "cull\" of tf: size");
		s->bytes = bytes;
		expect(*state, &file, BSDFRBF_OK, "");
		s->kind = 4000; /* a file may be without */
		s->flags = 0;
		expect(*state, &file, BSDFRBF_OK, "");
		s->kind = optional == 1 ? 25 : 33;
		expect(*state, &file, BSDFRBF_ERR_FORMAT, "cull\" of tf: size");
		free(file.at);
	}
}

/* A grid of DHR of another size is refused; a file may be without, and be read by those who do not know it. */
static void test_grid_missing(void **state)
{
	static const rbf_symmetry symmetry[] = {RBF_ISOTROPIC, RBF_QUADRILATERAL, RBF_BILATERAL_X, RBF_UP, RBF_ANISOTROPIC};
	static const uint64_t nodes[] = {6, 36, 66, 66, 121};
	for (int k = 0; k < 5; k++) {
		const image file = small_image(&(synthetic){3, symmetry[k], 1, 1, 0, 1, 30, 1, 0, 2, 2, 1});
		rbf_record_section *s = image_section(&file, 38);
		assert_non_null(s);
		assert_int_equal(s->flags, 0);
		assert_int_equal(s->bytes, nodes[k] * 3 * 2);
		s->bytes -= 2;
		expect(*state, &file, BSDFRBF_ERR_FORMAT, "dhr grid\" of tf: size");
		s->bytes += 2;
		expect(*state, &file, BSDFRBF_OK, "");
		s->kind = 4000;
		expect(*state, &file, BSDFRBF_OK, "");
		free(file.at);
	}
}

static void test_not_files(void **state)
{
	bsdfrbf_model *model;
	assert_int_equal(bsdfrbf_open(*state, "/tmp", &model), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_open(*state, "/dev/zero", &model), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_open(*state, "/none/such.rbf", &model), BSDFRBF_ERR_IO);
	assert_non_null(strstr(bsdfrbf_message(*state), "/none/such.rbf"));
	assert_int_equal(bsdfrbf_open(*state, path, &model), BSDFRBF_ERR_FORMAT); /* empty */
	assert_int_equal(bsdfrbf_open(*state, NULL, &model), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(bsdfrbf_open(NULL, path, NULL), BSDFRBF_ERR_ARGUMENT);
	unlink(path);
	assert_int_equal(mkfifo(path, 0666), 0);
	assert_int_equal(bsdfrbf_open(*state, path, &model), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_is_rbf(path), 0);
}

/* What contradicts itself is not written. */
static void test_defects(void **state)
{
	bsdfrbf_model *model = rbf_model_new();
	rbf_component *c = model->component + BSDFRBF_RB;
	model->channels = 1;
	synthetic_component(&synthetic_small, 3, c);
	((float *)c->dhr)[1] = NAN;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	assert_non_null(strstr(bsdfrbf_message(*state), "component rb contradicts itself: dhr"));
	((float *)c->dhr)[1] = 0;
	((rbf_set *)c->set)[1].first++;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	rbf_component_free(c);
	/* a grid of DHR with units of no number, or larger than any */
	synthetic_component(&(synthetic){3, RBF_BILATERAL_Y, 2, 3, 1, 2, 5, 1, 1, 1, 2, 1}, 3, c);
	model->channels = 3;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_OK);
	for (int n = 0; n < 2; n++) {
		const float unit = n ? INFINITY : NAN;
		memcpy(&c->dhr_unit[2], &unit, sizeof unit);
		assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
		assert_non_null(strstr(bsdfrbf_message(*state), "grid of the reflectance table"));
	}
	c->dhr_unit[2] = 0;
	c->dhr_cells = RBF_DHR_CELLS_MAX + 1;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	assert_non_null(strstr(bsdfrbf_message(*state), "grid of the reflectance table"));
	rbf_component_free(c);
	model->channels = 1;
	/* a learned beam of no number, or that moves like none, or that is not there */
	synthetic_component(&(synthetic){1, RBF_ANISOTROPIC, 3, 4, 3, 3, 40, 2, 1, 2, 4, 1}, 3, c);
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_OK);
	static const float wrong[] = {NAN, INFINITY, -1000};
	for (int n = 0; n < 3; n++) {
		rbf_linear *linear = (rbf_linear *)c->linear;
		const float kept = linear[1].row[1][3];
		linear[1].row[1][3] = wrong[n];
		assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
		assert_non_null(strstr(bsdfrbf_message(*state), "learned frame"));
		linear[1].row[1][3] = kept;
	}
	static const float limits[] = {NAN, INFINITY, .99f, 1e6f};
	for (int n = 0; n < 4; n++) {
		((float *)c->limit)[1] = limits[n];
		assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
		assert_non_null(strstr(bsdfrbf_message(*state), "limits"));
	}
	((float *)c->limit)[1] = 1;
	((rbf_level *)c->level)[1].slope[2] = INFINITY;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	assert_non_null(strstr(bsdfrbf_message(*state), "levels"));
	((rbf_level *)c->level)[1].slope[2] = 0;
	c->even = 3;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	assert_non_null(strstr(bsdfrbf_message(*state), "evened levels"));
	c->even = 2;
	c->frame[1] = RBF_MAP_MIRROR;
	assert_int_equal(bsdfrbf_save(*state, model, path), BSDFRBF_ERR_INTERNAL);
	bsdfrbf_close(model);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, new_path, remove_path)
	const struct CMUnitTest tests[] = {
		TEST(test_round_trip), TEST(test_texts), TEST(test_info), TEST(test_truncated), TEST(test_flipped),
		TEST(test_hostile_numbers), TEST(test_mutated), TEST(test_versions), TEST(test_sections), TEST(test_packed_masks), TEST(test_masks_missing), TEST(test_grid_missing), TEST(test_not_files),
		TEST(test_defects),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
