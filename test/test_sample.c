/* SPDX-License-Identifier: BSD-3-Clause */
/* What is drawn is what is evaluated: chi-square of samples against the integral of f |cos| over bins of equal probability. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "question.h"
#include "random_model.h"
#include "integrate.h"
#include "sample.h"

enum { MODELS = FIXTURES + RANDOM_PLANS, SAMPLES = 15000 };
static const double theta_deg[] = {0, 20, 45, 60, 75, 80, 83, 85};
enum { INCIDENCES = sizeof theta_deg / sizeof *theta_deg, CASES = MODELS * INCIDENCES };
static const double significance = 1e-4; /* that any case fails by chance */

static bsdfrbf_model *model[MODELS];

static int build(void **state)
{
	fixture_setup(state);
	memcpy(model, fixture_model, sizeof fixture_model);
	for (int m = 0; m < RANDOM_PLANS; m++)
		model[FIXTURES + m] = random_model(&random_plans[m], 7u + (uint64_t)m);
	return 0;
}

static int clear(void **state)
{
	for (int m = FIXTURES; m < MODELS; m++)
		bsdfrbf_close(model[m]);
	return fixture_teardown(state);
}

/* Incidence t of a model, at an azimuth that is no axis. */
static question ask(int m, int t)
{
	return question_at(model[m], theta_deg[t], 11 + 37. * m + 53. * t);
}

static void chi_square(void **state)
{
	(void)state;
	const double limit = chi_square_limit(significance, CASES);
	int failed = 0;
	for (int m = 0; m < MODELS; m++)
		for (int t = 0; t < INCIDENCES; t++) {
			question q = ask(m, t);
			quadrature cells = quadrature_make(scattered, &q, bsdfrbf_channels(q.model), 2e-5);
			int bins, drawn;
			const double z = chi_square_deviate(&q, &cells, SAMPLES, (uint64_t)(m * INCIDENCES + t), &bins, &drawn);
			if (!(z < limit) || bins < 20 || drawn < SAMPLES * .999) {
				print_error("%s at %g degrees, %s: z %.1f (limit %.1f), %d bins, %d drawn\n", m < FIXTURES ? fixture_plan[m].material : "random",
					theta_deg[t], fixture_maps(fixture_component(q.model, &q.transmit)), z, limit, bins, drawn);
				failed++;
			}
			free(cells.cell);
		}
	assert_int_equal(failed, 0);
}

/* The models between them use the maps that the sampler treats differently. */
static void maps_in_use(void **state)
{
	(void)state;
	int used[RBF_MAPS] = {0}, moved = 0, transmit;
	for (int m = 0; m < MODELS; m++) {
		const rbf_component *c = fixture_component(model[m], &transmit);
		moved += c->residual != 0;
		for (uint32_t f = 0; f < c->frames; f++)
			used[c->frame[f]]++;
		print_message("%s: %s\n", m < FIXTURES ? fixture_plan[m].material : "random", fixture_maps(c));
	}
	for (int i = 0; i <= RBF_MAP_SHIFT; i++)
		assert_true(used[i] > 0);
	assert_true(moved > 0);
}

/* The density integrates to 1, as far as the table of DHR is right. */
static void density_integrates(void **state)
{
	(void)state;
	for (int m = 0; m < FIXTURES; m++)
		for (int t = 0; t < INCIDENCES; t += 3) {
			question q = ask(m, t);
			quadrature cells = quadrature_make(scattered, &q, bsdfrbf_channels(q.model), 1e-4);
			double sum = 0;
			for (size_t i = 0; i < cells.cells; i++) {
				const quad_cell *c = &cells.cell[i];
				if (c->child >= 0)
					continue;
				for (int s = 0; s < 4; s++) {
					float d[3];
					quadrature_direction(c->x + (.25 + .5 * (s & 1)) * c->size, c->y + (.25 + .5 * (s >> 1)) * c->size, d);
					d[2] = q.transmit ? -d[2] : d[2];
					const float p = bsdfrbf_pdf(q.model, q.incident, d);
					assert_true(p >= 0 && isfinite(p));
					sum += .25 * 2 * RBF_PI * c->size * c->size * (double)p;
				}
			}
			if (!(fabs(sum - 1) < .03))
				fail_msg("%s at %g degrees: the density integrates to %.4f", fixture_plan[m].material, theta_deg[t], sum);
			free(cells.cell);
		}
}

