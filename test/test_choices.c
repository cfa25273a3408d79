/* SPDX-License-Identifier: BSD-3-Clause */
/* Choices that are labelled or measured together are as if each had been alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "left_out.h"
#include "model_fixture.h"
#include "random_model.h"
#include "settle.h"

typedef struct study {
	bsdfrbf_context *context;
	double direction[3 * RANDOM_BASES];
	rbf_fitted fitted;
} study;

/* Lobes at random, alike at all incidences but for how much light they have. */
static void begin(study *s)
{
	const random_plan *p = &random_plans[0];
	*s = (study){.context = bsdfrbf_context_new(), .fitted = {.symmetry = p->symmetry, .channels = 1}};
	rbf_fitted *m = &s->fitted;
	m->direction = s->direction;
	m->bases = random_rings(p, s->direction);
	assert_int_equal(rbf_mesh_build(s->context, p->symmetry, m->bases, s->direction, NULL, &m->mesh), BSDFRBF_OK);
	m->lobes = calloc(m->bases, sizeof *m->lobes);
	for (uint32_t b = 0; b < m->bases; b++) {
		rbf_lobes *l = &m->lobes[b];
		uint64_t seed = 5, own = b + 1;
		assert_int_equal(rbf_lobes_new(l, 60, 1), 0);
		for (uint32_t i = 0; i < l->count; i++) {
			const double z = random_unit(&seed), phi = 2 * RBF_PI * random_unit(&seed), sine = sqrt(1 - z*z);
			rbf_lobe_set(l, i, (const float[3]){(float)(sine * cos(phi)), (float)(sine * sin(phi)), (float)z}, 40);
			l->amplitude[i / RBF_LANES].a[i % RBF_LANES] = (float)(.5 + random_unit(&own));
			l->mass[i] = (double)rbf_lobe_amplitude(l, 0, i) * rbf_lobe_integral(40);
		}
		assert_int_equal(rbf_lobes_finish(l), 0);
	}
	assert_int_equal(rbf_label_prepare(m), 0);
}

static void end(study *s)
{
	for (uint32_t b = 0; b < s->fitted.bases; b++)
		rbf_lobes_free(&s->fitted.lobes[b]);
	free(s->fitted.lobes);
	rbf_label_release(&s->fitted);
	rbf_mesh_free(&s->fitted.mesh);
	bsdfrbf_context_free(s->context);
}

static rbf_choice choice_of(uint32_t one, uint32_t other, int settled)
{
	return (rbf_choice){.frames = 2, .frame = {one, other}, .belief = {.sharpness = .5f, .settled = settled}};
}

static size_t label_bytes(const rbf_fitted *m, const rbf_choice *c)
{
	return c->frames * m->lobe_first[m->bases] * sizeof *c->label;
}

static void same_labels(const rbf_fitted *m, const rbf_choice *a, const rbf_choice *b)
{
	assert_int_equal(a->frames, 2);
	assert_int_equal(b->frames, 2);
	assert_memory_equal(a->label, b->label, label_bytes(m, a));
	assert_memory_equal(a->share, b->share, 2 * sizeof *a->share);
}

/* Beams that lie on each other everywhere: settled once is what there is on the way to settled widely. */
static void settled_together(void **state)
{
	(void)state;
	study s;
	begin(&s);
	rbf_choice wide = choice_of(RBF_MAP_MIRROR, RBF_MAP_HALF, 2), once = choice_of(RBF_MAP_MIRROR, RBF_MAP_HALF, 1), alone[2] = {once, wide};
	assert_int_equal(rbf_choice_label_widely(&s.fitted, &wide, &once), 0);
	for (int n = 0; n < 2; n++)
		assert_int_equal(rbf_choice_label(&s.fitted, &alone[n]), 0);
	same_labels(&s.fitted, &once, &alone[0]);
	same_labels(&s.fitted, &wide, &alone[1]);
	assert_memory_not_equal(once.label, wide.label, label_bytes(&s.fitted, &wide)); /* else nothing was shown */
	for (int n = 0; n < 2; n++)
		rbf_choice_free(&alone[n]);
	rbf_choice_free(&wide);
	rbf_choice_free(&once);
	end(&s);
}

