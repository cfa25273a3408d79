/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Models that no measurement would ask for, by the hundred, each different: lobes of 0.2 to 60 degrees, peaks ten million
 * times over the base, equal lobes, lobes and incidences without mass, grazing, collinear and clustered incidences, triangles that are nearly
 * none, every map and symmetry. Environment: STRESS models (default 18; a hundred take half a minute), from
 * STRESS_FIRST on, STRESS_SEED.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "question.h"
#include "random_model.h"
#include "reference.h"
#include "integrate.h"
#include "sample.h"

enum { QUERIES = 40, SAMPLES = 6000 };
enum { RING = 720 };
static const double SIGNIFICANCE = 1e-4, JUMP = .1, SEEN = 1e-3, APART = 3e-3;
static const double WEIGHT_ROUNDING = 5e-7; /* rad: as ROUNDING of mesh_locate.c */
static const char *const scheme_name[] = {"scattered", "clustered", "collinear", "grazing", "slivers", "rings", "few"};
enum { SCHEMES = sizeof scheme_name / sizeof *scheme_name };

typedef struct subject {
	random_plan plan;
	bsdfrbf_model *model;
	const rbf_component *c;
	int scheme, number;
	uint64_t seed;
} subject;

static uint64_t seed = 1;
static int models = 18, first;
static long tried, meshless, values, failures, lost;
static double apart_worst;

static double unit(void)
{
	return random_unit(&seed);
}

static double between(double low, double high)
{
	return low + (high - low) * unit();
}

static uint32_t whole(uint32_t below)
{
	return (uint32_t)(below * unit());
}

