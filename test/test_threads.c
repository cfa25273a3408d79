/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * One model asked by many threads and by forked processes gives the answers that one thread gets, bit for bit; files are opened
 * and models built by several threads at once. test_thread_sanitizer.sh runs the same under the thread sanitizer, and with
 * RACE=1, where two threads write what they share, to see that it would notice.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "random_model.h"

#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

enum { THREADS = 8, QUESTIONS = 64, NUMBERS = 60, TRANSMITTING = RANDOM_PLANS, MODELS, CHILDREN = 4, CHILD_SECONDS = 60 };

static bsdfrbf_model *model[MODELS]; /* opened, so that their memory is a mapped file */
static char path[MODELS][64];
static uint64_t *expected[MODELS];   /* of one thread */

static void mix(uint64_t *sum, const void *data, size_t bytes) /* FNV-1a */
{
	const unsigned char *at = data;
	while (bytes--)
		*sum = (*sum ^ *at++) * 0x100000001b3u;
}

/* All that can be asked, at directions that depend on n alone: a checksum of the answers. */
static uint64_t answer(const bsdfrbf_model *m, int n)
{
	uint64_t seed = 1000 + (uint64_t)n, sum = 0xcbf29ce484222325u;
	float in[4][3], out[4][3], value[12], numbers[NUMBERS] = {0}, low, high;
	double u[4];
	const int transmit = m == model[TRANSMITTING];
	for (int i = 0; i < 4; i++) {
		for (int k = 0; k < 2; k++) {
			in[i][k] = (float)(2 * random_unit(&seed) - 1);
			out[i][k] = (float)(2 * random_unit(&seed) - 1);
		}
		in[i][2] = (float)(random_unit(&seed) + .01);
		out[i][2] = (float)(random_unit(&seed) + .01) * (transmit ? -1 : 1);
		u[i] = random_unit(&seed);
	}
	if (transmit && n % 32 == 0) { /* from the side that was not measured, which is slow at first */
		in[0][2] = -in[0][2];
		out[0][2] = -out[0][2];
	}
	memcpy(in[2], in[1], sizeof in[1]);
	bsdfrbf_eval(m, in[0], out[0], value);
	mix(&sum, value, sizeof *value);
	bsdfrbf_eval_many(m, 3, in[1], out[1], value);
	mix(&sum, value, 3 * sizeof *value);
	bsdfrbf_eval_exitant(m, in[1], 3, out[1], value);
	mix(&sum, value, 3 * sizeof *value);
	bsdfrbf_dhr(m, in[0], transmit, value);
	mix(&sum, value, sizeof *value);
	bsdfrbf_dhr_many(m, 3, in[1], transmit, value);
	mix(&sum, value, 3 * sizeof *value);
	numbers[0] = (float)bsdfrbf_sample(m, in[0], transmit, u[0], numbers + 1);
	numbers[4] = (float)bsdfrbf_sample_many(m, 3, in[1], transmit, u + 1, numbers + 5);
	numbers[20] = bsdfrbf_pdf(m, in[0], out[0]);
	bsdfrbf_pdf_many(m, 3, in[1], out[1], numbers + 21);
	bsdfrbf_resolution(m, in[1], n % 2 ? out[1] : NULL, transmit, &low, &high);
	numbers[30] = low;
	numbers[31] = high;
	bsdfrbf_incidence_info incidence;
	bsdfrbf_lobe_info lobe[2];
	if (bsdfrbf_get_incidence_info(m, transmit ? BSDFRBF_TF : BSDFRBF_RF, n % 3, &incidence) == BSDFRBF_OK)
		numbers[32] = incidence.dhr;
	if (bsdfrbf_get_lobes(m, transmit ? BSDFRBF_TF : BSDFRBF_RF, n % 3, n % 2, 2, lobe))
		numbers[33] = lobe[0].energy + lobe[0].moved[1];
	bsdfrbf_lambertian(m, BSDFRBF_RF, numbers + 40);
	mix(&sum, numbers, sizeof numbers);
	mix(&sum, bsdfrbf_get_text(m, "name"), 4);
	return sum;
}

/* Answers that differ from those of one thread, all questions once, from a question on. */
static int differences(int start)
{
	int wrong = 0;
	for (int k = 0; k < MODELS; k++)
		for (int n = 0; n < QUESTIONS; n++) {
			const int at = (start + n) % QUESTIONS;
			wrong += answer(model[k], at) != expected[k][at];
		}
	return wrong;
}

