/* SPDX-License-Identifier: BSD-3-Clause */
/* DHR against the quadrature of what is evaluated, and against the samples' own account. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "question.h"

static const double theta_deg[] = {0, 20, 45, 60, 75, 80, 83, 85};
enum { INCIDENCES = sizeof theta_deg / sizeof *theta_deg };
static const double AVERAGE = .002, WORST = .005; /* over all incidences of a model */
static const double SWAPPED = .02;   /* by reciprocity: .012 at most, on slats, which cut off sharply */

static void quadrature_agrees(void **state)
{
	(void)state;
	uint64_t seed = 5;
	int failed = 0;
	for (int m = 0; m < FIXTURES; m++) {
		double sum = 0, worst = 0;
		int count = 0, transmit;
		fixture_component(fixture_model[m], &transmit);
		for (int t = 0; t < INCIDENCES; t++)
			for (int turn = 0; turn < 2; turn++) {
				question q = question_at(fixture_model[m], theta_deg[t], 360 * random_unit(&seed));
				float table[3];
				const int channels = bsdfrbf_channels(q.model);
				quadrature cells = quadrature_make(scattered, &q, channels, 1e-5);
				bsdfrbf_dhr_scatter(q.model, q.incident, transmit, table);
				for (int n = 0; n < channels; n++) {
					const double error = fabs((double)table[n] / cells.total[n] - 1);
					sum += error;
					worst = fmax(worst, error);
					count++;
				}
				free(cells.cell);
			}
		print_message("%s: DHR off by %.2f %% on average, at most %.2f %% at %d incidences\n", fixture_plan[m].material, 100 * sum / count,
			100 * worst, count);
		failed += !(sum / count < AVERAGE) || !(worst < WORST);
	}
	assert_int_equal(failed, 0);
}

/* A prism film that splits a beam: each part is deflected by a constant in cosine space, and one of them ends where it would leave beyond
 * the horizon. */
static int split_beams(const double in[3], double beam[][3])
{
	int beams = 0;
	for (int side = -1; side < 2; side += 2) {
		const double x = .35 * side - in[0], y = -in[1], z2 = 1 - x*x - y*y;
		if (z2 > 0) {
			const double d[3] = {x, y, -sqrt(z2)};
			memcpy(beam[beams++], d, sizeof d);
		}
	}
	return beams;
}

static void split(const double in[3], const double out[3], double xyz[3])
{
	double beam[2][3], f = .01;
	for (int b = split_beams(in, beam); b-- > 0;)
		f += .45 * 200 / RBF_PI * exp(400 * (beam[b][0]*out[0] + beam[b][1]*out[1] + beam[b][2]*out[2] - 1)) / fmax(-out[2], .05);
	xyz[0] = xyz[1] = xyz[2] = out[2] < 0 ? f : 0;
}

/* Within some triangles DHR falls to half. */
static void end_agrees(void **state)
{
	(void)state;
	const plan p = {"split", 7, 7, {0, 12, 24, 36, 48, 60, 72}, 0, 15, 64};
	bsdfrbf_model *model = fixture_build_of(&p, split, split_beams, 1, 1);
	double worst = 0;
	for (int i = 0; i < 24; i++) {
		question q = question_at(model, 44 + .6 * i, 30 + 41 * (i * .618 - floor(i * .618)));
		float table;
		quadrature cells = quadrature_make(scattered, &q, 1, 1e-5);
		bsdfrbf_dhr_scatter(q.model, q.incident, 1, &table);
		worst = fmax(worst, fabs((double)table / cells.total[0] - 1));
		free(cells.cell);
	}
	print_message("a beam that ends: DHR off by %.2f %% at most\n", 100 * worst);
	assert_true(worst < WORST);
	bsdfrbf_close(model);
}

/* From the back, light that was measured from the front: f(a, b) = f(b, a). */
static void swapped_agrees(void **state)
{
	(void)state;
	enum { SAMPLES = 20000, TURNS = 2 };
	int cases = 0;
	for (int m = 0; m < FIXTURES; m++)
		cases += fixture_model[m]->component[BSDFRBF_TF].present ? (INCIDENCES - 3) * TURNS : 0;
	assert_true(cases > 0);
	const double limit = chi_square_limit(.01, cases);
	for (int m = 0; m < FIXTURES; m++) {
		int transmit;
		if (fixture_component(fixture_model[m], &transmit) != &fixture_model[m]->component[BSDFRBF_TF])
			continue;
		double worst = 0, furthest = -10;
		for (int i = 0; i < (INCIDENCES - 3) * TURNS; i++) {
			const double theta = theta_deg[i / TURNS];
			question q = question_at(fixture_model[m], theta, 70. * i);
			float table[3];
			int bins, drawn;
			q.below = 0;
			q.incident[2] = -q.incident[2];
			quadrature cells = quadrature_make(scattered, &q, 1, 1e-5);
			bsdfrbf_dhr_scatter(q.model, q.incident, 1, table);
			const double error = fabs((double)table[0] / cells.total[0] - 1);
			if (!(error < SWAPPED))
				fail_msg("%s from the back at %g degrees: %.4f, by quadrature %.4f", fixture_plan[m].material, theta, (double)table[0], cells.total[0]);
			const double deviate = chi_square_deviate(&q, &cells, SAMPLES, (uint64_t)i, &bins, &drawn);
			assert_int_equal(drawn, SAMPLES);
			if (!(deviate < limit))
				fail_msg("%s from the back at %g degrees: samples are %.1f deviations off, limit %.1f", fixture_plan[m].material, theta, deviate, limit);
			worst = fmax(worst, error);
			furthest = fmax(furthest, deviate);
			free(cells.cell);
		}
		print_message("%s from the back: DHR off by %.2f %% at most, samples by %.1f deviations\n", fixture_plan[m].material, 100 * worst, furthest);
	}
}

