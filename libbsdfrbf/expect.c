/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * An incidence that was left out is predicted with three errors, taken as independent: that of its own fit, which it is judged by, that of
 * the corners' fits, averaged by their weights w, and that of the interpolation. Linear interpolation of what is smooth errs by
 * sum over pairs of corners w_i w_j |e_ij|^2 times half the second derivative along e_ij, which gives the latter from the
 * geometry, and then the error of any other triangle of the neighbourhood, whose mean over the triangle has w_i w_j = 1/12 (1/6 on a
 * segment). The fits' errors average there with sum w^2 = 1/2 (2/3). Leaving an incidence out tells of the direction across the gap; of the one
 * along it nothing is known, and half as much is taken. Nor is known on which side of the incidence it bends: more where corners differ more
 * for their distance, as gloss does that rises to grazing incidence. Nor does it tell of light that changes unevenly between incidences along a line.
 * What fits miss alike, beyond what noise may do, they miss between incidences as well.
 *
 * A beam that ends between corners is not smooth. Where one corner's light and that of the others lie apart, their disagreement in the
 * middle is 1 + 1/3 (1 on a segment); interpolated at weight w, the truth on one side or the other of an end that may be anywhere, it
 * errs by 4 w (1 - w), which is 2/3 on average.
 */
#include "expect.h"
#include "bounds.h"
#include "disagreement.h"
#include "uneven.h"

#include <stdlib.h>
#include <string.h>

static const double MOST = 1; /* error of interpolation: one beam instead of another would be 2, half of it 1 */
static const float NEAR = .9f; /* weight of a corner from which on that corner alone was asked, an image of the same incidence, say */

/* |e|^2 with what is across the direction u by half. */
static double span(const float a[3], const float b[3], const float u[3])
{
	const float e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	const double along = (double)rbf_dot(e, u);
	return .5 * ((double)rbf_dot(e, e) + along * along);
}

/* What leaving out one incidence told. */
typedef struct lesson {
	double bend;  /* interpolation error over span; < 0: unknown */
	double error; /* that of interpolation itself */
	float u[3];   /* unit vector across the gap, in the base's coordinates */
	double steep; /* how much corners differ: mean of steepness() over so many elements around */
	uint32_t around;
} lesson;

static bsdfrbf_status learn(bsdfrbf_context *context, const rbf_fitted *m, uint32_t base, float left_out, float *fit, lesson *l)
{
	rbf_mesh mesh;
	float in[3], weight[3], most = 0, heaviest = 0;
	uint32_t corner[3];
	for (int n = 0; n < 3; n++)
		in[n] = (float)m->direction[3*base + (uint32_t)n];
	if (m->symmetry == RBF_ISOTROPIC) {
		in[0] = hypotf(in[0], in[1]);
		in[1] = 0;
	}
	const unsigned op = (unsigned)rbf_symmetry_fold(m->symmetry, in);
	rbf_mirror(op, in, in);
	unsigned char *out = calloc(m->bases, 1);
	if (!out)
		return rbf_out_of_memory(context);
	rbf_mesh_leave_out(m->symmetry, m->bases, m->direction, base, out);
	const bsdfrbf_status status = rbf_mesh_build(context, m->symmetry, m->bases, m->direction, out, &mesh);
	free(out);
	RBF_TRY(status);
	const uint32_t item = rbf_mesh_locate(&mesh, in, corner, weight);
	double squares = 0, whole = 0;
	const float *at[3];
	for (int i = 0; i < 3; i++)
		at[i] = mesh.vertex[corner[i]].direction;
	for (int i = 0; i < 3; i++) {
		squares += (double)(weight[i] * weight[i]);
		heaviest = fmaxf(heaviest, weight[i]);
		for (int k = 0; k < i; k++) {
			float e[3] = {at[i][0] - at[k][0], at[i][1] - at[k][1], at[i][2] - at[k][2]};
			const float part = weight[i] * weight[k] * rbf_dot(e, e);
			if (!(part > most))
				continue;
			most = part;
			rbf_normalize(e);
			memcpy(l->u, e, sizeof e);
		}
	}
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < i; k++)
			whole += (double)(weight[i] * weight[k]) * span(at[i], at[k], l->u);
	rbf_mirror(op, l->u, l->u);
	rbf_mesh_free(&mesh);
	/* the fits cannot err by more than all there is */
	*fit = fminf(*fit, left_out / (float)sqrt(1 + squares));
	const double rest = (double)(left_out * left_out) - (double)(*fit * *fit) * (1 + squares);
	l->error = sqrt(fmax(rest, 0));
	if (!(item & RBF_MESH_BORDER) && heaviest < NEAR && whole > 0)
		l->bend = l->error / whole;
	return BSDFRBF_OK;
}

