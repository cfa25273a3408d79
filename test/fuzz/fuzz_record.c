/* SPDX-License-Identifier: BSD-3-Clause */
/* The .rbf reader and the evaluator behind it. The bytes are tried as they are, and with right checksums. */
#include "fuzz.h"
#include "../image.h"

#include <stdlib.h>

static void open_and_look(const char *path, uint64_t verify_bytes)
{
	bsdfrbf_model *model;
	if (rbf_record_open(NULL, path, verify_bytes, &model) != BSDFRBF_OK)
		return;
	fuzz_look(model, 0); /* numbers that a file makes up may give anything: only the process must survive */
	bsdfrbf_close(model);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	if (size < RBF_RECORD_MAGIC_BYTES)
		return 0;
	open_and_look(fuzz_file(data, size), UINT64_MAX);
	const image file = {malloc(size), size};
	if (!file.at)
		return 0;
	memcpy(file.at, data, size);
	memcpy(file.at, RBF_RECORD_MAGIC, RBF_RECORD_MAGIC_BYTES);
	if (size >= sizeof(rbf_record_header))
		image_header(&file)->bytes = size;
	image_seal(&file);
	const char *path = fuzz_file(file.at, size);
	open_and_look(path, UINT64_MAX);
	open_and_look(path, 0); /* as a file too large to be checked when it is opened */
	free(file.at);
	return 0;
}
