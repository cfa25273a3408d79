/* SPDX-License-Identifier: BSD-3-Clause */
/* What the fuzz targets share: bytes as a file that has a path, and a look at a model from all sides. */
#ifndef FUZZ_H
#define FUZZ_H
#include "bsdfrbf.h"

/* The entry of libFuzzer, and of replay.c. Answers 0. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Puts the bytes into a file in memory, always the same one; returns its path. */
const char *fuzz_file(const void *data, size_t size);

/* Asks all that a renderer and rbfinfo ask. If the file was checked in full, values must be finite and not negative,
 * and samples unit vectors; else only the process must survive. */
void fuzz_look(const bsdfrbf_model *model, int checked);

/* Ends the process with a message: a finding. */
_Noreturn void fuzz_finding(const char *text);
#endif
