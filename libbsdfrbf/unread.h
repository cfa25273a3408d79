/* SPDX-License-Identifier: BSD-3-Clause */
/* Zeros that an instrument writes where it has not read. */
#ifndef RBF_UNREAD_H
#define RBF_UNREAD_H
#include "measure.h"

typedef struct rbf_unread {
	size_t samples;    /* so many were not read, */
	size_t incidences; /* at so many incidences, */
	size_t first;      /* the first of which is this one */
} rbf_unread;

/* Sets `read` to a component's incidences without what was not read: borrowed where nothing was left out. To be released in any case, as long as
 * `all` is there. Returns 0, or -1 when out of memory. Opens an OpenMP region. */
int rbf_unread_leave_out(const rbf_measured *all, int channels, rbf_measured *read, rbf_unread *found);
void rbf_unread_release(const rbf_measured *all, rbf_measured *read);
#endif
