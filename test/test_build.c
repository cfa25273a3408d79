/* SPDX-License-Identifier: BSD-3-Clause */
/* Builds from plans of all kinds, and what must hold for any model. */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "random_model.h"

static void vector(double theta, double phi, int below, float v[3])
{
	double d[3];
	polar(theta, phi, d);
	for (int n = 0; n < 3; n++)
		v[n] = (float)d[n];
	if (below)
		v[2] = -v[2];
}

static char *whole_file(const char *path, size_t *bytes)
{
	FILE *f = fopen(path, "rb");
	assert_non_null(f);
	fseek(f, 0, SEEK_END);
	*bytes = (size_t)ftell(f);
	rewind(f);
	char *text = malloc(*bytes + 1);
	assert_int_equal(fread(text, 1, *bytes, f), *bytes);
	fclose(f);
	return text;
}

static void same_bytes_for_any_threads(void **state)
{
	(void)state;
	static const plan small[] = {
		{"slats", 3, 3, {0, 30, 60}, -90, 90, 24},
		{"film", 4, 1, {0, 25, 50, 70}, 0, 0, 0},
	};
	const int threads[] = {1, 2, 8};
	for (size_t p = 0; p < sizeof small / sizeof *small; p++) {
		char *first = NULL;
		size_t length = 0;
		for (int t = 0; t < 3; t++) {
			const struct material *material = material_find(small[p].material);
			bsdfrbf_context *context = bsdfrbf_context_new();
			char path[64];
			size_t bytes;
			bsdfrbf_data *data = fixture_data(context, material->f, material->beams, material->transmits, material->coloured ? 3 : 1, &small[p]);
			bsdfrbf_model *made = fixture_build_data(context, data, small[p].lobes, threads[t]);
			snprintf(path, sizeof path, "/tmp/test_build.%d.rbf", (int)getpid());
			assert_int_equal(bsdfrbf_save(context, made, path), BSDFRBF_OK);
			char *text = whole_file(path, &bytes);
			unlink(path);
			if (!first) {
				first = text;
				length = bytes;
			} else {
				assert_int_equal(bytes, length);
				assert_memory_equal(first, text, length);
				free(text);
			}
			bsdfrbf_close(made);
			bsdfrbf_data_free(data);
			bsdfrbf_context_free(context);
		}
		free(first);
	}
}

/* Finite and not negative all over, DHR below `most`. */
static void check_sane(const bsdfrbf_model *m, float most)
{
	uint64_t seed = 4;
	const int channels = bsdfrbf_channels(m);
	for (int n = 0; n < 500; n++) {
		float in[3], out[3], value[3], smallest, largest;
		vector(n % 5 ? 90 * random_unit(&seed) : 89.9999, 360 * random_unit(&seed), random_unit(&seed) < .2, in);
		vector(n % 7 ? 90 * random_unit(&seed) : 89.9999, 360 * random_unit(&seed), random_unit(&seed) < .4, out);
		bsdfrbf_eval(m, in, out, value);
		for (int c = 0; c < channels; c++)
			assert_true(value[c] >= 0 && isfinite(value[c]));
		const float pdf = bsdfrbf_pdf(m, in, out);
		assert_true(pdf >= 0 && isfinite(pdf));
		bsdfrbf_dhr(m, in, n % 2, value);
		for (int c = 0; c < channels && n % 10 == 0; c++)
			assert_true(value[c] >= 0 && value[c] < most);
		bsdfrbf_resolution(m, in, n % 3 ? out : NULL, 0, &smallest, &largest);
		assert_true(smallest > 0 && largest >= smallest && isfinite(largest));
	}
}

static void values_are_finite(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++)
		check_sane(fixture_model[m], 1.05f);
}

static void unusual_plans(void **state)
{
	(void)state;
	static const plan odd[] = {
		{"film", 1, 1, {0}, 0, 0, 40},           /* normal incidence alone */
		{"film", 1, 1, {40}, 0, 0, 40},          /* one incidence */
		{"film", 2, 1, {0, 30}, 0, 0, 40},
		{"film", 2, 1, {30, 60}, 0, 0, 40},
		{"film", 3, 1, {10, 50, 89}, 0, 0, 40},
		{"brushed", 1, 4, {30}, 0, 30, 40},      /* one ring */
		{"brushed", 2, 4, {45, 89}, 0, 30, 40},
		{"redirect", 1, 6, {50}, 0, 60, 40},
	};
	for (size_t p = 0; p < sizeof odd / sizeof *odd; p++) {
		bsdfrbf_model *m = fixture_build(&odd[p]);
		check_sane(m, 1.5f);
		bsdfrbf_close(m);
	}
}

