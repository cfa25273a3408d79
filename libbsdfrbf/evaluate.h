/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of one component at one incident direction. A site is the per-incidence state; it lives on the stack. */
#ifndef RBF_EVALUATE_H
#define RBF_EVALUATE_H
#include "fan.h"
#include "kernel.h"
#include "shares.h"

#if RBF_ABREAST != 1
#error "a site has four lanes"
#endif

/* Exitant directions closer to the horizon than this z have their value limited, so that f stays finite. */
#define RBF_HORIZON_Z 0.01f

#define RBF_SITE_JOBS (3 * RBF_MAX_FRAMES)

typedef struct rbf_site {
	const rbf_component *component;
	float incident[3];          /* in the component's half space, folded */
	unsigned op;                /* operation that folded it */
	float cosine, sine;         /* isotropic: rotation by minus the incident azimuth */
	uint32_t corners;           /* those with weight > 0 */
	uint32_t base[3], vertex_op[3];
	float weight[RBF_FAN];      /* 0 beyond the corners */
	float part[RBF_FAN];        /* the same times what evens their levels (model.h): what each sends, before shares and maps */
	float direction[3][RBF_FAN]; /* measured directions of the corners */
	float flip[2][RBF_FAN];     /* signs by which vertex_op mirrors */
	float scale;                /* of all values: 1, but less outside the mesh where energy would grow */
	float tune;                 /* of all parts: 1, but where light is tuned */
	int moves;                  /* whether any corner's lobes do */
	rbf_motion motion[3];       /* residual, of each corner; its shifts begin with those of the base's first set */
	rbf_fan fan[RBF_MAX_FRAMES];
} rbf_site;

/* Prepares a site. incident: unit, z > 0, half space of the component. */
void rbf_site_locate(const rbf_component *component, const float incident[3], rbf_site *site);

/* The same in steps, for several sites at once: rbf_site_turn(), then where in the mesh it is, then the rest but for the scale, which samples
 * do without. */
typedef struct rbf_spot {
	uint32_t item;
	float weight[3];
} rbf_spot;
void rbf_site_find(const rbf_site *site, rbf_spot *at);
void rbf_site_settle(rbf_site *site, const rbf_spot *at);
void rbf_site_limit(rbf_site *site, const rbf_spot *at); /* the scale */

/* Members of a site that is not made: tune (of a component that has it), and scale at a folded incident direction. */
float rbf_site_tune(const rbf_component *component, const rbf_spot *at);
float rbf_site_scale(const rbf_component *component, const rbf_spot *at, const float incident[3]);

/* The same at a given place of the mesh: item and weights as rbf_mesh_locate() gives them, and an incident direction that is not folded
 * and need not be the one of the weights. What lies outside the mesh is not limited. */
void rbf_site_place(const rbf_component *component, uint32_t item, const float weight[3], const float incident[3], rbf_site *site);

/* The same with given corners (vertices of the component's mesh) and without residual motion; the caller may set motion[] and moves. */
void rbf_site_corners(const rbf_component *component, const float incident[3], const rbf_vertex vertex[3], const float weight[3],
	rbf_site *site);

/* Evens the levels of a site that has its corners, by `even` halves; level: of each corner. */
void rbf_site_even(rbf_site *site, uint32_t even, const rbf_level level[3]);

/* Only which operation (or rotation) folds a direction, and site->incident, the folded one. */
void rbf_site_turn(const rbf_component *component, const float incident[3], rbf_site *site);

/* Turns an exitant direction into the site's folded coordinates, and back. */
void rbf_site_fold(const rbf_site *site, const float exitant[3], float folded[3]);
static inline void rbf_site_unfold(const rbf_site *site, const float folded[3], float exitant[3])
{
	if (site->component->mesh.symmetry == RBF_ISOTROPIC) {
		exitant[0] = site->cosine*folded[0] - site->sine*folded[1];
		exitant[1] = site->cosine*folded[1] + site->sine*folded[0];
		exitant[2] = folded[2];
	} else
		rbf_mirror(site->op, folded, exitant);
}

/* The map of one corner and frame. */
static inline void rbf_site_warp(const rbf_site *site, uint32_t corner, uint32_t frame, rbf_warp *warp)
{
	rbf_fan_warp(&site->fan[frame], site->incident, site->direction, corner, warp);
}

/* Shares of the corners whose mapped directions have these z. */
static inline __attribute__((always_inline)) rbf_lanes rbf_shares_at(const rbf_site *site, uint32_t frame, rbf_lanes z)
{
	return rbf_shares(site->fan[frame].limit, rbf_lanes_load(site->weight), z);
}

/* DSF without the Lambertian part at a folded exitant direction (z > 0), before the limit at the horizon. */
void rbf_site_dsf(const rbf_site *site, const float exitant[3], float value[3]);

/* Luminance of the same, and with each lobe's value times its kappa. */
void rbf_site_width(const rbf_site *site, const float exitant[3], float sum[2]);

/* Both at an exitant direction that is not folded: returns the luminance of f. */
float rbf_site_eval_width(const rbf_site *site, const float exitant[3], float sum[2]);

/* f without the Lambertian part, sr^-1; exitant in the component's half space, not folded. */
void rbf_site_eval(const rbf_site *site, const float exitant[3], float value[3]);

/* DHR of the scattered part from the component's table. Outside the mesh it is at most that of the nearest point of the boundary. */
void rbf_component_dhr(const rbf_component *component, const float incident[3], float value[3]);

/* The same, more quickly and within a thousandth (dhr_grid.h). */
void rbf_component_dhr_quick(const rbf_component *component, const float incident[3], float value[3]);

/* What a pair of public directions means: the component that answers (NULL: none), the vectors in its half space, and
 * whether incident and exitant were swapped (reciprocity). */
typedef struct rbf_query {
	const rbf_component *component;
	float incident[3], exitant[3];
	int swapped;
} rbf_query;
int rbf_query_pair(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], rbf_query *query);

/* Component for an incident direction and side; *swapped: only the reverse component exists. NULL: none. */
const rbf_component *rbf_query_side(const bsdfrbf_model *model, const float incident[3], int transmit, int *swapped);

/* The same for a vector of any length; local: the direction in that component's half space. */
const rbf_component *rbf_query_incident(const bsdfrbf_model *model, const float incident[3], int transmit, float local[3], int *swapped);
#endif
