/* SPDX-License-Identifier: BSD-3-Clause */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "cluster.h"
#include "cull.h"
#include "evaluate.h"
#include "lobes.h"
#include "model_fixture.h"
#include "random_model.h"
#include "extent.h"

enum { BLOCKS = 80 };

static void unit(uint64_t *seed, float d[3])
{
	const double z = 2 * random_unit(seed) - 1, phi = 2 * RBF_PI * random_unit(seed), s = sqrt(1 - z*z);
	d[0] = (float)(s * cos(phi));
	d[1] = (float)(s * sin(phi));
	d[2] = (float)z;
}

/* Any jobs: of one block or of groups, some of them without a block that is asked for, some that move. */
static void vectors_agree_with_reference(void **state)
{
	(void)state;
	enum { JOBS = 9 };
	static rbf_block block[BLOCKS];
	static rbf_amplitude amplitude[3 * BLOCKS];
	static rbf_shift shift[2][BLOCKS];
	static const uint32_t values[3] = {1, 3, RBF_KERNEL_WIDTH};
	uint64_t seed = 1;
	for (int round = 0; round < 3000; round++) {
		const uint32_t jobs = 1 + (uint32_t)(random_unit(&seed) * JOBS), channels = values[round % 3];
		rbf_kernel_lobes of = {block, amplitude, channels == 3 ? BLOCKS : 0, channels, 1};
		rbf_kernel_job job[JOBS];
		rbf_motion motion[JOBS];
		float seen[3];
		unit(&seed, seen);
		for (uint32_t n = 0; n < jobs; n++) {
			rbf_kernel_job *j = &job[n];
			const double share = random_unit(&seed);
			*j = (rbf_kernel_job){.weight = (float)random_unit(&seed), .blocks = 1 + (uint32_t)(random_unit(&seed) * (round % 5 ? 12 : BLOCKS - 1))};
			j->first = (uint32_t)(random_unit(&seed) * (BLOCKS - j->blocks));
			j->motion = round % 4 == 3 && n % 2 ? &motion[n] : NULL;
			for (int bit = 0; bit < 64; bit++)
				j->mask |= (uint64_t)(random_unit(&seed) < share * share * 2) << bit;
			j->mask &= rbf_cull_all(j->blocks);
			of.plain &= !j->motion && j->blocks <= RBF_CULL_BITS;
			for (int k = 0; k < 3; k++)
				j->direction[k] = seen[k] + .03f * (float)(random_unit(&seed) - .5);
			rbf_normalize(j->direction);
			for (int k = 0; k < 2; k++) {
				motion[n].shift[k] = (round / 4 >> k) % 2 ? shift[k] : NULL;
				motion[n].weight[k] = (float)random_unit(&seed) * .5f;
			}
		}
		for (uint32_t b = 0; b < BLOCKS; b++)
			for (int i = 0; i < RBF_LANES; i++) {
				float c[3], near[3];
				unit(&seed, c);
				if (i % 2) /* lobes that matter are near the direction */
					for (int n = 0; n < 3; n++)
						c[n] = seen[n] + .05f * c[n];
				rbf_normalize(c);
				block[b].x[i] = c[0];
				block[b].y[i] = c[1];
				block[b].z[i] = c[2];
				block[b].k[i] = (float)pow(1e5, random_unit(&seed));
				for (int n = 0; n < 3; n++)
					amplitude[n * BLOCKS + b].a[i] = (float)random_unit(&seed);
				for (int n = 0; n < 2; n++) {
					unit(&seed, near);
					shift[n][b].x[i] = .2f * near[0];
					shift[n][b].y[i] = .2f * near[1];
					shift[n][b].z[i] = .2f * near[2];
				}
			}
		float expected[3], sum[3];
		rbf_kernel_reference(job, jobs, &of, expected);
		void (*const kernel[4])(const rbf_kernel_job *, uint32_t, const rbf_kernel_lobes *, float *) = {rbf_kernel_sum, rbf_kernel_generic,
#if defined(__x86_64__)
			__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? rbf_kernel_avx2 : rbf_kernel_generic,
#else
			rbf_kernel_generic,
#endif
			rbf_kernel_has_avx512() ? rbf_kernel_avx512 : rbf_kernel_generic};
		for (int k = 0; k < 4; k++) {
			kernel[k](job, jobs, &of, sum);
			/* a centre is a float: half an ulp of 1 (6e-8) at kappa d = 1e5 x .01 shifts the exponent by 1e-4 */
			for (uint32_t n = 0; n < channels; n++)
				if (!(fabsf(sum[n] - expected[n]) <= 3e-4f * expected[n] + 1e-7f))
					fail_msg("kernel %d, channel %u: %g, reference %g", k, n, (double)sum[n], (double)expected[n]);
		}
	}
}