static void failed(const subject *s, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void failed(const subject *s, const char *format, ...)
{
	char text[300];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	if (failures++ < 40)
		print_error("model %d (%s, %c, kappa to %.0f, motion %.2f, span %.0e; %s): %s\n", s->number, scheme_name[s->scheme], s->plan.symmetry,
			s->plan.kappa_high, s->plan.motion, s->plan.span, fixture_maps(s->c), text);
}

/* ------------------------------------------------------------------ models */

static double azimuth_in(rbf_symmetry symmetry)
{
	switch (symmetry) {
	case RBF_BILATERAL_X: return between(-90, 90);
	case RBF_BILATERAL_Y: case RBF_UP: return between(0, 180);
	case RBF_QUADRILATERAL: return between(0, 90);
	case RBF_ISOTROPIC: return 0;
	default: return between(0, 360);
	}
}

static uint32_t incidences(rbf_symmetry symmetry, int scheme, double *direction)
{
	uint32_t wanted = scheme == 6 ? 1 + whole(2) : 4 + whole(14), bases = 0;
	const double line = azimuth_in(symmetry), centre[2] = {between(5, 80), azimuth_in(symmetry)}, spread = between(.15, 2);
	for (int attempt = 0; attempt < 200 && bases < wanted; attempt++) {
		double theta = acos(between(.08, 1)) / DEGREE, phi = azimuth_in(symmetry), d[3];
		if (scheme == 1 && attempt % 4) { /* about one of the places, the others are scattered */
			theta = centre[0] + between(-spread, spread);
			phi = centre[1] + between(-spread, spread) / sin(centre[0] * DEGREE);
		} else if (scheme == 2)
			phi = line + (symmetry == RBF_ANISOTROPIC && attempt % 2 ? 180 : 0);
		else if (scheme == 3)
			theta = attempt ? between(80, 89.4) : 0;
		else if (scheme == 4 && attempt % 5)
			phi = line + between(-.3, .3);
		else if (scheme == 5)
			theta = 15 * whole(6);
		if (symmetry == RBF_ISOTROPIC)
			phi = 0;
		polar(fabs(theta), phi, d);
		if (symmetry != RBF_ISOTROPIC) { /* a cluster at a mirror axis may reach across it */
			float f[3] = {(float)d[0], (float)d[1], (float)d[2]}, folded[3];
			rbf_mirror((unsigned)rbf_symmetry_fold(symmetry, f), f, folded);
			for (int n = 0; n < 2; n++)
				d[n] = copysign(d[n], (double)folded[n]);
		}
		int apart = 1;
		for (uint32_t b = 0; b < bases; b++)
			apart &= hypot(hypot(d[0] - direction[3*b], d[1] - direction[3*b + 1]), d[2] - direction[3*b + 2]) > .05 * DEGREE;
		if (apart)
			memcpy(direction + 3 * bases++, d, sizeof d);
	}
	return bases;
}

static int make(int number, subject *s)
{
	static const rbf_symmetry symmetry[] = {RBF_ANISOTROPIC, RBF_BILATERAL_X, RBF_BILATERAL_Y, RBF_UP, RBF_QUADRILATERAL, RBF_ISOTROPIC};
	double direction[3 * RANDOM_BASES];
	random_plan *p = &s->plan;
	memset(s, 0, sizeof *s);
	s->number = number;
	s->scheme = number % SCHEMES;
	p->symmetry = symmetry[whole(6)];
	while (p->frames < 1 + whole(RBF_MAX_FRAMES)) {
		const uint32_t map = whole(RBF_MAPS);
		int known = p->symmetry == RBF_ISOTROPIC && !rbf_map_get(map)->plane;
		for (uint32_t f = 0; f < p->frames; f++)
			known |= p->frame[f] == map;
		if (!known)
			p->frame[p->frames++] = map;
	}
	p->lobes = 1 + whole(40);
	p->kappa_low = between(.9, 3);
	p->kappa_high = number % 2 ? number % 6 == 1 ? 4e6 : 80000 : 2500; /* the fit's least width; 0.2 degrees; or so wide that quadrature by cells sees every lobe */
	p->motion = number % 5 < 2 ? between(.02, .6) : 0;
	p->channels = number % 3 ? 1 : 3;
	p->span = number % 4 ? 1 : 1e7;
	p->odd = number % 3 == 1;
	p->even = number % 7 < 3 ? whole(3) : 0;
	p->tuned = number % 5 == 3;
	p->limit = number % 4 == 1 ? between(1, 3) : number % 16 == 2;
	const uint32_t bases = incidences(p->symmetry, s->scheme, direction);
	s->seed = seed;
	s->model = random_model_at(p, bases, direction, s->seed);
	if (s->model)
		s->c = &s->model->component[BSDFRBF_RF];
	return s->model != NULL;
}

/* --------------------------------------------------------------- directions */

/* Incident directions: anywhere, at vertices, on edges, at the pole, near the horizon. z > 0. */
static void incident_of(const subject *s, int n, float d[3])
{
	const rbf_mesh *mesh = &s->c->mesh;
	const rbf_vertex *a = &mesh->vertex[whole(mesh->vertices)], *b = a;
	const double z = n % 8 == 7 ? between(1e-6, .02) : unit() + 1e-9, phi = between(0, 360), r = sqrt(1 - fmin(1, z*z));
	if (mesh->elements) {
		const rbf_element *e = &mesh->element[whole(mesh->elements)];
		a = &mesh->vertex[e->v[0]];
		b = &mesh->vertex[e->v[1]];
	}
	d[0] = (float)(r * cos(phi * DEGREE));
	d[1] = (float)(r * sin(phi * DEGREE));
	d[2] = (float)fmin(1, z);
	if (n % 8 == 1)
		memcpy(d, a->direction, sizeof a->direction);
	else if (n % 8 == 2) {
		const float t = (float)unit();
		for (int k = 0; k < 3; k++)
			d[k] = a->direction[k] + t * (b->direction[k] - a->direction[k]);
	} else if (n % 8 == 3 && n < 8) {
		d[0] = d[1] = 0;
		d[2] = 1;
	}
	if (!(d[2] > 0))
		d[2] = 1e-6f;
	rbf_normalize(d);
}

/* Exitant ones: where light goes, anywhere, towards maps' own special places. */
static void exitant_of(const subject *s, const float in[3], int n, float d[3])
{
	if (n % 3 == 0 && bsdfrbf_sample(s->model, in, 0, unit(), d))
		return;
	if (n % 7 == 1) {
		d[0] = n % 2 ? in[0] : -in[0];
		d[1] = n % 4 < 2 ? in[1] : -in[1];
		d[2] = in[2];
		return;
	}
	const double z = n % 5 == 4 ? between(1e-7, .01) : unit() + 1e-9, phi = between(0, 2 * RBF_PI), r = sqrt(1 - fmin(1, z*z));
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)fmin(1, z);
	rbf_normalize(d);
}

