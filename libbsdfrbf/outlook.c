/* SPDX-License-Identifier: BSD-3-Clause */
#include "outlook.h"

#include <stdlib.h>
#include <string.h>

enum { BESIDE = 24, MOST = 2000 };   /* samples that are compared with; that are brought to an incidence */
static const float RATIO_MOST = 4;
static const float Z_LEAST = .01f;
static const float SAME = 1e-6f;     /* of a cosine: 0.08 degrees */
static const float NEAR_LEAST = 1e-6f; /* square of a distance between incidences */

int rbf_sources_make(const rbf_fitted *m, const rbf_seen *seen, const rbf_choice *choice, rbf_sources *s)
{
	*s = (rbf_sources){.fitted = m, .seen = seen, .frames = choice->frames, .frame = choice->frame};
	for (uint32_t f = 0; f < s->frames; f++)
		if (!(s->part[f] = rbf_label_parts(m, choice->label + (size_t)f * m->lobe_first[m->bases], 0)))
			return -1;
	return 0;
}

void rbf_sources_free(rbf_sources *s)
{
	for (uint32_t f = 0; f < s->frames && s->fitted; f++)
		rbf_label_parts_free(s->fitted, s->part[f]);
}

void rbf_outlook_free(rbf_outlook *o)
{
	free(o->compared);
	free(o->neighbour);
	free(o->near);
	free(o->warp);
	memset(o, 0, sizeof *o);
}

enum { IMAGES = 4 };

/* What mirrors leave where it is: an incidence in their plane. */
static uint32_t own_images(const rbf_fitted *m, uint32_t base, const float i[3], rbf_vertex image[IMAGES])
{
	int op[4] = {RBF_OP_NONE, RBF_OP_Y};
	const int ops = m->symmetry == RBF_ISOTROPIC ? 2 : rbf_symmetry_ops(m->symmetry, op);
	uint32_t count = 0;
	for (int n = 0; n < ops; n++) {
		float to[3];
		rbf_mirror((unsigned)op[n], i, to);
		if (op[n] != RBF_OP_NONE && rbf_dot(i, to) > 1 - SAME)
			image[count++] = (rbf_vertex){.direction = {i[0], i[1], i[2]}, .base = base, .op = (uint32_t)op[n]};
	}
	return count;
}

int rbf_outlook_make(const rbf_sources *s, uint32_t base, enum rbf_carry carry, const rbf_tree *beside, enum rbf_hidden hidden, const rbf_lobes *inner,
	rbf_outlook *o)
{
	const rbf_fitted *m = s->fitted;
	const uint32_t first = m->neighbour_first[base];
	const float i[3] = {(float)m->direction[3*base], (float)m->direction[3*base + 1], (float)m->direction[3*base + 2]};
	*o = (rbf_outlook){.of = s, .base = base, .around = m->neighbour_first[base + 1] - first, .carry = carry, .hidden = hidden,
		.inner = inner, .beside = beside};
	o->compared = malloc((2 * beside->count + 1) * sizeof *o->compared);
	o->neighbour = malloc((o->around + IMAGES) * sizeof *o->neighbour);
	o->near = malloc((o->around + IMAGES) * sizeof *o->near);
	o->warp = malloc(((size_t)o->around + IMAGES) * (s->frames + 1) * sizeof *o->warp);
	if (!o->compared || !o->neighbour || !o->near || !o->warp)
		return -1;
	for (uint32_t n = o->around, kept = o->around = 0; kept < n; kept++)
		if (hidden != RBF_HIDDEN_HERE || m->neighbour[first + kept].base != base)
			o->neighbour[o->around++] = m->neighbour[first + kept];
	if (hidden != RBF_HIDDEN_HERE)
		o->around += own_images(m, base, i, o->neighbour + o->around);
	for (size_t n = 0; n < 2 * beside->count; n++)
		o->compared[n] = -1;
	for (uint32_t n = 0; n < o->around; n++) {
		const rbf_vertex *k = &o->neighbour[n];
		const float e[3] = {k->direction[0] - i[0], k->direction[1] - i[1], k->direction[2] - i[2]};
		o->near[n] = 1 / rbf_max(rbf_dot(e, e), NEAR_LEAST);
		for (uint32_t f = 0; f < s->frames; f++) {
			const rbf_candidate *c = &m->candidate[s->frame[f]];
			rbf_warp_set(&o->warp[f * o->around + n], c->map, &c->linear, i, k->direction);
		}
	}
	return 0;
}

/* How much neighbour n tells of direction p by frame f, 0: nothing; where that is there, and the factor. */
static float told(const rbf_outlook *o, uint32_t f, uint32_t n, const float p[3], float there[3], float *gain)
{
	const rbf_warp *w = &o->warp[f * o->around + n];
	float mapped[3];
	*gain = rbf_warp_forward(w, p, mapped);
	if (!(*gain > 0) || !(mapped[2] > 0))
		return 0;
	if (o->carry == RBF_CARRY_F && w->kind == RBF_KIND_TURN)
		*gain *= p[2] / mapped[2];
	rbf_mirror(o->neighbour[n].op, mapped, there);
	return o->near[n] * rbf_seen_certainty(&o->of->seen[o->neighbour[n].base], there, o->hidden == RBF_HIDDEN_BAND);
}

