/* SPDX-License-Identifier: BSD-3-Clause */
#include "left_out.h"
#include "advect.h"
#include "assemble.h"
#include "levels.h"
#include "sample.h"
#include "settle.h"
#include "extent.h"
#include "tune.h"

#include <stdlib.h>
#include <string.h>

enum { TRIALS_MAX = 64, POINTS = 320 };
enum { TOGETHER = 3 }; /* choices at most */
enum { SCREEN = 4 }; /* every fourth trial is made first */
static const float BETWEEN = .15f; /* weight of a corner that an incidence lies between */
static const double NORMAL = .9999; /* cosine: it is next to all azimuths */
static const float SCREEN_LOSS = 1.06f;
static const double MOST = 2; /* that a trial counts: what differs by more than this differs by how much light there is */

/* One left-out incidence: where it falls in the mesh of the others, and its own fit at test directions. */
typedef struct rbf_left_out_trial {
	uint32_t base, points;
	float incident[3];
	rbf_vertex vertex[3];
	float weight[3];
	rbf_level level[3], arrived[3]; /* of those with a weight, as far as the others tell */
	rbf_knot knot[3];   /* of DHR, likewise */
	float (*point)[3];  /* exitant, of importance density */
	float *truth, *measure; /* DSF and solid angle stood for, per point */
	double energy;
} trial;

void rbf_left_out_free(rbf_left_out *b)
{
	for (uint32_t t = 0; t < b->trials && b->trial; t++) {
		free(b->trial[t].point);
		free(b->trial[t].truth);
		free(b->trial[t].measure);
	}
	free(b->trial);
	free(b->arrived);
	free(b->value);
	*b = (rbf_left_out){0};
}

/* Test directions: half drawn from the fit itself, half by cosine; weights by the balance heuristic (Veach 1997). */
static int trial_points(const rbf_lobes *l, float lambertian, trial *t)
{
	const uint32_t y = rbf_luminance(l->channels);
	double total = 0, *running = malloc((l->count + 1) * sizeof *running);
	t->point = malloc(2 * POINTS * sizeof *t->point);
	t->truth = malloc(2 * POINTS * sizeof *t->truth);
	t->measure = malloc(2 * POINTS * sizeof *t->measure);
	if (!running || !t->point || !t->truth || !t->measure) {
		free(running);
		return -1;
	}
	for (uint32_t i = 0; i < l->count; i++)
		running[i] = total += l->mass[i];
	for (int q = 0; q < 2 * POINTS; q++) {
		const double u = (q % POINTS + .5) / POINTS, v = fmod(q * .6180339887, 1);
		float p[3];
		if (q < POINTS) {
			if (!(total > 0))
				continue;
			uint32_t i = 0;
			while (i + 1 < l->count && running[i] <= u * total)
				i++;
			float centre[3];
			rbf_lobe_centre(l, i, centre);
			rbf_lobe_draw(centre, rbf_lobe_kappa(l, i), fmod(q * .7548776662 + .5, 1), v, p);
		} else {
			const double r = sqrt(u), phi = 2 * RBF_PI * v;
			p[0] = (float)(r * cos(phi));
			p[1] = (float)(r * sin(phi));
			p[2] = (float)sqrt(1 - u);
		}
		if (!(p[2] > 1e-3f))
			continue;
		float value[3];
		rbf_lobes_sum(l, p, value);
		const double density = POINTS * (p[2] / RBF_PI + (total > 0 ? value[y] / total : 0));
		memcpy(t->point[t->points], p, sizeof p);
		t->truth[t->points] = value[y];
		t->measure[t->points] = (float)(1 / density);
		t->energy += value[y] / density;
		t->points++;
	}
	t->energy += lambertian;
	free(running);
	return 0;
}

/* Corners, weights and knots of an incidence in the mesh of those that are not left out with it. across: without those either that it lies between,
 * but for normal incidence. Returns 1 if it is inside, 0 if outside, -1 if nothing is left, or with *status an error. */
