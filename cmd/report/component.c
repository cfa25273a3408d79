/* SPDX-License-Identifier: BSD-3-Clause */
#include "component.h"
#include "json.h"
#include "samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
	PICTURE_MOST = 96, PICTURE_LEAST = 32,  /* pixels a side of a measured incidence */
	MOVING_MOST = 72, MOVING_LEAST = 24,    /* of a moving one */
	PROFILE_SAMPLES = 200,
	CODES = CODE_STEPS + 2
};

/* State of one component's part of the page. */
typedef struct part {
	FILE *out;
	view v;
	const bsdfrbf_data *data;
	int size;            /* pixels a side */
	size_t pixels;
	float *direction, *f;  /* of the pixels */
	size_t histogram[CODES]; /* of the fits' codes, for the scale of colours */
	double highest;
	codes codes;
} part;

static const char *const short_name[4] = {"rf", "rb", "tf", "tb"};
static const char *const long_name[4] = {"front reflection", "back reflection", "front transmission", "back transmission"};

/* Largest size whose disc has at most `pixels` pixels. */
static int size_for(size_t pixels, int least, int most)
{
	int size = most;
	while (size > least && disc_directions(size, NULL) > pixels)
		size--;
	return size;
}

static int set_size(part *p, int size)
{
	p->size = size;
	p->pixels = disc_directions(size, NULL);
	free(p->direction);
	free(p->f);
	p->direction = malloc(p->pixels * 3 * sizeof *p->direction);
	p->f = malloc(p->pixels * sizeof *p->f);
	if (!p->direction || !p->f)
		return 0;
	disc_directions(size, p->direction);
	return 1;
}

static void number(FILE *out, const char *key, double value)
{
	fprintf(out, isfinite(value) && value > -1e-9 ? "\"%s\":%.6g," : "\"%s\":null,", key, value);
}

/* ------------------------------------------------------------ facts and mesh */

static void write_facts(part *p)
{
	const bsdfrbf_component_info *info = &p->v.info;
	FILE *out = p->out;
	float lambertian[3] = {0};
	bsdfrbf_lambertian(p->v.model, p->v.component, lambertian);
	fprintf(out, "\"name\":\"%s\",\"title\":\"%s\",\"symmetry\":\"%c\",\"symmetryText\":", short_name[p->v.component],
		long_name[p->v.component], info->symmetry);
	json_text(out, info->symmetry_text);
	fprintf(out, ",\"mirrors\":[%d,%d,%d],\"lobes\":%llu,\"residual\":%d,\"frames\":[", info->mirror_x, info->mirror_y,
		info->half_turn, (unsigned long long)info->lobes, info->residual);
	for (int f = 0; f < info->frames; f++)
		fprintf(out, "%s{\"name\":\"%s\",\"share\":%.4f}", f ? "," : "", info->frame_name[f], info->frame_share[f]);
	fprintf(out, "],");
	number(out, "residualDegrees", info->residual_deg);
	number(out, "excess", info->excess);
	number(out, "lambertian", lambertian[p->v.luminance]);
	number(out, "fitError", info->fit_error);
	number(out, "leaveOneOut", info->loo_error);
	number(out, "expected", info->expected_error);
	number(out, "asymmetry", info->asymmetry);
	number(out, "thetaMax", info->theta_max_deg);
}

static void write_mesh(part *p)
{
	const view *v = &p->v;
	fprintf(p->out, "\"vertices\":[");
	for (int n = 0; n < v->info.vertices; n++) {
		bsdfrbf_vertex_info vertex;
		if (bsdfrbf_get_vertex_info(v->model, v->component, n, &vertex) == BSDFRBF_OK)
			fprintf(p->out, "%s[%.5f,%.5f,%.5f,%d,%d]", n ? "," : "", vertex.direction[0], vertex.direction[1],
				vertex.direction[2], vertex.incidence, vertex.mirrored);
	}
	fprintf(p->out, "],\"triangles\":[");
	for (int n = 0; n < v->info.triangles; n++) {
		int corner[3];
		if (bsdfrbf_get_triangle(v->model, v->component, n, corner) == BSDFRBF_OK)
			fprintf(p->out, "%s[%d,%d,%d]", n ? "," : "", corner[0], corner[1], corner[2]);
	}
	fprintf(p->out, "],");
}

/* ---------------------------------------------------------------- incidences */

static void evaluate_picture(part *p, const float incident[3])
{
	view_eval(&p->v, incident, p->pixels, p->direction, p->f);
}

/* Fit at every pixel; then, for pixels with a sample near, its value and the fit at its very direction: a steep peak
 * would otherwise show differences that are only those of two directions. */