/* ------------------------------------------------------------------- checks */

static int sound(const float *v, int channels)
{
	for (int n = 0; n < channels; n++)
		if (!(v[n] >= 0 && isfinite(v[n])))
			return 0;
	return 1;
}

/* How much f changes over what the rounding of a direction moves it: a lot, beside f, at a vertex without light of its own that has
 * a bright one half a degree away, whose weight is then all there is; and where a shift takes an exitant direction to the horizon, as its
 * height there is the root of what the other components leave of 1: its length counts as well. */
static double rounding(const subject *s, const float in[3], const float out[3], float f)
{
	double most[2] = {0, 0};
	for (int which = 0; which < 2; which++) {
		const float *direction = which ? out : in;
		float axis[3][3];
		rbf_basis(direction, axis[0], axis[1]);
		memcpy(axis[2], direction, sizeof axis[2]);
		for (int side = 0; side < 6; side++) {
			const float most_step = side < 4 ? 3e-7f : 6e-8f, step = side % 2 ? most_step : -most_step, *along = axis[side / 2];
			float beside[3], value[3];
			for (int n = 0; n < 3; n++)
				beside[n] = direction[n] + step * along[n];
			if (!(beside[2] > 0))
				continue;
			bsdfrbf_eval_scatter(s->model, which ? in : beside, which ? beside : out, value);
			most[which] = fmax(most[which], fabs((double)(value[0] - f)));
		}
	}
	return 2 * (most[0] + most[1]);
}

/* Finite and not negative, whatever is asked; zero where there is no direction. Lengths do not matter. */
static void check_values(const subject *s, const float in[3], const float out[3])
{
	const int channels = bsdfrbf_channels(s->model);
	float value[3], scaled[3], low, high;
	bsdfrbf_eval(s->model, in, out, value);
	if (!sound(value, channels))
		failed(s, "f is %g at %.9g %.9g %.9g, %.9g %.9g %.9g", (double)value[0], (double)in[0], (double)in[1], (double)in[2], (double)out[0],
			(double)out[1], (double)out[2]);
	const float a[3] = {in[0] * 0x1p40f, in[1] * 0x1p40f, in[2] * 0x1p40f}, b[3] = {out[0] * 0x1p-30f, out[1] * 0x1p-30f, out[2] * 0x1p-30f};
	bsdfrbf_eval(s->model, a, b, scaled);
	/* what is a unit vector is made one again, which may change its last bits */
	if (!(fabsf(scaled[0] - value[0]) <= 1e-2f * value[0] + 1e-6f) && s->plan.kappa_high < 1e4
			&& !((double)fabsf(scaled[0] - value[0]) <= rounding(s, in, out, value[0])))
		failed(s, "f is %g for other lengths of the vectors, not %g", (double)scaled[0], (double)value[0]);
	const float pdf = bsdfrbf_pdf(s->model, in, out);
	bsdfrbf_resolution(s->model, in, out, 0, &low, &high);
	if (!sound(&pdf, 1) || !(low > 0 && high >= low && isfinite(high)))
		failed(s, "density %g, resolution %g to %g", (double)pdf, (double)low, (double)high);
	bsdfrbf_dhr(s->model, in, 0, value);
	if (!sound(value, channels))
		failed(s, "DHR is %g at z %g", (double)value[0], (double)in[2]);
	values += 4;
}