/* Solid angle of an element, or of the ring that a segment stands for, up to a common factor. */
static double element_area(const rbf_mesh *mesh, const rbf_element *e)
{
	const float *a = mesh->vertex[rbf_bound_vertex(mesh, e->v[0])].direction, *b = mesh->vertex[rbf_bound_vertex(mesh, e->v[1])].direction;
	const float *c = mesh->vertex[rbf_bound_vertex(mesh, e->v[2])].direction;
	if (mesh->symmetry == RBF_ISOTROPIC)
		return fabs((double)a[2] - (double)b[2]);
	const double p[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, q[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
	const double x = p[1]*q[2] - p[2]*q[1], y = p[2]*q[0] - p[0]*q[2], z = p[0]*q[1] - p[1]*q[0];
	return .5 * sqrt(x*x + y*y + z*z);
}

/* Bend times span, as one corner tells it. */
static double as_told(const rbf_mesh *mesh, const rbf_element *e, const rbf_vertex *by, const lesson *l)
{
	const int chain = mesh->symmetry == RBF_ISOTROPIC;
	float u[3];
	double sum = 0;
	rbf_mirror(by->op, l->u, u);
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < i; k++)
			if (!chain || (i == 1 && k == 0))
				sum += span(mesh->vertex[e->v[i]].direction, mesh->vertex[e->v[k]].direction, u) / (chain ? 6 : 12);
	return l->bend * sum;
}

/* uneven: what it may be off by, if leaving out incidences does not tell of less. */
static double element_error(const rbf_mesh *mesh, const rbf_element *e, const lesson *known, const rbf_errors *errors, double usual, double steep,
	double uneven)
{
	const int chain = mesh->symmetry == RBF_ISOTROPIC, corners = chain ? 2 : 3;
	double bend = 0, own = 0, missed = 0, most = 0;
	int told = 0;
	for (int i = 0; i < corners; i++) {
		const rbf_vertex *v = &mesh->vertex[e->v[i]];
		own += (double)errors->by_noise[v->base] / corners;
		missed += (double)errors->missed[v->base] / corners;
		if (known[v->base].bend < 0)
			continue;
		bend += as_told(mesh, e, v, &known[v->base]) * steep / known[v->base].steep;
		most = fmax(most, known[v->base].error);
		told++;
	}
	if (told)
		bend = fmax(bend / told, fmin(uneven, most));
	else { /* as elsewhere on average, along the first side */
		const float *a = mesh->vertex[e->v[0]].direction, *b = mesh->vertex[e->v[1]].direction;
		lesson side = {.bend = usual, .u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}};
		rbf_normalize(side.u);
		bend = as_told(mesh, e, &(rbf_vertex){.op = RBF_OP_NONE}, &side);
	}
	bend = fmin(bend, MOST);
	return sqrt(bend * bend + own * own * (chain ? 2. / 3 : .5) + fmax(missed * missed - own * own, 0));
}