static void write_pictures(part *p, const float incident[3], const samples *s)
{
	codes_clear(&p->codes);
	for (size_t i = 0; i < p->pixels; i++) {
		codes_value(&p->codes, p->f[i]);
		p->histogram[code_of(p->f[i])]++;
	}
	fprintf(p->out, "\"fit\":");
	json_codes(p->out, &p->codes);
	if (!s->count)
		return;
	for (int kind = 0; kind < 2; kind++) {
		codes_clear(&p->codes);
		for (size_t i = 0; i < p->pixels; i++) {
			const long n = samples_nearest(s, p->direction + 3*i);
			float value = 0;
			if (n >= 0 && kind == 0)
				value = fmaxf(s->f[n], (float)CODE_LOW); /* noise below zero: measured, but dark */
			else if (n >= 0)
				view_eval(&p->v, incident, 1, s->direction + 3*n, &value);
			codes_value(&p->codes, value);
		}
		fprintf(p->out, kind ? ",\"expected\":" : ",\"measured\":");
		json_codes(p->out, &p->codes);
	}
}

/* Polar angle within the plane of azimuth phi, negative on the other side. */
static void plane_direction(double angle, double phi, float d[3])
{
	view_direction(fabs(angle), angle < 0 ? phi + 180 : phi, d);
}

static void profile_point(part *p, const float incident[3], double angle, double phi)
{
	float d[3], f;
	plane_direction(angle, phi, d);
	view_eval(&p->v, incident, 1, d, &f);
	codes_unit(&p->codes, angle / 90);
	codes_value(&p->codes, f);
}

/* The plane through normal and peak: the fit, finer about the peak, and the samples close to the plane. */
static void write_profile(part *p, const float incident[3], const view_peak *peak, const samples *s)
{
	const double theta = view_theta(peak->direction);
	const double phi = theta > 1 ? view_phi(peak->direction) : view_theta(incident) > 1 ? view_phi(incident) : 0;
	codes_clear(&p->codes);
	for (int n = -89; n <= 89; n++) {
		if (fabs(n - theta) > 5)
			profile_point(p, incident, n, phi);
		if (n <= theta - 5 && n + 1 > theta - 5)
			for (int fine = 0; fine <= 100; fine++)
				if (theta - 5 + .1 * fine < 89.5)
					profile_point(p, incident, theta - 5 + .1 * fine, phi);
	}
	fprintf(p->out, ",\"plane\":%.2f,\"profile\":", phi);
	json_codes(p->out, &p->codes);
	if (!s->count)
		return;
	size_t near[PROFILE_SAMPLES];
	double band = 0;
	const size_t count = samples_near_plane(s, phi, PROFILE_SAMPLES, near, &band);
	const double c = cos(phi * REPORT_DEGREE), q = sin(phi * REPORT_DEGREE);
	codes_clear(&p->codes);
	for (size_t i = 0; i < count; i++) {
		const float *d = s->direction + 3 * near[i];
		codes_unit(&p->codes, atan2(c * d[0] + q * d[1], d[2]) / REPORT_DEGREE / 90);
		codes_value(&p->codes, s->f[near[i]]);
	}
	fprintf(p->out, ",\"band\":%g,\"near\":", band);
	json_codes(p->out, &p->codes);
}

/* Of many incidences only an even choice is shown as pictures. */
static int is_pictured(int index, int incidences, int pictured)
{
	return (long)(index + 1) * pictured / incidences > (long)index * pictured / incidences;
}

static int write_incidences(part *p, size_t words, int *matched)
{
	const view *v = &p->v;
	const int incidences = v->info.incidences;
	const size_t each = p->data ? 3 : 1, other = 2 * (190 + 100 + PROFILE_SAMPLES); /* codes a pixel; those of a profile */
	const size_t least = each * disc_directions(PICTURE_LEAST, NULL) + other;
	const int pictured = (size_t)incidences * least > words ? (int)(words / least) : incidences;
	const size_t room = words / (size_t)(pictured > 0 ? pictured : 1);
	if (!set_size(p, size_for(room > other ? (room - other) / each : 0, PICTURE_LEAST, PICTURE_MOST)))
		return 0;
	fprintf(p->out, "\"size\":%d,\"pictured\":%d,\"incidences\":[", p->size, pictured);
	for (int n = 0; n < incidences; n++) {
		bsdfrbf_incidence_info info;
		samples s;
		view_peak peak;
		if (bsdfrbf_get_incidence_info(v->model, v->component, n, &info) != BSDFRBF_OK || !samples_take(&s, v, p->data, n))
			return 0;
		*matched += s.count > 0;
		evaluate_picture(p, info.direction);
		view_find_peak(v, info.direction, p->pixels, p->direction, p->f, &peak);
		p->highest = fmax(p->highest, peak.f);
		fprintf(p->out, "%s{\"theta\":%.3f,\"phi\":%.3f,\"lobes\":%d,\"samples\":%zu,", n ? "," : "", view_theta(info.direction),
			view_phi(info.direction), info.lobes, s.count);
		number(p->out, "dhr", view_dhr(v, info.direction));
		number(p->out, "total", info.total);
		number(p->out, "fitError", info.fit_error);
		number(p->out, "leaveOneOut", info.loo_error);
		number(p->out, "reciprocity", bsdfrbf_get_reciprocity(v->model, v->component, n));
		fprintf(p->out, "\"peak\":[%.5g,%.2f,%.2f]", peak.f, view_theta(peak.direction), view_phi(peak.direction));
		if (is_pictured(n, incidences, pictured)) {
			putc(',', p->out);
			write_pictures(p, info.direction, &s);
			write_profile(p, info.direction, &peak, &s);
		}
		putc('}', p->out);
		samples_free(&s);
	}
	fprintf(p->out, "],");
	return 1;
}

