/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Out of memory at any moment, from measurements to a recorded file and back: a status, no crash, nothing lost, nothing left.
 * The library's allocations come here first (CMakeLists.txt: --wrap). MEMORY=1 fails every single one; else the later, the fewer.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "bsdfrbf.h"

enum { LIVE = 1 << 16, FILES = 40 };

static void *live[LIVE];
static size_t lives;
static long asked, fails_at = -1;
static int from_then_on;

void *__real_malloc(size_t bytes);
void *__real_realloc(void *at, size_t bytes);
void __real_free(void *at);
FILE *__real_open_memstream(char **at, size_t *bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *at, size_t bytes);
char *__wrap_strdup(const char *text);
void __wrap_free(void *at);
FILE *__wrap_open_memstream(char **at, size_t *bytes);

static int refuse(void)
{
	const long now = asked++;
	return fails_at >= 0 && (from_then_on ? now >= fails_at : now == fails_at);
}

static void add(void *at)
{
	if (at && lives < LIVE)
		live[lives++] = at;
}

static void forget(const void *at)
{
	for (size_t i = lives; at && i-- > 0;)
		if (live[i] == at) {
			live[i] = live[--lives];
			return;
		}
}

void *__wrap_malloc(size_t bytes)
{
	void *at = NULL;
	#pragma omp critical(memory)
	if (!refuse()) {
		at = __real_malloc(bytes);
		add(at);
	}
	return at;
}

void *__wrap_calloc(size_t count, size_t bytes)
{
	void *at = bytes && count > SIZE_MAX / bytes ? NULL : __wrap_malloc(count * bytes);
	if (at)
		memset(at, 0, count * bytes);
	return at;
}

void *__wrap_realloc(void *old, size_t bytes)
{
	void *at = NULL;
	#pragma omp critical(memory)
	if (!refuse()) {
		forget(old);
		at = __real_realloc(old, bytes);
		add(at);
	}
	return at;
}

char *__wrap_strdup(const char *text)
{
	char *at = __wrap_malloc(strlen(text) + 1);
	return at ? strcpy(at, text) : NULL;
}

void __wrap_free(void *at)
{
	#pragma omp critical(memory)
	forget(at);
	__real_free(at);
}

FILE *__wrap_open_memstream(char **at, size_t *bytes)
{
	return refuse() ? NULL : __real_open_memstream(at, bytes);
}

/* ------------------------------------------------------------------------- */

static char folder[] = "/tmp/rbf-memory-XXXXXX", path[FILES][64], result[64];
static int files;

/* Splits a sample of the fuzzer's corpus, files separated by a line "--- file". */
static void take(const char *name)
{
	char from[4096], *line = NULL;
	size_t room = 0;
	ssize_t bytes;
	snprintf(from, sizeof from, "%s/test/fuzz/corpus/build/%s", getenv("SOURCE_DIR"), name);
	FILE *in = fopen(from, "r"), *out = NULL;
	assert_non_null(in);
	for (files = 0; (bytes = getline(&line, &room, in)) >= 0;) {
		const int next = !strcmp(line, "--- file\n");
		if (!out || next) {
			if (out)
				fclose(out);
			assert_true(files < FILES);
			snprintf(path[files], sizeof path[files], "%s/%d.dat", folder, files);
			out = fopen(path[files++], "w");
			assert_non_null(out);
		}
		if (!next)
			fwrite(line, 1, (size_t)bytes, out);
	}
	free(line);
	fclose(out);
	fclose(in);
}

static bsdfrbf_status everything(void)
{
	static const float in[3] = {.3f, .2f, .8f}, out[3] = {-.3f, -.1f, .7f};
	bsdfrbf_model *model = NULL, *back = NULL;
	bsdfrbf_build_options options;
	bsdfrbf_status status = BSDFRBF_ERR_MEMORY;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = context ? bsdfrbf_data_new(context) : NULL;
	if (data) {
		status = BSDFRBF_OK;
		for (int n = 0; n < files && status == BSDFRBF_OK; n++)
			status = bsdfrbf_data_read(context, data, path[n]);
		bsdfrbf_build_defaults(&options);
		options.threads = 1;
		if (status == BSDFRBF_OK)
			status = bsdfrbf_build(context, data, &options, &model);
		if ((status == BSDFRBF_OK) != (model != NULL))
			status = BSDFRBF_ERR_INTERNAL;
		if (status == BSDFRBF_OK)
			status = bsdfrbf_save(context, model, result);
		if (status == BSDFRBF_OK)
			status = bsdfrbf_open(context, result, &back);
		if (status == BSDFRBF_OK) {
			float value[3], direction[3];
			bsdfrbf_eval(back, in, out, value);
			bsdfrbf_dhr(back, in, 0, value);
			bsdfrbf_sample(back, in, 0, .4, direction);
		} else if (!bsdfrbf_message(context)[0])
			status = BSDFRBF_ERR_INTERNAL;
	}
	bsdfrbf_close(back);
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return status;
}

static void fail_each(const char *name)
{
	take(name);
	snprintf(result, sizeof result, "%s/o.rbf", folder);
	fails_at = -1;
	assert_int_equal(everything(), BSDFRBF_OK); /* what stays for good, as of libraries, is made here */
	asked = 0;
	const size_t before = lives;
	assert_int_equal(everything(), BSDFRBF_OK);
	assert_int_equal(lives, before);
	const long all = asked;
	long faults = 0, refused = 0;
	for (from_then_on = 0; from_then_on < 2; from_then_on++)
		for (long k = 0; k < all; k += getenv("MEMORY") ? 1 : 1 + k / 5) {
			asked = 0;
			fails_at = k;
			const bsdfrbf_status status = everything();
			fails_at = -1;
			faults++;
			refused += status != BSDFRBF_OK;
			if ((status != BSDFRBF_OK && status != BSDFRBF_ERR_MEMORY) || lives != before)
				fail_msg("%s, allocation %ld of %ld%s: status %d, %zu blocks left", name, k, all, from_then_on ? " and all later" : "",
					(int)status, lives - before);
			bsdfrbf_model *whole = NULL; /* the file of an earlier run, or of this one */
			assert_int_equal(bsdfrbf_open(NULL, result, &whole), BSDFRBF_OK);
			bsdfrbf_close(whole);
		}
	print_message("%s: %ld allocations, %ld faults, %ld refused\n", name, all, faults, refused);
	for (int n = 0; n < files; n++)
		remove(path[n]);
	remove(result);
	assert_int_equal(rmdir(folder), 0); /* no temporary file is left */
	assert_non_null(mkdtemp(strcpy(folder, "/tmp/rbf-memory-XXXXXX")));
}

static void exhausted(void **state)
{
	(void)state;
	static const char *const name[] = {"isotropic", "aniso", "quad", "both", "one", "sir", "images", "planes", "lost"};
	assert_non_null(mkdtemp(folder));
	for (size_t n = 0; n < sizeof name / sizeof *name; n++)
		fail_each(name[n]);
	rmdir(folder);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(exhausted)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
