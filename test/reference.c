/* SPDX-License-Identifier: BSD-3-Clause */
#include "reference.h"
#include "bounds.h"
#include "evaluate.h"

/* The maps once more, with every number in double precision. */
#define float double
#define sqrtf sqrt
#define hypotf hypot
#define sinf sin
#define cosf cos
#define fabsf fabs
#define fminf fmin
#define fmaxf fmax
#define copysignf copysign
#define acosf acos
#define rbf_dot double_dot
#define rbf_cross double_cross
#define rbf_angle double_angle
#define rbf_normalize double_normalize
#define rbf_basis double_basis
#define rbf_mirror double_mirror
#define rbf_min double_min
#define rbf_max double_max
#define rbf_arctangent double_arctangent
#define rbf_polar_angle double_polar_angle
#define rbf_upper_angle double_upper_angle
#define rbf_disc_from_direction double_disc_from_direction
#define rbf_direction_from_disc double_direction_from_disc
#define rbf_square_from_direction double_square_from_direction
#define rbf_warp double_warp
#define rbf_warp_set double_warp_set
#define rbf_warp_clear double_warp_clear
#define rbf_turn_set double_turn_set
#define rbf_half_set double_half_set
#define rbf_shift_set double_shift_set
#define rbf_map_source double_map_source
#define rbf_warp_forward double_warp_forward
#define rbf_warp_inverse double_warp_inverse
#define rbf_validity double_validity
#define rbf_share_most double_share_most
#define rbf_frame_limit double_frame_limit
#define rbf_warp_bound double_warp_bound
#define rbf_shift_factor double_shift_factor
#define rbf_turn_forward double_turn_forward
#define rbf_turn_inverse double_turn_inverse
#define rbf_half_forward double_half_forward
#define rbf_half_inverse double_half_inverse
#define rbf_shift_forward double_shift_forward
#define rbf_shift_inverse double_shift_inverse
#define rbf_same double_same
#define rbf_frame_linear double_frame_linear
#define rbf_map double_map
#define rbf_map_kind double_map_kind
#define rbf_map_row double_map_row
#define rbf_map_get double_map_get
#define rbf_map_learned double_map_learned
#define rbf_map_name double_map_name
#define rbf_map_beam double_map_beam
#define rbf_map_turned double_map_turned
#define rbf_map_margin double_map_margin
#define RBF_KIND_FIXED DOUBLE_KIND_FIXED
#define RBF_KIND_TURN DOUBLE_KIND_TURN
#define RBF_KIND_HALF DOUBLE_KIND_HALF
#define RBF_KIND_SHIFT DOUBLE_KIND_SHIFT
#define RBF_MAP_FIXED DOUBLE_FIXED
#define RBF_MAP_MIRROR DOUBLE_MIRROR
#define RBF_MAP_XFLIP DOUBLE_XFLIP
#define RBF_MAP_YFLIP DOUBLE_YFLIP
#define RBF_MAP_RETRO DOUBLE_RETRO
#define RBF_MAP_HALF DOUBLE_HALF
#define RBF_MAP_SHIFT DOUBLE_SHIFT
#define RBF_MAP_SHIFT_X DOUBLE_SHIFT_X
#define RBF_MAP_SHIFT_Y DOUBLE_SHIFT_Y
#define RBF_MAP_SHIFT_XFLIP DOUBLE_SHIFT_XFLIP
#define RBF_MAP_SHIFT_YFLIP DOUBLE_SHIFT_YFLIP
#define RBF_MAP_SHIFT_RETRO DOUBLE_SHIFT_RETRO
#define RBF_MAP_LEARNED_SHIFT DOUBLE_LEARNED_SHIFT
#define RBF_MAP_LEARNED_TURN DOUBLE_LEARNED_TURN
#define RBF_MAPS_LISTED DOUBLE_MAPS_LISTED
#define RBF_MAPS DOUBLE_MAPS
#undef RBF_MAP_H
#undef RBF_VECTOR_H
#include "map.h"
#undef float

static void lobes(const rbf_site *site, uint32_t k, uint32_t frame, const double mapped[3], double sum[3])
{
	const rbf_component *c = site->component;
	const rbf_set *first = c->set + (size_t)site->base[k] * c->frames, *set = first + frame;
	double at[3];
	double_mirror(site->vertex_op[k], mapped, at);
	sum[0] = sum[1] = sum[2] = 0;
	for (uint32_t b = set->first; b < set->first + set->blocks; b++)
		for (int i = 0; i < RBF_LANES; i++) {
			double centre[3] = {(double)c->block[b].x[i], (double)c->block[b].y[i], (double)c->block[b].z[i]}, square = 0;
			for (int n = 0; n < 2; n++)
				if (site->motion[k].shift[n]) {
					const rbf_shift *s = site->motion[k].shift[n] + (b - first->first);
					const double w = (double)site->motion[k].weight[n];
					centre[0] += w * (double)s->x[i];
					centre[1] += w * (double)s->y[i];
					centre[2] += w * (double)s->z[i];
				}
			if (site->motion[k].shift[0] || site->motion[k].shift[1])
				double_normalize(centre);
			for (int n = 0; n < 3; n++)
				square += (at[n] - centre[n]) * (at[n] - centre[n]);
			const double e = exp(-.5 * (double)c->block[b].k[i] * square);
			for (uint32_t n = 0; n < c->channels; n++)
				sum[n] += e * (double)c->amplitude[(size_t)n * c->blocks + b].a[i];
		}
}