static void check_no_direction(const subject *s)
{
	static const float none[][3] = {{0, 0, 0}, {1, 0, 0}, {-.6f, .8f, 0}, {NAN, 0, 1}, {INFINITY, 0, 1}, {0, 0, -INFINITY}};
	const float up[3] = {.1f, .2f, .9f};
	for (size_t i = 0; i < sizeof none / sizeof *none; i++)
		for (int turn = 0; turn < 2; turn++) {
			float value[3] = {9, 9, 9}, out[3], low, high;
			bsdfrbf_eval(s->model, turn ? up : none[i], turn ? none[i] : up, value);
			if (value[0] != 0)
				failed(s, "f is %g where there is no direction", (double)value[0]);
			bsdfrbf_resolution(s->model, turn ? up : none[i], turn ? none[i] : up, 0, &low, &high);
			if (!(low > 0 && high >= low))
				failed(s, "resolution %g to %g where there is no direction", (double)low, (double)high);
			if (!turn && bsdfrbf_sample(s->model, none[i], 0, .5, out))
				failed(s, "a sample where there is no direction");
			values += 2;
		}
}

/* Float, vector instructions and culling against double, lobe by lobe. */
static void check_precision(const subject *s, const float in[3], const float out[3], double peak, double *worst)
{
	rbf_site site;
	float folded[3], value[3];
	double truth[3];
	rbf_site_locate(s->c, in, &site);
	rbf_site_fold(&site, out, folded);
	rbf_site_dsf(&site, folded, value);
	reference_dsf(&site, folded, truth);
	values++;
	for (uint32_t n = 0; n < s->c->channels; n++) {
		const double error = fabs((double)value[n] - truth[n]) / (truth[n] + 1e-4 * peak + 1e-20);
		*worst = fmax(*worst, error);
	}
}

/* The largest DSF among some samples. */
static double peak_of(const subject *s, const float in[3])
{
	double peak = 0;
	for (int i = 0; i < 20; i++) {
		float out[3], value[3];
		if (!bsdfrbf_sample(s->model, in, 0, (i + .5) / 20, out))
			return 0;
		bsdfrbf_eval_scatter(s->model, in, out, value);
		for (uint32_t n = 0; n < s->c->channels; n++)
			peak = fmax(peak, (double)(value[n] * out[2]));
	}
	return peak;
}

/* Mirrored, both vectors, nothing changes; isotropic, turned together. */
static void check_symmetry(const subject *s, const float in[3], const float out[3], double peak)
{
	float value[3], turned[3], a[3], b[3];
	bsdfrbf_eval_scatter(s->model, in, out, value);
	values++;
	if (s->plan.symmetry == RBF_ISOTROPIC) {
		if (in[2] > .99999f)
			return; /* lobes at random are not even about the normal, where there is no azimuth to turn them by */
		const double phi = between(0, 2 * RBF_PI), x = cos(phi), y = sin(phi);
		const float *from[2] = {in, out};
		float *to[2] = {a, b};
		for (int n = 0; n < 2; n++) {
			to[n][0] = (float)(x * (double)from[n][0] - y * (double)from[n][1]);
			to[n][1] = (float)(y * (double)from[n][0] + x * (double)from[n][1]);
			to[n][2] = from[n][2];
		}
		bsdfrbf_eval_scatter(s->model, a, b, turned);
		/* an angle error of 2e-7 between two vectors, relative to the narrowest lobe */
		const double tolerance = 1e-5 * sqrt(s->plan.kappa_high) + 1e-3;
		const double z = fmax((double)out[2], .01), apart = fabs((double)(value[0] - turned[0])) * z;
		if (apart > tolerance * (z * (double)value[0] + 1e-2 * peak) && apart > z * rounding(s, in, out, value[0]))
			failed(s, "turned by %.1f degrees, f is %g instead of %g (peak %g)", phi / DEGREE, (double)turned[0], (double)value[0], peak / z);
		return;
	}
	int op[4];
	const int ops = rbf_symmetry_ops(s->plan.symmetry, op);
	for (int k = 1; k < ops; k++) {
		if (in[0] == 0 || in[1] == 0)
			continue; /* on an axis a direction is its own image, but its exitance is not */
		rbf_mirror((unsigned)op[k], in, a);
		rbf_mirror((unsigned)op[k], out, b);
		bsdfrbf_eval_scatter(s->model, a, b, turned);
		if (memcmp(value, turned, s->c->channels * sizeof *value) != 0)
			failed(s, "mirrored by %d, f is %g instead of %g", op[k], (double)turned[0], (double)value[0]);
	}
}