/* Sums over a fit leave out what does not reach a direction: as all lobes together, for one mask's blocks and for more. */
static void out_of_reach(void **state)
{
	(void)state;
	uint64_t seed = 5, asked = 0, reach = 0;
	for (int round = 0; round < 400; round++) {
		rbf_lobes l;
		assert_int_equal(rbf_lobes_new(&l, 1 + (uint32_t)(random_unit(&seed) * (round % 2 ? 60 : 1500)), 1), 0);
		float middle[3] = {0, 0, 1}, kappa = 1;
		for (uint32_t i = 0; i < l.count; i++) {
			float c[3];
			if (i % RBF_LANES == 0) {
				unit(&seed, middle);
				kappa = (float)pow(1e5, random_unit(&seed));
			}
			unit(&seed, c);
			for (int n = 0; n < 3; n++)
				c[n] = middle[n] + .1f * c[n];
			rbf_normalize(c);
			rbf_lobe_set(&l, i, c, kappa * (1 + (float)random_unit(&seed)));
			l.amplitude[i / RBF_LANES].a[i % RBF_LANES] = (float)random_unit(&seed);
		}
		assert_int_equal(rbf_lobes_finish(&l), 0);
		for (int n = 0; n < 20; n++) {
			float d[3];
			double sum = 0;
			unit(&seed, d);
			for (uint32_t i = 0; i < l.count; i++) {
				float c[3];
				rbf_lobe_centre(&l, i, c);
				const double x = (double)(c[0] - d[0]), y = (double)(c[1] - d[1]), z = (double)(c[2] - d[2]);
				sum += (double)rbf_lobe_amplitude(&l, 0, i) * exp(-.5 * (double)rbf_lobe_kappa(&l, i) * (x*x + y*y + z*z));
			}
			assert_float_equal(rbf_lobes_luminance(&l, d), sum, 1e-4 * sum + 1e-9 * l.count);
			const uint32_t blocks = rbf_lobes_rest(&l, 0);
			asked += blocks;
			reach += (uint64_t)__builtin_popcountll(rbf_extent_mask(l.extent, l.blocks, 0, blocks, d));
		}
		rbf_lobes_free(&l);
	}
	assert_true(reach < asked / 2); /* worth asking */
}

/* As files before had them. */
static uint64_t *wide_masks(const rbf_component *c)
{
	uint64_t *wide = malloc(c->sets * RBF_CULL_CELLS * sizeof *wide);
	for (size_t i = 0; i < c->sets * RBF_CULL_CELLS; i++) {
		const rbf_set *set = &c->set[i / RBF_CULL_CELLS];
		wide[i] = set->blocks ? rbf_cull_read(rbf_cull_packed(c->cull, set, (uint32_t)(i % RBF_CULL_CELLS))) : 0;
	}
	return wide;
}

/* Without the masks, or with: f differs by less than the bound. With masks that are not packed it is the same. */
static void culling_error(const bsdfrbf_model *model, const char *name)
{
	int transmit;
	const rbf_component *c = fixture_component(model, &transmit);
	rbf_component whole = *c, wide = *c;
	uint64_t seed = 2;
	double worst = 0, kept = 0;
	enum { PAIRS = 4000 };
	whole.cull = wide.cull = NULL;
	uint64_t *const masks = wide_masks(c);
	wide.cull_wide = masks;
	assert_non_null(c->cull);
	for (uint64_t i = 0; i < rbf_cull_words(c->blocks); i++)
		kept += __builtin_popcountll(c->cull[i]);
	for (int n = 0; n < PAIRS; n++) {
		rbf_site a, b;
		float i[3], o[3], p[3], q[3], with[3], without[3], before[3];
		unit(&seed, i);
		unit(&seed, o);
		i[2] = fabsf(i[2]) + 1e-3f;
		o[2] = fabsf(o[2]) + 1e-3f;
		rbf_normalize(i);
		rbf_normalize(o);
		rbf_site_locate(c, i, &a);
		rbf_site_locate(&whole, i, &b);
		rbf_site_fold(&a, o, p);
		rbf_site_fold(&b, o, q);
		rbf_site_dsf(&a, p, with);
		rbf_site_dsf(&b, q, without);
		b.component = &wide;
		rbf_site_dsf(&b, q, before);
		assert_memory_equal(with, before, c->channels * sizeof *with);
		for (uint32_t k = 0; k < c->channels; k++) {
			const float all = without[k] + c->lambertian[k] * o[2] * (float)(1 / RBF_PI);
			if (all > 1e-12f)
				worst = fmax(worst, fabs((double)with[k] - (double)without[k]) / (double)all);
		}
	}
	print_message("%s: culling off by at most %.1e, %.0f groups a cell\n", name, worst, kept / (c->sets * (double)RBF_CULL_CELLS));
	assert_true(worst < 1e-3);
	free(masks);
}

