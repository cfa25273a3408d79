/* SPDX-License-Identifier: BSD-3-Clause */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "model_fixture.h"
#include "sample.h"
#include "takeover.h"

static void random_direction(uint64_t *seed, float low, float d[3])
{
	const double z = low + (1 - low) * random_unit(seed), phi = 2 * RBF_PI * random_unit(seed), s = sqrt(1 - z*z);
	d[0] = (float)(s * cos(phi));
	d[1] = (float)(s * sin(phi));
	d[2] = (float)z;
}

/* A direction within `angle` of another, above the horizon. */
static void random_near(uint64_t *seed, const float axis[3], double angle, float d[3])
{
	const double a[3] = {(double)axis[0], (double)axis[1], (double)axis[2]};
	double near[3];
	do
		around_axis(a, angle * random_unit(seed), 2 * RBF_PI * random_unit(seed), near);
	while (near[2] < .02);
	for (int n = 0; n < 3; n++)
		d[n] = (float)near[n];
	rbf_normalize(d);
}

/* A beam that is turned, pressed together and deflected. */
static const rbf_linear learned = {{{-.8f, .3f, .1f, .05f}, {.2f, .6f, -.15f, 0}}};

static float distance(const float a[3], const float b[3])
{
	const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return sqrtf(x*x + y*y + z*z);
}

static void nothing_moves_at_its_own_incidence(void **state)
{
	(void)state;
	uint64_t seed = 1;
	for (unsigned map = 0; map < RBF_MAPS; map++)
		for (int n = 0; n < 2000; n++) {
			rbf_warp warp;
			float i[3], o[3], p[3];
			random_direction(&seed, .02f, i);
			random_direction(&seed, .02f, o);
			rbf_warp_set(&warp, map, &learned, i, i);
			assert_float_equal(rbf_warp_forward(&warp, o, p), 1, 1e-3);
			assert_true(distance(o, p) < 3e-5f);
			assert_float_equal(rbf_warp_inverse(&warp, o, p), 1, 1e-3);
			assert_true(distance(o, p) < 3e-5f);
		}
}

static void there_and_back(void **state)
{
	(void)state;
	uint64_t seed = 2;
	for (unsigned map = 0; map < RBF_MAPS; map++) {
		int tried = 0;
		for (int n = 0; n < 5000; n++) {
			rbf_warp warp;
			float i[3], k[3], o[3], p[3], back[3] = {0, 0, 0};
			random_direction(&seed, .02f, i);
			random_near(&seed, i, .4, k);
			random_direction(&seed, .02f, o);
			rbf_warp_set(&warp, map, &learned, i, k);
			if (!(rbf_warp_forward(&warp, o, p) > 0) || p[2] < .05f)
				continue;
			assert_float_equal(rbf_dot(p, p), 1, 1e-4);
			/* near the half map's own horizon an angle is a ratio of small numbers */
			if (map == RBF_MAP_HALF && 1 + rbf_dot(p, k) < .02f)
				continue;
			assert_true(rbf_warp_inverse(&warp, p, back) > 0);
			assert_true(distance(o, back) < 2e-3f);
			tried++;
		}
		assert_true(tried > 1000);
	}
}

/* Change of solid angle by differences: area of the image of a small square. */
static double jacobian(const rbf_warp *warp, const float p[3], double step)
{
	const double axis[3] = {(double)p[0], (double)p[1], (double)p[2]};
	double image[4][3], d[3];
	for (int c = 0; c < 4; c++) {
		float at[3], out[3];
		around_axis(axis, step, RBF_PI / 2 * c, d);
		for (int n = 0; n < 3; n++)
			at[n] = (float)d[n];
		rbf_normalize(at);
		if (!(rbf_warp_inverse(warp, at, out) > 0))
			return -1;
		for (int n = 0; n < 3; n++)
			image[c][n] = (double)out[n];
	}
	const double u[3] = {image[2][0] - image[0][0], image[2][1] - image[0][1], image[2][2] - image[0][2]};
	const double v[3] = {image[3][0] - image[1][0], image[3][1] - image[1][1], image[3][2] - image[1][2]};
	const double c[3] = {u[1]*v[2] - u[2]*v[1], u[2]*v[0] - u[0]*v[2], u[0]*v[1] - u[1]*v[0]};
	return sqrt(c[0]*c[0] + c[1]*c[1] + c[2]*c[2]) / (4 * step * step);
}