/* At a measured incidence the model says what was measured there. */
static void measured_incidences_are_met(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++) {
		const plan *p = &fixture_plan[m];
		const struct material *material = m == 1 ? &cats_eye_material : material_find(p->material);
		int transmit;
		const rbf_component *c = fixture_component(fixture_model[m], &transmit);
		const int channels = bsdfrbf_channels(fixture_model[m]), y = channels == 3;
		for (int t = 0; t < p->thetas; t++) {
			double in[3], difference = 0, total = 0;
			polar(p->theta[t], p->phi0, in);
			const float i[3] = {(float)in[0], (float)in[1], (float)in[2]};
			for (int n = 0; n < 800; n++) { /* even in projected solid angle */
				const double r = sqrt((n + .5) / 800), phi = 2 * RBF_PI * .6180339887 * n, z = sqrt(1 - r*r);
				const double out[3] = {r * cos(phi), r * sin(phi), transmit ? -z : z};
				const float o[3] = {(float)out[0], (float)out[1], (float)out[2]};
				double truth[3];
				float value[3];
				material->f(in, out, truth);
				bsdfrbf_eval(fixture_model[m], i, o, value);
				difference += fabs((double)value[y] - truth[y]);
				total += truth[y];
			}
			/* the fixtures have few lobes, and samples 5 degrees apart: too coarse for what grazing light makes of a brushed metal */
			if (!(difference < (p->theta[t] < 55 ? .17 : .45) * total))
				fail_msg("%s at %g degrees: L1 %.3f, %s", p->material, p->theta[t], difference / total, fixture_maps(c));
		}
	}
}

/* The last warning's text. */
static char last_warning[400];
static void keep_warning(void *user, const char *text)
{
	(void)user;
	warned++;
	snprintf(last_warning, sizeof last_warning, "%s", text);
}