/* Beams that part: other lobes are settled widely, and the one choice tells nothing of the other. */
static void settled_apart(void **state)
{
	(void)state;
	study s;
	begin(&s);
	rbf_choice wide = choice_of(RBF_MAP_MIRROR, RBF_MAP_XFLIP, 2), once = choice_of(RBF_MAP_MIRROR, RBF_MAP_XFLIP, 1), alone = wide;
	assert_int_equal(rbf_choice_label_widely(&s.fitted, &wide, &once), 0);
	assert_int_equal(rbf_choice_label(&s.fitted, &alone), 0);
	same_labels(&s.fitted, &wide, &alone);
	assert_null(once.label);
	rbf_choice_free(&alone);
	rbf_choice_free(&wide);
	end(&s);
}

static void tuned_together(void **state)
{
	(void)state;
	study s;
	rbf_left_out b = {0};
	begin(&s);
	assert_int_equal(rbf_left_out_make(s.context, &s.fitted, .1f, 0, &b), BSDFRBF_OK);
	assert_true(b.trials > 3);
	rbf_choice labelled = choice_of(RBF_MAP_MIRROR, RBF_MAP_FIXED, 0);
	assert_int_equal(rbf_choice_label(&s.fitted, &labelled), 0);
	for (uint32_t even = 0; even < 3; even++) {
		rbf_choice one[3], together[3];
		for (int n = 0; n < 3; n++) {
			one[n] = labelled;
			one[n].even = even;
			one[n].tune = n + 1;
			together[n] = one[n];
			assert_int_equal(rbf_left_out_error(&b, &one[n], NULL), 0);
		}
		assert_int_equal(rbf_left_out_tuned(&b, 3, (rbf_choice *const[]){&together[0], &together[1], &together[2]}), 0);
		assert_true(one[0].error < one[1].error || one[0].error > one[1].error); /* else nothing was shown */
		for (int n = 0; n < 3; n++) {
			assert_memory_equal(&one[n].error, &together[n].error, sizeof one[n].error);
			assert_memory_equal(one[n].base_error, together[n].base_error, s.fitted.bases * sizeof *one[n].base_error);
			free(one[n].base_error);
			free(together[n].base_error);
		}
	}
	rbf_choice_free(&labelled);
	rbf_left_out_free(&b);
	end(&s);
}

/* One frame gets all there is; several are believed as far as they predict, whichever of them drop out on the way. */
static void labels_follow_predictions(void **state)
{
	(void)state;
	study s;
	begin(&s);
	const rbf_fitted *m = &s.fitted;
	const uint32_t lobes = m->lobe_first[m->bases], frame[3] = {RBF_MAP_MIRROR, RBF_MAP_FIXED, RBF_MAP_RETRO};
	float *label = malloc(3 * lobes * sizeof *label), share[3];
	rbf_label(m, 1, frame, (rbf_belief){.sharpness = 4}, label, share);
	assert_true(share[0] >= 1 && share[0] <= 1);
	for (uint32_t i = 0; i < lobes; i++)
		assert_true(label[i] >= 1 && label[i] <= 1);
	for (uint32_t i = 0; i < lobes; i++) /* next to nothing of it, but for one where the others are nothing beside it */
		m->candidate[RBF_MAP_RETRO].prediction[i] = i == 7 ? 900 : -900;
	rbf_label(m, 3, frame, (rbf_belief){.sharpness = .5f}, label, share);
	assert_true(share[2] <= 0);
	int both = 0;
	double first = 0;
	for (uint32_t i = 0; i < lobes; i++) {
		const double told = .5 * ((double)m->candidate[frame[0]].prediction[i] - (double)m->candidate[frame[1]].prediction[i]);
		assert_true(label[2 * lobes + i] <= 0);
		assert_float_equal((double)(label[i] + label[lobes + i]), 1, 1e-6);
		if (!(label[i] > .01f) || !(label[lobes + i] > .01f))
			continue;
		const double beyond = log((double)(label[i] / label[lobes + i])) - told; /* what the shares say, of all alike */
		first = both++ ? first : beyond;
		assert_float_equal(beyond, first, 1e-4);
	}
	assert_true(both > 20);
	free(label);
	end(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(labels_follow_predictions),
		cmocka_unit_test(settled_together),
		cmocka_unit_test(settled_apart),
		cmocka_unit_test(tuned_together),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
