/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * An incidence that was left out is predicted with three errors, taken as independent: that of its own fit, which it is judged by, that of
 * the corners' fits, averaged by their weights w, and that of the interpolation. Linear interpolation of what is smooth errs by
 * sum over pairs of corners w_i w_j |e_ij|^2 times half the second derivative along e_ij, which gives the latter from the
 * geometry, and then the error of any other triangle of the neighbourhood, whose mean over the triangle has w_i w_j = 1/12 (1/6 on a
 * segment). The fits' errors average there with sum w^2 = 1/2 (2/3). Leaving an incidence out tells of the direction across the gap; of the one
 * along it nothing is known, and half as much is taken. Nor is known on which side of the incidence it bends: more where corners differ more
 * for their distance, as gloss does that rises to grazing incidence.
 *
 * A beam that ends between corners is not smooth. Where one corner's light and that of the others lie apart, their disagreement in the
 * middle is 1 + 1/3 (1 on a segment); interpolated at weight w, the truth on one side or the other of an end that may be anywhere, it
 * errs by 4 w (1 - w), which is 2/3 on average.
 */
#include "expect.h"
#include "bounds.h"
#include "difference.h"
#include "disagreement.h"

#include <stdlib.h>
#include <string.h>

static const float NEAR = .9f; /* weight of a corner from which on that corner alone was asked, an image of the same incidence, say */

int rbf_expect_fit(const rbf_measured *measured, const rbf_trials *trials, const rbf_fitted *m, const float lambertian[3],
	const uint32_t *count, float *fit)
{
	const float floor = lambertian[rbf_luminance(m->channels)];
	float error[RBF_TRIALS_MOST];
	int failed = 0;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t t = 0; t < trials->count; t++) {
		const uint32_t b = rbf_trial_base(trials, t);
		rbf_lobes half;
		if (!rbf_team_mine(m->team, t))
			continue;
		if (rbf_fit(&measured->incidence[b], (int)m->channels, lambertian, count[b], 2, &half, NULL)) {
			failed = 1;
			continue;
		}
		error[t] = rbf_difference(&m->lobes[b], &half, NULL, floor, 0);
		rbf_lobes_free(&half);
	}
	if (rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, trials->count, sizeof *error, error))
		return -1;
	for (uint32_t i = 0; i < trials->bases; i++) {
		uint32_t before, after;
		rbf_trials_around(trials, i, &before, &after);
		const double from = m->direction[3*rbf_trial_base(trials, before) + 2], to = m->direction[3*rbf_trial_base(trials, after) + 2];
		const double z = m->direction[3*trials->order[i] + 2], share = from > to ? fmin(fmax((from - z) / (from - to), 0), 1) : 1;
		fit[trials->order[i]] = (float)((1 - share) * (double)error[before] + share * (double)error[after]);
	}
	return 0;
}

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
	if (!(item & RBF_MESH_BORDER) && heaviest < NEAR && whole > 0)
		l->bend = sqrt(fmax(rest, 0)) / whole;
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

static double element_error(const rbf_mesh *mesh, const rbf_element *e, const lesson *known, const float *fit, double usual, double steep)
{
	const int chain = mesh->symmetry == RBF_ISOTROPIC, corners = chain ? 2 : 3;
	double bend = 0, own = 0;
	int told = 0;
	for (int i = 0; i < corners; i++) {
		const rbf_vertex *v = &mesh->vertex[e->v[i]];
		own += (double)fit[v->base] / corners;
		if (known[v->base].bend < 0)
			continue;
		bend += as_told(mesh, e, v, &known[v->base]) * steep / known[v->base].steep;
		told++;
	}
	if (told)
		bend /= told;
	else { /* as elsewhere on average, along the first side */
		const float *a = mesh->vertex[e->v[0]].direction, *b = mesh->vertex[e->v[1]].direction;
		lesson side = {.bend = usual, .u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}};
		rbf_normalize(side.u);
		bend = as_told(mesh, e, &(rbf_vertex){.op = RBF_OP_NONE}, &side);
	}
	return sqrt(bend * bend + own * own * (chain ? 2. / 3 : .5));
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

bsdfrbf_status rbf_expect(bsdfrbf_context *context, const rbf_fitted *m, const rbf_component *c, const float *left_out, const float *fit,
	float *expected)
{
	lesson *known = calloc((size_t)m->bases + 1, sizeof *known);
	double usual = 0;
	double *area = calloc((size_t)m->bases + 1, sizeof *area);
	float *own = malloc(((size_t)m->bases + 1) * sizeof *own), *apart = malloc(((size_t)m->mesh.elements + 1) * sizeof *apart);
	bsdfrbf_status status = known && area && own && apart ? BSDFRBF_OK : rbf_out_of_memory(context);
	uint32_t told = 0;
	for (uint32_t b = 0; b < m->bases; b++)
		expected[b] = 0;
	for (uint32_t b = 0; b < m->bases && status == BSDFRBF_OK; b++) {
		own[b] = fit[b];
		known[b].bend = -1;
		if (left_out[b] >= 0)
			status = learn(context, m, b, left_out[b], &own[b], &known[b]);
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
	}
	for (uint32_t n = 0; n < m->mesh.elements && told && status == BSDFRBF_OK; n++) {
		const rbf_element *e = &m->mesh.element[n];
		const double size = element_area(&m->mesh, e), bent = element_error(&m->mesh, e, known, own, usual / told, steepness(&m->mesh, e, apart[n]));
		const double error = fmax(bent, end_error(&m->mesh, e, left_out, apart[n]));
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
	free(apart);
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
