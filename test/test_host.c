/* SPDX-License-Identifier: BSD-3-Clause */
/* The library as a guest: it prints nothing, and leaves the host's locale, signal handlers, floating-point environment,
 * working folder, file mask, thread settings and descriptors alone; nor do they change what it writes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "bsdfrbf.h"

#include <dirent.h>
#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <omp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[64];

/* A locale with a decimal comma, made for this test. */
static int comma_locale(void)
{
	char command[200];
	snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >/dev/null 2>&1", folder);
	if (system(command) != 0)
		return 0;
	setenv("LOCPATH", folder, 1);
	return setlocale(LC_ALL, "de_DE.UTF-8") && !strcmp(localeconv()->decimal_point, ",");
}

static const char *in_folder(const char *name)
{
	static char path[4][128];
	static int next;
	next = (next + 1) % 4;
	snprintf(path[next], sizeof path[0], "%s/%s", folder, name);
	return path[next];
}

static int write_measurement(double theta)
{
	FILE *f = fopen(in_folder("in.txt"), "w");
	fprintf(f, "#sample_name \"%s\"\n#format: theta phi BSDF\n#incident_angle %d.%d 0\n", "M\xc3\xbcller \xfc <&> --", (int)theta,
		(int)(10 * theta) % 10);
	for (int t = 0; t < 88; t += 8)
		for (int p = 0; p < 360; p += t ? 30 : 360)
			fprintf(f, "%d %d.5 0.%03d\n", t, p, 100 + (p * 7 + t) % 200);
	return fclose(f) == 0;
}