/* Lobes at eight places, as many at each, in turn, and three more: each block is of one place, in the former order, with its amplitudes. */
static void lobes_share_blocks(void **state)
{
	(void)state;
	enum { PLACES = 8, COUNT = PLACES * RBF_LANES + 3, SET_BLOCKS = PLACES + 1, FIRST = 2, ALL = FIRST + SET_BLOCKS };
	static rbf_block block[ALL];
	static rbf_amplitude amplitude[3 * ALL];
	const rbf_component c = {.channels = 3, .frames = 1, .blocks = ALL, .block = block, .amplitude = amplitude};
	const rbf_set set = {.first = FIRST, .blocks = SET_BLOCKS};
	float place[PLACES][3];
	uint64_t seed = 4;
	for (int n = 0; n < PLACES; n++) { /* far from each other */
		const float phi = (float)n * (float)(2 * RBF_PI / PLACES);
		memcpy(place[n], (float[3]){.8f * cosf(phi), .8f * sinf(phi), .6f}, sizeof place[n]);
	}
	for (uint32_t i = 0; i < COUNT; i++) {
		rbf_block *b = &block[FIRST + i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		const float *at = i < 3 ? (const float[3]){0, 0, 1} : place[i % PLACES];
		b->x[lane] = at[0];
		b->y[lane] = at[1];
		b->z[lane] = at[2];
		b->k[lane] = (i < 3 ? 300 : 100) + (float)random_unit(&seed);
		for (uint32_t n = 0; n < 3; n++)
			amplitude[n * ALL + FIRST + i / RBF_LANES].a[lane] = (float)(i + 100 * n);
	}
	assert_int_equal(rbf_cluster(&c, &set, block, amplitude, NULL), 0);
	int found[COUNT] = {0};
	for (uint32_t at = 0; at < COUNT; at++) {
		const rbf_block *b = &block[FIRST + at / RBF_LANES];
		const uint32_t lane = at % RBF_LANES, i = (uint32_t)amplitude[FIRST + at / RBF_LANES].a[lane];
		assert_true(i < COUNT && !found[i]++);
		for (uint32_t n = 1; n < 3; n++)
			assert_int_equal((int)amplitude[n * ALL + FIRST + at / RBF_LANES].a[lane], i + 100 * n);
		const float *is = i < 3 ? (const float[3]){0, 0, 1} : place[i % PLACES];
		assert_true(b->x[lane] == is[0] && b->y[lane] == is[1] && b->z[lane] == is[2]);
		if (lane)
			assert_true(b->x[lane] == b->x[0] && b->y[lane] == b->y[0] && i > (uint32_t)amplitude[FIRST + at / RBF_LANES].a[lane - 1]);
	}
}

/* Without motion: what is not among the random plans. */
static const random_plan still_plans[] = {
	{RBF_QUADRILATERAL, 5, 4, {0, 25, 50, 70, 86}, 30, 3, {RBF_MAP_RETRO, RBF_MAP_HALF, RBF_MAP_SHIFT}, 60, 10, 3000, 0, 3, 0, 0, 1, 1, 0, 1},
	{RBF_UP, 5, 5, {0, 25, 50, 70, 84}, 45, 3, {RBF_MAP_LEARNED_SHIFT, RBF_MAP_LEARNED_TURN, RBF_MAP_FIXED}, 60, 10, 3000, 0, 1, 0, 0, 0, 0, 1.25, 1},
	{RBF_BILATERAL_X, 5, 5, {0, 25, 50, 70, 84}, 45, 2, {RBF_MAP_MIRROR, RBF_MAP_HALF}, 60, 10, 3000, 0, 1, 0, 0, 2, 0, 0, 1},
	{RBF_ISOTROPIC, 4, 1, {10, 30, 50, 70}, 0, 1, {RBF_MAP_MIRROR}, 560, 10, 3000, 0, 1, 0, 0, 1, 0, 0, 1}, /* more than masks have bits */
	{RBF_ISOTROPIC, 4, 1, {10, 30, 50, 70}, 0, 1, {RBF_MAP_MIRROR}, 300, 2, 30, 0, 1, 0, 0, 1, 0, 0, 1}, /* many, of which most count */
};
enum { STILL_PLANS = sizeof still_plans / sizeof *still_plans, MODELS = 2 + RANDOM_PLANS + STILL_PLANS };

static bsdfrbf_model *model[MODELS];

static int build(void **state)
{
	(void)state;
	model[0] = fixture_build(&fixture_plan[2]);
	model[1] = fixture_build(&fixture_plan[4]);
	for (int m = 0; m < RANDOM_PLANS; m++)
		model[2 + m] = random_model(&random_plans[m], 3u + (uint64_t)m);
	for (int m = 0; m < STILL_PLANS; m++)
		model[2 + RANDOM_PLANS + m] = random_model(&still_plans[m], 50u + (uint64_t)m);
	return 0;
}

static int clear(void **state)
{
	(void)state;
	for (int m = 0; m < MODELS; m++)
		bsdfrbf_close(model[m]);
	return 0;
}

static void culling(void **state)
{
	(void)state;
	culling_error(model[0], "film");
	culling_error(model[1], "grating");
	for (int m = 0; m < RANDOM_PLANS; m++)
		culling_error(model[2 + m], "random");
}

static void ways_to_evaluate_agree(void **state)
{
	(void)state;
	enum { COUNT = 300 };
	for (int m = 0; m < MODELS; m++) {
		static float in[COUNT][3], out[COUNT][3], many[COUNT * 3], exitant[COUNT * 3];
		const size_t channels = (size_t)bsdfrbf_channels(model[m]);
		uint64_t seed = 3;
		for (int n = 0; n < COUNT; n++) {
			unit(&seed, out[n]);
			if (n % 7)
				memcpy(in[n], in[n - 1], sizeof in[n]);
			else
				unit(&seed, in[n]);
		}
		bsdfrbf_eval_many(model[m], COUNT, in[0], out[0], many);
		for (int n = 0; n < COUNT; n += 7)
			bsdfrbf_eval_exitant(model[m], in[n], COUNT - n < 7 ? (size_t)(COUNT - n) : 7, out[n], exitant + (size_t)n * channels);
		assert_memory_equal(many, exitant, COUNT * channels * sizeof *many);
		for (int n = 0; n < COUNT; n++) {
			float one[3], scatter[3], lambertian[3];
			const int transmit = (in[n][2] < 0) != (out[n][2] < 0);
			bsdfrbf_eval(model[m], in[n], out[n], one);
			assert_memory_equal(one, many + (size_t)n * channels, channels * sizeof *one);
			bsdfrbf_eval_scatter(model[m], in[n], out[n], scatter);
			bsdfrbf_lambertian(model[m], (transmit ? BSDFRBF_TF : BSDFRBF_RF) + (in[n][2] < 0), lambertian);
			for (size_t k = 0; k < channels; k++)
				assert_float_equal(one[k], scatter[k] + lambertian[k] / (float)RBF_PI, 1e-5f * one[k] + 1e-7f);
		}
	}
}

/* Lists of any length, in part of the same incidence, of both sides, of no direction: as one after the other. */
static void pairs_in_one_call_agree(void **state)
{
	(void)state;
	enum { MOST = 60 };
	for (int m = 0; m < MODELS; m++) {
		const size_t channels = (size_t)bsdfrbf_channels(model[m]);
		uint64_t seed = 11 + (uint64_t)m;
		for (int round = 0; round < 200; round++) {
			float in[MOST][3], out[MOST][3], many[MOST * 3 + 1];
			const size_t count = (size_t)(random_unit(&seed) * MOST);
			const double again = round % 3 ? 0 : .3, none = round % 4 ? 0 : .1;
			for (size_t n = 0; n < count; n++) {
				unit(&seed, in[n]);
				unit(&seed, out[n]);
				if (n && random_unit(&seed) < again)
					memcpy(in[n], in[n - 1], sizeof in[n]);
				if (random_unit(&seed) < none)
					in[n][round % 8 ? 2 : 0] = random_unit(&seed) < .5 ? 0 : NAN;
				for (int k = 0; k < 3 && round % 5 == 0; k++)
					out[n][k] *= 3;
			}
			many[count * channels] = -7;
			bsdfrbf_eval_many(model[m], count, in[0], out[0], many);
			assert_true(many[count * channels] == -7);
			for (size_t n = 0; n < count; n++) {
				float one[3];
				bsdfrbf_eval(model[m], in[n], out[n], one);
				for (size_t k = 0; k < channels; k++)
					if (!(fabsf(many[n * channels + k] - one[k]) <= 3e-5f * one[k] + 1e-9f))
						fail_msg("model %d, pair %zu of %zu: %g in one call, %g alone", m, n, count, (double)many[n * channels + k], (double)one[k]);
			}
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(vectors_agree_with_reference),
		cmocka_unit_test(out_of_reach),
		cmocka_unit_test(lobes_share_blocks),
		cmocka_unit_test(culling),
		cmocka_unit_test(ways_to_evaluate_agree),
		cmocka_unit_test(pairs_in_one_call_agree),
	};
	return cmocka_run_group_tests(tests, build, clear);
}
