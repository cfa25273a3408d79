/* SPDX-License-Identifier: BSD-3-Clause */
/* Processes that build together, here threads with a barrier: they end with what one alone makes, or all know that one gave up. */
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "learn.h"
#include "model_fixture.h"
#include "random_model.h"
#include "team.h"

enum { MOST = 5 };

typedef struct crew {
	pthread_barrier_t barrier;
	int size;
	void *post[MOST];
	int left[MOST];       /* calls of gather() that go well; < 0: all */
} crew;

typedef struct member {
	rbf_team team;
	crew *crew;
	void (*work)(struct member *, void *);
	void *job;
} member;

static int gather(void *user, void *blocks, const size_t *bytes)
{
	member *m = user;
	crew *c = m->crew;
	size_t at = 0;
	if (!c->left[m->team.rank]--)
		return -1;
	c->post[m->team.rank] = blocks;
	pthread_barrier_wait(&c->barrier);
	for (int r = 0; r < c->size; r++) {
		if (r != m->team.rank)
			memcpy((char *)blocks + at, (char *)c->post[r] + at, bytes[r]);
		at += bytes[r];
	}
	pthread_barrier_wait(&c->barrier);
	return 0;
}

static void *run(void *user)
{
	member *m = user;
	m->work(m, m->job);
	return NULL;
}

/* Lets `size` members do the same work, which may call gather() `calls` times. */
static void together(int size, int calls, void (*work)(member *, void *), void *job)
{
	crew c = {.size = size};
	member m[MOST];
	pthread_t thread[MOST];
	pthread_barrier_init(&c.barrier, NULL, (unsigned)size);
	for (int r = 0; r < size; r++) {
		c.left[r] = calls;
		m[r] = (member){.team = {.rank = r, .size = size, .gather = gather, .user = &m[r]}, .crew = &c, .work = work, .job = job};
	}
	for (int r = 0; r < size; r++)
		assert_int_equal(pthread_create(&thread[r], NULL, run, &m[r]), 0);
	for (int r = 0; r < size; r++)
		pthread_join(thread[r], NULL);
	pthread_barrier_destroy(&c.barrier);
}

/* ------------------------------------------------------------------- rows */

typedef struct rows { size_t items, each; uint64_t *first; int wrong; } rows;

static unsigned char byte_of(size_t item, size_t place)
{
	return (unsigned char)(item * 131 + place * 29 + 7);
}

static void share_rows(member *m, void *job)
{
	rows *r = job;
	const uint64_t total = r->first[r->items];
	unsigned char *data = calloc(total + 1, 1);
	for (size_t i = 0; i < r->items; i++)
		for (uint64_t k = r->first[i]; k < r->first[i + 1] && rbf_team_mine(&m->team, i); k += total > 1000000 ? 1009 : 1)
			data[k] = byte_of(i, k);
	if (r->each ? rbf_team_share_rows(&m->team, r->items, r->each, data) : rbf_team_share(&m->team, r->items, r->first, data))
		r->wrong = 1;
	for (size_t i = 0; i < r->items; i++)
		for (uint64_t k = r->first[i]; k < r->first[i + 1]; k += total > 1000000 ? 1009 : 1)
			r->wrong |= data[k] != byte_of(i, k);
	free(data);
}

static void every_row_reaches_all(void **state)
{
	(void)state;
	uint64_t seed = 5;
	for (int size = 1; size <= MOST; size++)
		for (size_t items = 0; items < 14; items++)
			for (size_t each = 0; each < 4; each += 3) {
				rows r = {.items = items, .each = each, .first = calloc(items + 1, sizeof *r.first)};
				for (size_t i = 0; i < items; i++)
					r.first[i + 1] = r.first[i] + (each ? each : (size_t)(random_unit(&seed) * 40));
				together(size, -1, share_rows, &r);
				free(r.first);
				assert_false(r.wrong);
			}
	/* in several rounds, none of which starts at rank 0 */
	rows large = {.items = 11, .first = calloc(12, sizeof *large.first)};
	for (size_t i = 0; i < large.items; i++)
		large.first[i + 1] = large.first[i] + (i % 4 == 1 ? 17u << 20 : 3u << 20);
	together(3, -1, share_rows, &large);
	free(large.first);
	assert_false(large.wrong);
}

typedef struct lowest { int failing; float value[MOST]; int failed[MOST], wrong; } lowest;

