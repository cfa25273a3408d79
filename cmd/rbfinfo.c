/* SPDX-License-Identifier: BSD-3-Clause */
/* rbfinfo: what a recorded interpolant holds, as "key: value" lines and tables. */
#include "common.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREES (180 / 3.14159265358979323846)

static const char *const component_name[4] = {"rf (front reflection)", "rb (back reflection)", "tf (front transmission)",
	"tb (back transmission)"};

static void print_error(const char *key, double value)
{
	if (value >= 0)
		printf("    %s: %.4f\n", key, value);
	else
		printf("    %s: unknown\n", key);
}

static void print_cell(double value)
{
	if (value >= 0)
		printf(" %9.4f", value);
	else
		printf(" %9s", "-");
}

static double theta_of(const float d[3])
{
	return DEGREES * atan2(hypot(d[0], d[1]), d[2]);
}

static double phi_of(const float d[3])
{
	const double phi = DEGREES * atan2(d[1], d[0]);
	return fabs(phi < -5e-3 ? phi + 360 : phi + 0.);
}

static void print_incidences(const bsdfrbf_model *model, bsdfrbf_component component, int count)
{
	printf("    incident directions:\n       theta      phi    lobes       DHR     total   fit err   loo err  expected  recipr.\n");
	for (int i = 0; i < count; i++) {
		bsdfrbf_incidence_info info;
		if (bsdfrbf_get_incidence_info(model, component, i, &info) != BSDFRBF_OK)
			continue;
		printf("    %8.2f %8.2f %8d", theta_of(info.direction), phi_of(info.direction), info.lobes);
		print_cell(info.dhr);
		print_cell(info.total);
		print_cell(info.fit_error);
		print_cell(info.loo_error);
		print_cell(info.expected_error);
		print_cell(bsdfrbf_get_reciprocity(model, component, i));
		putchar('\n');
	}
}

/* Triangles within which a beam ends: where to measure more. */
static void print_cutoffs(const bsdfrbf_model *model, bsdfrbf_component component, const bsdfrbf_component_info *info)
{
	float *disagreement = malloc(((size_t)info->triangles + 1) * sizeof *disagreement);
	if (!disagreement)
		cmd_fail("out of memory");
	const int count = cmd_cutoffs(model, component, info->triangles, disagreement);
	printf("    %s that hold a cut-off: %d\n", info->symmetry == 'I' ? "segments" : "triangles", count);
	if (count)
		printf("       theta      phi  disagreement\n");
	for (int t = 0; t < info->triangles && count; t++) {
		int corner[3];
		float middle[3] = {0, 0, 0};
		if (!(disagreement[t] > BSDFRBF_CUTOFF) || bsdfrbf_get_triangle(model, component, t, corner) != BSDFRBF_OK)
			continue;
		for (int k = 0; k < (info->symmetry == 'I' ? 2 : 3); k++) {
			bsdfrbf_vertex_info vertex;
			if (bsdfrbf_get_vertex_info(model, component, corner[k], &vertex) == BSDFRBF_OK)
				for (int n = 0; n < 3; n++)
					middle[n] += vertex.direction[n];
		}
		printf("    %8.2f %8.2f %13.2f\n", theta_of(middle), phi_of(middle), disagreement[t]);
	}
	free(disagreement);
}

/* How much more light leaves than arrives, where it does. */
static void print_excess(const bsdfrbf_model *model, bsdfrbf_component component, const bsdfrbf_component_info *info)
{
	bsdfrbf_incidence_info worst = {.total = 0}, one;
	for (int i = 0; i < info->incidences; i++)
		if (bsdfrbf_get_incidence_info(model, component, i, &one) == BSDFRBF_OK && one.total > worst.total)
			worst = one;
	printf("    incidences with more light than arrives: %d; largest total %.4f at theta %.2f phi %.2f\n", info->excess, worst.total,
		theta_of(worst.direction), phi_of(worst.direction));
}

