/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Gains of incidences: a lamp drifts, or the sample is set up anew, and a whole scan is off by some factor. As f(a, b) = f(b, a), what was
 * measured at incidences a and b with gains of e^g_a and e^g_b gives g_a - g_b = ln f_a(b) - ln f_b(a), and so do all mirror images of the two.
 * The fits tell both values, where there were samples nearby.
 */
#include "gains.h"
#include "measure.h"
#include "median.h"
#include "model.h"

#include <stdlib.h>
#include <string.h>

enum { PARTNERS = 64, TURNS = 9, GRID = 20 };
static const double FAINT = .1;      /* of the mean value at an incidence: what counts half */
static const double FAINT_OUT = .01; /* what does not count */

static const float LEAST = .03f;  /* ln, at normal incidence: less is an error of fits; it grows towards grazing incidence, as 1 / sqrt(cos) */
static const float GRAZING = .01f;

/* Where an incidence was measured: cells over the disc of exitant directions that have samples in them or beside them. */
typedef struct cover { unsigned char cell[GRID][GRID]; } cover;

/* Scans that pairs are made of: bases of one reflection, or of both transmissions. */
typedef struct scans {
	const bsdfrbf_model *model;
	uint32_t count, front;         /* the first `front` are the first component's */
	const rbf_component *part[2];
	float (*direction)[3], *light, *least; /* in the world; DHR; gain that counts */
	cover *cover;
	uint32_t images;
	int op[4], turned;             /* mirrors, or turns if isotropic */
	uint32_t pairs;
	rbf_pair *pair;
} scans;

static void cell_of(const float d[3], int *x, int *y)
{
	const float up[3] = {d[0], d[1], fabsf(d[2])};
	float disc[2];
	rbf_disc_from_direction(up, disc);
	*x = (int)fminf(fmaxf((disc[0] + 1) * (GRID / 2.f), 0), GRID - 1);
	*y = (int)fminf(fmaxf((disc[1] + 1) * (GRID / 2.f), 0), GRID - 1);
}

static int covered(const cover *c, const float d[3])
{
	int x, y;
	cell_of(d, &x, &y);
	return c->cell[y][x];
}

static void turn(float c, float s, const float d[3], float to[3])
{
	to[0] = c * d[0] - s * d[1];
	to[1] = s * d[0] + c * d[1];
	to[2] = d[2];
}

/* The base that a measured incidence is part of; *c, *s: the turn that takes the one to the other. */
static uint32_t base_of(const rbf_component *component, const double direction[3], float *c, float *s)
{
	const int isotropic = component->mesh.symmetry == RBF_ISOTROPIC;
	const float d[3] = {(float)direction[0], (float)direction[1], (float)direction[2]}, out = hypotf(d[0], d[1]);
	uint32_t nearest = 0;
	float most = -2;
	for (uint32_t b = 0; b < component->mesh.bases; b++) {
		const float *at = component->base_info[b].direction;
		const float near = isotropic ? hypotf(at[0], at[1]) * out + at[2] * d[2] : rbf_dot(at, d);
		if (near > most) {
			most = near;
			nearest = b;
		}
	}
	const float *at = component->base_info[nearest].direction, both = hypotf(at[0], at[1]) * out;
	*c = isotropic && both > 0 ? (at[0] * d[0] + at[1] * d[1]) / both : 1;
	*s = isotropic && both > 0 ? (at[1] * d[0] - at[0] * d[1]) / both : 0;
	return nearest;
}

static void set_cover(const rbf_component *component, const rbf_measured *measured, cover *all)
{
	for (size_t i = 0; i < measured->count; i++) {
		const rbf_incidence *in = &measured->incidence[i];
		float c, s;
		cover *at = all + base_of(component, in->direction, &c, &s);
		for (size_t k = 0; k < in->count; k++) {
			const float d[3] = {(float)in->outgoing[3*k], (float)in->outgoing[3*k + 1], (float)in->outgoing[3*k + 2]};
			float to[3];
			int x, y;
			turn(c, s, d, to);
			cell_of(to, &x, &y);
			for (int n = 0; n < 9; n++) {
				const int u = x + n % 3 - 1, v = y + n / 3 - 1;
				if (u >= 0 && v >= 0 && u < GRID && v < GRID)
					at->cell[v][u] = 1;
			}
		}
	}
}

