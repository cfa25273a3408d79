/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Preloaded into a command, makes one of its calls go wrong: the calls by which files are opened for writing, written, synced and
 * named. Environment: FAULT_AT the call, counted from 1 (0: none); FAULT_DO what happens there:
 *   full, broken  it fails with ENOSPC, EIO
 *   short         write() takes half; other calls succeed
 *   again         write() is interrupted once, EINTR; other calls succeed
 *   9, 2, ...     that signal is raised, before the call
 * FAULT_COUNT: a file that gets the number of calls. FAULT_NAMED: no file without a name can be made, as on old file systems.
 * FAULT_STREAMS: aborts where a file gets the number of a standard stream.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static long calls;

static void *next(const char *name)
{
	return dlsym(RTLD_NEXT, name);
}

__attribute__((destructor)) static void count(void)
{
	const char *path = getenv("FAULT_COUNT");
	FILE *f = path ? fopen(path, "w") : NULL;
	if (f) {
		fprintf(f, "%ld\n", calls);
		fclose(f);
	}
}

/* Counts a call. Returns 0, an error number, or -1 (short) or -2 (again), which concern write() alone. */
static int fault(void)
{
	const char *at = getenv("FAULT_AT"), *what = getenv("FAULT_DO");
	if (!at || !what || ++calls != atol(at))
		return 0;
	if (*what >= '0' && *what <= '9')
		raise(atoi(what));
	return !strcmp(what, "full") ? ENOSPC : !strcmp(what, "broken") ? EIO : !strcmp(what, "short") ? -1 : !strcmp(what, "again") ? -2 : 0;
}

static int fails(void)
{
	const int error = fault();
	if (error > 0)
		errno = error;
	return error > 0;
}

/* Reading is left alone. */
static int refused(int flags)
{
	if ((flags & O_TMPFILE) == O_TMPFILE && getenv("FAULT_NAMED")) {
		errno = EOPNOTSUPP;
		return 1;
	}
	return ((flags & O_ACCMODE) != O_RDONLY || flags & O_DIRECTORY) && fails();
}

#define WITH_MODE(flags, mode) \
	mode_t mode = 0; \
	if (flags & (O_CREAT | __O_TMPFILE)) { \
		va_list arguments; \
		va_start(arguments, flags); \
		mode = va_arg(arguments, mode_t); \
		va_end(arguments); \
	}

static int opened(const char *path, int file)
{
	if (file >= 0 && file < 3 && strcmp(path, "/dev/null") && getenv("FAULT_STREAMS"))
		abort();
	return file;
}

int open(const char *path, int flags, ...)
{
	WITH_MODE(flags, mode)
	int (*real)(const char *, int, mode_t) = next("open");
	return refused(flags) ? -1 : opened(path, real(path, flags, mode));
}

int openat(int folder, const char *path, int flags, ...)
{
	WITH_MODE(flags, mode)
	int (*real)(int, const char *, int, mode_t) = next("openat");
	return refused(flags) ? -1 : opened(path, real(folder, path, flags, mode));
}

ssize_t write(int file, const void *data, size_t bytes)
{
	ssize_t (*real)(int, const void *, size_t) = next("write");
	const int what = fault();
	if (what > 0 || what == -2) {
		errno = what > 0 ? what : EINTR;
		return -1;
	}
	return real(file, data, what == -1 && bytes > 1 ? bytes / 2 : bytes);
}

int fsync(int file)
{
	int (*real)(int) = next("fsync");
	return fails() ? -1 : real(file);
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags)
{
	int (*real)(int, const char *, int, const char *, int) = next("linkat");
	return fails() ? -1 : real(from_folder, from, to_folder, to, flags);
}

int renameat(int from_folder, const char *from, int to_folder, const char *to)
{
	int (*real)(int, const char *, int, const char *) = next("renameat");
	return fails() ? -1 : real(from_folder, from, to_folder, to);
}
