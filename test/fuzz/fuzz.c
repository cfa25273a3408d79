/* SPDX-License-Identifier: BSD-3-Clause */
#include "fuzz.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

void fuzz_finding(const char *text)
{
	fprintf(stderr, "finding: %s\n", text);
	abort();
}

const char *fuzz_file(const void *data, size_t size)
{
	static char path[64];
	static int file = -1;
	if (file < 0) {
		file = memfd_create("fuzz", MFD_CLOEXEC);
		snprintf(path, sizeof path, "/proc/self/fd/%d", file);
	}
	if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != (ssize_t)size)
		fuzz_finding("no file in memory");
	return path;
}

static void values(const float *value, int channels, int checked)
{
	for (int c = 0; c < channels && checked; c++)
		if (!(value[c] >= 0 && isfinite(value[c])))
			fuzz_finding("a value that is negative or not finite");
}

/* A vertical, a slanted and a grazing direction to both sides, vectors of other lengths, and what is no direction. */
static const float direction[][3] = {{0, 0, 1}, {.5f, .2f, .8f}, {-.7f, .7f, .02f}, {.1f, -.4f, -.9f}, {0, 0, -1}, {.6f, 0, -.01f},
	{0, 0, 0}, {1, 0, 0}, {3e18f, -2e18f, 4e18f}, {1e-30f, 1e-30f, 2e-30f}};
enum { DIRECTIONS = sizeof direction / sizeof *direction };

void fuzz_look(const bsdfrbf_model *model, int checked)
{
	const int channels = bsdfrbf_channels(model);
	float value[3], list[3 * DIRECTIONS], smallest, largest, out[3];
	for (int i = 0; i < DIRECTIONS; i++) {
		const float *in = direction[i];
		bsdfrbf_eval_exitant(model, in, DIRECTIONS, direction[0], list);
		for (int o = 0; o < DIRECTIONS; o++)
			values(list + o * channels, channels, checked);
	}
	float incident[3 * DIRECTIONS][3], outgoing[3 * DIRECTIONS][3], many[3 * 3 * DIRECTIONS];
	for (int n = 0; n < 3 * DIRECTIONS; n++)
		for (int k = 0; k < 3; k++) {
			incident[n][k] = direction[n % DIRECTIONS][k];
			outgoing[n][k] = direction[(n * 7 + n / DIRECTIONS) % DIRECTIONS][k];
		}
	bsdfrbf_eval_many(model, 3 * DIRECTIONS, incident[0], outgoing[0], many);
	values(many, 3 * DIRECTIONS * channels, checked);
	for (int i = 1; i < DIRECTIONS; i += 2) {
		const float *in = direction[i], *o = direction[(i + 3) % DIRECTIONS];
		const bsdfrbf_component through = in[2] < 0 ? BSDFRBF_TB : BSDFRBF_TF;
		bsdfrbf_eval(model, in, o, value);
		values(value, channels, checked);
		bsdfrbf_resolution(model, in, o, 0, &smallest, &largest);
		if (checked && !(smallest > 0 && largest >= smallest && isfinite(largest)))
			fuzz_finding("a resolution that is none");
		const float pdf = bsdfrbf_pdf(model, in, o);
		values(&pdf, 1, checked);
		for (int transmit = 0; transmit < 2; transmit++) {
			if (transmit && i > 1 && !bsdfrbf_has(model, through))
				continue; /* answered by reciprocity, which takes milliseconds an incidence */
			bsdfrbf_dhr(model, in, transmit, value);
			values(value, channels, checked);
			for (int k = 0; k < 3; k++)
				if (bsdfrbf_sample(model, in, transmit, .3 * k + .1, out) && checked
						&& !(fabsf(out[0]*out[0] + out[1]*out[1] + out[2]*out[2] - 1) < 1e-4f))
					fuzz_finding("a sample that is no unit vector");
		}
	}
	for (int c = 0; c < 4; c++) {
		bsdfrbf_component_info info;
		bsdfrbf_incidence_info incidence;
		if (bsdfrbf_get_component_info(model, (bsdfrbf_component)c, &info) != BSDFRBF_OK)
			continue;
		for (int i = 0; i < info.incidences && i < 100; i++)
			bsdfrbf_get_incidence_info(model, (bsdfrbf_component)c, i, &incidence);
	}
	bsdfrbf_get_text(model, "name");
	bsdfrbf_get_section(model, 0, NULL, NULL, NULL);
}