/* ------------------------------------------------------------------ threads */

typedef struct worker {
	pthread_t thread;
	pthread_barrier_t *all; /* started */
	int number, wrong;
} worker;

static void together(void *(*work)(void *))
{
	worker w[THREADS];
	pthread_barrier_t all;
	int wrong = 0;
	pthread_barrier_init(&all, NULL, THREADS);
	for (int t = 0; t < THREADS; t++) {
		w[t] = (worker){.all = &all, .number = t};
		assert_int_equal(pthread_create(&w[t].thread, NULL, work, &w[t]), 0);
	}
	for (int t = 0; t < THREADS; t++) {
		pthread_join(w[t].thread, NULL);
		wrong += w[t].wrong;
	}
	pthread_barrier_destroy(&all);
	assert_int_equal(wrong, 0);
}

static void *ask(void *user)
{
	worker *w = user;
	pthread_barrier_wait(w->all);
	w->wrong = differences(w->number * QUESTIONS / THREADS) + differences(0);
	return NULL;
}

static void threads_share_models(void **state)
{
	(void)state;
	together(ask);
}

static void *open_and_ask(void *user)
{
	worker *w = user;
	pthread_barrier_wait(w->all);
	for (int k = 0; k < TRANSMITTING; k++) {
		bsdfrbf_context *context = bsdfrbf_context_new();
		bsdfrbf_model *own = NULL, *none = NULL;
		w->wrong += bsdfrbf_open(context, path[k], &own) != BSDFRBF_OK;
		w->wrong += bsdfrbf_open(context, "/none", &none) != BSDFRBF_ERR_IO || !strstr(bsdfrbf_message(context), "/none");
		for (int n = w->number; own && n < QUESTIONS; n += 7)
			w->wrong += answer(own, n) != expected[k][n];
		bsdfrbf_close(own);
		bsdfrbf_context_free(context);
	}
	return NULL;
}

static void threads_open_files(void **state)
{
	(void)state;
	together(open_and_ask);
}

/* A small model built and saved, as a checksum of the file. */
static uint64_t built(int number)
{
	static const char *const head = "#format: theta phi BSDF\n#intheta %d\n#inphi 0\n";
	char name[64], from[64];
	uint64_t sum = 0xcbf29ce484222325u;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_model *made = NULL;
	bsdfrbf_build_options options;
	bsdfrbf_build_defaults(&options);
	options.lobes = 4;
	snprintf(name, sizeof name, "/tmp/rbf-threads-%d-%d.rbf", (int)getpid(), number);
	snprintf(from, sizeof from, "/tmp/rbf-threads-%d-%d.txt", (int)getpid(), number);
	for (int theta = 0; theta <= 40; theta += 40) {
		FILE *f = fopen(from, "w");
		fprintf(f, head, theta);
		for (int t = 0; t < 88; t += 8)
			for (int p = 0; p < 360; p += t ? 30 : 360)
				fprintf(f, "%d %d .%03d\n", t, p, 100 + (p * 7 + t) % 200);
		fclose(f);
		if (bsdfrbf_data_read(context, data, from) != BSDFRBF_OK)
			sum = 0;
	}
	if (bsdfrbf_build(context, data, &options, &made) != BSDFRBF_OK || bsdfrbf_save(context, made, name) != BSDFRBF_OK)
		sum = 0;
	FILE *f = fopen(name, "r");
	for (int c; sum && f && (c = getc(f)) != EOF;)
		mix(&sum, &(char){(char)c}, 1);
	if (f)
		fclose(f);
	remove(name);
	remove(from);
	bsdfrbf_close(made);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return sum;
}

static uint64_t built_alone;

static void *build_own(void *user)
{
	worker *w = user;
	pthread_barrier_wait(w->all);
	w->wrong = built(w->number) != built_alone;
	return NULL;
}

static void threads_build(void **state)
{
	(void)state;
	built_alone = built(THREADS);
	assert_int_not_equal(built_alone, 0);
	together(build_own);
}

/* -------------------------------------------------------------------- forks */

