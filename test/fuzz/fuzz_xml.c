/* SPDX-License-Identifier: BSD-3-Clause */
/* XML that carries a record. What points to another file is looked at, but not followed. */
#include "fuzz.h"
#include "carrier.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	char *text = malloc(size ? size : 1); /* as long as it is, so that a byte too far is seen */
	rbf_carrier carrier;
	if (!text)
		return 0;
	memcpy(text, data, size);
	if (rbf_carrier_is_xml(text, size) && rbf_carrier_find(text, size, &carrier) && !*carrier.file) {
		bsdfrbf_model *model;
		if (carrier.mark < text || carrier.mark >= text + size)
			fuzz_finding("a mark outside the text");
		if (carrier.bytes <= size) {
			unsigned char *record = malloc(carrier.bytes ? (size_t)carrier.bytes : 1);
			if (record)
				rbf_carrier_decode(text, &carrier, record);
			free(record);
		}
		if (bsdfrbf_open(NULL, fuzz_file(data, size), &model) == BSDFRBF_OK) {
			fuzz_look(model, 0);
			bsdfrbf_close(model);
		}
	}
	free(text);
	return 0;
}
