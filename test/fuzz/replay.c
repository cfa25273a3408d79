/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Runs a fuzz target over stored inputs, without libFuzzer: replay TARGET's files and folders.
 * Before them an option: -damage N tries each file cut and with one byte changed as well, at every Nth byte; 0: not.
 */
#include "fuzz.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static unsigned long executions;
static size_t step;

static void run(const uint8_t *data, size_t size)
{
	executions++;
	LLVMFuzzerTestOneInput(data, size);
}

static void damage(uint8_t *data, size_t size)
{
	static const uint8_t change[] = {0x01, 0x80, 0xff, 0x20};
	for (size_t bytes = 0; bytes < size; bytes += step)
		run(data, bytes);
	for (size_t i = 0; i < size; i += step) {
		const uint8_t by = change[i / step % sizeof change];
		data[i] ^= by;
		run(data, size);
		data[i] ^= by;
	}
}

static void replay(const char *path)
{
	struct stat info;
	if (stat(path, &info) != 0)
		fuzz_finding(path);
	if (S_ISDIR(info.st_mode)) {
		struct dirent **entry;
		const int entries = scandir(path, &entry, NULL, alphasort);
		for (int i = 0; i < entries; i++) {
			char name[4096];
			snprintf(name, sizeof name, "%s/%s", path, entry[i]->d_name);
			if (entry[i]->d_name[0] != '.')
				replay(name);
			free(entry[i]);
		}
		if (entries >= 0)
			free(entry);
		return;
	}
	FILE *f = fopen(path, "rb");
	uint8_t *data = malloc((size_t)info.st_size + 1);
	if (!f || !data || fread(data, 1, (size_t)info.st_size, f) != (size_t)info.st_size)
		fuzz_finding(path);
	fclose(f);
	run(data, (size_t)info.st_size);
	if (step)
		damage(data, (size_t)info.st_size);
	free(data);
}

int main(int argc, char **argv)
{
	int at = 1;
	if (at + 1 < argc && !strcmp(argv[at], "-damage")) {
		step = strtoul(argv[at + 1], NULL, 10);
		at += 2;
	}
	for (; at < argc; at++)
		replay(argv[at]);
	printf("%lu executions\n", executions);
	return executions == 0;
}
