/* SPDX-License-Identifier: BSD-3-Clause */
/* Narrow beams with a haze about them that is a millionth as high, and as much light. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "fit.h"
#include "model_fixture.h"

enum { BASE = 2500, BEAM = 700, SAMPLES = BASE + BEAM, FAR = 3 }; /* FAR: degrees from the beam where there is nothing but haze */
static double outgoing[3 * SAMPLES];
static float dsf[SAMPLES];
static const rbf_incidence incidence = {.direction = {0, 0, 1}, .count = SAMPLES, .outgoing = outgoing, .dsf = dsf};

static double square(const double a[3], const double b[3])
{
	return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

typedef struct scene { double axis[3], kappa, peak, haze; } scene;

static double haze_at(const scene *s, const double o[3])
{
	return s->haze * (exp(-30 * square(s->axis, o)) + .02 * o[2]);
}

static double at(const scene *s, const double o[3])
{
	return s->peak * exp(-.5 * s->kappa * square(s->axis, o)) + haze_at(s, o);
}

/* A beam of `width` degrees at half its height, in samples as dense as it asks for, among such that are 2 degrees apart; 2 % noise. */
static void fit(scene *s, double width, rbf_lobes *lobes)
{
	const double radius = 3 * width * DEGREE;
	uint64_t seed = 5;
	float error;
	polar(25, 70, s->axis);
	s->kappa = 8 * log(2) / (width * width * DEGREE * DEGREE);
	for (int i = 0; i < SAMPLES; i++) {
		double *o = outgoing + 3*i, noise = 0;
		if (i < BASE)
			polar(acos(1 - .97 * (i + .5) / BASE) / DEGREE, 137.508 * i, o);
		else
			around_axis(s->axis, radius * pow((i - BASE + .5) / BEAM, .7), 2.39996 * i, o);
		for (int k = 0; k < 12; k++)
			noise += random_unit(&seed) - .5;
		dsf[i] = (float)(at(s, o) * (1 + .02 * noise));
	}
	const float none[3] = {0, 0, 0};
	assert_int_equal(rbf_fit(&incidence, 1, none, 150, 0, lobes, &error), 0);
}

static double fitted(const rbf_lobes *lobes, const double o[3])
{
	const float w[3] = {(float)o[0], (float)o[1], (float)o[2]};
	float value[3];
	rbf_lobes_sum(lobes, w, value);
	return (double)value[0];
}

/* Mean error over the mean, away from the beam. */
static double haze_error(const scene *s, const rbf_lobes *lobes)
{
	double difference = 0, total = 0;
	for (int i = 0; i < 4000; i++) {
		double o[3];
		polar(acos(1 - .95 * (i + .25) / 4000) / DEGREE, 271.9557 * i, o);
		if (square(o, s->axis) < FAR * DEGREE * FAR * DEGREE)
			continue;
		difference += fabs(fitted(lobes, o) - haze_at(s, o));
		total += haze_at(s, o);
	}
	return difference / total;
}

/* The same in the beam. */
static double beam_error(const scene *s, const rbf_lobes *lobes, double width)
{
	double difference = 0, total = 0;
	for (int i = 0; i < 2000; i++) {
		double o[3];
		around_axis(s->axis, 1.5 * width * DEGREE * sqrt((i + .5) / 2000), 2.39996 * i, o);
		difference += fabs(fitted(lobes, o) - at(s, o));
		total += at(s, o);
	}
	return difference / total;
}

static void meets(double width, double height, double beam_most, double haze_most)
{
	scene s = {.peak = 1, .haze = height};
	rbf_lobes lobes;
	fit(&s, width, &lobes);
	const double beam = beam_error(&s, &lobes, width), haze = haze_error(&s, &lobes);
	print_message("beam of %g degrees, haze of %g: errors %.4f, %.4f\n", width, height, beam, haze);
	assert_true(beam < beam_most && haze < haze_most);
	rbf_lobes_free(&lobes);
}

/* Beside a beam of half a degree. */
static void haze_is_kept(void **state)
{
	(void)state;
	meets(.5, 1e-4, .015, .08);
	meets(.5, 2e-6, .015, .25); /* it is a fifteenth of all light */
}

/* As narrow as the samples show it. */
static void beam_is_kept(void **state)
{
	(void)state;
	meets(.2, 2e-6, .015, .16);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(haze_is_kept), cmocka_unit_test(beam_is_kept)
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
