/* SPDX-License-Identifier: BSD-3-Clause */
/* What records have packed: lobes are rounded by little, and all of it comes back bit by bit, or is not packed; what is damaged is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "random_model.h"
#include "image.h"
#include "moves.h"

#include <stdio.h>
#include <unistd.h>

static char path[64];

/* Bytes of the sections of a model, or of its file. */
static uint64_t bytes_of(const bsdfrbf_model *model)
{
	uint64_t all = 0, bytes;
	for (int i = 0; i < bsdfrbf_get_section(model, -1, NULL, NULL, NULL); i++) {
		bsdfrbf_get_section(model, i, NULL, NULL, &bytes);
		all += bytes;
	}
	return all;
}

static bsdfrbf_model *again(const bsdfrbf_model *model)
{
	bsdfrbf_model *back;
	assert_int_equal(bsdfrbf_save(NULL, model, path), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_open(NULL, path, &back), BSDFRBF_OK);
	return back;
}

static void assert_same(const rbf_component *a, const rbf_component *b)
{
	uint32_t na[RBF_NUMBERS_MAX], nb[RBF_NUMBERS_MAX];
	rbf_numbers_get(a, na);
	rbf_numbers_get(b, nb);
	assert_memory_equal(na, nb, sizeof na);
	for (int row = 0; row < RBF_ARRAY_ROWS; row++) {
		const size_t size = (size_t)(rbf_array_entries(a, row) * rbf_array_row[row].entry);
		const void *x = rbf_array_get(a, row), *y = rbf_array_get(b, row);
		if (size && x) {
			assert_non_null(y);
			assert_memory_equal(x, y, size);
			assert_int_equal((uintptr_t)y % RBF_RECORD_ALIGN, 0);
		}
	}
}

static void comes_back(void **state)
{
	(void)state;
	for (int k = 0; k < RANDOM_PLANS; k++) {
		random_plan p = random_plans[k];
		p.no_dhr = 0;
		bsdfrbf_model *model = random_model(&p, 40 + (uint64_t)k), *back = again(model), *twice;
		const double share = (double)bytes_of(back) / (double)bytes_of(model);
		int packed = 0;
		for (int i = 0; i < bsdfrbf_get_section(back, -1, NULL, NULL, NULL); i++) {
			const char *name;
			bsdfrbf_get_section(back, i, &name, NULL, NULL);
			packed += !strcmp(name, "packed");
		}
		print_message("plan %d: %.3f of the bytes\n", k, share);
		assert_int_equal(packed, 1);
		assert_true(share < (p.motion > 0 ? .333 : .5));
		assert_same(&model->component[BSDFRBF_RF], &back->component[BSDFRBF_RF]);
		twice = again(back);
		assert_true(bytes_of(twice) == bytes_of(back));
		assert_same(&model->component[BSDFRBF_RF], &twice->component[BSDFRBF_RF]);
		bsdfrbf_close(twice);
		bsdfrbf_close(back);
		bsdfrbf_close(model);
	}
}

static const random_plan mirrors = {RBF_ISOTROPIC, 5, 1, {0, 25, 50, 70, 80}, 0, 2, {RBF_MAP_MIRROR, RBF_MAP_RETRO}, 100, 10, 3000, 0, 3, 0, 0, 2, 0, 0, 1};

