/* SPDX-License-Identifier: BSD-3-Clause */
/* Readers of measurement files, one a format; bsdfrbf_data_read() chooses by content. */
#ifndef RBF_READ_H
#define RBF_READ_H
#include "gather.h"
#include "text.h"

/* Each reads the whole text and joins it to `data`, all or nothing. path as given by the caller. */
bsdfrbf_status rbf_read_mountain(rbf_text *text, bsdfrbf_data *data, const char *path);
bsdfrbf_status rbf_read_zemax(rbf_text *text, bsdfrbf_data *data, const char *path);
/* .sir, a finished interpolant of one component. */
bsdfrbf_status rbf_read_sir(rbf_text *text, bsdfrbf_data *data, const char *path);
#endif