static int place_trial(const rbf_left_out *b, const unsigned char *left_out, int across, trial *t, bsdfrbf_status *status)
{
	const rbf_fitted *m = b->fitted;
	unsigned char *out = malloc(m->bases);
	int inside = -1;
	*status = out ? BSDFRBF_OK : BSDFRBF_ERR_MEMORY;
	if (out)
		memcpy(out, left_out, m->bases);
	for (int pass = 0; pass <= across && *status == BSDFRBF_OK; pass++) {
		rbf_mesh mesh;
		rbf_component shell = {0};
		rbf_site site;
		uint32_t corner[3];
		for (int n = 0; n < 3 && pass; n++)
			if (t->weight[n] > BETWEEN && m->direction[3 * t->vertex[n].base + 2] < NORMAL)
				rbf_mesh_leave_out(m->symmetry, m->bases, m->direction, t->vertex[n].base, out);
		inside = -1;
		if (!memchr(out, 0, m->bases))
			break;
		*status = rbf_mesh_build(NULL, m->symmetry, m->bases, m->direction, out, &mesh);
		if (*status != BSDFRBF_OK)
			break;
		shell.mesh = mesh;
		rbf_site_turn(&shell, t->incident, &site);
		inside = !(rbf_mesh_locate(&mesh, site.incident, corner, t->weight) & RBF_MESH_BORDER);
		rbf_knot *knot = rbf_network_make(&mesh, b->value);
		for (int n = 0, k = 0; n < 3 && knot; n++) {
			t->vertex[n] = mesh.vertex[corner[n]];
			if (t->weight[n] > 0)
				t->knot[k++] = knot[t->vertex[n].base];
		}
		if (!knot)
			*status = BSDFRBF_ERR_MEMORY;
		free(knot);
		rbf_mesh_free(&mesh);
	}
	free(out);
	return inside;
}

/* Trials that are to be, of incidences at regular places in the list; trial[] has room for all. */
static uint32_t list_trials(const rbf_fitted *m, trial *t)
{
	const uint32_t step = (m->bases + TRIALS_MAX - 1) / TRIALS_MAX;
	uint32_t count = 0;
	for (uint32_t base = step / 2; base < m->bases; base += step) {
		t[count] = (trial){.base = base};
		for (int n = 0; n < 3; n++)
			t[count].incident[n] = (float)m->direction[3*base + (uint32_t)n];
		count++;
	}
	return count;
}

/* Those of `count` that are to be used and have any energy become the first ones. Returns 0, or -1 when out of memory. */
static int use_trials(const rbf_fitted *m, float lambertian, uint32_t count, const char *use, rbf_left_out *b)
{
	int failed = 0;
	b->trials = count; /* what they allocate is freed in any case */
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t i = 0; i < count; i++)
		if (use[i])
			failed |= trial_points(&m->lobes[b->trial[i].base], lambertian, &b->trial[i]) != 0;
	if (failed)
		return -1;
	b->trials = 0;
	for (uint32_t i = 0; i < count; i++) {
		trial *t = &b->trial[i];
		if (use[i] && t->energy > 0) {
			b->trial[b->trials++] = *t;
			continue;
		}
		free(t->point);
		free(t->truth);
		free(t->measure);
		t->point = NULL;
		t->truth = t->measure = NULL;
	}
	return 0;
}

static void set_levels(const rbf_fitted *m, const float *sent, const unsigned char *out, const rbf_left_out *b, trial *t)
{
	for (int n = 0, k = 0; n < 3; n++) {
		if (!(t->weight[n] > 0))
			continue;
		rbf_level_of(m, sent, out, t->vertex[n].base, &t->level[k]);
		rbf_level_of(m, b->arrived, out, t->vertex[n].base, &t->arrived[k++]);
	}
}

/* Places a trial; returns as place_trial(). */
static int make_trial(const rbf_left_out *b, int across, const float *sent, trial *t, bsdfrbf_status *status)
{
	const rbf_fitted *m = b->fitted;
	unsigned char *out = calloc(m->bases, 1);
	int inside = -1;
	*status = BSDFRBF_ERR_MEMORY;
	if (out) {
		rbf_mesh_leave_out(m->symmetry, m->bases, m->direction, t->base, out);
		inside = place_trial(b, out, across, t, status);
		if (*status == BSDFRBF_OK && inside >= 0)
			set_levels(m, sent, out, b, t);
	}
	free(out);
	return inside;
}