/* Variance of a sample mean over REPEATS sets of COUNT numbers, evenly spaced with a jitter, or independent. */
static double variance(const question *q, int stratified, double (*g)(const float d[3]))
{
	enum { REPEATS = 50, COUNT = 256 };
	uint64_t seed = 99;
	double sum = 0, square = 0;
	for (int r = 0; r < REPEATS; r++) {
		double mean = 0;
		for (int i = 0; i < COUNT; i++) {
			float d[3];
			const double u = random_unit(&seed);
			bsdfrbf_sample(q->model, q->incident, q->transmit, stratified ? (i + u) / COUNT : u, d);
			mean += g(d) / COUNT;
		}
		sum += mean / REPEATS;
		square += mean * mean / REPEATS;
	}
	return square - sum * sum;
}

static double east(const float d[3]) { return (double)d[0]; }
static double height(const float d[3]) { return fabs((double)d[2]); }
static double quadrant(const float d[3]) { return d[0] > 0 && d[1] > 0; }

static void stratified_numbers(void **state)
{
	(void)state;
	double (*const g[])(const float d[3]) = {east, height, quadrant};
	for (int m = 0; m < FIXTURES; m++) {
		double product = 1;
		for (int t = 1; t < 4; t++)
			for (int k = 0; k < 3; k++) {
				const question q = ask(m, t);
				const double even = variance(&q, 1, g[k]), random = variance(&q, 0, g[k]);
				product *= random > 1e-12 ? even / random : 1;
			}
		const double ratio = pow(product, 1. / 9);
		print_message("%s: variance of stratified over random numbers %.2f\n", fixture_plan[m].material, ratio);
		assert_true(ratio < .95); /* draws that are rejected fall back on random numbers: film has most */
	}
}

/* The answers to a list are those to its rows, on measured sides and on those answered by reciprocity, whose sides change at row 7. */
static void lists(void **state)
{
	(void)state;
	enum { COUNT = 12 };
	for (int m = 0; m < MODELS; m++)
		for (int transmit = 0; transmit < 2; transmit++) {
			const int channels = bsdfrbf_channels(model[m]);
			float in[COUNT][3], out[COUNT][3], density[COUNT], dhr[COUNT * 3], one[3];
			double u[COUNT];
			size_t drawn = 0;
			for (int i = 0; i < COUNT; i++) {
				const question q = ask(m, i / 3);
				memcpy(in[i], q.incident, sizeof in[i]);
				in[i][2] *= i < 7 ? 1 : -1;
				u[i] = (i % 3 + .5) / 3;
			}
			const size_t told = bsdfrbf_sample_many(model[m], COUNT, in[0], transmit, u, out[0]);
			bsdfrbf_pdf_many(model[m], COUNT, in[0], out[0], density);
			bsdfrbf_dhr_many(model[m], COUNT, in[0], transmit, dhr);
			for (int i = 0; i < COUNT; i++) {
				drawn += (size_t)bsdfrbf_sample(model[m], in[i], transmit, u[i], one);
				assert_memory_equal(one, out[i], sizeof one);
				assert_true(density[i] == bsdfrbf_pdf(model[m], in[i], out[i]));
				bsdfrbf_dhr(model[m], in[i], transmit, one);
				assert_memory_equal(one, dhr + i * channels, channels * sizeof *one);
			}
			assert_int_equal(told, drawn);
		}
}