/* Of the component's lobes: every other one becomes the image of the one before; or those of the second frame have places and widths of the first. */
enum { AS_THEY_ARE, TWINS, SHARED };
static bsdfrbf_model *changed(int how, double motion)
{
	random_plan p = mirrors;
	p.motion = motion;
	bsdfrbf_model *model = random_model(&p, 11);
	rbf_component *c = &model->component[BSDFRBF_RF];
	rbf_block *block = (rbf_block *)c->block;
	for (uint32_t i = 0; i + 1 < c->blocks * RBF_LANES && how == TWINS; i += 2) {
		rbf_block *b = &block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		if (!(b->k[lane] > 0 && b->k[lane + 1] > 0))
			continue;
		b->x[lane + 1] = b->x[lane];
		b->y[lane + 1] = -b->y[lane];
		b->z[lane + 1] = b->z[lane];
		b->k[lane + 1] = b->k[lane];
		for (uint32_t n = 0; n < c->channels; n++) {
			rbf_amplitude *a = &((rbf_amplitude *)c->amplitude)[n * c->blocks + i / RBF_LANES];
			a->a[lane + 1] = a->a[lane];
		}
	}
	for (uint32_t s = 0; s + 1 < c->sets && how == SHARED; s += 2)
		for (uint32_t n = 0; n + 1 < c->set[s].blocks && n + 1 < c->set[s + 1].blocks; n++)
			block[c->set[s + 1].first + n] = block[c->set[s].first + n];
	free((void *)c->cull);
	assert_int_equal(motion > 0 && rbf_moves_round(c), 0);
	assert_int_equal(rbf_assemble_cull(NULL, c, (float)motion), 0);
	return model;
}

/* What is an image, or another frame's too, takes fewer bytes, and comes back with its masks. */
static void repeats_take_less(void **state)
{
	(void)state;
	double bytes[3];
	for (int how = AS_THEY_ARE; how <= SHARED; how++) {
		bsdfrbf_model *model = changed(how, 0), *back = again(model);
		const rbf_component *c = &model->component[BSDFRBF_RF];
		uint32_t twins = 0;
		for (uint32_t s = 0; s < c->sets; s++)
			twins += 2 * rbf_pack_twins(c, &c->set[s]);
		assert_true(how == TWINS ? twins > .7 * c->blocks : !twins);
		assert_same(c, &back->component[BSDFRBF_RF]);
		bytes[how] = (double)bytes_of(back);
		bsdfrbf_close(back);
		bsdfrbf_close(model);
	}
	print_message("images take %.3f of the bytes, shared lobes %.3f\n", bytes[TWINS] / bytes[0], bytes[SHARED] / bytes[0]);
	assert_true(bytes[TWINS] < .68 * bytes[0] && bytes[SHARED] < .93 * bytes[0]);
}

/* So do shifts of images, which become images. */
static void moved_images_take_less(void **state)
{
	(void)state;
	double bytes[2];
	for (int how = AS_THEY_ARE; how <= TWINS; how++) {
		bsdfrbf_model *model = changed(how, .2), *back = again(model);
		const rbf_component *c = &model->component[BSDFRBF_RF];
		rbf_moves m;
		uint32_t images = 0;
		assert_null(rbf_moves_find(c, &m));
		for (uint32_t i = 0; i < c->shifts; i++) {
			const uint32_t source = rbf_moves_source(&m, i);
			for (int lane = 0; lane < RBF_LANES && source != i; lane++) {
				assert_true(c->shift[i].x[lane] == c->shift[source].x[lane] && c->shift[i].y[lane] == -c->shift[source].y[lane]);
				assert_true(c->shift[i].z[lane] == c->shift[source].z[lane]);
			}
			images += source != i;
		}
		assert_true(how == TWINS ? images > .3 * c->shifts : !images);
		rbf_moves_release(&m);
		assert_same(c, &back->component[BSDFRBF_RF]);
		bytes[how] = (double)bytes_of(back);
		assert_true(bytes[how] < .333 * (double)bytes_of(model));
		bsdfrbf_close(back);
		bsdfrbf_close(model);
	}
	print_message("moved images take %.3f of the bytes\n", bytes[TWINS] / bytes[0]);
	assert_true(bytes[TWINS] < .68 * bytes[0]);
}