/* Incident direction on the way across an edge, from -1 to 1. */
static void crossing(const double middle[3], const double across[3], double at, float in[3])
{
	for (int n = 0; n < 3; n++)
		in[n] = (float)(middle[n] + at * 2e-5 * across[n]);
	rbf_normalize(in);
}

static double dsf(const subject *s, const float in[3], const float out[3])
{
	float value[3];
	values++;
	bsdfrbf_eval_scatter(s->model, in, out, value);
	return (double)(value[0] * out[2]);
}

/* The same with the weights worked out in double, in the element that was found. Each is a sum of three products: in a triangle 2e-4 rad
 * wide float gets them wrong by 2e-4, which at a dark vertex, beside one 1e7 times as bright, is nearly all of its light and changes
 * with the last bit of the direction. Only this arithmetic is replaced: neither the choice of the element nor anything outside the mesh,
 * nor weights that are off by more than rounding. */
static double dsf_exact(const subject *s, const float in[3], const float out[3])
{
	const rbf_mesh *mesh = &s->c->mesh;
	const double f = dsf(s, in, out);
	rbf_query q;
	rbf_site site;
	uint32_t corner[3];
	float weight[3], folded[3], value[3], rise = 0;
	double w[3], sum = 0, clipped = 0;
	if (!rbf_query_pair(s->model, in, out, &q) || q.component != s->c || q.swapped)
		return f;
	rbf_site_turn(s->c, q.incident, &site);
	rbf_site_fold(&site, q.exitant, folded);
	const uint32_t item = rbf_mesh_locate(mesh, site.incident, corner, weight);
	if (item & RBF_MESH_BORDER)
		return f;
	const float incident[3] = {site.incident[0], site.incident[1], site.incident[2]};
	for (int k = 0; k < 3; k++) {
		const float *b = mesh->vertex[corner[(k + 1) % 3]].direction, *c = mesh->vertex[corner[(k + 2) % 3]].direction;
		double d[3], x[3], y[3]; /* differences, which are exact */
		for (int n = 0; n < 3; n++) {
			d[n] = (double)incident[n];
			x[n] = (double)b[n] - d[n];
			y[n] = (double)c[n] - d[n];
		}
		w[k] = d[0] * (x[1]*y[2] - x[2]*y[1]) + d[1] * (x[2]*y[0] - x[0]*y[2]) + d[2] * (x[0]*y[1] - x[1]*y[0]);
		sum += w[k];
		rise = fmaxf(rise, sqrtf(rbf_dot(mesh->element[item].inverse[k], mesh->element[item].inverse[k])));
	}
	for (int k = 0; k < 3; k++) {
		w[k] = fmax(w[k] / sum, 0);
		clipped += w[k];
	}
	rbf_site_place(s->c, item, weight, incident, &site);
	rbf_site_eval(&site, folded, value);
	if ((double)(value[0] * out[2]) != f)
		return f; /* not how the library came by it */
	for (int k = 0; k < 3; k++) {
		w[k] /= clipped;
		if (!(fabs(w[k] - (double)weight[k]) <= WEIGHT_ROUNDING * (double)rise))
			return f;
		weight[k] = (float)w[k];
	}
	rbf_site_place(s->c, item, weight, incident, &site);
	rbf_site_eval(&site, folded, value);
	return (double)(value[0] * out[2]);
}

/* Down to the last bits of the directions: the largest step left of what `of` says, relative to what is within .001 degrees. Slopes of
 * thin triangles and towards dark vertices are steep, and end in steps that are small beside the whole rise; a jump does not. */
