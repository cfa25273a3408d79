/* SPDX-License-Identifier: BSD-3-Clause */
/* Components of random lobes, in every map and with residual motion, that no measurement would ask for. Include after model_fixture.h. */
#ifndef TEST_RANDOM_MODEL_H
#define TEST_RANDOM_MODEL_H
#include "assemble.h"
#include "dhr.h"
#include "levels.h"
#include "moves.h"
#include "tune.h"

typedef struct random_plan {
	rbf_symmetry symmetry;
	int thetas, phis;
	double theta[8], phi_step;
	uint32_t frames, frame[RBF_MAX_FRAMES], lobes;
	double kappa_low, kappa_high, motion; /* of the lobes; rad */
	uint32_t channels;
	double span;  /* amplitudes vary by this factor, evenly in their logarithm; 0: by no more than chance */
	int odd;      /* 1: some lobes are equal, some have no mass, some incidences none at all */
	uint32_t even; /* of levels, in halves; with slopes */
	int tuned;     /* 1: light is */
	double limit; /* of the last frame's shares, smaller ones of the others; 0: those of the maps */
	int no_dhr;   /* 1: the table of DHR, which takes longest, says .5 everywhere */
} random_plan;

enum { RANDOM_BASES = 64 };

/* The incidences of a plan; direction has room for RANDOM_BASES. Returns how many. */
static inline uint32_t random_rings(const random_plan *p, double *direction)
{
	uint32_t bases = 0;
	for (int t = 0; t < p->thetas; t++)
		for (int a = 0; a < (p->theta[t] > 0 ? p->phis : 1); a++) {
			assert_true(bases < RANDOM_BASES);
			polar(p->theta[t], a * p->phi_step, direction + 3 * bases++);
		}
	return bases;
}

/* Coefficients of a learned map, such as the symmetry allows: 0 where a mirrored incidence would not get a mirrored beam. */
static inline rbf_linear random_linear(rbf_symmetry symmetry, uint64_t *seed)
{
	static const struct { rbf_symmetry symmetry; float allowed[8]; } row[] = {
		{RBF_ISOTROPIC, {1}},
		{RBF_QUADRILATERAL, {1, 0, 0, 0, 0, 1, 0, 0}},
		{RBF_BILATERAL_Y, {1, 0, 1, 1, 0, 1, 0, 0}},
		{RBF_BILATERAL_X, {1, 0, 0, 0, 0, 1, 1, 1}},
		{RBF_UP, {1, 1, 0, 0, 1, 1, 0, 0}},
		{RBF_ANISOTROPIC, {1, 1, 1, 1, 1, 1, 1, 1}},
	};
	rbf_linear linear = {{{0}}};
	for (size_t r = 0; r < sizeof row / sizeof *row; r++)
		for (int n = 0; n < 8 && row[r].symmetry == symmetry; n++)
			linear.row[n / 4][n % 4] = row[r].allowed[n] * (float)(2.4 * random_unit(seed) - 1.2);
	return linear;
}

/* Mirror operations that leave measured incidence b where it is. Returns how many, itself included. */
static inline uint32_t random_images(const rbf_mesh *mesh, uint32_t b, unsigned op[4])
{
	int all[4];
	const int ops = mesh->symmetry == RBF_ISOTROPIC ? 0 : rbf_symmetry_ops(mesh->symmetry, all);
	uint32_t count = 1, v = 0;
	op[0] = 0;
	while (v + 1 < mesh->vertices && mesh->vertex[v].base != b)
		v++;
	const float *d = mesh->vertex[v].direction;
	for (int k = 1; k < ops; k++)
		if ((!(all[k] & RBF_OP_X) || d[0] == 0) && (!(all[k] & RBF_OP_Y) || d[1] == 0))
			op[count++] = (unsigned)all[k];
	return count;
}

/* On a mirror axis a material is its own image: every lobe of base b becomes one of the images of the first of its group. */
static inline void random_own_image(rbf_lobes *l, const unsigned op[4], uint32_t images)
{
	for (uint32_t i = 0; images > 1 && i < l->count; i++) {
		const uint32_t first = i - i % images;
		float centre[3], image[3];
		rbf_lobe_centre(l, first, centre);
		rbf_mirror(op[i % images], centre, image);
		rbf_lobe_set(l, i, image, rbf_lobe_kappa(l, first));
		const int whole = first + images <= l->count;
		for (uint32_t n = 0; n < l->channels; n++) {
			rbf_amplitude *a = l->amplitude + n * l->blocks;
			a[i / RBF_LANES].a[i % RBF_LANES] = whole ? a[first / RBF_LANES].a[first % RBF_LANES] : 0;
		}
		l->mass[i] = whole ? l->mass[first] : 0;
	}
}