/* A shift leads to where it led, but for part of the lobe's spread; what is rounded stays as it is. */
static void rounds_shifts_little(void **state)
{
	(void)state;
	bsdfrbf_model *model = random_model(&random_plans[2], 6);
	const rbf_component *c = &model->component[BSDFRBF_RF];
	rbf_moves m;
	uint64_t seed = 3;
	double most = 0;
	assert_null(rbf_moves_find(c, &m));
	for (uint32_t i = 0; i < c->shifts * RBF_LANES; i++) {
		const uint32_t block = m.block[i / RBF_LANES], lane = i % RBF_LANES;
		const rbf_block *b = &c->block[block];
		rbf_shift was = {{0}, {0}, {0}}, is = was;
		float end[2][3];
		int32_t at[2], again[2];
		was.x[lane] = (float)(.6 * random_unit(&seed) - .3);
		was.y[lane] = (float)(.6 * random_unit(&seed) - .3);
		was.z[lane] = (float)(.6 * random_unit(&seed) - .3);
		rbf_moves_encode(c, &m, &was, block, lane, at);
		rbf_moves_decode(c, &m, at, block, lane, &is);
		rbf_moves_encode(c, &m, &is, block, lane, again);
		assert_memory_equal(at, again, sizeof at);
		if (!m.steps[block * RBF_LANES + lane]) {
			assert_true(is.x[lane] == 0 && is.y[lane] == 0 && is.z[lane] == 0);
			continue;
		}
		for (int n = 0; n < 2; n++) {
			const rbf_shift *s = n ? &is : &was;
			memcpy(end[n], (float[3]){b->x[lane] + s->x[lane], b->y[lane] + s->y[lane], b->z[lane] + s->z[lane]}, sizeof end[n]);
			rbf_normalize(end[n]);
		}
		const float apart[3] = {end[0][0] - end[1][0], end[0][1] - end[1][1], end[0][2] - end[1][2]};
		most = fmax(most, sqrt((double)(rbf_dot(apart, apart) * b->k[lane])));
	}
	print_message("shifts lead past by %.4f of the spread\n", most);
	assert_true(most > .005 && most < sqrt(2) / 64 * 1.02);
	rbf_moves_release(&m);
	bsdfrbf_close(model);
}

/* A lobe that was not rounded makes a record of plain arrays, which has it as it is. */
static void else_is_plain(void **state)
{
	(void)state;
	bsdfrbf_model *model = random_model(&random_plans[0], 3), *back;
	rbf_component *c = &model->component[BSDFRBF_RF];
	((rbf_block *)c->block)[1].x[2] += 1e-7f;
	back = again(model);
	assert_true(bytes_of(back) == bytes_of(model));
	assert_same(c, &back->component[BSDFRBF_RF]);
	bsdfrbf_close(back);
	bsdfrbf_close(model);
}