/* Many at one incidence are those drawn one by one, but for rounding, which decides otherwise now and then whether one is kept. */
static void many_at_one_incidence(void **state)
{
	(void)state;
	enum { COUNT = 1003 };
	static float in[COUNT][3], out[COUNT][3];
	static double u[COUNT];
	uint64_t seed = 5;
	int others = 0;
	for (int i = 0; i < COUNT; i++)
		u[i] = i < 3 ? (double[]){0, 1, NAN}[i] : random_unit(&seed);
	for (int m = 0; m < MODELS; m++)
		for (int t = 0; t < INCIDENCES; t++) {
			const question q = ask(m, t);
			size_t drawn = 0;
			for (int i = 0; i < COUNT; i++)
				memcpy(in[i], q.incident, sizeof q.incident);
			const size_t told = bsdfrbf_sample_many(q.model, COUNT, in[0], q.transmit, u, out[0]);
			for (int i = 0; i < COUNT; i++) {
				float one[3];
				drawn += (size_t)bsdfrbf_sample(q.model, q.incident, q.transmit, u[i], one);
				others += hypot(hypot((double)(one[0] - out[i][0]), (double)(one[1] - out[i][1])), (double)(one[2] - out[i][2])) > 1e-3;
			}
			assert_int_equal(told, drawn);
		}
	if (others > CASES * COUNT / 10000)
		fail_msg("%d of %d are others", others, CASES * COUNT);
}

static void ends_of_the_range(void **state)
{
	(void)state;
	const double u[] = {0, 0x1p-60, .5, 1 - 0x1p-53, 1, 2, -1, NAN, INFINITY};
	for (int m = 0; m < MODELS; m++)
		for (size_t i = 0; i < sizeof u / sizeof *u; i++) {
			const question q = ask(m, 3);
			float d[3];
			if (bsdfrbf_sample(q.model, q.incident, q.transmit, u[i], d))
				assert_float_equal(rbf_dot(d, d), 1, 1e-5);
			else
				assert_true(d[0] == 0 && d[1] == 0 && d[2] == 0);
		}
	const float nowhere[3] = {0, 0, 0}, level[3] = {1, 0, 0}, below[3] = {0, 0, -1}, none[3] = {NAN, 0, 1};
	float d[3];
	assert_false(bsdfrbf_sample(model[0], nowhere, 1, .5, d));
	assert_false(bsdfrbf_sample(model[0], level, 1, .5, d));
	assert_false(bsdfrbf_sample(model[0], none, 1, .5, d));
	assert_false(bsdfrbf_sample(model[1], below, 0, .5, d)); /* the back was not measured */
}

/* Bounds are not far above what arrives: two of three draws are kept, and more, those that go below the horizon counted. */
static void most_draws_are_kept(void **state)
{
	(void)state;
	double sum = 0;
	int sites = 0;
	for (int m = 0; m < FIXTURES; m++)
		for (int t = 0; t < INCIDENCES; t++) {
			const question q = ask(m, t);
			const float incident[3] = {q.incident[0], q.incident[1], fabsf(q.incident[2])};
			int transmit;
			const rbf_component *c = fixture_component(q.model, &transmit);
			const int y = bsdfrbf_channels(q.model) == 3;
			rbf_site site;
			rbf_spot at;
			rbf_sampler sampler;
			double arrives[3];
			rbf_site_turn(c, incident, &site);
			rbf_site_find(&site, &at);
			rbf_site_settle(&site, &at);
			rbf_sampler_set(&site, rbf_draws_at(q.model, c, at.item), at.weight, &sampler);
			rbf_site_dhr(&site, arrives);
			assert_true((double)sampler.total > .999 * arrives[y]);
			sum += (double)sampler.total / arrives[y];
			sites++;
		}
	print_message("%.3f draws for each that is kept\n", sum / sites);
	assert_true(sum / sites < 1.5);
}

