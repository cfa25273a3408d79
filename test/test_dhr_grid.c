/* SPDX-License-Identifier: BSD-3-Clause */
/* The grid that answers most questions for DHR, against the mesh's own table. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "random_model.h"
#include "dhr_grid.h"
#include "evaluate.h"

#include <unistd.h>

enum { DIRECTIONS = 20000, MODELS = 7 };
static const double MISSED = .0015, ANSWERED = .6;

/* Incidences from which each symmetry's mesh can be made, by their azimuths. */
static const struct { rbf_symmetry symmetry; uint32_t channels; int phis; double phi, step; } form[MODELS] = {
	{RBF_ISOTROPIC, 1, 1, 0, 0}, {RBF_ISOTROPIC, 3, 1, 0, 0}, {RBF_QUADRILATERAL, 1, 4, 0, 30}, {RBF_BILATERAL_X, 3, 7, -90, 30},
	{RBF_BILATERAL_Y, 1, 7, 0, 30}, {RBF_UP, 1, 7, 0, 30}, {RBF_ANISOTROPIC, 1, 12, 0, 30},
};

static bsdfrbf_model *model_of_form[MODELS];

static bsdfrbf_model *make(int k)
{
	static const double theta[] = {0, 20, 40, 58, 72};
	const random_plan p = {.symmetry = form[k].symmetry, .frames = 2, .frame = {RBF_MAP_FIXED, RBF_MAP_MIRROR}, .lobes = form[k].channels == 3 ? 500 : 240, .kappa_low = 10,
		.kappa_high = 200, .channels = form[k].channels};
	double direction[3 * RANDOM_BASES];
	uint32_t bases = 0;
	for (int t = 0; t < 5; t++)
		for (int a = 0; a < (t ? form[k].phis : 1); a++)
			polar(theta[t], form[k].phi + a * form[k].step, direction + 3 * bases++);
	bsdfrbf_model *model = random_model_at(&p, bases, direction, 5 + (uint64_t)k);
	assert_non_null(model);
	return model;
}

static void direction_of(uint64_t *seed, double least_z, float d[3])
{
	const double z = least_z + (1 - least_z) * random_unit(seed), phi = 2 * RBF_PI * random_unit(seed), r = sqrt(1 - z*z);
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)z;
}

/* Where the grid answers, it does as the table, from any direction; elsewhere the table does. Returns the share of the former. */
static double agrees(const bsdfrbf_model *model, const char *what)
{
	const rbf_component *c = &model->component[BSDFRBF_RF];
	uint64_t seed = 3;
	double most = 0;
	int answered = 0;
	for (int i = 0; i < DIRECTIONS; i++) {
		float d[3], table[3], grid[3], value[3];
		direction_of(&seed, .15, d);
		rbf_component_dhr(c, d, table);
		const int has = rbf_dhr_from_grid(c, d, grid);
		bsdfrbf_dhr_scatter(model, d, 0, value);
		assert_memory_equal(value, has ? grid : table, c->channels * sizeof *value);
		for (uint32_t n = 0; n < c->channels && has; n++)
			most = fmax(most, fabs((double)(grid[n] / table[n]) - 1));
		answered += has;
	}
	print_message("%s %c: %u cells answer %.3f of the directions, and miss %.4f %% at most\n", what, c->mesh.symmetry, c->dhr_cells,
		(double)answered / DIRECTIONS, 100 * most);
	assert_true(most < MISSED);
	return (double)answered / DIRECTIONS;
}

static void answers_as_the_table(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++) {
		const bsdfrbf_model *model = model_of_form[k];
		const rbf_component *c = &model->component[BSDFRBF_RF];
		assert_non_null(c->dhr_grid);
		assert_true(agrees(model, "random lobes") > ANSWERED);
		/* exactly up and at the horizon: no cell lies outside */
		for (int n = 0; n < 400; n++) {
			const float d[3] = {(float)cos(n * RBF_PI / 200) * (n > 0), (float)sin(n * RBF_PI / 200) * (n > 0), n ? 1e-6f : 1};
			float grid[3] = {-1, -1, -1};
			rbf_dhr_from_grid(c, d, grid);
			assert_true(grid[0] >= 0 && grid[0] < 10);
		}
	}
}