/* Corner k's share (map.h) among corners of some validity. */
static double share_of(const double *valid, const float *weight, uint32_t corners, uint32_t k, double most)
{
	double total = 0, left = 1, open = 0;
	for (uint32_t n = 0; n < corners; n++)
		total += (double)weight[n] * valid[n];
	for (uint32_t n = 0; n < corners; n++) {
		const double share = valid[n] / total;
		left -= (double)weight[n] * fmin(share, most);
		open += share < most ? (double)weight[n] : 0;
	}
	const double own = valid[k] / total;
	return fmin(own + (own < most ? fmax(left, 0) / fmax(open, 1e-6) : 0), most);
}

/* How much more corner k sends than its own light, or less, where levels are evened (model.h). */
static double evened(const rbf_site *site, uint32_t k)
{
	const rbf_component *c = site->component;
	double mean = 0, rises = 0, sent = 0, at[3] = {0, 0, 0}, own[3], gain[3], gains = 0;
	if (!c->level)
		return 1;
	const double home[3] = {(double)site->incident[0], (double)site->incident[1], (double)site->incident[2]};
	for (uint32_t n = 0; n < site->corners; n++) {
		gain[n] = (double)site->direction[2][n] / fmax(home[2], .01);
		gains += (double)site->weight[n] * gain[n];
		for (int i = 0; i < 3; i++)
			at[i] += (double)site->weight[n] * (double)site->direction[i][n];
	}
	double_normalize(at);
	if (c->mesh.symmetry == RBF_ISOTROPIC && site->corners > 1) /* within a chain, whose weights are those of the angle */
		memcpy(at, home, sizeof at);
	for (uint32_t n = 0; n < site->corners; n++) {
		const rbf_level *level = &c->level[site->base[n]];
		double i[3], near[3], rise = 0, half = 0;
		double_mirror(site->vertex_op[n], at, near);
		double_mirror(site->vertex_op[n], home, i);
		for (int k = 0; k < 3; k++) {
			rise += .5 * (double)level->slope[k] * near[k];
			half += (double)level->half[k] * i[k];
		}
		own[n] = pow((double)level->root, 4) * fmax((double)level->kept + gain[n] / sqrt(gains) * half, .1);
		mean += (double)site->weight[n] * (double)level->root;
		rises += (double)site->weight[n] * rise;
	}
	const double together = pow(fmin(fmax(mean + rises, .5 * mean), 2 * mean), 4);
	for (uint32_t n = 0; n < site->corners; n++)
		sent += (double)site->weight[n] * fmin(together, 3 * own[n]);
	if (!(own[k] > together * 1e-24))
		return 1;
	return 1 + .5 * c->even * (fmin(together / own[k], 3) * together / fmax(sent, together * 1e-3) - 1);
}

void reference_dsf(const void *of, const float exitant[3], double value[3])
{
	const rbf_site *site = of;
	const rbf_component *c = site->component;
	const double o[3] = {(double)exitant[0], (double)exitant[1], (double)exitant[2]};
	value[0] = value[1] = value[2] = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		struct double_warp warp[3];
		double valid[3], factor[3], mapped[3][3], gain = 0;
		for (uint32_t k = 0; k < site->corners; k++) {
			double i[3], to[3];
			for (int n = 0; n < 3; n++) {
				i[n] = (double)site->incident[n];
				to[n] = (double)site->direction[n][k];
			}
			double_warp_set(&warp[k], c->frame[f], rbf_frame_linear(c, f), i, to);
			gain += (double)site->weight[k] * warp[k].gain;
		}
		for (uint32_t k = 0; k < site->corners; k++) {
			warp[k].gain /= sqrt(gain);
			factor[k] = double_warp_forward(&warp[k], o, mapped[k]);
			valid[k] = warp[k].kind == DOUBLE_KIND_FIXED ? 1 : double_validity(mapped[k][2]);
		}
		for (uint32_t k = 0; k < site->corners; k++) {
			const double w = (double)site->tune * (double)site->weight[k] * evened(site, k) * share_of(valid, site->weight, site->corners, k, double_frame_limit(c, f)) * factor[k];
			double sum[3];
			lobes(site, k, f, mapped[k], sum);
			for (uint32_t n = 0; n < c->channels && w > 0; n++)
				value[n] += w * sum[n];
		}
	}
}