/* Rounding moves a lobe by a thousandth of its spread, and changes it by as little; what is rounded stays as it is. */
static void rounds_little(void **state)
{
	(void)state;
	enum { BLOCKS = 2000 };
	rbf_component c = {.channels = 3, .blocks = BLOCKS};
	rbf_block *block = calloc(BLOCKS, sizeof *block), *was = malloc(BLOCKS * sizeof *was);
	rbf_amplitude *amplitude = calloc(3 * BLOCKS, sizeof *amplitude), *before = malloc(3 * BLOCKS * sizeof *before);
	uint64_t seed = 5;
	c.block = block;
	c.amplitude = amplitude;
	for (uint32_t i = 0; i < BLOCKS * RBF_LANES; i++) {
		rbf_block *b = &block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		const double z = i % 50 ? random_unit(&seed) : 0, phi = 2 * RBF_PI * (i % 7 ? random_unit(&seed) : .25 * (i % 4)), s = sqrt(1 - z*z);
		b->x[lane] = (float)(s * cos(phi));
		b->y[lane] = (float)(s * sin(phi));
		b->z[lane] = (float)z;
		b->k[lane] = (float)(.5 * pow(8e6, random_unit(&seed)));
		for (uint32_t n = 0; n < 3; n++)
			amplitude[n * BLOCKS + i / RBF_LANES].a[lane] = i % 13 == n ? 0 : (float)pow(10, 14 * random_unit(&seed) - 9);
	}
	memcpy(was, block, BLOCKS * sizeof *was);
	memcpy(before, amplitude, 3 * BLOCKS * sizeof *before);
	rbf_pack_round(&c);
	double moved = 0, wider = 0, more = 0;
	for (uint32_t i = 0; i < BLOCKS * RBF_LANES; i++) {
		const rbf_block *a = &was[i / RBF_LANES], *b = &block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		const double x = (double)b->x[lane] - (double)a->x[lane], y = (double)b->y[lane] - (double)a->y[lane], z = (double)b->z[lane] - (double)a->z[lane];
		moved = fmax(moved, sqrt((x*x + y*y + z*z) * (double)a->k[lane]));
		wider = fmax(wider, fabs((double)(b->k[lane] / a->k[lane]) - 1));
		for (uint32_t n = 0; n < 3; n++) {
			const float from = before[n * BLOCKS + i / RBF_LANES].a[lane], to = amplitude[n * BLOCKS + i / RBF_LANES].a[lane];
			if ((from > 0) != (to > 0)) fail_msg("%g %g k %g z %g", (double)from, (double)to, (double)a->k[lane], (double)a->z[lane]);
			more = fmax(more, from > 0 ? fabs((double)(to / from) - 1) : 0);
		}
	}
	print_message("moved by %.5f, kappa by %.5f, amplitudes by %.5f\n", moved, wider, more);
	assert_true(moved > 1e-4 && moved < 1.2e-3 && wider > 1e-4 && wider < 5e-4 && more > 1e-4 && more < 5e-4);
	memcpy(was, block, BLOCKS * sizeof *was);
	memcpy(before, amplitude, 3 * BLOCKS * sizeof *before);
	rbf_pack_round(&c);
	assert_memory_equal(was, block, BLOCKS * sizeof *was);
	assert_memory_equal(before, amplitude, 3 * BLOCKS * sizeof *before);
	free(block);
	free(was);
	free(amplitude);
	free(before);
}

static image read_from(const char *name)
{
	FILE *f = fopen(name, "rb");
	assert_non_null(f);
	assert_int_equal(fseek(f, 0, SEEK_END), 0);
	const long bytes = ftell(f);
	image file = {malloc((size_t)bytes), (size_t)bytes};
	rewind(f);
	assert_int_equal(fread(file.at, 1, file.bytes, f), file.bytes);
	fclose(f);
	return file;
}

static image read_image(void)
{
	return read_from(path);
}

static bsdfrbf_status open_image(const image *file, uint64_t verify_bytes)
{
	bsdfrbf_model *model;
	FILE *f = fopen(path, "wb");
	assert_non_null(f);
	assert_int_equal(fwrite(file->at, 1, file->bytes, f), file->bytes);
	assert_int_equal(fclose(f), 0);
	const bsdfrbf_status status = rbf_record_open(NULL, path, verify_bytes, &model);
	if (status == BSDFRBF_OK) {
		float value[3], out[3];
		bsdfrbf_eval(model, (float[]){.3f, .1f, .9f}, (float[]){-.4f, .2f, .8f}, value);
		bsdfrbf_sample(model, (float[]){.3f, .1f, .9f}, 0, .3, out);
		bsdfrbf_close(model);
	}
	return status;
}

/* A byte that is wrong is found in files of any size; where somebody made checksums right again, what is there may be anything. */
static void damage_packed(image *file, uint32_t kind, uint64_t seed)
{
	const rbf_record_section *s = image_section(file, kind);
	int refused = 0;
	assert_non_null(s);
	for (int round = 0; round < 300; round++) {
		char *at = file->at + s->offset + (size_t)(random_unit(&seed) * (double)s->bytes), kept = *at;
		*at = (char)(kept ^ (1 << round % 8));
		assert_int_equal(open_image(file, round % 2 ? UINT64_MAX : 0), BSDFRBF_ERR_FORMAT);
		image_seal(file);
		refused += open_image(file, round % 2 ? UINT64_MAX : 0) != BSDFRBF_OK;
		*at = kept;
		image_seal(file);
	}
	assert_true(refused > 0 && refused < 300);
}