static void image(const scans *s, uint32_t k, const float d[3], float to[3])
{
	const float phi = (float)(RBF_PI * k / (TURNS - 1));
	if (s->turned)
		turn(cosf(phi), sinf(phi), d, to);
	else
		rbf_mirror((unsigned)s->op[k], d, to);
}

/* Image k as b's scan sees it, with b where it was measured: a's own direction, brought along. */
static void image_back(const scans *s, uint32_t k, const float d[3], float to[3])
{
	const float phi = (float)(RBF_PI * k / (TURNS - 1));
	if (s->turned)
		turn(cosf(phi), -sinf(phi), d, to);
	else
		rbf_mirror((unsigned)s->op[k], d, to);
}

/* The median over the images. */
static void ask(const scans *s, rbf_pair *p)
{
	const uint32_t y = rbf_luminance(s->model->channels);
	double told[TURNS] = {0}, weights = 0;
	int count = 0;
	for (uint32_t k = 0; k < s->images; k++) {
		float b[3], a[3], there[3], back[3];
		image(s, k, s->direction[p->b], b);
		image_back(s, k, s->direction[p->a], a);
		if (!covered(&s->cover[p->a], b) || !covered(&s->cover[p->b], a))
			continue;
		bsdfrbf_eval(s->model, s->direction[p->a], b, there);
		bsdfrbf_eval(s->model, b, s->direction[p->a], back);
		const double share = RBF_PI * fmin((double)(there[y] / s->light[p->a]), (double)(back[y] / s->light[p->b]));
		if (!(share > FAINT_OUT))
			continue;
		weights += share / (share + FAINT);
		told[count++] = log((double)there[y] / (double)back[y]);
	}
	p->difference = rbf_median(told, (size_t)count);
	p->weight = count ? weights / count : 0;
}

/* All pairs, or, of many incidences, some for each. */
static int make_pairs(scans *s)
{
	const uint64_t all = s->part[1] ? (uint64_t)s->front * (s->count - s->front) : (uint64_t)s->count * (s->count - 1) / 2;
	const uint64_t step = all / ((uint64_t)s->count * PARTNERS) + 1;
	for (int pass = 0; pass < 2; pass++) {
		uint32_t room = 0;
		for (uint32_t a = 0; a < s->front; a++)
			for (uint32_t b = s->part[1] ? s->front : a + 1; b < s->count; b++) {
				if ((a + (uint64_t)b * 7919) % step)
					continue;
				if (pass)
					s->pair[room] = (rbf_pair){.a = a, .b = b};
				room++;
			}
		if (!pass && !(s->pair = malloc(((size_t)room + 1) * sizeof *s->pair)))
			return -1;
		s->pairs = room;
	}
	#pragma omp parallel for schedule(dynamic, 16)
	for (int64_t i = 0; i < (int64_t)s->pairs; i++)
		ask(s, &s->pair[i]);
	uint32_t used = 0;
	for (uint32_t i = 0; i < s->pairs; i++)
		if (s->pair[i].weight > 0)
			s->pair[used++] = s->pair[i];
	s->pairs = used;
	return 0;
}