/* Disagreement of an element's corners for their distance, a positive number. */
static double steepness(const rbf_mesh *mesh, const rbf_element *e, float disagreement)
{
	double square = 0;
	for (int i = 0; i < 3; i++) {
		const float *a = mesh->vertex[e->v[i]].direction, *b = mesh->vertex[e->v[(i + 1) % 3]].direction;
		const float side[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
		square += (double)rbf_dot(side, side);
	}
	return fmax((double)disagreement, 1e-3) / sqrt(square);
}

/* Means over the elements around each base. */
static void set_steepness(const rbf_mesh *mesh, const float *disagreement, lesson *known)
{
	for (uint32_t n = 0; n < mesh->elements; n++) {
		const rbf_element *e = &mesh->element[n];
		const double here = steepness(mesh, e, disagreement[n]);
		for (int i = 0; i < (mesh->symmetry == RBF_ISOTROPIC ? 2 : 3); i++) {
			lesson *l = &known[mesh->vertex[e->v[i]].base];
			l->steep += (here - l->steep) / ++l->around;
		}
	}
}

/* Error of an element if a beam ends in it, else 0. On a chain, leaving out either of its corners predicts across the same end: if
 * that errs by less, no more ends there. (A mesh without a corner has other triangles, which may miss it.) */
static double end_error(const rbf_mesh *mesh, const rbf_element *e, const float *left_out, float disagreement)
{
	const int chain = mesh->symmetry == RBF_ISOTROPIC;
	const float shown = fmaxf(left_out[mesh->vertex[e->v[0]].base], left_out[mesh->vertex[e->v[1]].base]);
	if (!(disagreement > BSDFRBF_CUTOFF))
		return 0;
	return chain ? 2 / 3. * (double)(shown >= 0 ? fminf(disagreement, shown) : disagreement) : .5 * (double)disagreement;
}

bsdfrbf_status rbf_expect(bsdfrbf_context *context, const rbf_fitted *m, const rbf_component *c, const rbf_errors *errors, float *expected)
{
	lesson *known = calloc((size_t)m->bases + 1, sizeof *known);
	double usual = 0;
	double *area = calloc((size_t)m->bases + 1, sizeof *area);
	float *own = malloc(((size_t)m->bases + 1) * sizeof *own), *light = malloc(((size_t)m->bases + 1) * sizeof *light);
	float *apart = malloc(((size_t)m->mesh.elements + 1) * sizeof *apart), *uneven = malloc(((size_t)m->mesh.elements + 1) * sizeof *uneven);
	bsdfrbf_status status = known && area && own && light && apart && uneven ? BSDFRBF_OK : rbf_out_of_memory(context);
	const rbf_errors all = {errors->left_out, own, errors->missed};
	uint32_t told = 0;
	for (uint32_t b = 0; b < m->bases; b++)
		expected[b] = 0;
	for (uint32_t b = 0; b < m->bases && status == BSDFRBF_OK; b++) {
		own[b] = errors->by_noise[b];
		light[b] = c->base_info[b].dhr;
		known[b].bend = -1;
		if (errors->left_out[b] >= 0)
			status = learn(context, m, b, errors->left_out[b], &own[b], &known[b]);
		if (known[b].bend < 0)
			continue;
		usual += known[b].bend;
		told++;
	}
	if (told && status == BSDFRBF_OK) {
		#pragma omp parallel for schedule(dynamic)
		for (int64_t n = 0; n < (int64_t)m->mesh.elements; n++)
			apart[n] = rbf_disagreement(c, (uint32_t)n);
		set_steepness(&m->mesh, apart, known);
		rbf_uneven(&m->mesh, light, uneven);
	}
	for (uint32_t n = 0; n < m->mesh.elements && told && status == BSDFRBF_OK; n++) {
		const rbf_element *e = &m->mesh.element[n];
		const double size = element_area(&m->mesh, e);
		const double bent = element_error(&m->mesh, e, known, &all, usual / told, steepness(&m->mesh, e, apart[n]), (double)uneven[n]);
		const double error = fmax(bent, end_error(&m->mesh, e, errors->left_out, apart[n]));
		for (int i = 0; i < (m->symmetry == RBF_ISOTROPIC ? 2 : 3); i++) {
			const uint32_t b = m->mesh.vertex[e->v[i]].base;
			expected[b] += (float)(size * error);
			area[b] += size;
		}
	}
	for (uint32_t b = 0; b < m->bases && told && status == BSDFRBF_OK; b++)
		expected[b] = area[b] > 0 ? expected[b] / (float)area[b] : 0;
	free(known);
	free(area);
	free(own);
	free(light);
	free(apart);
	free(uneven);
	return status;
}

float rbf_expected_mean(const rbf_component *c)
{
	double sum = 0, area = 0;
	for (uint32_t n = 0; n < c->mesh.elements; n++) {
		const rbf_element *e = &c->mesh.element[n];
		const int corners = c->mesh.symmetry == RBF_ISOTROPIC ? 2 : 3;
		const double size = element_area(&c->mesh, e);
		for (int i = 0; i < corners; i++) {
			const float expected = c->base_info[rbf_bound_base(c, &c->mesh.vertex[rbf_bound_vertex(&c->mesh, e->v[i])])].expected;
			if (!(expected > 0))
				continue;
			sum += size * (double)expected;
			area += size;
		}
	}
	return area > 0 ? (float)(sum / area) : -1;
}
