/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * k takes over at d where the direction at l that belongs to it is lower than d, and lower than RBF_VALID_Z. A lower bound of the angle to
 * where each of both begins is known for every kind of map; the greater one counts.
 */
#include "takeover.h"

#define SAFE 1e-3f /* rad, for rounding */

static float angle_from_sine(float sine)
{
	return asinf(rbf_min(rbf_max(sine, -1.f), 1.f));
}

/* z at l is row . d, row being the third one of the rotation from beam to beam; more turns about the beam at l move the row by the twist. */
static float turned(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float d[3])
{
	rbf_warp w;
	float beam[3];
	rbf_warp_set(&w, map, linear, n->k, n->l);
	rbf_map_source(map, linear, n->l, beam);
	const float row[3] = {w.m[6], w.m[7], w.m[8]}, less[3] = {-row[0], -row[1], 1 - row[2]}, length = sqrtf(rbf_dot(less, less));
	const float off = n->twist * sqrtf(rbf_max(1 - beam[2]*beam[2], 0.f));
	const float low = angle_from_sine(rbf_dot(row, d)) - angle_from_sine(RBF_VALID_Z) - off;
	if (length <= off)
		return low;
	return rbf_max(low, -angle_from_sine(rbf_dot(less, d) / length) - angle_from_sine(off / length));
}

/* Tangential components move by the same everywhere; angles are at least as long as distances of these. */
static float shifted(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float d[3])
{
	rbf_warp w;
	rbf_warp_set(&w, map, linear, n->k, n->l);
	const float x = d[0] + w.m[0], y = d[1] + w.m[1], length = sqrtf(w.m[0]*w.m[0] + w.m[1]*w.m[1]);
	const float low = RBF_VALID_S - sqrtf(x*x + y*y);
	if (!(length > 0))
		return INFINITY; /* nothing moves */
	return rbf_max(low, -(d[0]*w.m[0] + d[1]*w.m[1]) / length - .5f * length);
}

/* Largest growth of a small step of d as it is seen from l, by half vectors of which this is at least the tangent of the angle to k: of steps across,
 * towards l. cosine, sine: of the angle between k and l. */
static float growth(float tangent, float cosine, float sine)
{
	return tangent * cosine > sine ? cosine + sine * tangent : sqrtf(1 + tangent * tangent);
}

/* tan(g + x) for a tangent of g; more than it is. */
static float further(float tangent, float x)
{
	const float step = x * (1 + .56f * x * x), rest = 1 - tangent * step;
	return x < 1 && rest > .01f ? (tangent + step) / rest : 1e9f;
}

/* A step of d that is surely within the way: the half vector moves by half of each. */
static float within(float way, float tangent, float cosine, float sine)
{
	if (!(way > 0))
		return 0;
	const float least = way / growth(further(tangent, .5f * way), cosine, sine);
	const float middle = .5f * (least + way / growth(further(tangent, .5f * least), cosine, sine));
	return middle * growth(further(tangent, .5f * middle), cosine, sine) <= way ? middle : least;
}

/* With the half vector h, l is mirrored to m(l) = 2 (h.l) h - l, and what is at l higher than at k is the z of m(l - k). If d moves by e, h
 * moves by at most e / (2 cos g), g from k to h, and mirrored vectors by twice that; m(l) itself by less, as l is close to k. */
static float halved(const rbf_neighbour *n, const float d[3], float enough)
{
	float h[3] = {n->k[0] + d[0], n->k[1] + d[1], n->k[2] + d[2]};
	const float e[3] = {n->l[0] - n->k[0], n->l[1] - n->k[1], n->l[2] - n->k[2]}, chord = rbf_dot(e, e), length = sqrtf(chord);
	const float whole = sqrtf(rbf_dot(h, h));
	if (!(whole > 0))
		return 0;
	if (!(length > 0))
		return INFINITY;
	for (int i = 0; i < 3; i++)
		h[i] /= whole;
	const float c = rbf_max(rbf_dot(h, n->k), 1e-6f), tangent = sqrtf(rbf_max(1 - c*c, 0)) / c, cosine = 1 - .5f * chord;
	const float sine = length * sqrtf(rbf_max(1 - .25f * chord, 0));
	const float z = 2 * rbf_dot(h, n->l) * h[2] - n->l[2], up = (2 * rbf_dot(h, e) * h[2] - e[2]) / length;
	/* angles are no less than differences of sines */
	const float quick = within(z - RBF_VALID_Z, tangent, cosine, sine);
	if (quick >= enough)
		return quick;
	return rbf_max(within(angle_from_sine(z) - angle_from_sine(RBF_VALID_Z), tangent, cosine, sine), within(angle_from_sine(up), tangent, -1, 0));
}

float rbf_takeover_angle(const rbf_neighbour *n, unsigned map, const rbf_linear *linear, const float d[3], float enough)
{
	float angle;
	switch (rbf_map_get(map)->kind) {
	case RBF_KIND_TURN: angle = turned(n, map, linear, d); break;
	case RBF_KIND_SHIFT: angle = shifted(n, map, linear, d); break;
	case RBF_KIND_HALF: angle = halved(n, d, enough); break;
	default: return INFINITY;
	}
	return angle > SAFE ? angle - SAFE : 0; /* also for what is not a number */
}