/* Everything that the library does, and much that it refuses; results go to files named after `tag`. */
static void use_all(const char *tag)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_model *model = NULL, *back = NULL;
	for (int i = 0; i < 3; i++) {
		assert_true(write_measurement(30.5 * i));
		assert_int_equal(bsdfrbf_data_read(context, data, in_folder("in.txt")), BSDFRBF_OK);
	}
	assert_int_equal(bsdfrbf_data_read(context, data, folder), BSDFRBF_ERR_IO);
	bsdfrbf_build_options build;
	bsdfrbf_build_defaults(&build);
	build.threads = 2;
	build.lobes = 16;
	assert_int_equal(bsdfrbf_build(context, data, &build, &model), BSDFRBF_OK);
	char name[40];
	snprintf(name, sizeof name, "%s.rbf", tag);
	assert_int_equal(bsdfrbf_save(context, model, in_folder(name)), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_save(context, model, "/none/such"), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_open(context, "/none/such", &back), BSDFRBF_ERR_IO);
	assert_int_equal(bsdfrbf_open(context, in_folder("in.txt"), &back), BSDFRBF_ERR_FORMAT);
	assert_int_equal(bsdfrbf_open(context, in_folder(name), &back), BSDFRBF_OK);
	const float in[3] = {.3f, .4f, .8f}, out[3] = {0, -.5f, .9f};
	float value[3], drawn[3], low, high;
	bsdfrbf_eval(back, in, out, value);
	bsdfrbf_dhr(back, in, 0, value);
	bsdfrbf_sample(back, in, 0, .3, drawn);
	bsdfrbf_pdf(back, in, out);
	bsdfrbf_resolution(back, in, out, 0, &low, &high);
	bsdfrbf_resample_options xml;
	bsdfrbf_resample_defaults(&xml);
	xml.threads = 2;
	xml.log2 = 3;
	xml.thickness = .0125;
	snprintf(name, sizeof name, "%s.tree", tag);
	xml.path = in_folder(name);
	assert_int_equal(bsdfrbf_write_tree(context, back, &xml), BSDFRBF_OK);
	snprintf(name, sizeof name, "%s.klems", tag);
	xml.path = in_folder(name);
	xml.basis = BSDFRBF_KLEMS_QUARTER;
	assert_int_equal(bsdfrbf_write_klems(context, back, &xml), BSDFRBF_OK);
	bsdfrbf_close(back);
	bsdfrbf_close(model);
	/* measurements that cannot be used */
	const double direction[3] = {0, 0, 1}, low_value[1] = {-1};
	bsdfrbf_data_free(data);
	data = bsdfrbf_data_new(context);
	assert_int_equal(bsdfrbf_data_add(context, data, direction, 1, direction, low_value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_build(context, data, NULL, &model), BSDFRBF_ERR_DATA);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

static char *content(const char *name)
{
	struct stat info;
	FILE *f = fopen(in_folder(name), "rb");
	assert_non_null(f);
	assert_int_equal(fstat(fileno(f), &info), 0);
	char *text = calloc(1, (size_t)info.st_size + 1);
	assert_int_equal(fread(text, 1, (size_t)info.st_size, f), info.st_size);
	fclose(f);
	return text;
}

/* What follows the comment, whose figures are for people. */
static void assert_same_xml(const char *a, const char *b)
{
	char *x = content(a), *y = content(b);
	assert_string_equal(strstr(x, "-->"), strstr(y, "-->"));
	assert_non_null(strstr(x, "<Name>M\xc3\xbcller ? &lt;&amp;&gt; --</Name>"));
	assert_non_null(strstr(x, ">0.0125<"));
	free(x);
	free(y);
}

static void decimal_comma(void **state)
{
	(void)state;
	struct stat a, b;
	use_all("plain");
	if (!comma_locale()) {
		print_message("no localedef, or no source of de_DE: Debian has it in the package locales\n");
		skip();
	}
	use_all("comma");
	setlocale(LC_ALL, "C");
	assert_int_equal(stat(in_folder("plain.rbf"), &a), 0);
	assert_int_equal(stat(in_folder("comma.rbf"), &b), 0);
	assert_int_equal(a.st_size, b.st_size);
	char *x = content("plain.rbf"), *y = content("comma.rbf");
	assert_memory_equal(x, y, (size_t)a.st_size);
	free(x);
	free(y);
	assert_same_xml("plain.tree", "comma.tree");
	assert_same_xml("plain.klems", "comma.klems");
}

static int descriptors(void)
{
	DIR *d = opendir("/proc/self/fd");
	int count = 0;
	while (readdir(d))
		count++;
	closedir(d);
	return count;
}

static int same_handlers(const struct sigaction *before)
{
	for (int n = 1; n < NSIG; n++) {
		struct sigaction now;
		if (!sigaction(n, NULL, &now) && (now.sa_handler != before[n].sa_handler || now.sa_flags != before[n].sa_flags))
			return 0;
	}
	return 1;
}

static unsigned control_word(void)
{
#if defined(__x86_64__)
	return __builtin_ia32_stmxcsr() & ~0x3fu; /* modes and masks, not the flags of what happened */
#else
	return (unsigned)fegetround();
#endif
}

static void leaves_the_host_alone(void **state)
{
	(void)state;
	struct sigaction before[NSIG];
	char here[4096], there[4096];
	memset(before, 0, sizeof before);
	for (int n = 1; n < NSIG; n++)
		sigaction(n, NULL, &before[n]);
	use_all("first"); /* OpenMP's runtime opens what it needs */
	const char *locale = setlocale(LC_ALL, NULL);
	char locale_before[200];
	snprintf(locale_before, sizeof locale_before, "%s", locale);
	const int files = descriptors(), threads = omp_get_max_threads();
	const mode_t mask = umask(027);
	const unsigned control = control_word();
	assert_non_null(getcwd(here, sizeof here));

	fflush(NULL);
	const int out = dup(1), err = dup(2), said = open(in_folder("said"), O_RDWR | O_CREAT | O_TRUNC, 0600);
	dup2(said, 1);
	dup2(said, 2);
	use_all("second");
	fflush(NULL);
	dup2(out, 1);
	dup2(err, 2);
	const off_t printed = lseek(said, 0, SEEK_END);
	close(out);
	close(err);
	close(said);

	assert_int_equal(printed, 0);
	assert_true(same_handlers(before));
	assert_string_equal(setlocale(LC_ALL, NULL), locale_before);
	assert_int_equal(descriptors(), files);
	assert_int_equal(omp_get_max_threads(), threads);
	assert_int_equal(umask(mask), 027);
	assert_int_equal(control_word(), control);
	assert_non_null(getcwd(there, sizeof there));
	assert_string_equal(here, there);
}

static int setup(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/rbf-host-XXXXXX");
	return !mkdtemp(folder);
}

static int teardown(void **state)
{
	(void)state;
	char command[100];
	snprintf(command, sizeof command, "rm -rf %s", folder);
	return system(command);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(decimal_comma), cmocka_unit_test(leaves_the_host_alone)};
	return cmocka_run_group_tests(tests, setup, teardown);
}