/* Children that answer, as the parent does; a child that waits for threads it does not have is ended by its alarm. */
static void forked(void)
{
	pid_t child[CHILDREN];
	for (int k = 0; k < CHILDREN; k++) {
		fflush(NULL);
		child[k] = fork();
		if (!child[k]) {
			signal(SIGALRM, SIG_DFL);
			alarm(CHILD_SECONDS);
			_exit(differences(k) != 0);
		}
	}
	assert_int_equal(differences(0), 0);
	for (int k = 0; k < CHILDREN; k++) {
		int status = -1;
		assert_int_equal(waitpid(child[k], &status, 0), child[k]);
		if (!WIFEXITED(status) || WEXITSTATUS(status))
			fail_msg("a child ended with status %d", status);
	}
}

/* In a process of its own, since this one has asked already: opened, then forked before the first question. */
static void fork_after_load(void **state)
{
	(void)state;
	fflush(NULL);
	const pid_t parent = fork();
	if (!parent) {
		pid_t child[CHILDREN];
		int wrong = 0, status;
		alarm(2 * CHILD_SECONDS);
		for (int k = 0; k < MODELS; k++) {
			bsdfrbf_close(model[k]);
			model[k] = NULL;
			wrong |= bsdfrbf_open(NULL, path[k], &model[k]) != BSDFRBF_OK;
		}
		for (int k = 0; k < CHILDREN && !wrong; k++) {
			child[k] = fork();
			if (!child[k]) {
				alarm(CHILD_SECONDS);
				_exit(differences(k) != 0);
			}
		}
		for (int k = 0; k < CHILDREN && !wrong; k++)
			wrong |= waitpid(child[k], &status, 0) != child[k] || status != 0;
		_exit(wrong);
	}
	int status = -1;
	assert_int_equal(waitpid(parent, &status, 0), parent);
	assert_int_equal(status, 0);
}

static void fork_after_evaluation(void **state)
{
	(void)state;
	forked();
}

/* OpenMP's threads of the build do not exist in a child. */
static void fork_after_build(void **state)
{
	(void)state;
	assert_int_not_equal(built(THREADS), 0);
	forked();
}

/* --------------------------------------------------------------------- race */

static int shared;

static void *race(void *user)
{
	for (int n = 0; n < 1000; n++)
		shared += ((worker *)user)->number;
	return NULL;
}

static void threads_race(void **state)
{
	(void)state;
	together(race);
}

static int setup(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++) {
		random_plan p = random_plans[k % RANDOM_PLANS];
		p.no_dhr = 1;
		bsdfrbf_model *made = random_model(&p, 40 + (uint64_t)k);
		if (k == TRANSMITTING) {
			made->component[BSDFRBF_TF] = made->component[BSDFRBF_RF];
			memset(&made->component[BSDFRBF_RF], 0, sizeof made->component[BSDFRBF_RF]);
		}
		assert_int_equal(bsdfrbf_set_text(NULL, made, "name", "shared"), BSDFRBF_OK);
		snprintf(path[k], sizeof path[k], "/tmp/rbf-threads-%d-model%d.rbf", (int)getpid(), k);
		assert_int_equal(bsdfrbf_save(NULL, made, path[k]), BSDFRBF_OK);
		bsdfrbf_close(made);
		assert_int_equal(bsdfrbf_open(NULL, path[k], &model[k]), BSDFRBF_OK);
		expected[k] = malloc(QUESTIONS * sizeof *expected[k]);
		for (int n = 0; n < QUESTIONS; n++)
			expected[k][n] = answer(model[k], n);
		bsdfrbf_close(model[k]); /* what is worked out when it is first asked for is to be worked out by many at once */
		assert_int_equal(bsdfrbf_open(NULL, path[k], &model[k]), BSDFRBF_OK);
	}
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++) {
		bsdfrbf_close(model[k]);
		remove(path[k]);
		free(expected[k]);
	}
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(threads_share_models), cmocka_unit_test(threads_open_files), cmocka_unit_test(threads_build),
		cmocka_unit_test(fork_after_load), cmocka_unit_test(fork_after_evaluation), cmocka_unit_test(fork_after_build)};
	const struct CMUnitTest racing[] = {cmocka_unit_test(threads_race)};
	if (getenv("RACE"))
		return cmocka_run_group_tests(racing, NULL, NULL);
	return cmocka_run_group_tests(tests, setup, teardown);
}
