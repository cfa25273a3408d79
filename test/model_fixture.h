/* SPDX-License-Identifier: BSD-3-Clause */
/* Models built in the process from the analytic materials of materials.h. Include after cmocka.h. */
#ifndef TEST_MODEL_FIXTURE_H
#define TEST_MODEL_FIXTURE_H
#include "materials.h"
#include "../libbsdfrbf/arrays.h"
#include "../libbsdfrbf/map.h"

#include <stdlib.h>

#define DEGREE (RBF_PI / 180)

/* Where a material is measured, degrees; phi over phis steps from phi0. */
typedef struct plan {
	const char *material;    /* of materials.h, or "cat's eye" */
	int thetas, phis;
	double theta[10], phi0, phi_step;
	int lobes;
} plan;

static inline void polar(double theta_deg, double phi_deg, double d[3])
{
	d[0] = sin(theta_deg * DEGREE) * cos(phi_deg * DEGREE);
	d[1] = sin(theta_deg * DEGREE) * sin(phi_deg * DEGREE);
	d[2] = cos(theta_deg * DEGREE);
	if (theta_deg == 0)
		d[0] = d[1] = 0;
}

static inline double random_unit(uint64_t *state) /* SplitMix64 */
{
	uint64_t z = *state += 0x9e3779b97f4a7c15u;
	z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
	z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
	return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

typedef void bsdf(const double in[3], const double out[3], double xyz[3]);
typedef int maxima(const double in[3], double beam[][3]);

/* Direction at a distance and azimuth from an axis. */
static inline void around_axis(const double axis[3], double angle, double azimuth, double d[3])
{
	const double s = axis[2] < 0 ? -1 : 1, a = -1 / (s + axis[2]), b = axis[0] * axis[1] * a;
	const double t[3] = {1 + s*axis[0]*axis[0]*a, s*b, -s*axis[0]}, u[3] = {b, s + axis[1]*axis[1]*a, -axis[1]};
	for (int k = 0; k < 3; k++)
		d[k] = sin(angle) * (cos(azimuth)*t[k] + sin(azimuth)*u[k]) + cos(angle) * axis[k];
}

enum { FIXTURE_BASE = 900, FIXTURE_RINGS = 14, FIXTURE_AROUND = 14, FIXTURE_SAMPLES = FIXTURE_BASE + 4 * FIXTURE_RINGS * FIXTURE_AROUND + 4 };

/* Ruled along an axis at 30 degrees: a beam keeps its component along the ruling, and loses the one across it. */
static const double ruled[2] = {.8660254038, .5};

static inline void grooves(const double in[3], const double out[3], double xyz[3])
{
	const double along = in[0] * ruled[0] + in[1] * ruled[1];
	const double x = out[0] + along * ruled[0], y = out[1] + along * ruled[1];
	const double u = x * ruled[0] + y * ruled[1], v = y * ruled[0] - x * ruled[1];
	xyz[0] = xyz[1] = xyz[2] = .05 + 2 * exp(-.5 * (u*u / (.12 * .12) + v*v / (.3 * .3)));
}

/* Sends light back whence it came. */
static inline void cats_eye(const double in[3], const double out[3], double xyz[3])
{
	const double d2 = (in[0]-out[0]) * (in[0]-out[0]) + (in[1]-out[1]) * (in[1]-out[1]) + (in[2]-out[2]) * (in[2]-out[2]);
	xyz[0] = xyz[1] = xyz[2] = out[2] > 0 ? (.5 * 150 / (2*RBF_PI) * exp(-75 * d2) * (.3 + .7*in[2])) / fmax(out[2], .03) : 0;
}

static inline int cats_eye_beams(const double in[3], double beam[][3])
{
	memcpy(beam[0], in, 3 * sizeof *in);
	return 1;
}

static const struct material cats_eye_material = {.name = "cat's eye", .symmetry = "isotropic", .f = cats_eye, .beams = cats_eye_beams};

/* One incidence: an even spiral over the hemisphere, and rings around the beams (radius 0.3 to 25 degrees). */
static inline void fixture_measure(bsdfrbf_context *context, bsdfrbf_data *data, bsdf *f, maxima *beams, int transmits,
	int channels, const double in[3])
{
	static double out[FIXTURE_SAMPLES][3], value[FIXTURE_SAMPLES * 3];
	double beam[4][3];
	const int count = beams ? beams(in, beam) : 0;
	size_t n = 0;
	for (int i = 0; i < FIXTURE_BASE; i++) {
		const double z = (i + .5) / FIXTURE_BASE, phi = 2 * RBF_PI * .6180339887 * i, s = sqrt(1 - z*z);
		out[n][0] = s * cos(phi);
		out[n][1] = s * sin(phi);
		out[n++][2] = transmits ? -z : z;
	}
	for (int b = 0; b < count; b++) {
		for (int r = 0; r < FIXTURE_RINGS; r++)
			for (int a = 0; a < FIXTURE_AROUND; a++) {
				double d[3];
				around_axis(beam[b], .3 * pow(25 / .3, r / (FIXTURE_RINGS - 1.)) * DEGREE, 2 * RBF_PI * (a + .5 * (r % 2)) / FIXTURE_AROUND, d);
				if (fabs(d[2]) > .01 && (d[2] < 0) == transmits)
					memcpy(out[n++], d, sizeof d);
			}
		if (fabs(beam[b][2]) > .01)
			memcpy(out[n++], beam[b], sizeof beam[b]);
	}
	for (size_t i = 0; i < n; i++) {
		double xyz[3];
		f(in, out[i], xyz);
		for (int c = 0; c < channels; c++)
			value[i * (size_t)channels + (size_t)c] = channels == 3 ? xyz[c] : xyz[1];
	}
	assert_int_equal(bsdfrbf_data_add(context, data, in, n, out[0], value, channels, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
}

/* Warnings go to `warned`, a counter. */
static int warned;
static void count_warning(void *user, const char *text)
{
	(void)user;
	(void)text;
	warned++;
}

static inline bsdfrbf_data *fixture_data(bsdfrbf_context *context, bsdf *f, maxima *beams, int transmits, int channels, const plan *p)
{
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	assert_non_null(data);
	for (int t = 0; t < p->thetas; t++)
		for (int a = 0; a < (p->theta[t] > 0 ? p->phis : 1); a++) {
			double in[3];
			polar(p->theta[t], p->phi0 + a * p->phi_step, in);
			fixture_measure(context, data, f, beams, transmits, channels, in);
		}
	return data;
}

static inline bsdfrbf_model *fixture_build_data(bsdfrbf_context *context, bsdfrbf_data *data, int lobes, int threads)
{
	bsdfrbf_build_options options;
	bsdfrbf_model *model;
	bsdfrbf_build_defaults(&options);
	options.lobes = lobes;
	options.threads = threads;
	bsdfrbf_set_warning(context, count_warning, NULL);
	if (bsdfrbf_build(context, data, &options, &model) != BSDFRBF_OK)
		fail_msg("%s", bsdfrbf_message(context));
	return model;
}

/* Measured by a plan, and built; to be closed. */
static inline bsdfrbf_model *fixture_build_of(const plan *p, bsdf *f, maxima *beams, int transmits, int channels)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	assert_non_null(context);
	bsdfrbf_data *data = fixture_data(context, f, beams, transmits, channels, p);
	bsdfrbf_model *model = fixture_build_data(context, data, p->lobes, 2);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return model;
}

static inline bsdfrbf_model *fixture_build(const plan *p)
{
	const struct material *m = strcmp(p->material, cats_eye_material.name) ? material_find(p->material) : &cats_eye_material;
	assert_non_null(m);
	return fixture_build_of(p, m->f, m->beams, m->transmits, m->coloured ? 3 : 1);
}

/* The component that was measured, and its maps as a line of text. */
static inline const rbf_component *fixture_component(const bsdfrbf_model *model, int *transmit)
{
	*transmit = 0;
	for (int i = 0; i < 4; i++)
		if (model->component[i].present) {
			*transmit = i >= BSDFRBF_TF;
			return &model->component[i];
		}
	fail_msg("no component");
	return NULL;
}

static inline const char *fixture_maps(const rbf_component *c)
{
	static char text[100];
	text[0] = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		strcat(text, f ? " " : "");
		strcat(text, rbf_map_name(c->frame[f]));
	}
	strcat(text, c->residual ? " + residual" : "");
	return text;
}

/* The materials that between them call for every map. */
static const plan fixture_plan[] = {
	{"satin", 8, 1, {0, 15, 30, 45, 58, 68, 76, 82}, 0, 0, 120},
	{"cat's eye", 8, 1, {0, 15, 30, 45, 58, 68, 76, 82}, 0, 0, 120},
	{"film", 9, 1, {0, 15, 30, 45, 58, 68, 76, 82, 88}, 0, 0, 120},
	{"brushed", 6, 4, {0, 20, 40, 57, 72, 84}, 0, 30, 64},
	{"grating", 5, 4, {0, 20, 40, 58, 74}, 0, 60, 64},
	{"slats", 4, 4, {0, 25, 50, 74}, -90, 60, 64},
};
enum { FIXTURES = sizeof fixture_plan / sizeof *fixture_plan };

/* Builds all of them, and closes them again. */
static bsdfrbf_model *fixture_model[FIXTURES];

/* Group setup and teardown: all of them. */
static inline int fixture_setup(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++)
		fixture_model[m] = fixture_build(&fixture_plan[m]);
	return 0;
}

static inline int fixture_teardown(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++)
		bsdfrbf_close(fixture_model[m]);
	return 0;
}
#endif
