/* SPDX-License-Identifier: BSD-3-Clause */
/* Labels: how much of each lobe belongs to which frame, from how well a frame predicts it at the neighbouring incidences. */
#ifndef RBF_LABEL_H
#define RBF_LABEL_H
#include "lobes.h"
#include "map.h"

/* A map, and how well it predicts. */
typedef struct rbf_candidate {
	unsigned map;
	rbf_linear linear;  /* of a learned map */
	float *prediction;  /* log prediction of each lobe, mean over the neighbours; all bases in a row */
} rbf_candidate;
enum { RBF_CANDIDATES = RBF_MAPS_LISTED + 12 };

/* The measured incidences with their fits and neighbours in the mesh. Shared by the stages between fit and assembly. */
typedef struct rbf_fitted {
	rbf_symmetry symmetry;
	uint32_t channels, bases;
	const rbf_team *team;         /* that builds; NULL: this process alone */
	const double *direction;      /* bases x 3 */
	rbf_lobes *lobes;             /* [bases] */
	rbf_mesh mesh;                /* of all incidences */
	uint32_t *neighbour_first;    /* [bases + 1] */
	rbf_vertex *neighbour;        /* what lies next to each base where it was measured: in the mesh that may be elsewhere, mirrored */
	uint32_t candidates;
	rbf_candidate candidate[RBF_CANDIDATES]; /* the listed maps first, each at its own id */
	uint32_t *lobe_first;         /* [bases + 1]: where a base's lobes start in such rows */
	const float *scale;           /* [bases]: how many times what those around it tell each sends (scale.h); NULL: once */
} rbf_fitted;

/* Fills neighbours, lobe_first and the candidates with the listed maps. Opens OpenMP regions. Returns 0, or -1 when out of memory or
 * a process gave up. */
int rbf_label_prepare(rbf_fitted *fitted);
void rbf_label_release(rbf_fitted *fitted);

/* Adds a learned map to the candidates, of which it becomes the last; there must be room. Opens OpenMP regions. Returns as above. */
int rbf_label_add(rbf_fitted *fitted, unsigned map, const rbf_linear *linear);

/* Another beam for a learned map that was added. Opens OpenMP regions. Returns as above. */
int rbf_label_change(rbf_fitted *fitted, uint32_t candidate, const rbf_linear *linear);

/* Once lobes have changed: the first `keep` candidates as these have it; others go. Opens OpenMP regions. Returns as above. */
int rbf_label_renew(rbf_fitted *fitted, uint32_t keep);

/* What remains of a direction's claim by a map: DSF of another incidence's lobes at a mapped direction, times its gain. Directions
 * that sank below are judged just above the horizon, and count less. */
float rbf_label_judge(const rbf_lobes *lobes, unsigned op, const float mapped[3], float gain);

/* How well a map predicts a lobe of `base` at direction c, where DSF is `self`, from the lobes of its neighbours; lobes: of all bases, or a
 * part of each. The mean logarithm. */
float rbf_label_prediction(const rbf_fitted *fitted, const rbf_candidate *map, const rbf_lobes lobes[], uint32_t base, const float c[3], float self);

/* The lobes of all bases as far as they belong to a frame, by its labels (over all bases): of all channels, or their luminance alone. They share the
 * blocks of fitted->lobes, and have no masses. NULL: out of memory. */
rbf_lobes *rbf_label_parts(const rbf_fitted *fitted, const float label[], int luminance);
void rbf_label_parts_free(const rbf_fitted *fitted, rbf_lobes *parts);

/* Sets a lobe's labels (index over all bases, of which there are `lobes` lobes) to r[frames], without what is faint. */
void rbf_label_set(uint32_t lobes, uint32_t frames, float r[], uint32_t lobe, float *label);

/* Every process gets the rows that others made: of all bases' lobes, `each` numbers for a lobe. Returns as above. */
int rbf_label_share(const rbf_fitted *fitted, uint32_t each, float *rows);

/* How labels follow the predictions. */
typedef struct rbf_belief {
	float sharpness; /* exponent of a prediction */
	int faint;       /* shares count by their roots, and a third of a per cent is enough, for beams of little energy that stand high above what is
	                  * around them */
	int settled;     /* then rbf_settle(): 1, or 2: wide */
} rbf_belief;

/* Labels for a list of frames (indices of candidates): label[f * lobes + i], i counted over all bases; 0 where below 1e-3, sums to 1 over f.
 * share[frames]: energy shares. A frame is believed as far as it predicts, and by its share; those whose share falls below a few per cent
 * get none: share 0. Opens OpenMP regions. */
void rbf_label(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], rbf_belief belief, float *label, float share[]);
#endif
