/* SPDX-License-Identifier: BSD-3-Clause */
#include "summary.h"
#include "common.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

const char *const summary_name[4] = {"rf", "rb", "tf", "tb"};

static const double WIDE = 2; /* a gap of more than this many mean spacings is a hole */
static const double ELSEWHERE = .05; /* of the hemisphere: a hole that is neither around the source nor at the horizon */
static const double MANY = 1. / 3; /* of the incidences: more are no slips */
static const float COARSE = .15; /* noise is hardly that much */

static int ascending(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return x < y ? -1 : x > y;
}

static double middle(double *list, size_t count)
{
	qsort(list, count, sizeof *list, ascending);
	return count ? list[count / 2] : 0;
}

/* Of one incidence, degrees: the gap around the source, the most grazing sample, and the samples' mean spacing. */
static void look(const bsdfrbf_samples *s, double *source, double *grazing, double *spacing)
{
	double nearest = 4, lowest = 1;
	for (size_t i = 0; i < s->count; i++) {
		const double *o = s->outgoing + 3*i, *d = s->direction;
		const double chord = sqrt((o[0]-d[0])*(o[0]-d[0]) + (o[1]-d[1])*(o[1]-d[1]) + (o[2]-d[2])*(o[2]-d[2]));
		nearest = fmin(nearest, chord);
		lowest = fmin(lowest, o[2]);
	}
	*source = 360 / PI * asin(fmin(nearest / 2, 1));
	*grazing = 180 / PI * acos(lowest);
	*spacing = 180 / PI * sqrt(2 * PI / (double)(s->count ? s->count : 1));
}

/* What was not measured, and what came of it. All degrees: the gap around the source, the most grazing exitance, the samples' spacing.
 * share: of the hemisphere, all that was not measured. flat: of so many incidences, those that were measured in one plane. */
static void print_holes(int reflects, double gap, double edge, double step, double share, size_t flat, size_t count, const bsdfrbf_component_info *info)
{
	const int hole = reflects && gap > WIDE * step, cut = 90 - edge > WIDE * step;
	const int more = !flat && share > (hole ? 1 - cos(gap * PI / 180) : 0) + (cut ? cos(edge * PI / 180) : 0) + ELSEWHERE;
	const char *const filled = info->filled > 0 ? "filled from the incidences around" : "filled smoothly";
	fprintf(stderr, "    holes: ");
	if (flat == count) {
		fprintf(stderr, "all but one plane of exitance; %s\n", info->symmetry == 'I' ? "guessed beside it as along it"
			: info->filled > 0 ? "filled from the incidences around" : "dark beside it");
		return;
	}
	if (flat)
		fprintf(stderr, "all but one plane of exitance at %zu of %zu incidences", flat, count);
	if (hole)
		fprintf(stderr, "%s%.1f degrees around the source", flat ? "; " : "", gap);
	if (cut)
		fprintf(stderr, "%snothing beyond %.1f degrees of exitance", hole || flat ? "; " : "", edge);
	if (more)
		fprintf(stderr, "%s%.0f %% of the exitant hemisphere%s", hole || cut ? "; " : "", 100 * share, hole || cut ? " in all" : "");
	if (!hole && !cut && !flat && !more)
		fprintf(stderr, "none\n");
	else if (info->mirrored > 0)
		fprintf(stderr, "; mirrored where the other side was measured, else %s\n", filled);
	else
		fprintf(stderr, "; %s\n", filled);
}

static void print_samples(const bsdfrbf_data *data, int component, const bsdfrbf_component_info *info)
{
	const size_t count = bsdfrbf_data_incidences(data, (bsdfrbf_component)component);
	double *list = malloc((5 * count + 1) * sizeof *list);
	size_t used = 0, flat = 0;
	if (!list)
		return;
	double *const source = list, *const grazing = list + count, *const spacing = list + 2*count, *const samples = list + 3*count, *const share = list + 4*count;
	for (size_t i = 0; i < count; i++) {
		bsdfrbf_samples s;
		if (bsdfrbf_data_get(data, (bsdfrbf_component)component, i, &s) != BSDFRBF_OK || !s.count)
			continue;
		share[used] = bsdfrbf_data_unmeasured(data, (bsdfrbf_component)component, i);
		look(&s, &source[used], &grazing[used], &spacing[used]);
		samples[used++] = (double)s.count;
		flat += bsdfrbf_data_in_plane(data, (bsdfrbf_component)component, i) != 0;
	}
	fprintf(stderr, "    %d incidence%s to %.1f degrees", info->incidences, info->incidences == 1 ? "" : "s", info->theta_max_deg);
	if (used)
		fprintf(stderr, ", %.0f samples each", middle(samples, used));
	if (info->fit_error >= 0)
		fprintf(stderr, "; noise and fit together %.1f %%", 100 * info->fit_error);
	fputc('\n', stderr);
	if (used)
		print_holes(component < BSDFRBF_TF, middle(source, used), middle(grazing, used), middle(spacing, used), middle(share, used),
			flat, used, info);
	free(list);
}

static void print_frames(const bsdfrbf_component_info *info)
{
	fprintf(stderr, "    %.0f lobes each; frames", info->incidences ? (double)info->lobes / info->incidences : 0);
	for (int f = 0; f < info->frames; f++)
		fprintf(stderr, "%s %s %.0f %%", f ? "," : "", info->frame_name[f], 100 * info->frame_share[f]);
	if (info->residual)
		fprintf(stderr, " + residual %.1f degrees", info->residual_deg);
	fputc('\n', stderr);
}