/* -------------------------------------------------------------------- moving */

/* Azimuths that show all: the others are mirror images. */
static void azimuths(const bsdfrbf_component_info *info, double step, double *first, int *count)
{
	double span = 360;
	*first = 0;
	if (info->symmetry == 'I')
		span = 0;
	else if (info->mirror_x && info->mirror_y)
		span = 90;
	else if (info->mirror_x) {
		span = 180;
		*first = -90;
	} else if (info->mirror_y || info->half_turn)
		span = 180;
	*count = (int)(span / step) + (span < 360 && !(info->half_turn && span == 180));
}

/* The hemisphere at a raster of incident directions, for the sliders. */
static int write_moving(part *p, size_t words)
{
	static const double raster[][2] = {{2, 10}, {2.5, 15}, {2.5, 30}, {5, 15}, {5, 30}, {5, 45}, {10, 45}};
	const view *v = &p->v;
	const int last = (int)(sizeof raster / sizeof *raster) - 1;
	double first = 0;
	int thetas = 0, phis = 0, choice = 0;
	for (; choice <= last; choice++) {
		thetas = (int)(85 / raster[choice][0]) + 1;
		azimuths(&v->info, raster[choice][1], &first, &phis);
		if (words / (size_t)(thetas * phis) >= disc_directions(44, NULL) || choice == last)
			break;
	}
	if (!set_size(p, size_for(words / (size_t)(thetas * phis), MOVING_LEAST, MOVING_MOST)))
		return 0;
	fprintf(p->out, "\"moving\":{\"size\":%d,\"thetas\":%d,\"thetaStep\":%g,\"phis\":%d,\"phiFirst\":%g,\"phiStep\":%g,\"at\":[",
		p->size, thetas, raster[choice][0], phis, first, raster[choice][1]);
	for (int n = 0; n < phis * thetas; n++) {
		float incident[3];
		view_peak peak;
		view_direction(n % thetas * raster[choice][0], first + n / thetas * raster[choice][1], incident);
		evaluate_picture(p, incident);
		view_find_peak(v, incident, p->pixels, p->direction, p->f, &peak);
		codes_clear(&p->codes);
		for (size_t i = 0; i < p->pixels; i++)
			codes_value(&p->codes, p->f[i]);
		fprintf(p->out, "%s[%.5g,%.5g,%.2f,%.2f,", n ? "," : "", view_dhr(v, incident), peak.f, view_theta(peak.direction),
			view_phi(peak.direction));
		json_codes(p->out, &p->codes);
		putc(']', p->out);
	}
	fprintf(p->out, "]},");
	return 1;
}

/* --------------------------------------------------------------------- edges */

static int brighter(const void *a, const void *b)
{
	const float x = ((const bsdfrbf_lobe_info *)a)->energy, y = ((const bsdfrbf_lobe_info *)b)->energy;
	return (x < y) - (x > y);
}

/* A direction as a point of the disc. */
static void code_point(codes *c, const float d[3])
{
	const double s = hypot(d[0], d[1]), r = fmin(view_theta(d) / 90, 1);
	codes_unit(c, s > 0 ? r * d[0] / s : 0);
	codes_unit(c, s > 0 ? r * d[1] / s : 0);
}

static int write_arrows(part *p, int from, int to, size_t most)
{
	const view *v = &p->v;
	const size_t count = bsdfrbf_get_lobes(v->model, v->component, from, to, 0, NULL);
	bsdfrbf_lobe_info *lobe = malloc((count + 1) * sizeof *lobe);
	if (!lobe)
		return 0;
	bsdfrbf_get_lobes(v->model, v->component, from, to, count, lobe);
	double total = 0;
	for (size_t i = 0; i < count; i++)
		total += lobe[i].energy;
	qsort(lobe, count, sizeof *lobe, brighter);
	codes_clear(&p->codes);
	for (size_t i = 0; i < count && i < most && lobe[i].energy > 0; i++) {
		const float *m = lobe[i].moved;
		code_point(&p->codes, lobe[i].direction);
		code_point(&p->codes, m);
		codes_word(&p->codes, (unsigned)(lobe[i].energy / total * 65535));
		codes_byte(&p->codes, (unsigned)lobe[i].frame);
		codes_byte(&p->codes, m[2] > 0); /* 0: it ends, or sinks below the horizon */
	}
	json_codes(p->out, &p->codes);
	free(lobe);
	return 1;
}