static bsdfrbf_status make_trials(bsdfrbf_context *context, float lambertian, int across, const float *sent, rbf_left_out *b)
{
	const rbf_fitted *m = b->fitted;
	bsdfrbf_status status[TRIALS_MAX];
	int inside[TRIALS_MAX];
	char use[TRIALS_MAX];
	if (m->bases < 2)
		return BSDFRBF_OK;
	const uint32_t count = list_trials(m, b->trial);
	#pragma omp parallel for schedule(dynamic)
	for (uint32_t i = 0; i < count; i++)
		inside[i] = make_trial(b, across, sent, &b->trial[i], &status[i]);
	for (uint32_t i = 0; i < count; i++)
		if (status[i] != BSDFRBF_OK)
			return rbf_fail(context, status[i], "%s", bsdfrbf_status_text(status[i]));
	/* those inside the mesh of the others; if there are none but normal incidence, which tells no frame from one that turns back x or y, or both, those
	 * outside it as well */
	b->outside = 1;
	for (uint32_t i = 0; i < count; i++)
		b->outside &= inside[i] != 1 || (double)b->trial[i].incident[2] >= NORMAL;
	for (uint32_t i = 0; i < count; i++)
		use[i] = inside[i] == 1 || (b->outside && !inside[i]);
	return use_trials(m, lambertian, count, use, b) ? rbf_out_of_memory(context) : BSDFRBF_OK;
}

