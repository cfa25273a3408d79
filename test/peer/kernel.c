/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * kernel RBF: how far evaluation is from the pure cost of its exponentials. Prints, in nanoseconds: an exponential by libm and by
 * libmvec (eight at a time), a lobe of our kernel with nothing culled, a random pair; and the lobes that a pair sums.
 * test/bench compiles this with -mavx2 -mfma -ffast-math, which lets the compiler call libmvec, and with
 * --wrap=rbf_kernel_sum, by which the lobes are counted.
 */
#include "clock.h"
#include "bsdfrbf.h"
#include "kernel.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { LOBES = 1024, PAIRS = 20000, ROUNDS = 9 };

static float argument[LOBES], result[LOBES];
static rbf_block block[LOBES / RBF_LANES];
static rbf_amplitude amplitude[LOBES / RBF_LANES];
static float incident[PAIRS][3], outgoing[PAIRS][3];
static volatile float sink;
static int counting;
static unsigned long long lobes;

void __real_rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);
void __wrap_rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3]);
void __wrap_rbf_kernel_sum(const rbf_kernel_job *job, uint32_t jobs, const rbf_kernel_lobes *of, float sum[3])
{
	for (uint32_t j = 0; counting && j < jobs; j++) {
		const uint32_t group = rbf_cull_group(job[j].blocks);
		for (uint32_t g = 0; g * group < job[j].blocks; g++)
			if (job[j].mask >> g & 1) {
				const uint32_t left = job[j].blocks - g * group;
				lobes += RBF_LANES * (left < group ? left : group);
			}
	}
	__real_rbf_kernel_sum(job, jobs, of, sum);
}

static void direction(float least_z, int sign, float d[3])
{
	const double z = (double)least_z + (1 - (double)least_z) * uniform(), phi = 2 * RBF_PI * uniform(), r = sqrt(1 - z*z);
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)(sign * z);
}

/* The arrays may be read and written here, for all that the compiler knows: nothing is left out as done before. */
#define UNKNOWN() __asm__ volatile("" : : "r"(argument), "r"(result) : "memory")

static void scalar_exponentials(void)
{
	for (int k = 0; k < LOBES; k++) {
		result[k] = expf(argument[k]);
		UNKNOWN(); /* one by one */
	}
}

static void vector_exponentials(void)
{
	for (int k = 0; k < LOBES; k++)
		result[k] = expf(argument[k]);
	UNKNOWN();
}

/* Sixteen sets of 64 lobes, as a model has them, none of them culled. */
static void all_lobes(void)
{
	enum { SETS = 16, BLOCKS = LOBES / RBF_LANES / SETS };
	rbf_kernel_job job[SETS];
	float sum[3];
	for (int s = 0; s < SETS; s++)
		job[s] = (rbf_kernel_job){.direction = {0, 0, 1}, .weight = 1, .mask = rbf_cull_all(BLOCKS), .first = s * BLOCKS, .blocks = BLOCKS};
	rbf_kernel_sum(job, SETS, &(rbf_kernel_lobes){block, amplitude, 0, 1, 1}, sum);
	sink += sum[0];
}

static const bsdfrbf_model *model;
static void pairs(void)
{
	float value[3];
	for (int k = 0; k < PAIRS; k++) {
		bsdfrbf_eval(model, incident[k], outgoing[k], value);
		sink += value[0];
	}
}

static const struct { const char *name; void (*run)(void); int calls, count; } timed[] = {
	{"libm exp", scalar_exponentials, 2000, LOBES},
	{"libmvec exp", vector_exponentials, 10000, LOBES},
	{"kernel lobe", all_lobes, 5000, LOBES},
	{"pair", pairs, 1, PAIRS},
};

static int ascending(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
	enum { KINDS = sizeof timed / sizeof *timed };
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_model *opened;
	if (argc != 2 || bsdfrbf_open(context, argv[1], &opened)) {
		fprintf(stderr, "kernel: %s\n", argc == 2 ? bsdfrbf_message(context) : "needs an .rbf file");
		return 1;
	}
	model = opened;
	int component = BSDFRBF_RF;
	while (component < BSDFRBF_TB && !bsdfrbf_has(model, component))
		component++;
	const int front = component == BSDFRBF_RF || component == BSDFRBF_TF;
	for (int k = 0; k < PAIRS; k++) {
		direction(.15f, front ? 1 : -1, incident[k]);
		direction(.1f, front == (component >= BSDFRBF_TF) ? -1 : 1, outgoing[k]);
	}
	for (int k = 0; k < LOBES; k++) {
		float c[3];
		direction(0, 1, c);
		argument[k] = (float)(-20 * uniform());
		block[k / RBF_LANES].x[k % RBF_LANES] = c[0];
		block[k / RBF_LANES].y[k % RBF_LANES] = c[1];
		block[k / RBF_LANES].z[k % RBF_LANES] = c[2];
		block[k / RBF_LANES].k[k % RBF_LANES] = (float)(1 + 30 * uniform());
		amplitude[k / RBF_LANES].a[k % RBF_LANES] = 1;
	}
	double seconds[KINDS][ROUNDS];
	for (int r = -1; r < ROUNDS; r++) /* the first is to warm up */
		for (int t = 0; t < KINDS; t++) {
			const double start = now();
			for (int c = 0; c < timed[t].calls; c++)
				timed[t].run();
			if (r >= 0)
				seconds[t][r] = now() - start;
		}
	for (int t = 0; t < KINDS; t++) {
		qsort(seconds[t], ROUNDS, sizeof **seconds, ascending);
		printf("%s\t%.4f\n", timed[t].name, 1e9 * seconds[t][ROUNDS / 2] / timed[t].calls / timed[t].count);
	}
	counting = 1;
	pairs();
	printf("lobes of a pair\t%.1f\n", (double)lobes / PAIRS);
	bsdfrbf_close(opened);
	bsdfrbf_context_free(context);
	return 0;
}
