/* SPDX-License-Identifier: BSD-3-Clause */
/* Sampling of what evaluate.h evaluates: the same terms, drawn instead of summed. */
#ifndef RBF_SAMPLE_H
#define RBF_SAMPLE_H
#include "draws.h"
#include "evaluate.h"

/* What all draws at one site have in common. A part is one table of one corner and frame. */
typedef struct rbf_sampler {
	uint32_t parts;
	float clear[RBF_MAX_FRAMES];       /* z of exitant directions from which on no corner of a frame takes over from another */
	float band[RBF_MAX_FRAMES];        /* the same of directions at the corners */
	float excess[3];                   /* by how much the share of a corner can be above 1 */
	double running[3 * RBF_SITE_JOBS]; /* sum of the parts' bounds */
	struct rbf_sampler_part {
		const rbf_set *set;
		uint8_t corner, frame, table;
	} part[3 * RBF_SITE_JOBS];
} rbf_sampler;

void rbf_sampler_set(const rbf_site *site, rbf_sampler *sampler);

/* Draws an exitant direction in the component's half space (not folded), density proportional to the
 * luminance of DSF without the Lambertian part. Returns 1, or 0 if there is nothing to draw. */
int rbf_site_sample(const rbf_site *site, const rbf_sampler *sampler, double u, float exitant[3]);

/* One number of [0, 1) into two, by its odd and even bits: what was stratified stays so in both. */
void rbf_split_number(double u, double *a, double *b);

/* A number of [0, 1) from a state that any number may start. */
double rbf_uniform(uint64_t *state);

/* Centre of a corner's lobe with the site's residual motion, in the base's coordinates. */
void rbf_site_centre(const rbf_site *site, uint32_t corner, uint32_t block, uint32_t lane, float centre[3]);

/* Direction from a lobe exp(kappa (cos - 1)), kappa > 0, by two numbers of [0, 1); may lie below the horizon. */
void rbf_lobe_draw(const float centre[3], float kappa, double u, double v, float out[3]);
#endif