/* A model keeps the tables of each element that was sampled, and makes no others. */
static void tables_are_kept(void **state)
{
	(void)state;
	int transmit;
	const rbf_component *c = fixture_component(model[0], &transmit);
	const rbf_draws *first = rbf_draws_at(model[0], c, 0);
	assert_non_null(first);
	assert_ptr_equal(rbf_draws_at(model[0], c, 0), first);
	rbf_draws *again = rbf_draws_of_item(c, 0);
	assert_memory_equal(again, first, first->first);
	free(again);
	bsdfrbf_model *other = random_model(&random_plans[0], 70);
	const rbf_component *own = fixture_component(other, &transmit);
	assert_null(atomic_load(&other->late->draws[own - other->component]));
	assert_non_null(rbf_draws_at(other, own, RBF_MESH_BORDER));
	const rbf_kept_draws *kept = atomic_load(&other->late->draws[own - other->component]);
	size_t made = 0;
	for (size_t i = 0; i < kept->items; i++)
		made += atomic_load(&kept->of[i]) != NULL;
	assert_int_equal(made, 1);
	bsdfrbf_close(other);
}

/* A number at the border between two parts of a site's sampler, or beside it by rounding, draws from one of them: lobes behind those of a
 * set, which here have no direction at all, are never reached. */
static void borders_of_parts(void **state)
{
	(void)state;
	static const double beside[] = {-1e-7, -6e-8, -2e-8, -1e-12, -0x1p-53, 0, 0x1p-53, 1e-12, 2e-8, 6e-8, 1e-7};
	for (int m = 0; m < MODELS; m++) {
		int transmit;
		const rbf_component *of = fixture_component(model[m], &transmit);
		rbf_component c = *of;
		rbf_block *block = malloc((c.blocks + 16) * sizeof *block);
		rbf_amplitude *amplitude = malloc((c.channels * c.blocks + 16) * sizeof *amplitude);
		assert_true(block && amplitude);
		for (uint32_t b = 0; b < c.blocks + 16; b++)
			block[b] = b < c.blocks ? of->block[b] : (rbf_block){.z = {5, 5, 5, 5, 5, 5, 5, 5}, .k = {50, 50, 50, 50, 50, 50, 50, 50}};
		for (uint32_t b = 0; b < c.channels * c.blocks + 16; b++)
			for (int i = 0; i < RBF_LANES; i++)
				amplitude[b].a[i] = b < c.channels * c.blocks ? of->amplitude[b].a[i] : 1e9f;
		c.block = block;
		c.amplitude = amplitude;
		c.residual = 0;
		uint32_t last = 0;
		for (uint32_t v = 1; v < c.mesh.vertices; v++)
			last = c.mesh.vertex[v].base > c.mesh.vertex[last].base ? v : last;
		for (int second = 0; second < 2; second++) { /* a small part between others, or the last one */
			const rbf_vertex corner[3] = {c.mesh.vertex[0], c.mesh.vertex[second ? last : 0], c.mesh.vertex[second ? 0 : last]};
			const float weight[3] = {.5f, second ? 1e-5f : .25f, second ? .5f : .25f};
			float in[3] = {corner[0].direction[0] + .01f, corner[0].direction[1], corner[0].direction[2]}, out[3];
			rbf_site site;
			rbf_sampler sampler;
			rbf_normalize(in);
			rbf_site_corners(&c, in, corner, weight, &site);
			rbf_draws *draws = rbf_draws_of_corners(&c, corner, weight);
			assert_non_null(draws);
			rbf_sampler_set(&site, draws, NULL, &sampler);
			for (uint32_t p = 1; p <= sampler.parts; p++)
				for (size_t i = 0; i < sizeof beside / sizeof *beside; i++) {
					const double border = (double)(p < sampler.parts ? fminf(sampler.before[p], sampler.total) : sampler.total) / (double)sampler.total;
					if (rbf_site_sample(&site, &sampler, border * (1 + beside[i]), out))
						assert_float_equal(rbf_dot(out, out), 1, 1e-5);
				}
			free(draws);
		}
		free(block);
		free(amplitude);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(maps_in_use),
		cmocka_unit_test(chi_square),
		cmocka_unit_test(density_integrates),
		cmocka_unit_test(stratified_numbers),
		cmocka_unit_test(lists),
		cmocka_unit_test(many_at_one_incidence),
		cmocka_unit_test(ends_of_the_range),
		cmocka_unit_test(borders_of_parts),
		cmocka_unit_test(most_draws_are_kept),
		cmocka_unit_test(tables_are_kept),
	};
	return cmocka_run_group_tests(tests, build, clear);
}
