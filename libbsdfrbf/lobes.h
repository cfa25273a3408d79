/* SPDX-License-Identifier: BSD-3-Clause */
/* The lobes of one incidence as fitted: blocks of eight, ready for the kernel. */
#ifndef RBF_LOBES_H
#define RBF_LOBES_H
#include "kernel.h"
#include "team.h"

typedef struct rbf_lobes {
	uint32_t count, blocks, channels;
	rbf_block *block;          /* [blocks] */
	rbf_amplitude *amplitude;  /* [channels][blocks] */
	double *mass;              /* [count] energy of each lobe, luminance, sr; over the whole sphere */
	float *extent;              /* by extent.h, set by rbf_lobes_finish(): what sums need not look at */
} rbf_lobes;

/* Room for `count` lobes, all amplitudes 0. Returns 0, or -1 when out of memory. */
int rbf_lobes_new(rbf_lobes *lobes, uint32_t count, uint32_t channels);
void rbf_lobes_free(rbf_lobes *lobes);

int rbf_lobes_copy(const rbf_lobes *lobes, rbf_lobes *copy); /* returns as above */

static inline void rbf_lobe_centre(const rbf_lobes *l, uint32_t i, float centre[3])
{
	const rbf_block *b = &l->block[i / RBF_LANES];
	centre[0] = b->x[i % RBF_LANES];
	centre[1] = b->y[i % RBF_LANES];
	centre[2] = b->z[i % RBF_LANES];
}

static inline float rbf_lobe_kappa(const rbf_lobes *l, uint32_t i)
{
	return l->block[i / RBF_LANES].k[i % RBF_LANES];
}

static inline float rbf_lobe_amplitude(const rbf_lobes *l, uint32_t channel, uint32_t i)
{
	return l->amplitude[channel * l->blocks + i / RBF_LANES].a[i % RBF_LANES];
}

/* Once all lobes are set; before it nothing is summed. Returns 0, or -1 when out of memory. */
int rbf_lobes_finish(rbf_lobes *lobes);

void rbf_lobe_set(rbf_lobes *l, uint32_t i, const float centre[3], float kappa);

/* Fits of `count` incidences, made where they are rbf_team_mine(): all get all. Returns 0, or -1 when out of memory or a process
 * gave up. */
int rbf_lobes_share(const rbf_team *team, uint32_t count, uint32_t channels, rbf_lobes *lobes);

/* Blocks from `first` on that one mask tells of. */
static inline uint32_t rbf_lobes_rest(const rbf_lobes *l, uint32_t first)
{
	return l->blocks - first < RBF_CULL_BITS ? l->blocks - first : RBF_CULL_BITS;
}

/* DSF of all lobes at a direction. */
void rbf_lobes_sum(const rbf_lobes *l, const float direction[3], float value[3]);
float rbf_lobes_luminance(const rbf_lobes *l, const float direction[3]);
#endif
