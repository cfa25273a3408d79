/* SPDX-License-Identifier: BSD-3-Clause */
#include "bands.h"
#include "kernel.h"

#include <stdlib.h>
#include <string.h>

enum { SHARES = 65535 };
static const float TWIST = .05f; /* what two rotations one after the other can add to the angle between the corners */

/* A measured incidence, and the largest angle to a neighbouring vertex. */
typedef struct reach {
	float base[3], margin;
} reach;

/* A corner takes over only where another one's mapped direction is lower than RBF_VALID_Z; maps move directions by the margin, shifts
 * move their tangential components. */
static float band_of(int shift, float margin, float motion)
{
	float edge = asinf(RBF_VALID_Z) + margin + TWIST;
	if (shift)
		edge = acosf(rbf_max(RBF_VALID_S - 2 * sinf(.5f * margin), 0.f)) + 1e-3f;
	return sinf(rbf_min(edge + motion, (float)(RBF_PI / 2)));
}

/* Largest residual motion of every set, rad. */
static void motions(const rbf_component *c, float *motion)
{
	memset(motion, 0, c->sets * sizeof *motion);
	for (uint32_t e = 0; e < c->mesh.elements && c->shift_of; e++)
		for (uint32_t slot = 0; slot < 6; slot++) {
			const uint32_t at = c->shift_of[e * 6 + slot], base = c->mesh.vertex[c->mesh.element[e].v[slot / 2]].base;
			for (uint32_t f = 0; f < c->frames && at != RBF_NO_SHIFT; f++) {
				const rbf_set *set = &c->set[base * c->frames + f];
				const rbf_shift *s = &c->shift[at + (set->first - c->set[base * c->frames].first)];
				float *m = &motion[base * c->frames + f];
				for (uint32_t i = 0; i < set->blocks * RBF_LANES; i++)
					*m = fmaxf(*m, rbf_shift_motion(&s[i / RBF_LANES], i % RBF_LANES));
			}
		}
}

static void reaches(const rbf_mesh *mesh, reach *of)
{
	for (uint32_t v = 0; v < mesh->vertices; v++)
		rbf_mirror(mesh->vertex[v].op, mesh->vertex[v].direction, of[mesh->vertex[v].base].base);
	for (uint32_t e = 0; e < mesh->elements + mesh->borders; e++) {
		const int border = e >= mesh->elements;
		const uint32_t *v = border ? mesh->border[e - mesh->elements] : mesh->element[e].v;
		for (int i = 0; i < (border ? 2 : 3); i++) {
			const rbf_vertex *a = &mesh->vertex[v[i]], *b = &mesh->vertex[v[border ? 1 - i : (i + 1) % 3]];
			const float m = rbf_angle(a->direction, b->direction);
			of[a->base].margin = fmaxf(of[a->base].margin, m);
			of[b->base].margin = fmaxf(of[b->base].margin, m);
		}
	}
}

/* Luminance that a set's lobes send, and a little more: as 65535 shares, each lobe's rounded up. How points are spread for tables of DHR then is what
 * it ever was, and so are these tables, bit by bit. */
static float sent(const rbf_component *c, const rbf_set *set)
{
	const rbf_amplitude *luminance = c->amplitude + (size_t)rbf_luminance(c->channels) * c->blocks;
	double sum = 0;
	uint32_t some = 0;
	for (uint32_t b = set->first; b < set->first + set->blocks; b++)
		for (int i = 0; i < RBF_LANES; i++) {
			const double lobe = (double)luminance[b].a[i] * rbf_lobe_integral((double)c->block[b].k[i]);
			sum += lobe;
			some += lobe > 0;
		}
	return sum > 0 && some < SHARES / 2 ? SHARES * nextafterf((float)(sum / (SHARES - some)), INFINITY) : 0;
}

int rbf_bands_make(rbf_component *c)
{
	reach *of = calloc((size_t)c->mesh.bases + 1, sizeof *of);
	float *motion = malloc((c->sets + 1) * sizeof *motion);
	const int good = of && motion;
	if (good) {
		motions(c, motion);
		reaches(&c->mesh, of);
	}
	for (uint32_t s = 0; s < c->sets && good; s++) {
		const uint32_t f = s % c->frames, map = c->frame[f];
		const reach *r = &of[s / c->frames];
		rbf_set *set = (rbf_set *)&c->set[s];
		const float margin = rbf_map_margin(map, rbf_frame_linear(c, f), r->base, r->margin);
		set->sent = sent(c, set);
		set->band = rbf_frame_limit(c, f) > 1 ? band_of(rbf_map_get(map)->kind == RBF_KIND_SHIFT, margin, motion[s]) : 0;
	}
	free(of);
	free(motion);
	return good ? 0 : -1;
}