/* Mean of a function over samples against its integral, relative to the integral of the density (DHR itself is judged above). */
static void samples_agree(void **state)
{
	(void)state;
	enum { SAMPLES = 20000 };
	uint64_t seed = 3;
	for (int m = 0; m < FIXTURES; m++) {
		int transmit;
		fixture_component(fixture_model[m], &transmit);
		const int y = bsdfrbf_channels(fixture_model[m]) == 3;
		for (int t = 0; t < INCIDENCES; t++) {
			question q = question_at(fixture_model[m], theta_deg[t], 29 * t);
			double mean = 0, expected = 0;
			for (int i = 0; i < SAMPLES; i++) {
				float o[3];
				assert_true(bsdfrbf_sample(q.model, q.incident, transmit, (i + random_unit(&seed)) / SAMPLES, o));
				mean += (double)(o[0] + .5f * o[1] + 1) / SAMPLES;
			}
			quadrature cells = quadrature_make(scattered, &q, bsdfrbf_channels(q.model), 3e-5);
			for (size_t i = 0; i < cells.cells; i++) {
				const quad_cell *leaf = &cells.cell[i];
				float o[3];
				quadrature_direction(leaf->x + leaf->size / 2, leaf->y + leaf->size / 2, o);
				if (leaf->child < 0)
					expected += (double)(o[0] + .5f * o[1] + 1) * leaf->value[y] / cells.total[y];
			}
			if (!(fabs(mean - expected) < .02))
				fail_msg("%s at %g degrees: samples %.4f, integral %.4f", fixture_plan[m].material, theta_deg[t], mean, expected);
			free(cells.cell);
		}
	}
}

static double dhr_of(const bsdfrbf_model *model, int transmit, double theta, double phi)
{
	double d[3];
	float dhr[3];
	polar(theta, phi, d);
	const float in[3] = {(float)d[0], (float)d[1], (float)d[2]};
	bsdfrbf_dhr(model, in, transmit, dhr);
	for (int n = 0; n < bsdfrbf_channels(model); n++)
		assert_true(dhr[n] >= 0 && dhr[n] < 1.02f);
	return (double)dhr[bsdfrbf_channels(model) == 3];
}

/* Beyond the last measured incidence DHR goes on as it came, without a step, and is never more than all light. */
static void goes_on_outside(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++) {
		const plan *p = &fixture_plan[m];
		const double edge = p->theta[p->thetas - 1], spacing = edge - p->theta[p->thetas - 2], phi = p->phi0 + p->phi_step;
		int transmit;
		const rbf_component *c = fixture_component(fixture_model[m], &transmit);
		const double lambertian = (double)c->lambertian[c->channels == 3];
		const double here = dhr_of(fixture_model[m], transmit, edge, phi) - lambertian;
		const double before = dhr_of(fixture_model[m], transmit, edge - spacing, phi) - lambertian;
		const double trend = log(here / before) / spacing;
		double last = here;
		for (double theta = edge + .25; theta < 89.95; theta += .25) {
			const double next = dhr_of(fixture_model[m], transmit, theta, phi) - lambertian, expected = here * exp(trend * (theta - edge));
			if (!(fabs(next / last - 1) < .02))
				fail_msg("%s: DHR %.4f at %g degrees, %.4f before", p->material, next, theta, last);
			if (p->phis == 1 && theta < edge + 2 && !(fabs(next - expected) < .35 * fabs(expected - here) + .003 * here))
				fail_msg("%s: DHR %.4f at %g degrees, %.4f at the edge, expected %.4f", p->material, next, theta, here, expected);
			last = next;
		}
	}
}

/* Sinks ever more steeply towards grazing incidence. */
static double sinking_dhr(double theta_deg)
{
	return 1 - .8 * pow(sin(theta_deg * DEGREE), 6);
}

static void sinking(const double in[3], const double out[3], double xyz[3])
{
	xyz[0] = xyz[1] = xyz[2] = sinking_dhr(acos(in[2]) / DEGREE) * 1.5 / RBF_PI * out[2];
}

/* What falls ever faster goes on so: with the slope of the last step alone it is 10 % too much. */
static void bends_outside(void **state)
{
	(void)state;
	static const plan p = {"sinking", 10, 1, {0, 8, 16, 24, 32, 40, 48, 56, 64, 72}, 0, 0, 100};
	bsdfrbf_model *m = fixture_build_of(&p, sinking, NULL, 0, 1);
	const double is = dhr_of(m, 0, 77, 0), truth = sinking_dhr(77);
	print_message("DHR 5 degrees outside: %.4f, truth %.4f\n", is, truth);
	assert_float_equal(is / truth, 1, .08);
	bsdfrbf_close(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bends_outside),
		cmocka_unit_test(quadrature_agrees),
		cmocka_unit_test(end_agrees),
		cmocka_unit_test(swapped_agrees),
		cmocka_unit_test(samples_agree),
		cmocka_unit_test(goes_on_outside),
	};
	return cmocka_run_group_tests(tests, fixture_setup, fixture_teardown);
}