static int prepare(const bsdfrbf_data *data, scans *s)
{
	s->direction = malloc(((size_t)s->count + 1) * sizeof *s->direction);
	s->light = malloc(((size_t)s->count + 1) * sizeof *s->light);
	s->least = malloc(((size_t)s->count + 1) * sizeof *s->least);
	s->cover = calloc((size_t)s->count + 1, sizeof *s->cover);
	if (!s->direction || !s->light || !s->least || !s->cover)
		return -1;
	for (uint32_t k = 0; k < s->count; k++) {
		const rbf_component *c = s->part[k >= s->front];
		const rbf_base_info *info = &c->base_info[k >= s->front ? k - s->front : k];
		for (int n = 0; n < 3; n++)
			s->direction[k][n] = n == 2 && (c - s->model->component) & 1 ? -info->direction[n] : info->direction[n];
		s->light[k] = fmaxf(info->dhr, 1e-12f);
		s->least[k] = LEAST / sqrtf(fmaxf(info->direction[2], GRAZING));
	}
	for (int n = 0; n < 2 && s->part[n]; n++)
		set_cover(s->part[n], &data->component[s->part[n] - s->model->component], s->cover + (n ? s->front : 0));
	return 0;
}

/* told[bases of the component]: ln. */
static int solve(const bsdfrbf_data *data, const bsdfrbf_model *model, int first, int second, int asked, double *told)
{
	const rbf_component *c = &model->component[first], *o = &model->component[second];
	scans s = {.model = model, .count = c->mesh.bases, .front = c->mesh.bases, .part = {c}, .images = 1};
	if (o != c) {
		s.part[1] = o;
		s.count += o->mesh.bases;
	}
	if (o->mesh.symmetry == c->mesh.symmetry) {
		s.turned = c->mesh.symmetry == RBF_ISOTROPIC;
		s.images = s.turned ? TURNS : (uint32_t)rbf_symmetry_ops(c->mesh.symmetry, s.op);
	}
	double *all = calloc((size_t)s.count + 1, sizeof *all);
	int found = !all || prepare(data, &s) || make_pairs(&s) ? -1 : rbf_gains_solve(s.count, s.light, s.least, s.pairs, s.pair, all);
	if (found >= 0)
		memcpy(told, all + (asked == first ? 0 : s.front), model->component[asked].mesh.bases * sizeof *told);
	free(all);
	free(s.direction);
	free(s.light);
	free(s.least);
	free(s.cover);
	free(s.pair);
	return found < 0 ? -1 : 0;
}

int bsdfrbf_data_gains(const bsdfrbf_data *data, const bsdfrbf_model *model, bsdfrbf_component component, float *gain)
{
	if (!data || !model || !gain || (unsigned)component >= 4)
		return -1;
	const int other = component < BSDFRBF_TF ? (int)component : BSDFRBF_TF + BSDFRBF_TB - (int)component;
	const rbf_measured *measured = &data->component[component];
	const rbf_component *c = &model->component[component];
	for (size_t i = 0; i < measured->count; i++)
		gain[i] = 1;
	if (!c->present || !model->component[other].present || measured->ready || data->component[other].ready || !data->component[other].count)
		return 0;
	double *told = calloc((size_t)c->mesh.bases + 1, sizeof *told);
	const int first = (int)component < other ? (int)component : other;
	int found = !told || solve(data, model, first, first == (int)component ? other : (int)component, component, told) ? -1 : 0;
	for (size_t i = 0; i < measured->count && found >= 0; i++) {
		float turned[2];
		gain[i] = (float)exp(told[base_of(c, measured->incidence[i].direction, &turned[0], &turned[1])]);
		found += gain[i] < 1 || gain[i] > 1;
	}
	free(told);
	return found;
}

bsdfrbf_status bsdfrbf_data_scale(bsdfrbf_context *context, bsdfrbf_data *data, bsdfrbf_component component, size_t index, double factor)
{
	if (!data || index >= bsdfrbf_data_incidences(data, component) || !(factor > 0) || !isfinite(factor))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_scale: no such incidence, or a factor that is not above 0");
	rbf_incidence *in = &data->component[component].incidence[index];
	for (size_t i = 0; i < in->count * (size_t)data->channels; i++)
		in->dsf[i] = (float)(factor * (double)in->dsf[i]);
	for (size_t i = 0; i < in->lobes; i++)
		for (int n = 0; n < data->channels; n++)
			in->lobe[i].dsf[n] = (float)(factor * (double)in->lobe[i].dsf[n]);
	return BSDFRBF_OK;
}
