/* SPDX-License-Identifier: BSD-3-Clause */
/* An incident direction that was made ready answers as the functions that are asked once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "bsdfrbf.h"
#include "model_fixture.h"
#include "random_model.h"

enum { MODELS = 3, INCIDENCES = 40, QUESTIONS = 30 };
static bsdfrbf_model *model[MODELS];

static void direction(uint64_t *seed, float d[3])
{
	const double z = 2 * random_unit(seed) - 1, phi = 2 * RBF_PI * random_unit(seed), length = .5 + random_unit(seed);
	const double s = sqrt(1 - z*z);
	d[0] = (float)(length * s * cos(phi));
	d[1] = (float)(length * s * sin(phi));
	d[2] = (float)(length * z);
}

#define SAME(a, b) assert_memory_equal(a, b, sizeof(a))

/* All questions in any order, each by both ways. */
static void ask(const bsdfrbf_model *m, const float in[3], uint64_t *seed)
{
	bsdfrbf_incidence at, copy;
	memset(&at, 0xa5, sizeof at); /* whatever is in it */
	bsdfrbf_prepare(m, in, &at);
	for (int n = 0; n < QUESTIONS; n++) {
		float out[3], a[4] = {0}, b[4] = {0};
		const int kind = (int)(7 * random_unit(seed)), transmit = random_unit(seed) < .5;
		const double u = random_unit(seed);
		direction(seed, out);
		switch (kind) {
		case 0:
			bsdfrbf_eval(m, in, out, a);
			bsdfrbf_incidence_eval(&at, out, b);
			break;
		case 1:
			bsdfrbf_eval_scatter(m, in, out, a);
			bsdfrbf_incidence_eval_scatter(&at, out, b);
			SAME(a, b);
			if (u < .5)
				break;
			bsdfrbf_resolution(m, in, out, transmit, &a[0], &a[1]); /* known by now */
			bsdfrbf_incidence_resolution(&at, out, transmit, &b[0], &b[1]);
			break;
		case 2:
			bsdfrbf_dhr(m, in, transmit, a);
			bsdfrbf_incidence_dhr(&at, transmit, b);
			break;
		case 3:
			bsdfrbf_dhr_scatter(m, in, transmit, a);
			bsdfrbf_incidence_dhr_scatter(&at, transmit, b);
			break;
		case 4:
			a[3] = (float)bsdfrbf_sample(m, in, transmit, u, a);
			b[3] = (float)bsdfrbf_incidence_sample(&at, transmit, u, b);
			break;
		case 5:
			a[0] = bsdfrbf_pdf(m, in, out);
			b[0] = bsdfrbf_incidence_pdf(&at, out);
			break;
		default:
			bsdfrbf_resolution(m, in, n % 2 ? out : NULL, transmit, &a[0], &a[1]);
			bsdfrbf_incidence_resolution(&at, n % 2 ? out : NULL, transmit, &b[0], &b[1]);
		}
		SAME(a, b);
		if (n == QUESTIONS / 2) { /* it can be copied */
			copy = at;
			memset(&at, 0, sizeof at);
			at = copy;
		}
	}
}

static void answers_are_the_same(void **state)
{
	(void)state;
	uint64_t seed = 8;
	for (int k = 0; k < MODELS; k++)
		for (int i = 0; i < INCIDENCES; i++) {
			float in[3];
			direction(&seed, in);
			if (i < 3) { /* in the plane of the surface, no vector, no number */
				in[2] = 0;
				if (i)
					in[0] = in[1] = i == 2 ? NAN : 0;
			}
			if (!model[k]->component[BSDFRBF_TB].present && i % 8) /* reciprocity makes tables: not too many */
				in[2] = fabsf(in[2]);
			ask(model[k], in, &seed);
		}
}

/* A thread keeps the side that it sampled last: of that model, side and incidence alone. */
static void last_side_is_the_one_asked_for(void **state)
{
	(void)state;
	static const float in[2][3] = {{.3f, .2f, .8f}, {.3f, .2f, .9f}};
	uint64_t seed = 21;
	for (int n = 0; n < 200; n++) {
		const int k = (int)(MODELS * random_unit(&seed)), transmit = random_unit(&seed) < .5, d = random_unit(&seed) < .5;
		const double u = random_unit(&seed);
		bsdfrbf_incidence at;
		float a[4] = {0}, b[4] = {0};
		bsdfrbf_prepare(model[k], in[d], &at);
		a[3] = (float)bsdfrbf_sample(model[k], in[d], transmit, u, a);
		b[3] = (float)bsdfrbf_incidence_sample(&at, transmit, u, b);
		SAME(a, b);
	}
}

/* The last ones transmit from the front alone, and answer from the back by reciprocity. */
static int setup(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++) {
		random_plan p = random_plans[k];
		p.no_dhr = 1;
		model[k] = random_model(&p, 70 + (uint64_t)k);
		if (k) {
			model[k]->component[BSDFRBF_TF] = model[k]->component[BSDFRBF_RF];
			memset(&model[k]->component[BSDFRBF_RF], 0, sizeof model[k]->component[BSDFRBF_RF]);
		}
	}
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++)
		bsdfrbf_close(model[k]);
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(answers_are_the_same), cmocka_unit_test(last_side_is_the_one_asked_for)};
	return cmocka_run_group_tests(tests, setup, teardown);
}
