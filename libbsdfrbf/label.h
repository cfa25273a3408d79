/* SPDX-License-Identifier: BSD-3-Clause */
/* Labels: how much of each lobe belongs to which frame, from how well a frame predicts it at the neighbouring incidences. */
#ifndef RBF_LABEL_H
#define RBF_LABEL_H
#include "lobes.h"
#include "map.h"

/* The measured incidences with their fits and neighbours in the mesh. Shared by the stages between fit and assembly. */
typedef struct rbf_fitted {
	rbf_symmetry symmetry;
	uint32_t channels, bases;
	const double *direction;      /* bases x 3 */
	rbf_lobes *lobes;             /* [bases] */
	rbf_mesh mesh;                /* of all incidences */
	uint32_t *neighbour_first;    /* [bases + 1] */
	uint32_t *neighbour;          /* vertices next to each base's unmirrored vertex */
	float *prediction[RBF_MAPS];  /* log prediction of each lobe by each map, mean over the neighbours; all bases in a row */
	uint32_t *lobe_first;         /* [bases + 1]: where a base's lobes start in such rows */
} rbf_fitted;

/* Fills neighbours, lobe_first and prediction. Opens OpenMP regions. Returns 0, or -1 when out of memory. */
int rbf_label_prepare(rbf_fitted *fitted);
void rbf_label_release(rbf_fitted *fitted);

/* Labels for a list of frames: label[f * lobes + i], i counted over all bases; 0 where below 1e-3, sums to 1 over f.
 * share[frames]: energy shares. Frames whose share falls below a few per cent get none. */
int rbf_label(const rbf_fitted *fitted, uint32_t frames, const uint32_t frame[], float *label, float share[]);
#endif