static void share_lowest(member *m, void *job)
{
	lowest *l = job;
	float value = l->value[m->team.rank];
	l->wrong |= rbf_team_lowest(&m->team, &value) || value != -2;
	l->failed[m->team.rank] = rbf_team_failed(&m->team, m->team.rank == l->failing);
}

static void lowest_value_and_failure(void **state)
{
	(void)state;
	for (int failing = -1; failing < 4; failing++) {
		lowest l = {.failing = failing, .value = {1, 0, -2, 5}};
		together(4, -1, share_lowest, &l);
		assert_false(l.wrong);
		for (int r = 0; r < 4; r++)
			assert_int_equal(l.failed[r], failing >= 0);
	}
}

/* ------------------------------------------------------------------- build */

typedef struct task {
	const plan *plan;
	bsdfrbf_status status[MOST];
	char *bytes[MOST];
	size_t length[MOST];
	int residual, filled;
} task;

static void build(member *m, void *job)
{
	task *t = job;
	const int rank = m ? m->team.rank : 0;
	const struct material *material = material_find(t->plan->material);
	bsdfrbf_context *context = bsdfrbf_context_new();
	static pthread_mutex_t fixture = PTHREAD_MUTEX_INITIALIZER; /* it measures in memory of its own */
	pthread_mutex_lock(&fixture);
	bsdfrbf_data *data = fixture_data(context, material->f, material->beams, material->transmits, material->coloured ? 3 : 1, t->plan);
	pthread_mutex_unlock(&fixture);
	if (t->plan->theta[t->plan->thetas - 1] > 75) /* exitance is measured less far */
		assert_int_equal(bsdfrbf_data_cull(context, data, 20, NULL), BSDFRBF_OK);
	bsdfrbf_build_options options;
	bsdfrbf_model *model = NULL;
	bsdfrbf_build_defaults(&options);
	options.threads = m ? 1 : 2;
	options.lobes = t->plan->lobes;
	options.team = m ? &m->team : NULL;
	t->status[rank] = bsdfrbf_build(context, data, &options, &model);
	if (t->status[rank] == BSDFRBF_OK) {
		for (int c = 0; c < 4; c++)
			if (!m) {
				t->residual |= (int)model->component[c].residual;
				t->filled |= model->component[c].filled > 0;
			}
		char path[64];
		snprintf(path, sizeof path, "/tmp/test_team.%d.%d.rbf", (int)getpid(), rank);
		if (bsdfrbf_save(context, model, path) == BSDFRBF_OK) {
			FILE *f = fopen(path, "rb");
			fseek(f, 0, SEEK_END);
			t->length[rank] = (size_t)ftell(f);
			rewind(f);
			t->bytes[rank] = malloc(t->length[rank]);
			t->length[rank] = fread(t->bytes[rank], 1, t->length[rank], f);
			fclose(f);
		}
		unlink(path);
	}
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

static const plan plans[] = {
	{"slats", 3, 3, {0, 30, 60}, -90, 90, 24},
	{"film", 4, 1, {0, 25, 50, 70}, 0, 0, 0}, /* number of lobes from the data; three channels */
	{"translucent", 5, 1, {0, 20, 40, 60, 80}, 0, 0, 80}, /* residual motion */
	{"film", 5, 1, {0, 20, 40, 60, 80}, 0, 0, 0}, /* filled from other incidences */
};

static void same_bytes_for_any_team(void **state)
{
	(void)state;
	for (size_t p = 0; p < sizeof plans / sizeof *plans; p++) {
		task alone = {.plan = &plans[p]}, team = alone;
		build(NULL, &alone);
		assert_int_equal(alone.status[0], BSDFRBF_OK);
		if (p < 3)
			assert_int_equal(alone.residual, p == 2);
		assert_int_equal(alone.filled, p == 3);
		const int size = p ? 2 : 3;
		together(size, -1, build, &team);
		for (int r = 0; r < size; r++) {
			assert_int_equal(team.status[r], BSDFRBF_OK);
			assert_int_equal(team.length[r], alone.length[0]);
			assert_memory_equal(team.bytes[r], alone.bytes[0], alone.length[0]);
			free(team.bytes[r]);
		}
		free(alone.bytes[0]);
	}
}

/* Wherever in the build a process gives up, the others end as well. */
static void one_that_gives_up(void **state)
{
	(void)state;
	const int calls[] = {0, 1, 2, 4, 6, 15, 50};
	for (size_t n = 0; n < sizeof calls / sizeof *calls; n++) {
		task t = {.plan = &plans[0]};
		together(2, calls[n], build, &t);
		for (int r = 0; r < 2; r++)
			assert_int_equal(t.status[r], BSDFRBF_ERR_MEMORY);
	}
}

static void wrong_teams(void **state)
{
	(void)state;
	const bsdfrbf_team wrong[] = {{.rank = 0, .size = 0, .gather = gather}, {.rank = 2, .size = 2, .gather = gather},
		{.rank = -1, .size = 2, .gather = gather}, {.rank = 0, .size = 2}};
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	for (size_t n = 0; n < sizeof wrong / sizeof *wrong; n++) {
		bsdfrbf_build_options options;
		bsdfrbf_model *model;
		bsdfrbf_build_defaults(&options);
		options.team = &wrong[n];
		assert_int_equal(bsdfrbf_build(context, data, &options, &model), BSDFRBF_ERR_ARGUMENT);
		assert_null(model);
	}
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
}

/* ------------------------------------------------------------------- learn */

typedef struct study { rbf_fitted fitted; double share[MOST]; int failed; } study;

static void judge(member *m, void *job)
{
	study *s = job;
	rbf_fitted fitted = s->fitted;
	const uint32_t frame[] = {RBF_MAP_MIRROR};
	fitted.team = m ? &m->team : NULL;
	rbf_lesson *lesson = rbf_learn_begin(&fitted);
	s->share[m ? m->team.rank : 0] = rbf_learn_after(lesson, 1, frame);
	s->failed |= rbf_learn_failed(lesson);
	rbf_learn_end(lesson);
}

/* Only with many lobes is it worth it that several processes judge a frame. */
static void a_frame_is_judged_together(void **state)
{
	(void)state;
	const random_plan *p = &random_plans[0];
	double direction[3 * RANDOM_BASES];
	bsdfrbf_context *context = bsdfrbf_context_new();
	study s = {.fitted = {.symmetry = p->symmetry, .channels = 1, .direction = direction}};
	uint64_t seed = 3;
	s.fitted.bases = random_rings(p, direction);
	assert_int_equal(rbf_mesh_build(context, p->symmetry, s.fitted.bases, direction, NULL, &s.fitted.mesh), BSDFRBF_OK);
	s.fitted.lobes = calloc(s.fitted.bases, sizeof *s.fitted.lobes);
	for (uint32_t b = 0; b < s.fitted.bases; b++) {
		rbf_lobes *l = &s.fitted.lobes[b];
		assert_int_equal(rbf_lobes_new(l, 240, 1), 0);
		for (uint32_t i = 0; i < l->count; i++) {
			const double z = random_unit(&seed), phi = 2 * RBF_PI * random_unit(&seed), sine = sqrt(1 - z*z);
			rbf_lobe_set(l, i, (const float[3]){(float)(sine * cos(phi)), (float)(sine * sin(phi)), (float)z}, 40);
			l->amplitude[i / RBF_LANES].a[i % RBF_LANES] = (float)random_unit(&seed);
			l->mass[i] = 1;
		}
		assert_int_equal(rbf_lobes_finish(l), 0);
	}
	assert_int_equal(rbf_label_prepare(&s.fitted), 0);
	judge(NULL, &s);
	const double alone = s.share[0];
	assert_true(alone > .1 && alone < 1);
	together(3, -1, judge, &s);
	for (int r = 0; r < 3; r++)
		assert_true(s.share[r] == alone);
	assert_false(s.failed);
	together(3, 1, judge, &s); /* a process gives up: proof, too, that the frame was judged together */
	assert_true(s.failed);
	for (uint32_t b = 0; b < s.fitted.bases; b++)
		rbf_lobes_free(&s.fitted.lobes[b]);
	free(s.fitted.lobes);
	rbf_label_release(&s.fitted);
	rbf_mesh_free(&s.fitted.mesh);
	bsdfrbf_context_free(context);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_row_reaches_all),
		cmocka_unit_test(lowest_value_and_failure),
		cmocka_unit_test(wrong_teams),
		cmocka_unit_test(a_frame_is_judged_together),
		cmocka_unit_test(same_bytes_for_any_team),
		cmocka_unit_test(one_that_gives_up),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