/* Component rf over given incidences; thetas, phis and phi_step of the plan are not used. The model owns all; free with
 * bsdfrbf_close(). NULL if no mesh can be made of the incidences. */
static inline bsdfrbf_model *random_model_at(const random_plan *p, uint32_t bases, const double *direction, uint64_t seed)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_model *model = rbf_model_new();
	rbf_fitted fitted = {.symmetry = p->symmetry, .channels = p->channels, .direction = direction, .bases = bases};
	rbf_component *c = &model->component[BSDFRBF_RF];
	if (rbf_mesh_build(context, p->symmetry, fitted.bases, direction, NULL, &fitted.mesh) != BSDFRBF_OK) {
		bsdfrbf_context_free(context);
		bsdfrbf_close(model);
		return NULL;
	}
	fitted.lobes = calloc(fitted.bases, sizeof *fitted.lobes);
	uint32_t *images = calloc(fitted.bases, sizeof *images);
	for (uint32_t b = 0; b < fitted.bases; b++) {
		rbf_lobes *l = &fitted.lobes[b];
		assert_int_equal(rbf_lobes_new(l, p->lobes, p->channels), 0);
		for (uint32_t i = 0; i < p->lobes; i++) {
			const double z = random_unit(&seed), phi = 2 * RBF_PI * random_unit(&seed), s = sqrt(1 - z*z);
			const float centre[3] = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)z};
			const double kappa = p->kappa_low * pow(p->kappa_high / p->kappa_low, random_unit(&seed));
			rbf_lobe_set(l, i, centre, (float)kappa);
			double scale = sqrt(kappa) / p->lobes * (p->span > 1 ? pow(p->span, random_unit(&seed)) : 1);
			if (p->odd && (i % 11 == 5 || b % 7 == 3))
				scale = 0;
			for (uint32_t n = 0; n < p->channels; n++)
				l->amplitude[n * l->blocks + i / RBF_LANES].a[i % RBF_LANES] = (float)(random_unit(&seed) * scale);
			if (p->odd && i % 5 == 4) { /* like the one before */
				float same[3];
				rbf_lobe_centre(l, i - 1, same);
				rbf_lobe_set(l, i, same, rbf_lobe_kappa(l, i - 1));
			}
			l->mass[i] = (double)rbf_lobe_amplitude(l, rbf_luminance(p->channels), i) * rbf_lobe_integral((double)rbf_lobe_kappa(l, i));
		}
		unsigned op[4];
		images[b] = random_images(&fitted.mesh, b, op);
		random_own_image(l, op, images[b]);
		assert_int_equal(rbf_lobes_finish(l), 0);
	}
	assert_int_equal(rbf_label_prepare(&fitted), 0);
	for (unsigned map = RBF_MAPS_LISTED; map < RBF_MAPS; map++) { /* a candidate's index is then its map's id */
		const rbf_linear linear = random_linear(p->symmetry, &seed);
		assert_int_equal(rbf_label_add(&fitted, map, &linear), 0);
	}
	const uint32_t lobes = fitted.lobe_first[fitted.bases];
	float *label = calloc((size_t)p->frames * lobes, sizeof *label);
	for (uint32_t i = 0; i < lobes; i++) {
		const uint32_t a = (uint32_t)(random_unit(&seed) * p->frames), b = (uint32_t)(random_unit(&seed) * p->frames);
		const float part = i % 3 ? 1 : (float)random_unit(&seed);
		label[a * lobes + i] += part;
		label[b * lobes + i] += 1 - part;
	}
	for (uint32_t b = 0; b < fitted.bases; b++)
		for (uint32_t i = 0; i < fitted.lobes[b].count; i++)
			for (uint32_t f = 0; f < p->frames; f++) {
				float *own = label + f * lobes + fitted.lobe_first[b];
				own[i] = own[i - i % images[b]];
			}
	free(images);
	float limit[RBF_MAX_FRAMES];
	for (uint32_t f = 0; f < p->frames; f++)
		limit[f] = p->limit > 0 ? (float)(1 + (p->limit - 1) * (f + 1) / p->frames) : 0;
	assert_int_equal(rbf_assemble_sets(&fitted, p->frames, p->frame, label, limit, c), 0);
	assert_int_equal(rbf_levels_make(&fitted, p->even, 1, c), 0);
	if (p->motion > 0) {
		/* one motion for each pair of vertices, whichever elements share it */
		const uint32_t slots = c->mesh.elements * 6;
		uint32_t *of = malloc((slots + 1) * sizeof *of), total = 0;
#define MOVED(at) c->mesh.element[(at) / 6].v[(at) % 6 / 2]
#define TOWARDS(at) c->mesh.element[(at) / 6].v[((at) % 6 / 2 + 1 + (at) % 2) % 3]
		for (uint32_t at = 0; at < slots; at++) {
			uint32_t same = 0;
			while (same < at && (MOVED(same) != MOVED(at) || TOWARDS(same) != TOWARDS(at)))
				same++;
			of[at] = same < at ? of[same] : total;
			total += same < at ? 0 : rbf_assemble_blocks(c, c->mesh.vertex[MOVED(at)].base);
		}
#undef MOVED
#undef TOWARDS
		rbf_shift *shift = calloc(total, sizeof *shift);
		for (uint32_t i = 0; i < total * RBF_LANES; i++) {
			float *at[3] = {shift[i / RBF_LANES].x, shift[i / RBF_LANES].y, shift[i / RBF_LANES].z};
			for (int n = 0; n < 3; n++)
				at[n][i % RBF_LANES] = (float)(p->motion * (random_unit(&seed) - .5));
		}
		c->shift_of = of;
		c->shift = shift;
		c->shifts = total;
		c->residual = 1;
		assert_int_equal(rbf_moves_round(c), 0);
	}
	assert_int_equal(rbf_assemble_cull(NULL, c, p->motion > 0 ? (float)p->motion : 0), 0);
	if (p->tuned)
		assert_int_equal(rbf_tune_make(&fitted, 1, c), 0);
	if (p->no_dhr) {
		c->dhr_steps = 2;
		const size_t nodes = (c->mesh.elements * (size_t)rbf_dhr_element_nodes(c) + c->mesh.borders * (size_t)rbf_dhr_border_nodes(c)) * c->channels;
		float *table = malloc(nodes * sizeof *table);
		for (size_t n = 0; n < nodes; n++)
			table[n] = .5f;
		c->dhr = table;
	} else
		assert_int_equal(rbf_assemble_dhr(NULL, c) || rbf_assemble_dhr_grid(c), 0);
	c->base_info = calloc(fitted.bases, sizeof *c->base_info);
	c->present = 1;
	model->channels = p->channels;
	free(label);
	rbf_label_release(&fitted);
	for (uint32_t b = 0; b < fitted.bases; b++)
		rbf_lobes_free(&fitted.lobes[b]);
	free(fitted.lobes);
	bsdfrbf_context_free(context);
	return model;
}