static void damage(bsdfrbf_model *model)
{
	assert_int_equal(bsdfrbf_save(NULL, model, path), BSDFRBF_OK);
	bsdfrbf_close(model);
	image file = read_image();
	damage_packed(&file, 40, 9);
	assert_int_equal(open_image(&file, UINT64_MAX), BSDFRBF_OK);
	/* a stream that ends early or late */
	rbf_record_component *c = (rbf_record_component *)(file.at + image_section(&file, RBF_RECORD_COMPONENT)->offset);
	const uint64_t bytes = image_section(&file, 40)->bytes;
	uint32_t *packed = NULL;
	for (int n = 0; n < RBF_NUMBERS_MAX; n++)
		if (c->number[n] == bytes)
			packed = &c->number[n];
	assert_non_null(packed);
	for (uint64_t less = 1; less < bytes; less += 1 + less / 3) {
		const image cut = {file.at, file.bytes};
		*packed = (uint32_t)(bytes - less);
		image_seal(&cut);
		assert_int_equal(open_image(&cut, UINT64_MAX), BSDFRBF_ERR_FORMAT); /* other size than the number says */
	}
	*packed = (uint32_t)bytes;
	/* more than may come out of one */
	for (int n = 0; n < RBF_NUMBERS_MAX; n++) {
		const uint32_t kept = c->number[n];
		for (int way = 0; way < 4; way++) {
			c->number[n] = way == 0 ? 1u << 28 : way == 1 ? kept + 1 : way == 2 ? kept / 2 : 0xffffffffu;
			image_seal(&file);
			open_image(&file, way % 2 ? UINT64_MAX : 0);
		}
		c->number[n] = kept;
	}
	image_seal(&file);
	assert_int_equal(open_image(&file, UINT64_MAX), BSDFRBF_OK);
	for (uint16_t minor = 0; minor <= 2; minor++) { /* which had no such thing */
		image_header(&file)->minor = minor;
		image_seal(&file);
		assert_int_equal(open_image(&file, UINT64_MAX), BSDFRBF_ERR_FORMAT);
	}
	free(file.at);
}

static void damage_is_refused(void **state)
{
	(void)state;
	damage(random_model(&random_plans[0], 8));
	damage(changed(TWINS, 0));
	damage(changed(SHARED, 0));
	damage(changed(TWINS, .2));
	damage(random_model(&random_plans[1], 8));
}

/* A stream of version 1.2, which is read by other code. */
static void former_damage(void **state)
{
	(void)state;
	const char *source = getenv("SOURCE_DIR");
	char name[4096];
	if (!source)
		skip();
	snprintf(name, sizeof name, "%s/test/golden/tf-1.2.rbf", source);
	image file = read_from(name);
	assert_int_equal(open_image(&file, UINT64_MAX), BSDFRBF_OK);
	damage_packed(&file, RBF_RECORD_FORMER_PACKED, 12);
	image_header(&file)->minor = 3; /* whose streams are others, of another kind */
	image_seal(&file);
	assert_int_equal(open_image(&file, UINT64_MAX), BSDFRBF_ERR_FORMAT);
	free(file.at);
}

static int new_path(void **state)
{
	(void)state;
	strcpy(path, "/tmp/rbf-pack-XXXXXX");
	const int file = mkstemp(path);
	return file < 0 || close(file) != 0;
}

static int remove_path(void **state)
{
	(void)state;
	return unlink(path);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(comes_back), cmocka_unit_test(repeats_take_less), cmocka_unit_test(moved_images_take_less),
		cmocka_unit_test(rounds_shifts_little), cmocka_unit_test(else_is_plain), cmocka_unit_test(rounds_little),
		cmocka_unit_test(damage_is_refused), cmocka_unit_test(former_damage)};
	return cmocka_run_group_tests(tests, new_path, remove_path);
}