/* A table that jumps along edges: the cells there are marked, and no others suffer. */
static void jumps_are_marked(void **state)
{
	(void)state;
	for (int k = 2; k < MODELS; k++) {
		bsdfrbf_model *model = model_of_form[k];
		rbf_component *c = &model->component[BSDFRBF_RF];
		const size_t nodes = (size_t)rbf_dhr_element_nodes(c) * c->channels;
		for (uint32_t e = 0; e < c->mesh.elements; e += 8)
			for (size_t i = 0; i < nodes; i++)
				((float *)c->dhr)[e * nodes + i] *= .8f;
		free((void *)c->dhr_grid);
		c->dhr_grid = NULL;
		c->dhr_cells = 0;
		assert_int_equal(rbf_assemble_dhr_grid(c), 0);
		assert_non_null(c->dhr_grid);
		assert_true(agrees(model, "jumps") > .5);
	}
}

/* A table that tells nothing from one node to the next has none, and is asked itself. */
static void noise_has_none(void **state)
{
	(void)state;
	bsdfrbf_model *model = model_of_form[MODELS - 1];
	rbf_component *c = &model->component[BSDFRBF_RF];
	uint64_t seed = 8;
	for (size_t i = 0; i < c->mesh.elements * (size_t)rbf_dhr_element_nodes(c); i++)
		((float *)c->dhr)[i] *= (float)(1 + .2 * random_unit(&seed));
	free((void *)c->dhr_grid);
	c->dhr_grid = NULL;
	c->dhr_cells = 0;
	assert_int_equal(rbf_assemble_dhr_grid(c), 0);
	assert_null(c->dhr_grid);
	assert_int_equal(c->dhr_cells, 0);
	float d[3], table[3], value[3];
	direction_of(&seed, .2, d);
	rbf_component_dhr(c, d, table);
	bsdfrbf_dhr_scatter(model, d, 0, value);
	assert_memory_equal(value, table, sizeof *value);
}

/* It comes back from a file, and is a small part of all arrays; and a file without it answers by the table. */
static void is_recorded(void **state)
{
	(void)state;
	char path[] = "/tmp/rbf-dhr-grid-XXXXXX";
	const int file = mkstemp(path);
	assert_true(file >= 0 && close(file) == 0);
	for (int k = 0; k < MODELS; k++)
		for (int without = 0; without < 2; without++) {
			bsdfrbf_model *model = model_of_form[k], *back;
			rbf_component *c = &model->component[BSDFRBF_RF];
			const uint32_t y = rbf_luminance(c->channels);
			uint64_t seed = 4, all = 0, grid = 0;
			const uint16_t *kept = c->dhr_grid;
			c->dhr_grid = without ? NULL : kept;
			assert_int_equal(bsdfrbf_save(NULL, model, path), BSDFRBF_OK);
			assert_int_equal(bsdfrbf_open(NULL, path, &back), BSDFRBF_OK);
			for (int i = 0; i < 500; i++) {
				float d[3], before[3], after[3];
				direction_of(&seed, .01, d);
				bsdfrbf_dhr(model, d, 0, before);
				bsdfrbf_dhr(back, d, 0, after);
				assert_memory_equal(before, after, c->channels * sizeof *after);
				if (without) {
					rbf_component_dhr(c, d, before);
					assert_float_equal(after[y], before[y] + c->lambertian[y], 1e-6);
				}
			}
			for (int i = 0; i < bsdfrbf_get_section(model, -1, NULL, NULL, NULL); i++) {
				const char *name;
				uint64_t bytes;
				bsdfrbf_get_section(model, i, &name, NULL, &bytes);
				all += bytes;
				grid += strcmp(name, "dhr grid") ? 0 : bytes;
			}
			assert_true(without ? grid == 0 : grid > 0 && grid < all / 30);
			bsdfrbf_close(back);
			c->dhr_grid = kept;
		}
	unlink(path);
}

static int setup(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++)
		model_of_form[k] = make(k);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int k = 0; k < MODELS; k++)
		bsdfrbf_close(model_of_form[k]);
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(answers_as_the_table),
		cmocka_unit_test(is_recorded),
		cmocka_unit_test(jumps_are_marked), /* from here on, the models' tables are spoilt */
		cmocka_unit_test(noise_has_none),
	};
	return cmocka_run_group_tests(tests, setup, teardown);
}
