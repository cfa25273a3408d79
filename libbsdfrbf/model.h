/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * The interpolant in memory: plain arrays, the same whether just built or mapped from a file.
 *
 * Inside one component, vectors are those of its own half space (incident and exitant z >= 0, see measure.h).
 * DSF(i, o) = lambertian cos(o)/pi
 *   + sum over frames f of sum_k w_k v_kf g_kf L_kf(map_f(i, k, o)) / sum_k w_k v_kf,
 * k the corners of the mesh element that holds i, w their barycentric weights, map_f the frame's map (map.h) with
 * value factor g and validity v, L_kf a sum of lobes amp exp(-kappa/2 |o' - c|^2), o' and c unit vectors.
 * v_k / sum w v, the share of a corner, is at most the frame's limit; others then share what that leaves (map.h).
 * Where levels are evened, by e, corner k counts 1 - e + e M / C_k times: A_k the luminance of its lobes at home, C_k the same carried here,
 * A_k (kept_k + gain_k half_k.i), s_k a slope, which is tangential, and M = (sum_k w_k (A_k^(1/4) + s_k.i / 2))^4 what they send together; slopes
 * at most halve or double the sum. Outside the mesh it is that of the nearest point. No corner is raised more than 3 times, but all of
 * them by what is then missing.
 * Tuned light is 1 + 4 (w_0 w_1 t_0 + w_1 w_2 t_1 + w_2 w_0 t_2) + w_0 w_1 w_2 t_3 times that, t of the element.
 * With residual transport, c = unit(c_k + sum over the other corners l of w_l shift_kl).
 */
#ifndef RBF_MODEL_H
#define RBF_MODEL_H
#include "mesh.h"

#include <math.h>
#include <stdatomic.h>

#define RBF_LANES 8       /* lobes in a block */
#define RBF_EVEN 2u       /* halves of all the way */
#define RBF_LEVEL_SLOPED_LEAST .5f /* of the root without slopes */
#define RBF_LEVEL_SLOPED_MOST 2.f
#define RBF_TUNE 4        /* numbers of an element: middle of the edges from corner 0 to 1, 1 to 2, 2 to 0, of all; of a border: the first */
#define RBF_LIMIT_MOST 16.f
#define RBF_LEVEL_CARRIED_LEAST .1f
#define RBF_LEVEL_MOST 3.f /* times, at most, that a corner's level is raised alone */
#define RBF_MAX_FRAMES 4  /* frames of a component */

/* Index of the luminance channel: Y of X, Y, Z, or the only one. */
static inline uint32_t rbf_luminance(uint32_t channels)
{
	return channels == 3 ? 1 : 0;
}

/* Eight lobes. Unused lanes have k = 0, amplitude 0 and a unit centre. */
typedef struct rbf_block {
	float x[RBF_LANES], y[RBF_LANES], z[RBF_LANES]; /* centres, unit */
	float k[RBF_LANES];                             /* kappa, sr^-1 like: 1/sigma^2, sigma in radians */
} rbf_block;

/* Amplitudes of a block's lobes, one such array per channel (DSF, sr^-1). */
typedef struct rbf_amplitude { float a[RBF_LANES]; } rbf_amplitude;

/* Residual motion of a block's lobes along a directed edge, in the base's coordinates. */
typedef struct rbf_shift { float x[RBF_LANES], y[RBF_LANES], z[RBF_LANES]; } rbf_shift;

/* At least the angle that a residual shift moves a lobe by, rad. */
static inline float rbf_shift_motion(const rbf_shift *s, uint32_t lane)
{
	return 1.05f * sqrtf(s->x[lane]*s->x[lane] + s->y[lane]*s->y[lane] + s->z[lane]*s->z[lane]);
}

/* How much light the lobes of a base send, A, how that changes with the incident direction, and what maps keep of it. */
typedef struct rbf_level {
	float root;         /* A^(1/4) */
	float slope[3];     /* its gradient over the unit vector, in the base's coordinates (levels.h); 0 where it is not known */
	float kept;         /* share of A in frames but that of a half map: they keep it wherever they carry it */
	float half[3];      /* times i in the base's coordinates: what a half map makes of the rest at incidence i, for a gain of 1 */
} rbf_level;

/* The lobes of one base incidence that belong to one frame: set index = base * frames + frame.
 * A base's sets follow each other in the block array. */
typedef struct rbf_set {
	uint32_t first;     /* first block */
	uint32_t blocks;
	float sent;         /* luminance, sr; of records up to version 1.2, as the next two, of tables for sampling: only builds need it */
	float unused[2];
	float band;         /* z below which one corner may take over from another; 0: nowhere; for builds, too */
} rbf_set;

/* What was learned from the data for a frame (map.h): tangential components e of a beam as a linear map of the incident
 * direction, e[n] = row[n][0] x + row[n][1] y + row[n][2] z + row[n][3]; all 0 for a listed map. */
typedef struct rbf_linear { float row[2][4]; } rbf_linear;

#define RBF_CULL_GRID 28 /* cells a side over the disc (rbf_disc_from_direction) of the exitant hemisphere */

/* What is known of one measured incidence. */
typedef struct rbf_base_info {
	float direction[3];
	uint32_t lobes;
	float dhr;          /* luminance */
	float fit_error, loo_error; /* < 0: unknown */
	float expected;     /* mean relative L1 in the elements around it; 0: unknown */
} rbf_base_info;

/* Facts that are not needed to evaluate. */
typedef struct rbf_facts {
	float frame_share[RBF_MAX_FRAMES];
	float residual_deg, fit_error, loo_error, asymmetry;
	char symmetry_text[160];
} rbf_facts;

typedef struct rbf_component {
	int present;
	uint32_t channels;              /* 1 or 3 */
	float lambertian[3];            /* DHR of the Lambertian part, per channel (Y first if 1 channel: X, Y, Z else) */
	rbf_mesh mesh;
	uint32_t frames;
	uint32_t frame[RBF_MAX_FRAMES]; /* map ids (map.h) */
	uint32_t learned;               /* 1: linear is present, as a frame is learned */
	const rbf_linear *linear;       /* [frames] */
	uint32_t limited;               /* 1: limit is present */
	const float *limit;             /* [frames]: most of a corner's share, 1 to RBF_LIMIT_MOST; if absent, as the maps have it */
	uint32_t even;                  /* how far levels are evened, in halves: 0 to 2 */
	const rbf_level *level;         /* [mesh.bases], where they are */
	uint32_t tuned;                 /* 1: tune is present */
	const float *tune;              /* [mesh.elements + mesh.borders][RBF_TUNE]: by how much light rises (site.c) */
	uint32_t filled;                /* largest share of the hemisphere that an incidence was not measured in, but filled, in thousandths */
	uint32_t mirrored;              /* likewise, but filled from the incidence itself, by symmetry */
	uint32_t residual;              /* 1: shifts are present */
	uint32_t sets;                  /* bases * frames */
	const rbf_set *set;
	uint32_t blocks;
	const rbf_block *block;         /* [blocks] */
	const rbf_amplitude *amplitude; /* [channels][blocks] */
	/* culling: for each set and cell, which groups of ceil(set.blocks / 64) blocks matter; one of the two, or both NULL */
	const uint64_t *cull;           /* packed, see cull.h */
	const uint64_t *cull_wide;      /* [sets][RBF_CULL_GRID^2]: only of files that were written before masks were packed */
	uint32_t packed;                /* bytes of the stream below; 0: none, as ever but in a record and on its way there */
	const uint8_t *pack;            /* for what is then absent, see pack.h */
	const float *extent;            /* while a model is made, instead of them: by extent.h */
	/* residual transport: shift_of[element * 6 + corner * 2 + n] = first entry in `shift` for the corner's base, towards
	 * the n-th other corner (in cyclic order: corner+1, corner+2 mod 3); RBF_NO_SHIFT: no motion. */
	const uint32_t *shift_of;
	uint32_t shifts;                /* entries */
	const rbf_shift *shift;
	uint32_t edges;                 /* directed edges among them */
	uint32_t dhr_steps;             /* even */
	const float *dhr;               /* table of the scattered part's DHR, see dhr.h */
	const float *trend;             /* [borders][4 dhr_steps], or NULL: change of ln DHR from the border to the horizon, see dhr.h */
	uint32_t dhr_cells;             /* 0: no grid */
	uint32_t dhr_unit[3];           /* of each channel: bits of a float */
	const uint16_t *dhr_grid;       /* what the table answers at most directions, see dhr_grid.h; NULL: nothing */
	const rbf_base_info *base_info; /* [mesh.bases] */
	rbf_facts facts;
} rbf_component;
#define RBF_NO_SHIFT 0xffffffffu

#define RBF_RECIPROCAL_RINGS 24

/* Cells of a component's exitant directions (reciprocal.h): rings of equal width in polar angle, each cut into sectors. */
typedef struct rbf_reciprocal_grid {
	uint32_t rings;
	uint32_t first[RBF_RECIPROCAL_RINGS + 1];  /* first cell of each ring, and how many there are in all */
} rbf_reciprocal_grid;

typedef struct rbf_reciprocal {
	rbf_reciprocal_grid grid;
	void *_Atomic cell[];   /* one malloc'ed block each that never changes any more, or NULL: not yet made */
} rbf_reciprocal;

typedef struct rbf_kept_draws {
	size_t items;
	void *_Atomic of[];     /* of the elements, then of the borders: one malloc'ed rbf_draws each (draws.h), or NULL */
} rbf_kept_draws;

/* What is worked out when it is first asked for, by whichever thread asks, and kept: the one part of a model that is not fixed. */
typedef struct rbf_late {
	rbf_kept_draws *_Atomic draws[4];          /* of each component that was sampled */
	rbf_reciprocal *_Atomic reciprocal[2];     /* of tf, tb where the other one is missing */
} rbf_late;

struct bsdfrbf_model {
	uint64_t serial;        /* no other model of this process ever had it */
	uint32_t channels;
	rbf_component component[4];
	char *text;             /* "key\0value\0key\0value\0..." */
	uint32_t text_bytes;
	void *mapping;          /* the mapped file, or NULL: arrays were malloc'ed one by one */
	size_t mapping_bytes;
	void *made[4];          /* what was made of a component of a former version on opening, or NULL */
	rbf_late *late;
};

/* Allocates an empty model / frees a model with all it owns (unmaps, or frees arrays). */
bsdfrbf_model *rbf_model_new(void);
void rbf_component_free(rbf_component *component); /* only for arrays that were malloc'ed */
#endif