/* What the incidence's own fit has of a frame. */
static void own_part(const rbf_outlook *o, uint32_t f, const float p[3], float value[3])
{
	const rbf_fitted *m = o->of->fitted;
	const uint32_t y = rbf_luminance(m->channels);
	rbf_lobes_sum(&o->of->part[f][o->base], p, value);
	if (!o->inner)
		return;
	const float all = rbf_lobes_luminance(&m->lobes[o->base], p), share = all > 0 ? value[y] / all : 0;
	rbf_lobes_sum(o->inner, p, value);
	for (uint32_t c = 0; c < m->channels; c++)
		value[c] *= share;
}

/* What the others predict, and how certain that is, each frame by its light. */
static float predict(const rbf_outlook *o, const float p[3], float value[3])
{
	const rbf_sources *s = o->of;
	const uint32_t channels = s->fitted->channels, y = rbf_luminance(channels);
	float certain = 0, all = 0;
	value[0] = value[1] = value[2] = 0;
	for (uint32_t f = 0; f < s->frames; f++) {
		float sum[3] = {0, 0, 0}, weight = 0, near = 0, one[3], there[3], gain;
		for (uint32_t n = 0; n < o->around; n++) {
			const float w = told(o, f, n, p, there, &gain);
			if (!(w > 0))
				continue;
			rbf_lobes_sum(&s->part[f][o->neighbour[n].base], there, one);
			for (uint32_t c = 0; c < channels; c++)
				sum[c] += w * gain * one[c];
			weight += w;
			near += o->near[n];
		}
		if (!(weight > 0))
			own_part(o, f, p, sum);
		for (uint32_t c = 0; c < channels; c++)
			value[c] += sum[c] /= weight > 0 ? weight : 1;
		all += sum[y] + 1e-20f; /* certainty in the dark as well */
		certain += weight > 0 ? (sum[y] + 1e-20f) * weight / near : 0;
	}
	return certain / all;
}

/* What the incidence is over what is predicted, at the samples next to p. */
static float ratio_beside(rbf_outlook *o, const float p[3])
{
	const uint32_t y = rbf_luminance(o->of->fitted->channels);
	uint32_t index[BESIDE];
	float distance[BESIDE];
	double own = 0, predicted = 0;
	const int found = rbf_tree_nearest(o->beside, p, BESIDE, index, distance);
	for (int n = 0; n < found; n++) {
		const float *at = o->beside->point[index[n]];
		float *compared = &o->compared[2 * index[n]], value[3];
		if (compared[0] < 0) {
			const int some = predict(o, at, value) > 0;
			compared[0] = some ? rbf_lobes_luminance(&o->of->fitted->lobes[o->base], at) : 0;
			compared[1] = some ? value[y] : 0;
		}
		own += (double)compared[0];
		predicted += (double)compared[1];
	}
	return predicted > 0 ? rbf_min(rbf_max((float)(own / predicted), 1 / RATIO_MOST), RATIO_MOST) : 1;
}

float rbf_outlook_value(rbf_outlook *o, const float p[3], float value[3])
{
	const float certain = predict(o, p, value);
	if (!(certain > 0))
		return 0;
	const float ratio = ratio_beside(o, p);
	for (uint32_t c = 0; c < o->of->fitted->channels; c++)
		value[c] *= ratio;
	return certain;
}

/* Whether neighbour n tells more of p by frame f than the others; of equals, the first. */
static int tells_most(const rbf_outlook *o, uint32_t f, uint32_t n, const float p[3])
{
	float there[3], gain;
	const float own = told(o, f, n, p, there, &gain);
	int most = own > 0;
	for (uint32_t k = 0; k < o->around && most; k++) {
		const float other = k != n ? told(o, f, k, p, there, &gain) : 0;
		most = other < own || (other <= own && k > n);
	}
	return most;
}

static uint32_t bring(const rbf_outlook *o, uint32_t f, uint32_t n, const rbf_tree *from, float (*to)[3])
{
	uint32_t count = 0;
	for (size_t i = 0; i < from->count; i++) {
		float q[3], p[3];
		rbf_mirror(o->neighbour[n].op, from->point[i], q);
		if (rbf_warp_inverse(&o->warp[f * o->around + n], q, p) > 0 && p[2] > Z_LEAST && rbf_normalize(p) > 0
				&& rbf_seen_lacks(&o->of->seen[o->base], p) && tells_most(o, f, n, p))
			memcpy(to[count++], p, sizeof p);
	}
	return count;
}

int rbf_outlook_samples(const rbf_outlook *o, float (**direction)[3], uint32_t *count)
{
	const rbf_sources *s = o->of;
	size_t room = 0;
	for (uint32_t n = 0; n < o->around; n++) {
		const rbf_seen *from = &s->seen[o->neighbour[n].base];
		room += from->measured.count + from->filled.count;
	}
	float (*w)[3] = *direction = malloc((room * s->frames + 1) * sizeof *w);
	*count = 0;
	for (uint32_t f = 0; f < s->frames && w; f++)
		for (uint32_t n = 0; n < o->around; n++) {
			const rbf_seen *from = &s->seen[o->neighbour[n].base];
			*count += bring(o, f, n, &from->measured, w + *count);
			*count += bring(o, f, n, &from->filled, w + *count);
		}
	if (w && *count > MOST) { /* every so many */
		for (uint32_t i = 0; i < MOST; i++)
			memcpy(w[i], w[(uint64_t)i * *count / MOST], sizeof *w);
		*count = MOST;
	}
	return w ? 0 : -1;
}
