/* SPDX-License-Identifier: BSD-3-Clause */
/* Writing files: whatever happens, the old file is intact or the new one is whole, and nothing else is left. */
#include "synthetic.h"
#include "record.h"
#include "replace.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[64];

static int new_folder(void **state)
{
	(void)state;
	strcpy(folder, "/tmp/rbf-replace-XXXXXX");
	return !mkdtemp(folder) || chdir(folder) != 0;
}

static int entries(const char *path)
{
	DIR *d = opendir(path);
	int count = 0;
	for (struct dirent *e; d && (e = readdir(d));)
		count += strcmp(e->d_name, ".") && strcmp(e->d_name, "..");
	if (d)
		closedir(d);
	return count;
}

static int remove_folder(void **state)
{
	(void)state;
	DIR *d = opendir(folder);
	for (struct dirent *e; d && (e = readdir(d));)
		if (unlinkat(dirfd(d), e->d_name, 0) != 0)
			unlinkat(dirfd(d), e->d_name, AT_REMOVEDIR);
	if (d)
		closedir(d);
	return chdir("/") != 0 || rmdir(folder) != 0;
}

static void put(const char *path, const char *text)
{
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fputs(text, f);
	fclose(f);
}

static void assert_content(const char *path, const char *text)
{
	char found[64] = "";
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	const size_t n = fread(found, 1, sizeof found - 1, f);
	found[n] = 0;
	fclose(f);
	assert_string_equal(found, text);
}

static bsdfrbf_status put_safely(bsdfrbf_context *context, const char *path, const char *text, int named)
{
	rbf_replace r;
	RBF_TRY(rbf_replace_begin(context, path, named, &r));
	RBF_TRY(rbf_replace_write(&r, text, strlen(text)));
	return rbf_replace_commit(&r);
}

static void test_new_and_old(void **state)
{
	(void)state;
	const mode_t mask = umask(027);
	for (int named = 0; named < 2; named++) {
		struct stat info;
		char whole[128];
		assert_int_equal(put_safely(NULL, "plain", "one", named), BSDFRBF_OK);
		assert_content("plain", "one");
		assert_int_equal(stat("plain", &info), 0);
		assert_int_equal(info.st_mode & 07777, 0640);
		assert_int_equal(put_safely(NULL, "./plain", "two", named), BSDFRBF_OK);
		assert_content("plain", "two");
		snprintf(whole, sizeof whole, "%s/plain", folder);
		assert_int_equal(put_safely(NULL, whole, "three", named), BSDFRBF_OK);
		assert_content("plain", "three");
		assert_int_equal(entries("."), 1);
		unlink("plain");
	}
	umask(mask);
}

static void test_symbolic_link(void **state)
{
	(void)state;
	struct stat info;
	put("real", "old");
	assert_int_equal(symlink("real", "link"), 0);
	assert_int_equal(put_safely(NULL, "link", "new", 0), BSDFRBF_OK);
	assert_content("real", "new");
	assert_int_equal(lstat("link", &info), 0);
	assert_true(S_ISLNK(info.st_mode));
	unlink("real");
	assert_int_equal(put_safely(NULL, "link", "new", 0), BSDFRBF_ERR_IO);
	assert_int_equal(entries("."), 1);
	unlink("link");
}

static void refused(bsdfrbf_context *context, const char *path, const char *words)
{
	assert_int_equal(put_safely(context, path, "new", 0), BSDFRBF_ERR_IO);
	if (!strstr(bsdfrbf_message(context), words))
		fail_msg("\"%s\" lacks \"%s\"", bsdfrbf_message(context), words);
}

static void test_what_is_not_replaced(void **state)
{
	(void)state;
	bsdfrbf_context *context = bsdfrbf_context_new();
	char name[300];
	mkdir("sub", 0777);
	mkfifo("pipe", 0666);
	memset(name, 'x', sizeof name);
	name[sizeof name - 1] = 0;
	refused(context, "sub", "is a folder");
	refused(context, "sub/", "folder");
	refused(context, "pipe", "not a regular file");
	refused(context, "/dev/full", "not a regular file");
	refused(context, "/dev/null", "not a regular file");
	refused(context, "none/file", "No such file");
	refused(context, "/proc/file", "cannot");
	refused(context, name, "too long");
	assert_int_equal(put_safely(context, "", "new", 0), BSDFRBF_ERR_ARGUMENT);
	assert_int_equal(put_safely(context, NULL, "new", 0), BSDFRBF_ERR_ARGUMENT);
	unlink("pipe");
	rmdir("sub");
	assert_int_equal(entries("."), 0);
	bsdfrbf_context_free(context);
}