void summary_print(const bsdfrbf_model *model, const bsdfrbf_data *data)
{
	for (int c = 0; c < 4; c++) {
		bsdfrbf_component_info info;
		if (bsdfrbf_get_component_info(model, (bsdfrbf_component)c, &info) != BSDFRBF_OK)
			continue;
		fprintf(stderr, "%s: %s", summary_name[c], info.symmetry_text);
		if (info.asymmetry >= 0)
			fprintf(stderr, "; asymmetry %.1f %%", 100 * info.asymmetry);
		fputc('\n', stderr);
		print_samples(data, c, &info);
		print_frames(&info);
		if (info.loo_error >= 0)
			fprintf(stderr, "    error of incidences left out %.3f", info.loo_error);
		if (info.expected_error >= 0)
			fprintf(stderr, "%s expected between incidences %.3f", info.loo_error >= 0 ? "," : "   ", info.expected_error);
		if (info.loo_error >= 0 || info.expected_error >= 0)
			fputc('\n', stderr);
	}
}

void summary_warn(const bsdfrbf_model *model)
{
	for (int c = 0; c < 4; c++) {
		bsdfrbf_component_info info;
		if (bsdfrbf_get_component_info(model, (bsdfrbf_component)c, &info) != BSDFRBF_OK)
			continue;
		if (info.incidences == 1)
			cmd_say("warning - %s: a single incidence was measured; what light from elsewhere does is a guess: measure others",
				summary_name[c]);
		if (info.fit_error > COARSE)
			cmd_say("warning - %s: samples kept back are met with an error of %.0f %%; they are that noisy, or a peak is narrower than "
				"they are apart: measure finer at the peak", summary_name[c], 100 * info.fit_error);
		if (info.loo_error > .5)
			cmd_say("warning - %s: left-out incidences are predicted with an error of %.0f %%; expect little between the "
				"measured ones, or measure more of them", summary_name[c], 100 * info.loo_error);
		const int cutoffs = cmd_cutoffs(model, (bsdfrbf_component)c, info.triangles, NULL);
		if (cutoffs)
			cmd_say("warning - %s: a beam ends within %d of the %d %s between incidences; measure more of them there (rbfinfo -v)",
				summary_name[c], cutoffs, info.triangles, info.symmetry == 'I' ? "segments" : "triangles");
	}
}

int summary_gains(const bsdfrbf_model *model, const bsdfrbf_data *data, int component, float **gain)
{
	*gain = malloc((bsdfrbf_data_incidences(data, (bsdfrbf_component)component) + 1) * sizeof **gain);
	const int off = *gain ? bsdfrbf_data_gains(data, model, (bsdfrbf_component)component, *gain) : -1;
	if (off < 0)
		cmd_fail("out of memory");
	if (!off) {
		free(*gain);
		*gain = NULL;
	}
	return off;
}

/* The scan that is off by most, but for those named. Its gain becomes 1. */
static void name_farthest(const bsdfrbf_data *data, int component, float *gain, char text[64])
{
	bsdfrbf_samples s;
	size_t at = 0;
	for (size_t i = 0; i < bsdfrbf_data_incidences(data, (bsdfrbf_component)component); i++)
		if (fabs(log((double)gain[i])) > fabs(log((double)gain[at])))
			at = i;
	bsdfrbf_data_get(data, (bsdfrbf_component)component, at, &s);
	const double theta = 180 / PI * atan2(hypot(s.direction[0], s.direction[1]), s.direction[2]);
	const double phi = 180 / PI * atan2(s.direction[1], s.direction[0]);
	snprintf(text, 64, "theta %.1f phi %.1f by %.2f", component & 1 ? 180 - theta : theta, phi < -.05 ? phi + 360 : fabs(phi), (double)gain[at]);
	gain[at] = 1;
}

/* So many are off that none of them is the one that is. */
static void warn_many(const float *gain, int count, int component)
{
	float least = 1, most = 1;
	for (int i = 0; i < count; i++) {
		least = fminf(least, gain[i]);
		most = fmaxf(most, gain[i]);
	}
	cmd_say("warning - %s: f(a, b) and f(b, a) are not the same as far as was measured, and no few scans are to blame: factors of %.2f to %.2f, by incidence, "
		"would make them so. Stray light, misalignment, or a sample that is smaller than what is lit or seen does this; if it was the lamp that drifted, "
		"divide them out (mkrbf -r)", summary_name[component], (double)least, (double)most);
}

void summary_warn_gains(const bsdfrbf_model *model, const bsdfrbf_data *data)
{
	enum { NAMED = 4 };
	for (int c = 0; c < 4; c++) {
		float *gain;
		char list[NAMED * 66] = "", one[64];
		const int off = summary_gains(model, data, c, &gain), count = (int)bsdfrbf_data_incidences(data, (bsdfrbf_component)c);
		if (!off)
			continue;
		if (off > MANY * count) {
			warn_many(gain, count, c);
			free(gain);
			continue;
		}
		for (int n = 0; n < off && n < NAMED; n++) {
			name_farthest(data, c, gain, one);
			snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", n ? ", " : "", one);
		}
		free(gain);
		cmd_say("warning - %s: by reciprocity the whole scan is off by a factor at %d of %d incidences: %s%s; measure anew, or divide such "
			"factors out (mkrbf -r)", summary_name[c], off, count, list, off > NAMED ? ", ..." : "");
	}
}