static inline bsdfrbf_model *random_model(const random_plan *p, uint64_t seed)
{
	double direction[3 * RANDOM_BASES];
	const uint32_t bases = random_rings(p, direction);
	bsdfrbf_model *model = random_model_at(p, bases, direction, seed);
	assert_non_null(model);
	return model;
}

static const random_plan random_plans[] = {
	{RBF_BILATERAL_Y, 5, 5, {0, 25, 50, 70, 84}, 45, 4, {RBF_MAP_FIXED, RBF_MAP_MIRROR, RBF_MAP_XFLIP, RBF_MAP_YFLIP}, 60, 10, 3000, 0, 1, 0, 0, 2, 0, 3, 0},
	{RBF_QUADRILATERAL, 5, 4, {0, 25, 50, 70, 86}, 30, 3, {RBF_MAP_RETRO, RBF_MAP_HALF, RBF_MAP_SHIFT}, 60, 10, 3000, .15, 3, 0, 0, 1, 1, 0, 0},
	{RBF_ISOTROPIC, 5, 1, {0, 25, 50, 70, 80}, 0, 1, {RBF_MAP_HALF}, 60, 3, 3000, .2, 1, 0, 0, 2, 1, 1, 0},
	{RBF_ANISOTROPIC, 3, 6, {25, 55, 80}, 60, 1, {RBF_MAP_HALF}, 48, 10, 300, 0, 1, 0, 0, 0, 1, 2.5, 0},
	{RBF_UP, 5, 5, {0, 25, 50, 70, 84}, 45, 3, {RBF_MAP_LEARNED_SHIFT, RBF_MAP_LEARNED_TURN, RBF_MAP_FIXED}, 60, 10, 3000, .1, 1, 0, 0, 0, 0, 1.25, 0},
};
enum { RANDOM_PLANS = sizeof random_plans / sizeof *random_plans };
#endif