static void factor_is_value_times_solid_angle(void **state)
{
	(void)state;
	uint64_t seed = 3;
	for (unsigned map = 0; map < RBF_MAPS; map++) {
		int tried = 0;
		for (int n = 0; n < 5000; n++) {
			rbf_warp warp;
			float i[3], k[3], p[3], o[3], again[3];
			random_direction(&seed, .05f, i);
			random_near(&seed, i, .4, k);
			random_direction(&seed, .1f, p);
			rbf_warp_set(&warp, map, &learned, i, k);
			const float factor = rbf_warp_inverse(&warp, p, o);
			if (!(factor > 0) || o[2] < .15f)
				continue;
			const float value = rbf_warp_forward(&warp, o, again);
			const double area = jacobian(&warp, p, 2e-3);
			if (area < 0)
				continue;
			if (!(fabs((double)factor - (double)value * area) < .03 * (double)factor + .002))
				fail_msg("%s: factor %g, value %g times solid angle %g", rbf_map_name(map), (double)factor, (double)value, area);
			tried++;
		}
		assert_true(tried > 500);
	}
}

/* For a lobe: nothing that is drawn within four sigmas goes beyond the bound, grazing or not. */
static void bound_holds(void **state)
{
	(void)state;
	uint64_t seed = 4;
	for (unsigned map = 0; map < RBF_MAPS; map++)
		for (int n = 0; n < 20000; n++) {
			rbf_warp warp;
			float i[3], k[3], c[3], p[3], o[3] = {0, 0, 0};
			random_direction(&seed, .01f, i);
			random_near(&seed, i, .3, k);
			random_direction(&seed, 0, c);
			const double sigma = .003 * pow(100, random_unit(&seed));
			const rbf_reach reach = {.map = map, .base = {k[0], k[1], k[2]}, .lowest = rbf_reach_lowest(k, .31f)};
			const float slant = rbf_lobe_slant(&reach, c, (float)(1 / (sigma * sigma)));
			assert_true(slant >= 0);
			rbf_warp_set(&warp, map, &learned, i, k);
			const float bound = rbf_warp_bound(&warp, slant) * 1.001f;
			for (int s = 0; s < 20; s++) {
				const double axis[3] = {(double)c[0], (double)c[1], (double)c[2]};
				double d[3];
				around_axis(axis, 4 * sigma * random_unit(&seed), 2 * RBF_PI * random_unit(&seed), d);
				for (int m = 0; m < 3; m++)
					p[m] = (float)d[m];
				const float factor = rbf_warp_inverse(&warp, p, o);
				if (factor > bound && o[2] > 0)
					fail_msg("%s: factor %g over bound %g (i.z %g, k.z %g, sigma %g)", rbf_map_name(map), (double)factor, (double)bound,
						(double)i[2], (double)k[2], sigma);
			}
		}
}

/* z at l of the direction that a site at i sees where k has d; 2: none is seen. */
static float seen_from(unsigned map, const float i[3], const float k[3], const float l[3], const float d[3])
{
	rbf_warp to_k, to_l;
	float o[3], at[3];
	rbf_warp_set(&to_k, map, &learned, i, k);
	rbf_warp_set(&to_l, map, &learned, i, l);
	if (!(rbf_warp_inverse(&to_k, d, o) > 0) || !(o[2] > .001f))
		return 2;
	rbf_warp_forward(&to_l, o, at);
	return at[2];
}

