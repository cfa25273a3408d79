/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * ln DHR at an incidence is compared with a surface of second degree through those around it, and their mirror images (Cleveland and
 * Devlin, Journal of the American Statistical Association 83, 1988). If all is such a surface, but for gains of one variance, the difference
 * is a sum of these with known weights. The median over all incidences does not mind that the material is no such surface at a few.
 */
#include "unsteady.h"
#include "median.h"
#include "small_system.h"

#include <stdlib.h>
#include <string.h>

enum { AROUND = 16, IN_PLANE = 5, TERMS = 6, IN_PLANE_TERMS = 3, LEAST = 7 };
static const double NORMAL_SQUARE = .4549; /* median of the square of a normal deviate */
static const double RIDGE = 1e-7;          /* of the trace */
static const double APART = 1e-6;          /* squared distance */

typedef struct point {
	uint32_t base;
	double square, x[2]; /* distance and where it is, in the plane that touches the sphere at the incidence */
	double weight;
} point;

static int by_square(const void *a, const void *b)
{
	const point *p = a, *q = b;
	return p->square > q->square ? 1 : p->square < q->square ? -1 : p->base < q->base ? -1 : p->base > q->base;
}

/* All others and their images; returns how many. */
static uint32_t look_around(rbf_symmetry symmetry, uint32_t bases, const double *direction, uint32_t base, point list[])
{
	const int plane = symmetry == RBF_ISOTROPIC;
	const double *d = direction + 3 * (size_t)base;
	const float k[3] = {(float)d[0], (float)d[1], (float)d[2]};
	int op[4] = {RBF_OP_NONE, RBF_OP_X};
	const int ops = plane ? 2 : rbf_symmetry_ops(symmetry, op);
	float t[3], s[3];
	uint32_t count = 0;
	rbf_basis(k, t, s);
	for (uint32_t b = 0; b < bases; b++)
		for (int n = 0; n < ops && b != base; n++) {
			const float own[3] = {(float)direction[3*b], (float)direction[3*b + 1], (float)direction[3*b + 2]};
			point *p = &list[count];
			float e[3];
			*p = (point){.base = b};
			if (plane) {
				p->x[0] = (op[n] ? -1. : 1.) * (double)rbf_polar_angle(own) - (double)rbf_polar_angle(k);
			} else {
				rbf_mirror((unsigned)op[n], own, e);
				for (int i = 0; i < 3; i++)
					e[i] -= k[i];
				p->x[0] = (double)rbf_dot(e, t);
				p->x[1] = (double)rbf_dot(e, s);
			}
			p->square = p->x[0] * p->x[0] + p->x[1] * p->x[1];
			int known = p->square < APART;
			for (uint32_t i = count; i > 0 && !known && list[i - 1].base == b; i--) /* its own image */
				known = fabs(list[i - 1].x[0] - p->x[0]) + fabs(list[i - 1].x[1] - p->x[1]) < 1e-3;
			count += !known;
		}
	qsort(list, count, sizeof *list, by_square);
	return count;
}

/* Weights by which the values at `count` points, in the order of distance, give that of the surface at the incidence. */
static void set_weights(int terms, uint32_t count, point list[])
{
	const double farthest = 1.02 * list[count - 1].square, unit = sqrt(farthest);
	double normal[TERMS * TERMS] = {0}, x[TERMS] = {1}, trace = 0, term[AROUND][TERMS], near[AROUND];
	for (uint32_t i = 0; i < count; i++) {
		const double u = list[i].x[0] / unit, v = list[i].x[1] / unit, all[TERMS] = {1, u, terms > 3 ? v : u*u, u*u, u*v, v*v};
		const double close = 1 - pow(list[i].square / farthest, 1.5);
		near[i] = close * close * close;
		memcpy(term[i], all, sizeof all);
		for (int n = 0; n < terms; n++)
			for (int l = 0; l < terms; l++)
				normal[n * terms + l] += near[i] * all[n] * all[l];
	}
	for (int n = 0; n < terms; n++)
		trace += normal[n * terms + n];
	for (int n = 0; n < terms; n++)
		normal[n * terms + n] += RIDGE * trace;
	rbf_small_system_solve(terms, normal, x, 0);
	for (uint32_t i = 0; i < count; i++) {
		list[i].weight = 0;
		for (int n = 0; n < terms; n++)
			list[i].weight += near[i] * term[i][n] * x[n];
	}
}

/* Square of the difference, in variances of one gain. */
static double square_at(const float *dhr, uint32_t base, uint32_t count, point list[])
{
	double difference = log((double)dhr[base]), variance = 1;
	for (uint32_t i = 0; i < count; i++) {
		double all = 0; /* weights of its images */
		int first = 1;
		for (uint32_t k = 0; k < count; k++)
			if (list[k].base == list[i].base) {
				all += list[k].weight;
				first &= k >= i;
			}
		if (!first)
			continue;
		difference -= all * log((double)dhr[list[i].base]);
		variance += all * all;
	}
	return difference * difference / variance;
}

double rbf_unsteady(rbf_symmetry symmetry, uint32_t bases, const double *direction, const float *dhr)
{
	const int plane = symmetry == RBF_ISOTROPIC, terms = plane ? IN_PLANE_TERMS : TERMS;
	const uint32_t most = plane ? IN_PLANE : AROUND;
	point *list = malloc((4 * (size_t)bases + 1) * sizeof *list);
	double *square = malloc(((size_t)bases + 1) * sizeof *square), lowest = 1, found = 0;
	uint32_t told = 0, dark = 0;
	for (uint32_t b = 0; b < bases; b++) {
		lowest = fmin(lowest, direction[3*b + 2]);
		dark |= !(dhr[b] > 0);
	}
	for (uint32_t b = 0; list && square && b < bases && !dark; b++) {
		if (direction[3*b + 2] < lowest + 1e-3) /* nothing lies beyond */
			continue;
		const uint32_t all = look_around(symmetry, bases, direction, b, list), count = all < most ? all : most;
		if (count <= (uint32_t)terms)
			continue;
		set_weights(terms, count, list);
		square[told++] = square_at(dhr, b, count, list);
	}
	if (square && told >= LEAST)
		found = sqrt(rbf_median(square, told) / NORMAL_SQUARE);
	const int failed = !list || !square;
	free(list);
	free(square);
	return failed ? -1 : found;
}