/* Runs `work` in a child; returns its exit code, or 128 + signal. */
static int in_child(int (*work)(void))
{
	fflush(NULL);
	const pid_t child = fork();
	if (child == 0)
		_exit(work());
	int status = 0;
	waitpid(child, &status, 0);
	return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static int as_nobody(void)
{
	if (geteuid() == 0 && setuid(65534) != 0)
		return 77;
	return put_safely(NULL, "locked/file", "new", 0) == BSDFRBF_ERR_IO
		&& put_safely(NULL, "locked/other", "new", 1) == BSDFRBF_ERR_IO
		&& put_safely(NULL, "open/file", "new", 0) == BSDFRBF_ERR_IO ? 0 : 1;
}

static void test_write_protected(void **state)
{
	(void)state;
	chmod(".", 0755);
	mkdir("locked", 0777);
	put("locked/file", "old");
	chmod("locked", 0555);
	mkdir("open", 0777);
	chmod("open", 0777);
	put("open/file", "old");
	chmod("open/file", 0444);
	assert_int_equal(in_child(as_nobody), 0);
	assert_content("locked/file", "old");
	assert_content("open/file", "old");
	assert_int_equal(entries("locked"), 1);
	assert_int_equal(entries("open"), 1);
	chmod("locked", 0755);
	unlink("locked/file");
	unlink("open/file");
	rmdir("locked");
	rmdir("open");
}

static char large[1 << 20];

static bsdfrbf_status put_large(const char *path, int named)
{
	rbf_replace r;
	RBF_TRY(rbf_replace_begin(NULL, path, named, &r));
	for (int i = 0; i < 64; i++)
		RBF_TRY(rbf_replace_write(&r, large, sizeof large));
	return rbf_replace_commit(&r);
}

static int beyond_limit(void)
{
	const struct rlimit limit = {4 << 20, 4 << 20};
	signal(SIGXFSZ, SIG_IGN);
	if (setrlimit(RLIMIT_FSIZE, &limit) != 0)
		return 77;
	return put_large("file", 0) == BSDFRBF_ERR_IO && put_large("file", 1) == BSDFRBF_ERR_IO ? 0 : 1;
}

static void test_size_limit(void **state)
{
	(void)state;
	put("file", "old");
	assert_int_equal(in_child(beyond_limit), 0);
	assert_content("file", "old");
	assert_int_equal(entries("."), 1);
	unlink("file");
}

static int on_full_disk(void)
{
	/* The mount is seen by this child alone, and ends with it. */
	if (unshare(CLONE_NEWNS) != 0 || mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) != 0
		|| mount("tmpfs", "disk", "tmpfs", 0, "size=2m") != 0 || chdir("disk") != 0)
		return 77;
	put("file", "old");
	for (int named = 0; named < 2; named++) {
		if (put_large("file", named) != BSDFRBF_ERR_IO || entries(".") != 1)
			return 1;
		assert_content("file", "old");
	}
	return 0;
}

static void test_full_disk(void **state)
{
	(void)state;
	mkdir("disk", 0777);
	const int result = in_child(on_full_disk);
	rmdir("disk");
	if (result == 77)
		skip(); /* may not mount */
	assert_int_equal(result, 0);
}

static int stop(void *user, const char *stage, double done)
{
	(void)stage;
	(void)done;
	return --*(int *)user < 0;
}

static void test_cancel(void **state)
{
	(void)state;
	for (int named = 0; named < 2; named++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		int left = 3 * 16 + 5; /* it is asked every 64 kB */
		rbf_replace r;
		put("file", "old");
		bsdfrbf_set_progress(context, stop, &left);
		assert_int_equal(rbf_replace_begin(context, "file", named, &r), BSDFRBF_OK);
		for (int i = 0; i < 3; i++)
			assert_int_equal(rbf_replace_write(&r, large, sizeof large), BSDFRBF_OK);
		assert_int_equal(rbf_replace_write(&r, large, sizeof large), BSDFRBF_ERR_CANCELLED);
		assert_content("file", "old");
		assert_int_equal(entries("."), 1);
		unlink("file");
		bsdfrbf_context_free(context);
	}
}

static double now(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Kills a process that saves over and over again, at arbitrary moments, by either signal. */
static void test_killed(void **state)
{
	(void)state;
	const synthetic want = {3, RBF_UP, 20, 30, 40, 10, 5000, 2, 1, 100, 16, 1};
	bsdfrbf_model *model = rbf_model_new();
	bsdfrbf_context *context = bsdfrbf_context_new();
	uint64_t seed = 1;
	int left = 0;
	model->channels = 3;
	synthetic_component(&want, 5, model->component + BSDFRBF_TF);
	double save = now();
	assert_int_equal(bsdfrbf_save(context, model, "file"), BSDFRBF_OK);
	save = fmin(now() - save, .1);
	for (int i = 0; i < 40; i++) {
		const struct timespec pause = {0, (long)(3e9 * save * synthetic_unit(&seed))};
		bsdfrbf_model *read = NULL;
		int status;
		fflush(NULL);
		const pid_t child = fork();
		while (child == 0)
			if (bsdfrbf_save(NULL, model, "file") != BSDFRBF_OK)
				_exit(1);
		nanosleep(&pause, NULL);
		kill(child, i % 2 ? SIGKILL : SIGINT);
		waitpid(child, &status, 0);
		assert_true(WIFSIGNALED(status));
		assert_int_equal(bsdfrbf_open(context, "file", &read), BSDFRBF_OK);
		bsdfrbf_close(read);
		left = entries(".") - 1;
	}
	/* Only between link and rename, some microseconds, has an unnamed file a temporary name. */
	if (left)
		print_message("%d temporary files after 40 kills\n", left);
	assert_true(left <= 2);
	bsdfrbf_context_free(context);
	bsdfrbf_close(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(test_new_and_old, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_symbolic_link, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_what_is_not_replaced, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_write_protected, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_size_limit, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_full_disk, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_cancel, new_folder, remove_folder),
		cmocka_unit_test_setup_teardown(test_killed, new_folder, remove_folder),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