bsdfrbf_status rbf_left_out_images(bsdfrbf_context *context, rbf_fitted *m, float lambertian, unsigned op, rbf_left_out *b)
{
	const rbf_component shell = {.mesh = m->mesh};
	char use[TRIALS_MAX];
	*b = (rbf_left_out){.fitted = m, .trial = calloc(TRIALS_MAX + 1, sizeof *b->trial)};
	if (!b->trial)
		return rbf_out_of_memory(context);
	const uint32_t count = list_trials(m, b->trial);
	for (uint32_t i = 0; i < count; i++) {
		trial *t = &b->trial[i];
		const float own[3] = {t->incident[0], t->incident[1], t->incident[2]};
		uint32_t corner[3];
		rbf_site site;
		rbf_mirror(op, own, t->incident);
		rbf_site_turn(&shell, t->incident, &site);
		use[i] = !(rbf_mesh_locate(&m->mesh, site.incident, corner, t->weight) & RBF_MESH_BORDER);
		for (int n = 0; n < 3; n++)
			t->vertex[n] = m->mesh.vertex[corner[n]];
	}
	if (use_trials(m, lambertian, count, use, b))
		return rbf_out_of_memory(context);
	for (uint32_t i = 0; i < b->trials; i++)
		for (uint32_t p = 0; p < b->trial[i].points; p++)
			rbf_mirror(op, b->trial[i].point[p], b->trial[i].point[p]);
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_left_out_make(bsdfrbf_context *context, rbf_fitted *m, float lambertian, int across, rbf_left_out *b)
{
	b->fitted = m;
	b->trials = 0;
	b->outside = 0;
	b->trial = calloc(TRIALS_MAX + 1, sizeof *b->trial);
	float *sent = rbf_levels_sent(m);
	b->arrived = rbf_levels_arrived(m);
	b->value = b->arrived ? rbf_tune_arrived(m->bases, b->arrived) : NULL;
	const bsdfrbf_status status = b->trial && sent && b->value ? make_trials(context, lambertian, across, sent, b) : rbf_out_of_memory(context);
	free(sent);
	return status;
}

void rbf_left_out_spans(const rbf_left_out *b, rbf_span *span)
{
	for (uint32_t i = 0; i < b->fitted->bases; i++)
		span[i] = (rbf_span){.bend = -1};
	for (uint32_t n = 0; n < b->trials; n++) {
		const trial *t = &b->trial[n];
		rbf_span sum = {0};
		for (int i = 0; i < 3; i++) {
			sum.squares += t->weight[i] * t->weight[i];
			for (int k = 0; k < i; k++) {
				const float *p = t->vertex[i].direction, *q = t->vertex[k].direction, e[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
				sum.bend += t->weight[i] * t->weight[k] * rbf_dot(e, e);
			}
		}
		span[t->base] = sum;
	}
}

/* Residual motion between the corners of a trial. */
static int trial_motion(const rbf_fitted *m, const rbf_choice *choice, const rbf_component *c, const trial *t, rbf_site *site,
	rbf_shift *store[3][2])
{
	uint32_t used[3], count = 0;
	for (uint32_t n = 0; n < 3; n++)
		if (t->weight[n] > 0)
			used[count++] = n;
	for (uint32_t k = 0; k < count; k++) {
		const rbf_vertex *own = &t->vertex[used[k]];
		uint32_t slot = 0;
		for (uint32_t l = 0; l < count; l++) {
			if (l == k)
				continue;
			const rbf_vertex *other = &t->vertex[used[l]];
			rbf_vertex to = {.base = other->base, .op = other->op ^ own->op};
			float (*motion)[3] = malloc((m->lobes[own->base].count + 1) * sizeof *motion), mean;
			rbf_mirror(own->op, other->direction, to.direction);
			store[k][slot] = malloc((rbf_assemble_blocks(c, own->base) + 1) * sizeof **store[k]);
			const int failed = !motion || !store[k][slot]
				|| rbf_advect(m, choice->frames, choice->frame, choice->label, own->base, &to, choice->cap, motion, &mean);
			if (!failed) {
				rbf_assemble_shift(m, c, choice->label, own->base, (const float (*)[3])motion, store[k][slot]);
				site->motion[k].shift[slot] = store[k][slot];
				site->moves = 1;
				site->motion[k].weight[slot] = t->weight[used[l]];
			}
			free(motion);
			if (failed)
				return -1;
			slot++;
		}
	}
	return 0;
}

static void trial_levels(const rbf_fitted *m, const rbf_choice *choice, const trial *t, rbf_site *site)
{
	rbf_level level[3];
	memcpy(level, t->level, sizeof level);
	for (uint32_t k = 0; k < site->corners; k++) {
		const double *d = m->direction + 3 * site->base[k];
		const float own[3] = {(float)d[0], (float)d[1], (float)d[2]};
		rbf_level_carried(site->component, own, site->base[k], &level[k]);
		if (!choice->slopes)
			rbf_level_flatten(&level[k]);
	}
	rbf_site_even(site, choice->even, level);
}

/* By how much light is tuned: DHR where it is, from the test directions, against what is expected. */
static double trial_tune(const rbf_left_out *b, const rbf_choice *choice, const trial *t, const float value[])
{
	double is = 0, truth = 0;
	rbf_level level[3];
	rbf_vertex vertex[3];
	float weight[3];
	uint32_t corners = 0;
	for (uint32_t p = 0; p < t->points; p++) {
		is += (double)(value[p] * t->measure[p]);
		truth += (double)(t->truth[p] * t->measure[p]);
	}
	for (int n = 0; n < 3; n++)
		if (t->weight[n] > 0) {
			level[corners] = t->arrived[corners];
			if (choice->tune < 2)
				rbf_level_flatten(&level[corners]);
			vertex[corners] = t->vertex[n];
			weight[corners++] = t->weight[n];
		}
	const double expected = rbf_tune_expected(corners, level, choice->tune > 2 ? t->knot : NULL, vertex, weight);
	return truth > 0 ? rbf_tune_ratio(expected, (double)b->value[t->base] * is / truth) : 1;
}

/* Errors of some choices that differ by how they are tuned alone. */
static int trial_errors(const rbf_left_out *b, uint32_t choices, rbf_choice *const choice[], const rbf_component *c, const trial *t, float *error)
{
	const rbf_fitted *m = b->fitted;
	rbf_site site;
	rbf_shift *store[3][2] = {{NULL}};
	float seen[2 * POINTS];
	const uint32_t y = rbf_luminance(m->channels);
	rbf_site_corners(c, t->incident, t->vertex, t->weight, &site);
	if (choice[0]->even)
		trial_levels(m, choice[0], t, &site);
	const int failed = choice[0]->cap > 0 && trial_motion(m, choice[0], c, t, &site, store);
	for (uint32_t p = 0; p < t->points && !failed; p++) {
		float folded[3], value[3];
		rbf_site_fold(&site, t->point[p], folded);
		rbf_site_dsf(&site, folded, value);
		seen[p] = value[y];
	}
	for (uint32_t n = 0; n < choices && !failed; n++) {
		const double tune = choice[n]->tune ? trial_tune(b, choice[n], t, seen) : 1;
		double sum = 0;
		for (uint32_t p = 0; p < t->points; p++)
			sum += fabs(tune * (double)seen[p] - (double)t->truth[p]) * (double)t->measure[p];
		error[n] = (float)(sum / t->energy);
	}
	for (int k = 0; k < 3; k++)
		for (int n = 0; n < 2; n++)
			free(store[k][n]);
	return failed ? -1 : 0;
}

/* Mean error over every step-th trial. */
static float mean_error(const rbf_left_out *b, const rbf_choice *choice, uint32_t step)
{
	double sum = 0;
	uint32_t count = 0;
	for (uint32_t t = 0; t < b->trials; t += step, count++)
		sum += fmin((double)choice->base_error[b->trial[t].base], MOST);
	return count ? (float)(sum / count) : -1;
}

/* Leaves out frames that got no lobe. */
static void drop_empty(rbf_choice *c, size_t lobes)
{
	uint32_t kept = 0;
	for (uint32_t f = 0; f < c->frames; f++) {
		if (!(c->share[f] > 0))
			continue;
		memmove(c->label + kept * lobes, c->label + f * lobes, lobes * sizeof *c->label);
		c->frame[kept] = c->frame[f];
		c->limit[kept] = c->limit[f];
		c->share[kept++] = c->share[f];
	}
	c->frames = kept;
}

/* Labels a choice. once: gets what there is after the first sweep, if there are more and it would have no other; or NULL. */
static int label(const rbf_fitted *m, rbf_choice *choice, rbf_choice *once)
{
	const size_t lobes = m->lobe_first[m->bases], bytes = choice->frames * lobes * sizeof *choice->label + 1;
	const int wide = choice->belief.settled > 1, sweeps = wide ? RBF_SETTLE_SWEEPS : choice->belief.settled;
	choice->label = malloc(bytes);
	if (!choice->label)
		return -1;
	rbf_label(m, choice->frames, choice->frame, choice->belief, choice->label, choice->share);
	for (int n = 0; n < sweeps; n++) {
		if (rbf_settle(m, choice->frames, choice->frame, wide, choice->label, choice->share))
			return -1;
		if (n || !once || !rbf_settle_alike(m, choice->frames, choice->frame, choice->share))
			continue;
		once->label = malloc(bytes);
		if (!once->label)
			return -1;
		memcpy(once->label, choice->label, bytes - 1);
		memcpy(once->share, choice->share, sizeof once->share);
		drop_empty(once, lobes);
	}
	drop_empty(choice, lobes);
	return 0;
}

int rbf_choice_label(const rbf_fitted *m, rbf_choice *choice)
{
	return label(m, choice, NULL);
}

int rbf_choice_label_widely(const rbf_fitted *m, rbf_choice *wide, rbf_choice *once)
{
	return label(m, wide, once);
}

/* Errors of some choices that differ by how they are tuned alone; they have labels. */
static int measure(const rbf_left_out *b, uint32_t choices, rbf_choice *const choice[], const rbf_choice *best)
{
	const rbf_choice *const one = choice[0];
	const rbf_fitted *m = b->fitted;
	rbf_component c = {0};
	for (uint32_t n = 0; n < choices; n++) {
		choice[n]->base_error = malloc((m->bases + 1) * sizeof *one->base_error);
		if (!choice[n]->base_error)
			return -1;
		for (uint32_t i = 0; i < m->bases; i++)
			choice[n]->base_error[i] = -1;
		choice[n]->error = INFINITY;
	}
	if (rbf_assemble_sets(m, one->frames, one->frame, one->label, one->limit, &c))
		return -1;
	c.extent = rbf_extent_make(c.block, c.blocks);
	int failed = !c.extent;
	const int screen = best && b->trials >= 3 * SCREEN;
	for (int pass = !screen; pass < 2 && !failed; pass++) {
		uint32_t list[TRIALS_MAX], count = 0;
		float error[TRIALS_MAX * TOGETHER];
		for (uint32_t t = 0; t < b->trials; t++)
			if (screen ? (t % SCREEN == 0) != pass : 1)
				list[count++] = t;
		#pragma omp parallel for schedule(dynamic) reduction(|:failed)
		for (int64_t i = 0; i < (int64_t)count; i++)
			if (rbf_team_mine(m->team, (uint64_t)i))
				failed |= trial_errors(b, choices, choice, &c, &b->trial[list[i]], &error[i * choices]) != 0;
		failed = rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, count, choices * sizeof *error, error);
		for (uint32_t i = 0; i < count && !failed; i++)
			for (uint32_t n = 0; n < choices; n++)
				choice[n]->base_error[b->trial[list[i]].base] = error[i * choices + n];
		if (!pass && mean_error(b, one, SCREEN) > SCREEN_LOSS * mean_error(b, best, SCREEN))
			break;
		for (uint32_t n = 0; n < choices && pass; n++)
			choice[n]->error = mean_error(b, choice[n], 1);
	}
	rbf_assemble_release(&c);
	free((void *)c.extent);
	return failed ? -1 : 0;
}

int rbf_left_out_error(const rbf_left_out *b, rbf_choice *choice, const rbf_choice *best)
{
	return !choice->label && rbf_choice_label(b->fitted, choice) ? -1 : measure(b, 1, &choice, best);
}

int rbf_left_out_tuned(const rbf_left_out *b, uint32_t choices, rbf_choice *const choice[])
{
	return measure(b, choices, choice, NULL);
}

void rbf_choice_free(rbf_choice *c)
{
	free(c->label);
	free(c->base_error);
	memset(c, 0, sizeof *c);
}
