/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * timing RBF XML [QUESTIONS]: what a renderer asks (only the first of its questions, if a number of them is given), put in turn to a record and to a tensor tree through Radiance's own library (bsdf.h), one
 * after the other in every round. Prints a line for each question: name, nanoseconds a call of ours and of the peer's
 * (medians of the rounds' processor time). test/bench compiles this against build/radiance/source/common when it runs.
 * Random numbers are the same for both; directions fill the solid angle up to 81 degrees of incidence and 84 of exitance.
 */
#include "clock.h"
#include "bsdfrbf.h"

#include <math.h>
#include <stdio.h>
#include "bsdf.h" /* needs stdio.h */

#include <stdlib.h>
#include <string.h>

enum { COUNT = 10000, RUN = 100, ROUNDS = 9 };

static const char *record_path, *tree_path;
static bsdfrbf_model *model;
static SDData tree;
static SDComponent *scattering;
static int transmit, channels;
static float incident[COUNT][3], outgoing[COUNT][3], values[COUNT * 3];
static double incident_d[COUNT][3], outgoing_d[COUNT][3], number[COUNT];
static volatile double sink;

static void direction(double least_z, int sign, float f[3], double d[3])
{
	const double z = least_z + (1 - least_z) * uniform(), phi = 2 * 3.14159265358979 * uniform(), r = sqrt(1 - z*z);
	const double v[3] = {r * cos(phi), r * sin(phi), sign * z};
	for (int k = 0; k < 3; k++)
		d[k] = f[k] = (float)v[k];
}

static void our_pairs(void)
{
	for (int k = 0; k < COUNT; k++)
		bsdfrbf_eval(model, incident[k], outgoing[k], values);
}

static void our_pairs_at_once(void)
{
	bsdfrbf_eval_many(model, COUNT, incident[0], outgoing[0], values);
}

static void our_exitants(void)
{
	for (int k = 0; k < COUNT; k += RUN)
		bsdfrbf_eval_exitant(model, incident[k], RUN, outgoing[k], values);
}

static void their_pairs(void)
{
	SDValue value;
	for (int k = 0; k < COUNT; k++) {
		SDevalBSDF(&value, incident_d[k], outgoing_d[k], &tree);
		sink += value.cieY;
	}
}

static void their_exitants(void)
{
	SDValue value;
	for (int k = 0; k < COUNT; k++) {
		SDevalBSDF(&value, incident_d[k - k % RUN], outgoing_d[k], &tree);
		sink += value.cieY;
	}
}

static void our_samples(int run)
{
	float out[3];
	for (int k = 0; k < COUNT; k++) {
		bsdfrbf_sample(model, incident[k - k % run], transmit, number[k], out);
		sink += (double)out[2];
	}
}

/* The density alone: SDsampBSDF() would evaluate as well. */
static void their_samples(int run)
{
	for (int k = 0; k < COUNT; k++) {
		const double *in = incident_d[k - k % run];
		const SDCDst *density = scattering->func->getCDist(in, scattering);
		double out[3] = {in[0], in[1], in[2]};
		if (density)
			scattering->func->sampCDist(out, number[k], density);
		sink += out[2];
	}
}

static void our_samples_here(void) { our_samples(COUNT); }
static void their_samples_here(void) { their_samples(COUNT); }
static void our_samples_scattered(void) { our_samples(1); }
static void their_samples_scattered(void) { their_samples(1); }

static void our_samples_here_at_once(void)
{
	static float here[COUNT][3];
	for (int k = 0; k < COUNT; k++)
		memcpy(here[k], incident[0], sizeof here[k]);
	bsdfrbf_sample_many(model, COUNT, here[0], transmit, number, values);
}

static void our_samples_at_once(void)
{
	bsdfrbf_sample_many(model, COUNT, incident[0], transmit, number, values);
}

static void our_dhr(void)
{
	for (int k = 0; k < COUNT; k++)
		bsdfrbf_dhr(model, incident[k], transmit, values);
}

static void their_dhr(void)
{
	for (int k = 0; k < COUNT; k++)
		sink += SDdirectHemi(incident_d[k], SDsampSp | SDsampDf | (transmit ? SDsampT : SDsampR), &tree);
}

static void our_size(void)
{
	float least, most;
	for (int k = 0; k < COUNT; k++) {
		bsdfrbf_resolution(model, incident[k], outgoing[k], transmit, &least, &most);
		sink += (double)most;
	}
}

static void their_size(void)
{
	double size[2];
	for (int k = 0; k < COUNT; k++) {
		SDsizeBSDF(size, incident_d[k], outgoing_d[k], SDqueryMin + SDqueryMax, &tree);
		sink += size[1];
	}
}

static void our_start(void)
{
	bsdfrbf_model *m;
	if (bsdfrbf_open(NULL, record_path, &m))
		exit(1);
	bsdfrbf_eval(m, incident[0], outgoing[0], values);
	bsdfrbf_close(m);
}

static void their_start(void)
{
	SDData data;
	SDValue value;
	SDclearBSDF(&data, tree_path);
	if (SDloadFile(&data, tree_path))
		exit(1);
	SDevalBSDF(&value, incident_d[0], outgoing_d[0], &data);
	sink += value.cieY;
	SDfreeBSDF(&data);
}

/* The scattered ones go last: after them the tree keeps 10,000 tables. */
static const struct { const char *name; void (*ours)(void), (*theirs)(void); int calls; } question[] = {
	{"pair", our_pairs, their_pairs, COUNT},
	{"pairs in one call", our_pairs_at_once, their_pairs, COUNT},
	{"exitants at one incidence", our_exitants, their_exitants, COUNT},
	{"resolution", our_size, their_size, COUNT},
	{"sample at one incidence", our_samples_here, their_samples_here, COUNT},
	{"samples at one incidence in one call", our_samples_here_at_once, their_samples_here, COUNT},
	{"open and one pair", our_start, their_start, 1},
	{"sample at scattered incidences", our_samples_scattered, their_samples_scattered, COUNT},
	{"samples in one call", our_samples_at_once, their_samples_scattered, COUNT},
	{"DHR", our_dhr, their_dhr, COUNT},
};

static int ascending(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	if (argc < 3 || bsdfrbf_open(context, argv[1], &model)) {
		fprintf(stderr, "timing: %s\n", argc >= 3 ? bsdfrbf_message(context) : "needs an .rbf file and a tensor tree");
		return 1;
	}
	record_path = argv[1];
	tree_path = argv[2];
	SDclearBSDF(&tree, tree_path);
	int component = BSDFRBF_RF;
	while (component < BSDFRBF_TB && !bsdfrbf_has(model, component))
		component++;
	transmit = component >= BSDFRBF_TF;
	channels = bsdfrbf_channels(model);
	const int front = component == BSDFRBF_RF || component == BSDFRBF_TF;
	if (SDloadFile(&tree, argv[2])) {
		fprintf(stderr, "timing: Radiance cannot load %s: %s\n", argv[2], SDerrorDetail);
		return 1;
	}
	const SDSpectralDF *side = component == BSDFRBF_RF ? tree.rf : component == BSDFRBF_RB ? tree.rb : component == BSDFRBF_TF ? tree.tf : tree.tb;
	if (!side || !side->ncomp || channels != 1) {
		fprintf(stderr, "timing: %s has not the component that %s has, or it is coloured\n", argv[2], argv[1]);
		return 1;
	}
	scattering = (SDComponent *)side->comp;
	for (int k = 0; k < COUNT; k++) {
		direction(.15, front ? 1 : -1, incident[k], incident_d[k]);
		direction(.1, front == transmit ? -1 : 1, outgoing[k], outgoing_d[k]);
		number[k] = uniform();
	}
	size_t questions = sizeof question / sizeof *question;
	if (argc > 3 && (size_t)atoi(argv[3]) < questions)
		questions = (size_t)atoi(argv[3]);
	for (size_t q = 0; q < questions; q++) {
		double ours[ROUNDS], theirs[ROUNDS];
		for (int r = -1; r < ROUNDS; r++) { /* the first is to warm up */
			const double start = now();
			question[q].ours();
			const double middle = now();
			question[q].theirs();
			const double end = now();
			if (r >= 0) {
				ours[r] = middle - start;
				theirs[r] = end - middle;
			}
		}
		qsort(ours, ROUNDS, sizeof *ours, ascending);
		qsort(theirs, ROUNDS, sizeof *theirs, ascending);
		printf("%s\t%.3f\t%.3f\n", question[q].name, 1e9 * ours[ROUNDS / 2] / question[q].calls, 1e9 * theirs[ROUNDS / 2] / question[q].calls);
		fflush(stdout);
	}
	SDfreeBSDF(&tree);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return 0;
}