static void print_component(const bsdfrbf_model *model, bsdfrbf_component component, int verbose)
{
	bsdfrbf_component_info info;
	if (bsdfrbf_get_component_info(model, component, &info) != BSDFRBF_OK)
		return;
	printf("component: %s\n", component_name[component]);
	printf("    symmetry: %s\n", info.symmetry_text);
	print_error("asymmetry", info.asymmetry);
	printf("    incidences: %d\n", info.incidences);
	printf("    largest theta: %.2f degrees\n", info.theta_max_deg);
	printf("    lobes: %llu (%.1f an incidence)\n", (unsigned long long)info.lobes,
		info.incidences ? (double)info.lobes / info.incidences : 0);
	printf("    mesh: %d vertices, %d %s\n", info.vertices, info.triangles, info.symmetry == 'I' ? "segments" : "triangles");
	printf("    frames:");
	for (int f = 0; f < info.frames; f++)
		printf("%s %s %.1f %%", f ? "," : "", info.frame_name[f], 100 * info.frame_share[f]);
	putchar('\n');
	for (int f = 0; f < info.frames; f++) {
		const float *x = info.frame_beam[f][0], *y = info.frame_beam[f][1];
		if (info.frame_learned[f])
			printf("    beam of %s: x %+.3f ix %+.3f iy %+.3f iz %+.3f, y %+.3f ix %+.3f iy %+.3f iz %+.3f\n", info.frame_name[f],
				x[0], x[1], x[2], x[3], y[0], y[1], y[2], y[3]);
	}
	int limits = 0;
	for (int f = 0; f < info.frames; f++)
		if (info.frame_limit[f] > 0)
			printf("%s %g of %s", limits++ ? "," : "    shares: at most", (double)info.frame_limit[f], info.frame_name[f]);
	if (limits)
		putchar('\n');
	if (info.mirrored > 0)
		printf("    not measured: up to %.1f %% of the exitant hemisphere; mirrored, as the other side was\n", 100 * info.mirrored);
	if (info.filled > 0)
		printf("    not measured: up to %.1f %% of the exitant hemisphere; filled from the incidences around\n", 100 * info.filled);
	if (info.even > 0)
		printf("    levels: evened%s\n", info.even < 1 ? " half way" : "");
	if (info.tuned)
		printf("    light: tuned to the DHR that is expected\n");
	if (info.residual)
		printf("    residual transport: %.3f degrees on average, %d directed edges\n", info.residual_deg, info.edges);
	else
		printf("    residual transport: none\n");
	float lambertian[3] = {0};
	bsdfrbf_lambertian(model, component, lambertian);
	if (bsdfrbf_channels(model) == 3)
		printf("    Lambertian part: X %.4f Y %.4f Z %.4f\n", lambertian[0], lambertian[1], lambertian[2]);
	else
		printf("    Lambertian part: %.4f\n", lambertian[0]);
	print_excess(model, component, &info);
	print_error("fit error", info.fit_error);
	print_error("leave-one-out error", info.loo_error);
	print_error("expected error", info.expected_error);
	if (verbose) {
		print_cutoffs(model, component, &info);
		print_incidences(model, component, info.incidences);
	}
}

/* A line of text from the file, which may come from anywhere: nothing that a terminal would obey. */
static void print_line(const char *text, size_t length)
{
	for (size_t i = 0; i < length; i++)
		putchar((unsigned char)text[i] < 32 || text[i] == 127 ? '?' : text[i]);
	putchar('\n');
}

/* Texts that name many things have one a line. */
static void print_text(const bsdfrbf_model *model, const char *key, int verbose)
{
	const char *text = bsdfrbf_get_text(model, key);
	if (!*text)
		return;
	if (!strchr(text, '\n')) {
		printf("%s: ", key);
		print_line(text, strlen(text));
		return;
	}
	size_t lines = 0;
	for (const char *at = text; *at; at += strcspn(at, "\n"), at += *at == '\n')
		lines++;
	printf("%s: %zu\n", key, lines);
	for (const char *at = text; verbose && *at; at += strcspn(at, "\n"), at += *at == '\n') {
		fputs("    ", stdout);
		print_line(at, strcspn(at, "\n"));
	}
}

static void print_sections(const bsdfrbf_model *model)
{
	static const char *const name[4] = {"rf", "rb", "tf", "tb"};
	unsigned long long total = 0;
	const int sections = bsdfrbf_get_section(model, -1, NULL, NULL, NULL);
	printf("sections:\n");
	for (int i = 0; i < sections; i++) {
		const char *section = "";
		int component = -1;
		uint64_t bytes = 0;
		bsdfrbf_get_section(model, i, &section, &component, &bytes);
		printf("    %-16s %-2s %12llu\n", section, component >= 0 && component < 4 ? name[component] : "",
			(unsigned long long)bytes);
		total += bytes;
	}
	printf("    %-16s %-2s %12llu\n", "all", "", total);
}

int main(int argc, char **argv)
{
	const char *word;
	int verbose = 0, at;
	cmd_start(argv[0]);
	for (at = 1; (word = cmd_option(argc, argv, &at, "-")); at++) {
		if (!strcmp(word, "-v"))
			verbose = 1;
		else
			cmd_unknown(word);
	}
	if (at == argc)
		cmd_misuse("no .rbf file");
	bsdfrbf_context *context = cmd_context();
	for (int i = at; i < argc; i++) {
		bsdfrbf_model *model = cmd_open(context, argv[i]);
		printf("%sfile: %s\n", i > at ? "\n" : "", argv[i]);
		print_text(model, "name", verbose);
		print_text(model, "command", verbose);
		print_text(model, "source", verbose);
		print_text(model, "spikes", verbose);
		print_text(model, "unread", verbose);
		printf("channels: %s\n", bsdfrbf_channels(model) == 3 ? "X Y Z" : "Y");
		for (int c = 0; c < 4; c++)
			print_component(model, (bsdfrbf_component)c, verbose);
		print_sections(model);
		bsdfrbf_close(model);
	}
	bsdfrbf_context_free(context);
	cmd_finish_output();
	return 0;
}
