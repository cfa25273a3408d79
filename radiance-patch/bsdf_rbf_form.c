/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * libbsdfrbf: the form in which Radiance is to see a recorded interpolant. With BSDFRBF_FORM=ttree or ttree:g in the environment
 * it gets a tensor tree (of 2^g cells a side) in place of the interpolant: made when it is first asked for, and kept as XML in
 * the user's cache folder ($XDG_CACHE_HOME/bsdfrbf, else ~/.cache/bsdfrbf; XDG Base Directory Specification) under the checksum
 * of the record's content. Where there is no such folder the tree is made in memory, for this process alone.
 *
 * Making it takes all processors, by OpenMP, which does not survive a fork; renderers fork. So a child process makes it.
 * Several processes may ask at once: the first one makes the tree, the others wait for it. The file appears as a whole.
 */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE		/* memfd_create */
#endif
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <errno.h>
#include <time.h>
#include <fcntl.h>
#include <unistd.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include "bsdf.h"
#include "bsdf_rbf_part.h"

#define RBF_PATH	4096
#define RBF_WAIT	15000	/* turns of 20 ms: five minutes */

/* What the environment asks for: 0 direct, -1 not understood, else 1 and *log2 (0: the library's choice). */
int
rbf_form(int *log2)
{
	const char	*form = getenv("BSDFRBF_FORM");
	char		*end;

	*log2 = 0;
	if (form == NULL || !*form || !strcmp(form, "direct"))
		return 0;
	if (strncmp(form, "ttree", 5))
		return -1;
	if (!form[5])
		return 1;
	*log2 = strtol(form + 6, &end, 10);
	return form[5] == ':' && end > form + 6 && !*end && *log2 >= 2 && *log2 <= 8 ? 1 : -1;
}

/* The cache folder, made if need be. 0: there is none. */
static int
rbf_cache_folder(char folder[RBF_PATH])
{
	const char	*base = getenv("XDG_CACHE_HOME");
	const char	*below = "";
	size_t		i;

	if (base == NULL || *base != '/') {
		base = getenv("HOME");
		below = "/.cache";
	}
	if (base == NULL || *base != '/' || strlen(base) + 64 > RBF_PATH)
		return 0;
	sprintf(folder, "%s%s/bsdfrbf", base, below);
	for (i = 1; folder[i]; i++)
		if (folder[i] == '/') {
			folder[i] = '\0';
			mkdir(folder, 0700);
			folder[i] = '/';
		}
	mkdir(folder, 0700);
	return access(folder, W_OK|X_OK) == 0;
}

static int
rbf_to_descriptor(void *user, const void *data, size_t bytes)
{
	const char	*at = (const char *)data;
	ssize_t		done;

	while (bytes > 0) {
		done = write(*(int *)user, at, bytes);
		if (done < 0 && errno != EINTR)
			return -1;
		if (done > 0) {
			at += done;
			bytes -= done;
		}
	}
	return 0;
}

/* Makes the tree in a child process. *message: room for RBF_PATH characters. */
static int
rbf_make_tree(const bsdfrbf_model *model, const bsdfrbf_resample_options *options, char *message)
{
	bsdfrbf_context	*context;
	bsdfrbf_status	status;
	size_t		used = 0;
	ssize_t		got;
	int		ends[2], result;
	pid_t		child;

	strcpy(message, "no process could be started to make a tensor tree");
	if (pipe(ends) < 0)
		return 0;
	fflush(NULL);
	if ((child = fork()) < 0) {
		close(ends[0]); close(ends[1]);
		return 0;
	}
	if (!child) {
		close(ends[0]);
		context = bsdfrbf_context_new();
		status = context == NULL ? BSDFRBF_ERR_MEMORY : bsdfrbf_write_tree(context, model, options);
		if (status != BSDFRBF_OK)
			rbf_to_descriptor(&ends[1], bsdfrbf_message(context), strlen(bsdfrbf_message(context)));
		_exit(status != BSDFRBF_OK);
	}
	close(ends[1]);
	while (used < RBF_PATH-1 && ((got = read(ends[0], message + used, RBF_PATH-1 - used)) > 0 ||
				(got < 0 && errno == EINTR)))
		used += got > 0 ? got : 0;
	close(ends[0]);
	while (waitpid(child, &result, 0) < 0)
		if (errno != EINTR) {
			result = used > 0;	/* somebody else waited for it: judge by the message */
			break;
		}
	if (result && !used)
		strcpy(message, "the process that made a tensor tree was ended");
	else
		message[used] = '\0';
	return result == 0;
}

/* Waits until the folder is ours or the tree is there. Not for ever: a holder may be stopped, a file server may not answer. Without
 * the lock work is done twice, no more. */
static void
rbf_wait_turn(int folder, const char *path)
{
	const struct timespec	pause = {0, 20000000};	/* 20 ms */
	int			n;

	for (n = 0; n < RBF_WAIT && folder >= 0 && access(path, R_OK) < 0; n++) {
		if (!flock(folder, LOCK_EX|LOCK_NB) || (errno != EWOULDBLOCK && errno != EINTR))
			break;
		nanosleep(&pause, NULL);
	}
}

/* Path of the tree's XML, valid until the next call; NULL on failure, with the reason in SDerrorDetail. */
const char *
rbf_tree_file(const bsdfrbf_model *model, int log2, size_t room)
{
	static char			path[RBF_PATH+128];
	static int			memory = -1;
	char				folder[RBF_PATH], message[RBF_PATH];
	bsdfrbf_resample_options	options;
	int				lock, made;

	bsdfrbf_resample_defaults(&options);
	options.log2 = log2;
	if (rbf_cache_folder(folder)) {
		sprintf(path, "%s/%016llx-ttree%d-%s.xml", folder, (unsigned long long)bsdfrbf_checksum(model),
				log2, bsdfrbf_version());
		if (access(path, R_OK) == 0)
			return path;
		lock = open(folder, O_RDONLY|O_DIRECTORY|O_CLOEXEC);
		rbf_wait_turn(lock, path);
		options.path = path;
		made = access(path, R_OK) == 0 || rbf_make_tree(model, &options, message);
		if (lock >= 0)
			close(lock);
		if (made)
			return path;
	}
	if (memory >= 0)
		close(memory);
	memory = memfd_create("bsdfrbf", MFD_CLOEXEC);
	options.path = NULL;
	options.write = rbf_to_descriptor;
	options.user = &memory;
	if (memory >= 0 && rbf_make_tree(model, &options, message)) {
		sprintf(path, "/proc/self/fd/%d", memory);
		return path;
	}
	if (memory < 0)
		strcpy(message, "no memory for a tensor tree");
	SDerrorDetail[0] = '\0';
	strncat(SDerrorDetail, message, room - 1);
	return NULL;
}