typedef struct edge { int a, b; } edge;

static int by_vertices(const void *first, const void *second)
{
	const edge *x = first, *y = second;
	return x->a != y->a ? x->a - y->a : x->b - y->b;
}

/* Each edge once, with the lobes of either end moved to the other. */
static int write_edges(part *p, size_t words)
{
	enum { ARROW = 6, LEAST = 8, MOST = 60 }; /* words an arrow; arrows */
	const view *v = &p->v;
	edge *list = malloc((3 * (size_t)v->info.triangles + 1) * sizeof *list);
	if (!list)
		return 0;
	size_t all = 0, edges = 0;
	for (int n = 0; n < v->info.triangles; n++) {
		int corner[3];
		if (bsdfrbf_get_triangle(v->model, v->component, n, corner) != BSDFRBF_OK)
			continue;
		for (int k = 0; k < 3; k++) {
			const int a = corner[k], b = corner[(k + 1) % 3];
			if (a != b)
				list[all++] = a < b ? (edge){a, b} : (edge){b, a};
		}
	}
	qsort(list, all, sizeof *list, by_vertices);
	for (size_t n = 0; n < all; n++)
		if (n == 0 || by_vertices(&list[n], &list[n - 1]))
			list[edges++] = list[n];
	const size_t shown = edges * 2 * ARROW * LEAST > words ? words / (2 * ARROW * LEAST) : edges;
	size_t most = words / (2 * ARROW * (shown ? shown : 1));
	most = most > MOST ? MOST : most;
	int done = 1;
	fprintf(p->out, "\"edgesInAll\":%zu,\"edges\":[", edges);
	for (size_t n = 0; n < shown && done; n++) {
		fprintf(p->out, "%s[%d,%d,", n ? "," : "", list[n].a, list[n].b);
		done = write_arrows(p, list[n].a, list[n].b, most);
		putc(',', p->out);
		done = done && write_arrows(p, list[n].b, list[n].a, most);
		putc(']', p->out);
	}
	fprintf(p->out, "],");
	free(list);
	return done;
}

/* -------------------------------------------------------------------- curves */

/* DHR against polar angle at the azimuths that were measured most, or at regular ones. */
static void write_curves(part *p)
{
	const view *v = &p->v;
	double first;
	int count;
	azimuths(&v->info, 45, &first, &count);
	fprintf(p->out, "\"curves\":[");
	for (int n = 0; n < count; n++) {
		fprintf(p->out, "%s{\"phi\":%g,\"dhr\":[", n ? "," : "", first + 45 * n);
		for (int theta = 0; theta <= 88; theta += 2) {
			float incident[3];
			view_direction(theta, first + 45 * n, incident);
			fprintf(p->out, "%s%.5g", theta ? "," : "", view_dhr(v, incident));
		}
		fprintf(p->out, "]}");
	}
	fprintf(p->out, "],");
}

/* Colours reach from the highest peak down to where all but the darkest twentieth of the pixels is shown, over at most
 * five decades. */
static void write_range(const part *p)
{
	size_t total = 0, below = 0;
	for (unsigned n = 1; n < CODES; n++)
		total += p->histogram[n];
	unsigned low = 1;
	while (low + 1 < CODES && (below += p->histogram[low]) < total / 20)
		low++;
	const double value = CODE_LOW * pow(CODE_HIGH / CODE_LOW, (low - 1) / (double)CODE_STEPS);
	fprintf(p->out, "\"range\":[%.4g,%.4g]", fmax(value, 1e-5 * p->highest), p->highest);
}

int report_component(FILE *out, const bsdfrbf_model *model, bsdfrbf_component component, const bsdfrbf_data *data,
	size_t words, int *matched)
{
	part *p = calloc(1, sizeof *p);
	if (!p)
		return 0;
	p->out = out;
	p->data = data;
	*matched = 0;
	int done = view_start(&p->v, model, component);
	if (done) {
		putc('{', out);
		write_facts(p);
		write_mesh(p);
		done = write_incidences(p, words * 9 / 20, matched) && write_moving(p, words * 9 / 20) && write_edges(p, words / 10);
		write_curves(p);
		write_range(p);
		putc('}', out);
	}
	done = done && !p->codes.failed;
	free(p->direction);
	free(p->f);
	free(p->codes.byte);
	free(p);
	return done;
}