static double step(const subject *s, const double middle[3], const double across[3], const float out[3], double peak,
	double of(const subject *s, const float in[3], const float out[3]))
{
	double low = -1, high = 1, f[3];
	float at[3];
	crossing(middle, across, low, at);
	f[0] = of(s, at, out);
	crossing(middle, across, high, at);
	f[2] = of(s, at, out);
	while (high - low > .004) { /* 8e-8 */
		const double half = (low + high) / 2;
		crossing(middle, across, half, at);
		f[1] = of(s, at, out);
		if (fabs(f[1] - f[0]) > fabs(f[2] - f[1])) {
			high = half;
			f[2] = f[1];
		} else {
			low = half;
			f[0] = f[1];
		}
	}
	double most = fmax(f[0], f[2]) + .1 * peak + 1e-30;
	for (int k = 0; k < RING && fabs(f[2] - f[0]) > JUMP * most; k++) {
		const double phi = 2 * RBF_PI * k / RING, along[3] = {across[1]*middle[2] - across[2]*middle[1],
			across[2]*middle[0] - across[0]*middle[2], across[0]*middle[1] - across[1]*middle[0]};
		double turned[3];
		for (int i = 0; i < 3; i++)
			turned[i] = cos(phi) * across[i] + sin(phi) * along[i];
		crossing(middle, turned, 1, at);
		most = fmax(most, of(s, at, out));
	}
	return fabs(f[2] - f[0]) / most;
}

/* Across an edge or a vertex. */
static void check_continuity(const subject *s, double *worst)
{
	const rbf_mesh *mesh = &s->c->mesh;
	if (!mesh->elements || s->plan.symmetry == RBF_ISOTROPIC)
		return;
	const rbf_element *e = &mesh->element[whole(mesh->elements)];
	const float *a = mesh->vertex[e->v[0]].direction, *b = mesh->vertex[e->v[1]].direction;
	const double t = unit() < .3 ? 0 : unit();
	double middle[3], across[3];
	for (int n = 0; n < 3; n++)
		middle[n] = (double)a[n] + t * (double)(b[n] - a[n]);
	across[0] = (double)(a[1]*b[2] - a[2]*b[1]);
	across[1] = (double)(a[2]*b[0] - a[0]*b[2]);
	across[2] = (double)(a[0]*b[1] - a[1]*b[0]);
	const double length = sqrt(across[0]*across[0] + across[1]*across[1] + across[2]*across[2]);
	for (int n = 0; n < 3; n++)
		across[n] /= length;
	float in[3];
	crossing(middle, across, 0, in);
	if (!(in[2] > 1e-3f))
		return;
	const double peak = peak_of(s, in);
	for (int n = 0; n < 6; n++) {
		float out[3];
		exitant_of(s, in, 3 * n, out);
		if (!(out[2] > .02f))
			continue;
		double jump = step(s, middle, across, out, peak, dsf);
		if (!(jump < JUMP)) /* a jump of f, or of float? Looked for anew: the one must not hide the other */
			jump = fmin(jump, step(s, middle, across, out, peak, dsf_exact));
		*worst = fmax(*worst, jump);
	}
}

/* Share of numbers from which a direction is to be drawn: the others are rejected as often as is tried. */
static double drawn_share(const bsdfrbf_model *model, const rbf_site *site, double arrives)
{
	rbf_sampler sampler;
	rbf_spot at;
	rbf_site_find(site, &at);
	rbf_sampler_set(site, rbf_draws_at(model, site->component, at.item), at.weight, &sampler);
	const double total = (double)site->scale * (double)sampler.total;
	return total > arrives ? 1 - pow(1 - arrives / total, RBF_SAMPLE_TRIES) : 1;
}

/* DHR of the table, and the samples, against quadrature. Not where frames carry nearly all out of the hemisphere: there hardly a draw is kept,
 * and DHR is that of lobes' tails. */
static void check_energy(const subject *s, double *table_error, double *lobe_error, double *deviate)
{
	question q = {.model = s->model};
	incident_of(s, (int)whole(7), q.incident);
	if (!(q.incident[2] > .05f))
		return;
	rbf_site site;
	double lobes[3];
	float table[3];
	const int y = bsdfrbf_channels(q.model) == 3;
	rbf_site_locate(s->c, q.incident, &site);
	rbf_site_dhr(&site, lobes);
	bsdfrbf_dhr_scatter(q.model, q.incident, 0, table);
	double apart;
	quadrature cells = quadrature_agreed(scattered, &q, bsdfrbf_channels(q.model), 2e-5, APART, &apart);
	const double truth = cells.total[y];
	if (!(apart <= APART))
		failed(s, "no two quadratures agree: %.2g apart, DHR %.3g, z %.3g", apart, truth, (double)q.incident[2]);
	apart_worst = fmax(apart_worst, apart);
	double sent = 0;
	for (uint32_t k = 0; k < site.corners; k++)
		for (uint32_t f = 0; f < s->c->frames; f++)
			sent += (double)site.part[k] * s->c->set[site.base[k] * s->c->frames + f].sent;
	if (truth < SEEN * sent)
		lost++;
	else if (truth > 1e-12) {
		int bins, drawn;
		*table_error = fabs((double)table[y] / truth - 1);
		*lobe_error = fabs((double)site.scale * lobes[y] / truth - 1);
		*deviate = chi_square_deviate(&q, &cells, SAMPLES, s->seed, &bins, &drawn);
		if (drawn < SAMPLES * (drawn_share(s->model, &site, truth) - .01) || bins < 2)
			failed(s, "%d of %d samples drawn, %d bins, DHR %.3g, z %.3g", drawn, SAMPLES, bins, truth, (double)q.incident[2]);
	}
	free(cells.cell);
}

