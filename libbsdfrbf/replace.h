/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes a file so that at every moment the old one is there, or the new one as a whole. */
#ifndef RBF_REPLACE_H
#define RBF_REPLACE_H
#include "status.h"

typedef struct rbf_replace {
	bsdfrbf_context *context;
	const char *path;        /* as the caller named it, for messages */
	char *target;            /* the file itself: symbolic links resolved */
	const char *name;        /* its name within the folder */
	int folder, file;        /* descriptors */
	char temporary[32];      /* name in the folder; "" while the file has none (O_TMPFILE) */
} rbf_replace;

/* Starts writing. The new data has no name until rbf_replace_commit() where the file system can do that (O_TMPFILE), so
 * that not even kill -9 leaves anything behind; elsewhere, or if `named`, it is a file ".rbf-<random>" beside the target.
 * On failure nothing is left and nothing is to be released. `path` must stay valid until the end. Errors: ARGUMENT, IO, MEMORY. */
bsdfrbf_status rbf_replace_begin(bsdfrbf_context *context, const char *path, int named, rbf_replace *replace);

/* Appends. Asks the progress callback now and then, so that a signal handler's flag can stop a long write.
 * On failure all is cleaned up. Errors: IO, CANCELLED. */
bsdfrbf_status rbf_replace_write(rbf_replace *replace, const void *data, size_t bytes);

/* fsync, rename, fsync of the folder. Releases everything, also on failure. Errors: IO. */
bsdfrbf_status rbf_replace_commit(rbf_replace *replace);

/* Gives up: the old file stays, no temporary file is left. */
void rbf_replace_abort(rbf_replace *replace);
#endif