/* The same for sites in a triangle: J is no more than the bounds towards the two other corners come to. */
static void rise_holds(void **state)
{
	(void)state;
	uint64_t seed = 8;
	double worth = 0;
	for (int n = 0; n < 20000; n++) {
		float k[3][3], i[3] = {0, 0, 0}, c[3], o[3], weight[3], bound = 0;
		random_direction(&seed, .05f, k[0]);
		random_near(&seed, k[0], .3, k[1]);
		random_near(&seed, k[0], .3, k[2]);
		random_direction(&seed, 0, c);
		const double sigma = .003 * pow(100, random_unit(&seed)), u = random_unit(&seed), v = (1 - u) * random_unit(&seed);
		const float share[3] = {(float)(1 - u - v), (float)u, (float)v};
		for (int a = 0; a < 3; a++)
			for (int m = 0; m < 3; m++)
				i[m] += share[a] * k[a][m];
		const float length = rbf_normalize(i);
		const rbf_reach reach = {.map = RBF_MAP_HALF, .base = {k[0][0], k[0][1], k[0][2]}, .lowest = rbf_reach_lowest(k[0], .31f)};
		for (int a = 0; a < 3; a++) {
			weight[a] = share[a] / length;
			bound += weight[a] * (a ? rbf_lobe_rise(&reach, k[a], c, (float)(1 / (sigma * sigma))) : 1);
		}
		rbf_warp warp;
		rbf_warp_set(&warp, RBF_MAP_HALF, NULL, i, k[0]);
		worth += (double)(warp.sine * rbf_lobe_slant(&reach, c, (float)(1 / (sigma * sigma))) + 1 - bound);
		for (int s = 0; s < 20; s++) {
			const double axis[3] = {(double)c[0], (double)c[1], (double)c[2]};
			double d[3];
			around_axis(axis, 4 * sigma * random_unit(&seed), 2 * RBF_PI * random_unit(&seed), d);
			const float p[3] = {(float)d[0], (float)d[1], (float)d[2]};
			const float factor = rbf_warp_inverse(&warp, p, o) / warp.gain;
			if (factor > bound * 1.001f && o[2] > 0)
				fail_msg("factor %g over bound %g (i.z %g, k.z %g, sigma %g)", (double)factor, (double)bound, (double)i[2], (double)k[0][2], sigma);
		}
	}
	assert_true(worth > 20000 * .04); /* below what holds for any direction of the incidence */
}

/* No site in the triangle of k, l and a third sees k take over from l nearer than the bound says; and the bound is worth something. */
static void where_corners_take_over(void **state)
{
	(void)state;
	uint64_t seed = 6;
	for (unsigned map = 1; map < RBF_MAPS; map++) {
		int over = 0, worth = 0, tried = 0;
		for (int n = 0; n < 4000; n++) {
			float k[3], l[3], m[3], i[3], c[3];
			random_direction(&seed, .1f, k);
			random_near(&seed, k, .4, l);
			random_near(&seed, k, .4, m);
			random_direction(&seed, 0, c);
			const double u = random_unit(&seed), v = (1 - u) * random_unit(&seed);
			for (int a = 0; a < 3; a++)
				i[a] = (float)(u * (double)l[a] + v * (double)m[a] + (1 - u - v) * (double)k[a]);
			rbf_normalize(i);
			rbf_neighbour near = {.twist = .1f};
			memcpy(near.k, k, sizeof k);
			memcpy(near.l, l, sizeof l);
			const float bound = rbf_takeover_angle(&near, map, &learned, c, n % 2 ? INFINITY : .2f);
			worth += bound > .1f;
			tried++;
			for (int s = 0; s < 60 && bound > 0; s++) {
				const double axis[3] = {(double)c[0], (double)c[1], (double)c[2]};
				double near_c[3];
				around_axis(axis, fmin((double)bound, 3) * sqrt(random_unit(&seed)), 2 * RBF_PI * random_unit(&seed), near_c);
				const float d[3] = {(float)near_c[0], (float)near_c[1], (float)near_c[2]};
				if (!(d[2] > 0))
					continue;
				const float z = seen_from(map, i, k, l, d);
				if (z < RBF_VALID_Z - 1e-4f && z < d[2] - 1e-4f)
					fail_msg("%s: takes over with z %g from %g, nearer than %g rad", rbf_map_name(map), (double)d[2], (double)z, (double)bound);
				over++;
			}
		}
		assert_true(over > 10000 && worth > tried / 4);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nothing_moves_at_its_own_incidence),
		cmocka_unit_test(there_and_back),
		cmocka_unit_test(factor_is_value_times_solid_angle),
		cmocka_unit_test(bound_holds),
		cmocka_unit_test(rise_holds),
		cmocka_unit_test(where_corners_take_over),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