static void stress(void **state)
{
	(void)state;
	double precision = 0, jump = 0, table_sum = 0, table_worst = 0, lobe_worst = 0;
	int energies = 0, table_beyond = 0;
	const double limit = chi_square_limit(SIGNIFICANCE, models / 2 + 1);
	const uint64_t start = seed;
	for (int m = first; m < first + models; m++) {
		subject s;
		seed = start + 0x9e3779b97f4a7c15u * (uint64_t)m; /* whatever the others asked for */
		double worst = 0, here = 0, table = -1, lobes = 0, deviate = -99;
		if (!make(m, &s)) {
			meshless++;
			continue;
		}
		tried++;
		check_no_direction(&s);
		for (int n = 0; n < QUERIES; n++) {
			float in[3], out[3];
			incident_of(&s, n, in);
			exitant_of(&s, in, n, out);
			const double peak = peak_of(&s, in);
			check_values(&s, in, out);
			check_precision(&s, in, out, peak, &worst);
			check_symmetry(&s, in, out, peak);
			if (n % 4 == 0)
				check_continuity(&s, &here);
		}
		if (getenv("STRESS_VERBOSE"))
			print_message("%d %s %c: precision %.2g jump %.2g\n", m, scheme_name[s.scheme], s.plan.symmetry, worst, here);
		if (!(worst < .02))
			failed(&s, "float is off by %.2g from double", worst);
		if (!(here < JUMP))
			failed(&s, "jumps by %.2g across an edge", here);
		precision = fmax(precision, worst);
		jump = fmax(jump, here);
		if (m % 2 == 0)
			check_energy(&s, &table, &lobes, &deviate);
		if (table >= 0) {
			energies++;
			table_sum += table;
			table_worst = fmax(table_worst, table);
			table_beyond += table > .05;
			lobe_worst = fmax(lobe_worst, lobes);
			if (getenv("STRESS_VERBOSE"))
				print_message("  table %.2g lobes %.2g chi %.1f\n", table, lobes, deviate);
			if (!(lobes < .03))
				failed(&s, "DHR over the lobes is off by %.2g", lobes);
			if (!(deviate < limit))
				failed(&s, "chi-square %.1f above its mean (limit %.1f)", deviate, limit);
		}
		bsdfrbf_close(s.model);
	}
	print_message("%ld models (%ld plans have no mesh), %ld values; float against double at most %.2g, jump across edges at most %.2g; "
		"%d incidences: two quadratures at most %.2g apart, DHR over the lobes off by at most %.2g, from the table %.2g on average, above .05 "
		"%d times; samples: chi-square of each; %ld more send nearly all below the horizon\n", tried, meshless, values, precision, jump,
		energies, apart_worst, lobe_worst, table_sum / energies, table_beyond, lost);
	assert_int_equal(failures, 0);
	assert_true(table_sum / energies < .02);
}

int main(void)
{
	const char *text = getenv("STRESS");
	if (text)
		models = atoi(text);
	text = getenv("STRESS_FIRST");
	if (text)
		first = atoi(text);
	text = getenv("STRESS_SEED");
	if (text)
		seed = strtoull(text, NULL, 10);
	const struct CMUnitTest tests[] = {cmocka_unit_test(stress)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