/* Asked for as isotropic: incidences at other azimuths say whether it is. */
static void isotropy_is_checked(void **state)
{
	(void)state;
	static const plan plans[] = {{"brushed", 3, 2, {20, 40, 60}, 0, 90, 60}, {"satin", 3, 3, {20, 40, 60}, 0, 50, 60}};
	for (int n = 0; n < 2; n++) {
		const struct material *material = material_find(plans[n].material);
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = fixture_data(context, material->f, material->beams, material->transmits, 1, &plans[n]);
		bsdfrbf_build_options options;
		bsdfrbf_model *m;
		bsdfrbf_build_defaults(&options);
		options.lobes = plans[n].lobes;
		options.symmetry = 'I';
		last_warning[0] = 0;
		bsdfrbf_set_warning(context, keep_warning, NULL);
		assert_int_equal(bsdfrbf_build(context, data, &options, &m), BSDFRBF_OK);
		if ((strstr(last_warning, "differ from their images by") == NULL) != n)
			fail_msg("%s: '%s'", plans[n].material, last_warning);
		bsdfrbf_close(m);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* Builds a material, and tells what came of it and the last warning. */
static bsdfrbf_component_info info_of(const plan *p, char symmetry)
{
	const struct material *material = material_find(p->material);
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = fixture_data(context, material->f, material->beams, material->transmits, 1, p);
	bsdfrbf_build_options options;
	static char text[200];
	bsdfrbf_component_info info;
	bsdfrbf_model *m;
	bsdfrbf_build_defaults(&options);
	options.lobes = p->lobes;
	options.symmetry = symmetry;
	last_warning[0] = 0;
	bsdfrbf_set_warning(context, keep_warning, NULL);
	assert_int_equal(bsdfrbf_build(context, data, &options, &m), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_get_component_info(m, material->transmits ? BSDFRBF_TF : BSDFRBF_RF, &info), BSDFRBF_OK);
	snprintf(text, sizeof text, "%s", info.symmetry_text);
	info.symmetry_text = text; /* the model's goes */
	bsdfrbf_close(m);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return info;
}

/* Measured all round, an isotropic material is found to be so, and what was measured at each polar angle joined; others are not. */
static void isotropy_is_found(void **state)
{
	(void)state;
	static const plan plans[] = {{"satin", 3, 3, {0, 35, 70}, 0, 120, 120}, {"brushed", 3, 3, {0, 35, 70}, 0, 120, 60},
		{"satin", 3, 3, {0, 35, 70}, 0, 120, 120}};
	for (int n = 0; n < 3; n++) {
		const bsdfrbf_component_info info = info_of(&plans[n], n == 2 ? 'A' : 0);
		if (strncmp(info.symmetry_text, n ? "anisotropic" : "isotropic, by the data (azimuths 0 to 360", 11))
			fail_msg("%s: %s", plans[n].material, info.symmetry_text);
		assert_int_equal(info.incidences, n ? 7 : 3);
		assert_int_equal(strstr(last_warning, "taken as isotropic, not as anisotropic (azimuths 0 to 360 measured); -s decides otherwise") == NULL, n != 0);
	}
}

/* Measured all round at azimuths that are no images of each other, a material with two mirror planes is found to have these; one that is askew has none (and what
 * half a turn would add was measured); nor is any looked for where all are to be kept apart. */
static void images_are_found(void **state)
{
	(void)state;
	static const plan plans[] = {{"brushed", 4, 8, {0, 25, 50, 75}, 15, 45, 80}, {"askew", 4, 8, {0, 25, 50, 75}, 15, 45, 80},
		{"brushed", 4, 8, {0, 25, 50, 75}, 15, 45, 80}};
	static const char *const text[] = {"quadrilateral, mirrors x and y, by the data (azimuths 0 to 360", "anisotropic (azimuths",
		"anisotropic, asked for"};
	for (int n = 0; n < 3; n++) {
		const bsdfrbf_component_info info = info_of(&plans[n], n == 2 ? 'A' : 0);
		if (strncmp(info.symmetry_text, text[n], strlen(text[n])))
			fail_msg("%s: %s", plans[n].material, info.symmetry_text);
		assert_int_equal(info.incidences, n ? 25 : 13); /* half a turn apart: joined */
		assert_int_equal(strstr(last_warning, "not as anisotropic (azimuths 0 to 360 measured); -s A keeps them apart") == NULL, n > 0);
	}
}

/* Half a circle of azimuths is what a mirror image needs as well as half a turn: which of them it is, the data say. */
static void half_a_turn_is_found(void **state)
{
	(void)state;
	static const plan p = {"grooves", 4, 7, {0, 20, 40, 60}, 0, 30, 100};
	for (int asked = 0; asked < 2; asked++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = fixture_data(context, grooves, NULL, 0, 1, &p);
		bsdfrbf_build_options options;
		bsdfrbf_model *m;
		bsdfrbf_component_info info;
		const float in[3] = {-.45f, -.3f, .841f};
		const double i[3] = {(double)in[0], (double)in[1], (double)in[2]};
		double difference = 0, total = 0;
		bsdfrbf_build_defaults(&options);
		options.lobes = p.lobes;
		options.symmetry = asked ? 'B' : 0;
		last_warning[0] = 0;
		bsdfrbf_set_warning(context, keep_warning, NULL);
		assert_int_equal(bsdfrbf_build(context, data, &options, &m), BSDFRBF_OK);
		assert_int_equal(bsdfrbf_get_component_info(m, BSDFRBF_RF, &info), BSDFRBF_OK);
		assert_non_null(strstr(info.symmetry_text, asked ? "bilateral, mirror y, asked for" : "180 degrees (up), by the data (azimuths 0 to 180 measured)"));
		assert_non_null(strstr(last_warning, asked ? "differ from their images by" : "as 180 degrees (up), by the data (azimuths 0 to 180 measured): taken so; -s decides otherwise"));
		for (int q = 0; q < 2000; q++) { /* beyond what was measured: half a turn from it */
			const double r = sqrt((q + .5) / 2000), phi = 2 * RBF_PI * .6180339887 * q, out[3] = {r * cos(phi), r * sin(phi), sqrt(1 - r*r)};
			const float o[3] = {(float)out[0], (float)out[1], (float)out[2]};
			double truth[3];
			float value[3];
			grooves(i, out, truth);
			bsdfrbf_eval(m, in, o, value);
			difference += fabs((double)value[0] - truth[0]);
			total += truth[0];
		}
		print_message("%s: L1 %.4f\n", info.symmetry_text, difference / total);
		assert_true(asked ? difference > .2 * total : difference < .06 * total);
		bsdfrbf_close(m);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* No steps: queries a little apart, across edges and vertices of the mesh, differ a little. Across a mirror axis the fit of an
 * incidence that lies on it meets its own mirror image, and steps by the error of the fit. */
static void no_steps(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++) {
		int transmit;
		const rbf_component *c = fixture_component(fixture_model[m], &transmit);
		uint64_t seed = 6;
		double worst = 0;
		for (uint32_t e = 0; e < c->mesh.elements; e++)
			for (int side = 0; side < 3; side++) {
				const float *a = c->mesh.vertex[c->mesh.element[e].v[side]].direction, *b = c->mesh.vertex[c->mesh.element[e].v[(side + 1) % 3]].direction;
				for (int n = 0; n < 6; n++) {
					const float t = n < 2 ? (float)n : (float)random_unit(&seed);
					double edge[3], near[2][3];
					float value[2][3], dhr[2][3], out[3], in[2][3];
					for (int k = 0; k < 3; k++)
						edge[k] = (double)(a[k] + t * (b[k] - a[k]));
					const double length = sqrt(edge[0]*edge[0] + edge[1]*edge[1] + edge[2]*edge[2]), turn = 2 * RBF_PI * random_unit(&seed);
					for (int k = 0; k < 3; k++)
						edge[k] /= length;
					for (int s = 0; s < 2; s++) {
						around_axis(edge, 2e-5, turn + RBF_PI * s, near[s]);
						for (int k = 0; k < 3; k++)
							in[s][k] = (float)near[s][k];
					}
					const int mirrored = c->mesh.symmetry != RBF_ISOTROPIC
						&& rbf_symmetry_fold(c->mesh.symmetry, in[0]) != rbf_symmetry_fold(c->mesh.symmetry, in[1]);
					if (in[0][2] < .05f || in[1][2] < .05f)
						continue;
					vector(80 * random_unit(&seed), 360 * random_unit(&seed), transmit, out);
					for (int s = 0; s < 2; s++) {
						bsdfrbf_eval(fixture_model[m], in[s], out, value[s]);
						bsdfrbf_dhr(fixture_model[m], in[s], transmit, dhr[s]);
					}
					const int y = bsdfrbf_channels(fixture_model[m]) == 3;
					const double step = fabs((double)(value[0][y] - value[1][y])) / (.01 + (double)(value[0][y] + value[1][y]));
					worst = fmax(worst, mirrored ? .05 * step : step);
					assert_float_equal(dhr[0][y], dhr[1][y], 1e-3);
				}
			}
		if (!(worst < .02))
			fail_msg("%s: a step of %.3f", fixture_plan[m].material, worst);
	}
}

/* Slats end a beam between incidences; nothing else here does. */
static void cut_offs_are_found(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++) {
		int transmit, found = 0;
		bsdfrbf_component_info info;
		const rbf_component *c = fixture_component(fixture_model[m], &transmit);
		const bsdfrbf_component component = (bsdfrbf_component)(c - fixture_model[m]->component);
		assert_int_equal(bsdfrbf_get_component_info(fixture_model[m], component, &info), BSDFRBF_OK);
		for (int t = 0; t < info.triangles; t++) {
			const float disagreement = bsdfrbf_get_disagreement(fixture_model[m], component, t);
			assert_true(disagreement >= 0 && disagreement <= 3);
			found += disagreement > BSDFRBF_CUTOFF;
		}
		print_message("%s: %d of %d hold a cut-off\n", fixture_plan[m].material, found, info.triangles);
		assert_int_equal(found > 0, !strcmp(fixture_plan[m].material, "slats"));
		assert_true(bsdfrbf_get_disagreement(fixture_model[m], component, info.triangles) < 0);
		assert_true(bsdfrbf_get_disagreement(fixture_model[m], component, -1) < 0);
	}
}

/* The symmetry's operations change nothing. */
static void symmetry_holds(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++) {
		int transmit, ops[4] = {0};
		const rbf_component *c = fixture_component(fixture_model[m], &transmit);
		const int isotropic = c->mesh.symmetry == RBF_ISOTROPIC;
		const int count = isotropic ? 6 : rbf_symmetry_ops(c->mesh.symmetry, ops);
		uint64_t seed = 8;
		for (int n = 0; n < 500; n++) {
			const double t = 88 * random_unit(&seed), p = 360 * random_unit(&seed), s = 88 * random_unit(&seed), q = 360 * random_unit(&seed);
			float in[3], out[3], value[3], i[3], o[3], same[3];
			vector(t, p, 0, in);
			vector(s, q, transmit, out);
			bsdfrbf_eval(fixture_model[m], in, out, value);
			for (int k = 0; k < count; k++) {
				if (isotropic) {
					vector(t, p + 61 * k, 0, i);
					vector(s, q + 61 * k, transmit, o);
				} else {
					rbf_mirror((unsigned)ops[k], in, i);
					rbf_mirror((unsigned)ops[k], out, o);
				}
				bsdfrbf_eval(fixture_model[m], i, o, same);
				assert_float_equal(value[0], same[0], 2e-3f * value[0] + 1e-5f);
			}
		}
	}
}

static void vectors_of_all_kinds(void **state)
{
	(void)state;
	const float kind[][3] = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {NAN, 0, 1}, {0, 0, NAN}, {INFINITY, 0, 1}, {1e30f, 0, 1e30f},
		{1e-30f, 0, 1e-30f}, {1e-42f, 0, 1e-42f}, {3, 4, 12}, {-3, -4, -12}, {0, -0.f, 1}, {-1, 0, 1e-8f}, {3e38f, 3e38f, 3e38f}};
	const size_t kinds = sizeof kind / sizeof *kind;
	for (int m = 0; m < FIXTURES; m++)
		for (size_t i = 0; i < kinds; i++)
			for (size_t o = 0; o < kinds; o++) {
				float value[3], small, large, out[3];
				bsdfrbf_eval(fixture_model[m], kind[i], kind[o], value);
				assert_true(isfinite(value[0]) && value[0] >= 0);
				assert_true(isfinite(bsdfrbf_pdf(fixture_model[m], kind[i], kind[o])));
				bsdfrbf_resolution(fixture_model[m], kind[i], kind[o], 1, &small, &large);
				assert_true(small > 0 && large >= small);
				if (o < 2) {
					bsdfrbf_dhr(fixture_model[m], kind[i], (int)o, value);
					assert_true(isfinite(value[0]) && value[0] >= 0);
					bsdfrbf_sample(fixture_model[m], kind[i], (int)o, .3, out);
					assert_true(isfinite(out[0]) && isfinite(out[1]) && isfinite(out[2]));
				}
			}
	/* length does not matter */
	const float in[3] = {.3f, .1f, .9f}, out[3] = {-.2f, .1f, .8f}, in2[3] = {3, 1, 9}, out2[3] = {-.002f, .001f, .008f};
	float a[3], b[3];
	bsdfrbf_eval(fixture_model[2], in, out, a);
	bsdfrbf_eval(fixture_model[2], in2, out2, b);
	assert_true(a[1] > 0);
	assert_float_equal(a[1], b[1], 1e-4f * a[1]);
}

static void forked_processes(void **state)
{
	(void)state;
	float in[3], out[3], before[3], value[3];
	vector(40, 20, 0, in);
	vector(30, 200, 0, out);
	bsdfrbf_eval(fixture_model[2], in, out, before);
	pid_t child[3];
	for (int k = 0; k < 3; k++) {
		child[k] = fork();
		assert_true(child[k] >= 0);
		if (!child[k]) {
			int wrong = 0;
			for (int n = 0; n < 2000; n++) {
				float o[3];
				bsdfrbf_eval(fixture_model[2], in, out, value);
				wrong |= memcmp(before, value, sizeof before) != 0;
				wrong |= !bsdfrbf_sample(fixture_model[2], in, 0, (n + .5) / 2000, o);
			}
			_exit(wrong);
		}
	}
	for (int n = 0; n < 2000; n++) {
		bsdfrbf_eval(fixture_model[2], in, out, value);
		assert_memory_equal(before, value, sizeof before);
	}
	for (int k = 0; k < 3; k++) {
		int status;
		assert_int_equal(waitpid(child[k], &status, 0), child[k]);
		assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
	}
}

static void unusable_data(void **state)
{
	(void)state;
	const double in[3] = {0, 0, 1}, in2[3] = {.5, 0, .8660254};
	double out[200][3], zero[200] = {0}, one[200];
	bsdfrbf_model *made = (bsdfrbf_model *)out;
	for (int i = 0; i < 200; i++) {
		polar(85 * (i + .5) / 200, 137.5 * i, out[i]);
		one[i] = .2;
	}
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	assert_int_equal(bsdfrbf_build(context, data, NULL, &made), BSDFRBF_ERR_DATA);
	assert_null(made);
	assert_int_equal(bsdfrbf_data_add(context, data, in, 200, out[0], zero, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	assert_int_equal(bsdfrbf_data_add(context, data, in2, 200, out[0], zero, 1, BSDFRBF_QUANTITY_BSDF), BSDFRBF_OK);
	made = (bsdfrbf_model *)out;
	assert_int_equal(bsdfrbf_build(context, data, NULL, &made), BSDFRBF_ERR_DATA);
	assert_null(made);
	assert_true(strlen(bsdfrbf_message(context)) > 10);
	bsdfrbf_data_free(data);

	/* a perfect diffuser: nothing but the Lambertian part */
	data = bsdfrbf_data_new(context);
	bsdfrbf_data_add(context, data, in, 200, out[0], one, 1, BSDFRBF_QUANTITY_BSDF);
	bsdfrbf_data_add(context, data, in2, 200, out[0], one, 1, BSDFRBF_QUANTITY_BSDF);
	made = fixture_build_data(context, data, 0, 1);
	check_sane(made, .66f);
	float dhr[3];
	const float up[3] = {0, 0, 1};
	bsdfrbf_dhr(made, up, 0, dhr);
	assert_float_equal(dhr[0], .2 * RBF_PI, .01);
	bsdfrbf_close(made);
	bsdfrbf_data_free(data);

	/* incidences .1 degrees apart: one is used, with a word */
	data = bsdfrbf_data_new(context);
	const double near[3] = {sin(30.1 * DEGREE), 0, cos(30.1 * DEGREE)}, *three[3] = {in, in2, near};
	for (int k = 0; k < 3; k++)
		fixture_measure(context, data, material_find("film")->f, NULL, 0, 3, three[k]);
	warned = 0;
	made = fixture_build_data(context, data, 40, 1);
	assert_int_equal(warned, 1);
	bsdfrbf_component_info info;
	assert_int_equal(bsdfrbf_get_component_info(made, BSDFRBF_RF, &info), BSDFRBF_OK);
	assert_int_equal(info.incidences, 2);
	bsdfrbf_close(made);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

/* Reflects .9 of everything, and transmits share times |cos(incidence)| of it. */
static double transmitted;
static void bright(const double in[3], const double out[3], double xyz[3])
{
	xyz[0] = xyz[1] = xyz[2] = (out[2] > 0 ? .9 : transmitted * in[2]) / RBF_PI;
}

static void excess_of_light(void **state)
{
	(void)state;
	static const plan p = {"bright", 4, 1, {0, 25, 50, 75}, 0, 0, 40};
	const double share[2] = {.08, .16};           /* in all .98 at most; 1.06 at normal incidence, 1.045, 1.003, .94 */
	for (int n = 0; n < 2; n++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = fixture_data(context, bright, NULL, 0, 1, &p);
		bsdfrbf_component_info info;
		bsdfrbf_incidence_info one;
		bsdfrbf_model *made = NULL;
		transmitted = share[n];
		for (int t = 0; t < p.thetas; t++) {
			double in[3];
			polar(p.theta[t], 0, in);
			fixture_measure(context, data, bright, NULL, 1, 1, in);
		}
		warned = 0;
		bsdfrbf_set_warning(context, keep_warning, NULL);
		assert_int_equal(bsdfrbf_build(context, data, NULL, &made), BSDFRBF_OK);
		assert_int_equal(warned, 2 * n); /* as reflection, and as transmission */
		for (int c = BSDFRBF_RF; c <= BSDFRBF_TF; c += BSDFRBF_TF - BSDFRBF_RF) {
			assert_int_equal(bsdfrbf_get_component_info(made, (bsdfrbf_component)c, &info), BSDFRBF_OK);
			assert_int_equal(info.excess, 2 * n);
			for (int i = 0; i < info.incidences; i++) {
				assert_int_equal(bsdfrbf_get_incidence_info(made, (bsdfrbf_component)c, i, &one), BSDFRBF_OK);
				assert_float_equal(one.total, .9 + share[n] * (double)one.direction[2], .003);
			}
		}
		if (n)
			assert_non_null(strstr(last_warning, "front transmission (tf): reflected and transmitted light together exceeds 1 at 2 of 4 incidences, most at theta 0.0 phi 0.0 (1.06"));
		bsdfrbf_close(made);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

/* A mirror's peak of one degree among samples that are 5 degrees apart, one of them at its top: what the fit makes of it is wider, and more
 * than 1. Rings about it, which show its width, end that. */
static void coarse_peaks(void **state)
{
	(void)state;
	enum { SPIRAL = 900, RINGS = 12, AROUND = 12 };
	static double out[SPIRAL + RINGS * AROUND + 1][3], value[SPIRAL + RINGS * AROUND + 1];
	for (int fine = 0; fine < 2; fine++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_data *data = bsdfrbf_data_new(context);
		bsdfrbf_model *made = NULL;
		for (int t = 0; t < 4; t++) {
			double in[3], mirror[3];
			polar(20 * t, 0, in);
			polar(20 * t, 180, mirror);
			size_t n = 0;
			for (; n < SPIRAL; n++)
				polar(acos(1 - ((double)n + .5) / SPIRAL) / DEGREE, 137.508 * (double)n, out[n]);
			memcpy(out[n++], mirror, sizeof mirror);
			for (int i = 0; i < fine * RINGS * AROUND; i++)
				around_axis(mirror, .3 * (1 + i / AROUND) * DEGREE, 2 * RBF_PI * i / AROUND, out[n++]);
			for (size_t i = 0; i < n; i++) {
				const double x = out[i][0] - mirror[0], y = out[i][1] - mirror[1], z = out[i][2] - mirror[2];
				value[i] = .01 + .9 / (2 * RBF_PI * (DEGREE * DEGREE)) * exp(-.5 * (x*x + y*y + z*z) / (DEGREE * DEGREE)) * (fine ? 1.2 : 1);
			}
			assert_int_equal(bsdfrbf_data_add(context, data, in, n, out[0], value, 1, BSDFRBF_QUANTITY_DSF), BSDFRBF_OK);
		}
		last_warning[0] = 0;
		bsdfrbf_set_warning(context, keep_warning, NULL);
		assert_int_equal(bsdfrbf_build(context, data, NULL, &made), BSDFRBF_OK);
		assert_non_null(strstr(last_warning, "DHR exceeds 1"));
		if (!strstr(last_warning, fine ? "check the measurement's scale" : "narrower than the samples are apart (5.") || !strstr(last_warning, fine ? "" : "finer at the peak"))
			fail_msg("%s", last_warning);
		bsdfrbf_close(made);
		bsdfrbf_data_free(data);
		bsdfrbf_context_free(context);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(excess_of_light),
		cmocka_unit_test(coarse_peaks),
		cmocka_unit_test(same_bytes_for_any_threads),
		cmocka_unit_test(values_are_finite),
		cmocka_unit_test(unusual_plans),
		cmocka_unit_test(measured_incidences_are_met),
		cmocka_unit_test(isotropy_is_checked), cmocka_unit_test(isotropy_is_found), cmocka_unit_test(images_are_found), cmocka_unit_test(half_a_turn_is_found),
		cmocka_unit_test(no_steps),
		cmocka_unit_test(cut_offs_are_found),
		cmocka_unit_test(symmetry_holds),
		cmocka_unit_test(vectors_of_all_kinds),
		cmocka_unit_test(forked_processes),
		cmocka_unit_test(unusable_data),
	};
	return cmocka_run_group_tests(tests, fixture_setup, fixture_teardown);
}
