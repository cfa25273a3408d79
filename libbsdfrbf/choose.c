/* SPDX-License-Identifier: BSD-3-Clause */
#include "choose.h"
#include "advect.h"
#include "assemble.h"
#include "learn.h"
#include "sample.h"
#include "settle.h"
#include "simplex.h"

#include <stdlib.h>
#include <string.h>

enum { TRIALS_MAX = 64, POINTS = 320, FRAMES_MAX = 3 };
enum { SCREEN = 4 }; /* every fourth trial is made first */
static const rbf_belief BELIEF = {.sharpness = 4};
static const float SHARPER = 2; /* times as sharp, and as blunt, are tried once the frames are chosen */
static const float SCREEN_LOSS = 1.06f;
static const float ENOUGH = 1.25f; /* times the error of the fits: no better frame is looked for */
static const double LEARN_GAIN = .01; /* of the energy, that a learned frame must add to what is predicted */
static const float GAIN = .97f; /* another frame must lower the error to this share */
static const float LEARNED_GAIN = .92f; /* a learned one to this: it has six coefficients, and nothing is known of it beyond the mesh */
enum { REFINE_ROUNDS = 3 }; /* for each coefficient */
static const double REFINE_STEP = .05, REFINE_END = .02; /* of a coefficient; of the error, between the simplex's corners */

/* One left-out incidence: where it falls in the mesh of the others, and its own fit at test directions. */
typedef struct trial {
	uint32_t base, points;
	float incident[3];
	rbf_vertex vertex[3];
	float weight[3];
	float (*point)[3];  /* exitant, of importance density */
	float *truth, *measure; /* DSF and solid angle stood for, per point */
	double energy;
} trial;

typedef struct bench {
	rbf_fitted *fitted;
	uint32_t trials;
	trial *trial;
} bench;

static void bench_free(bench *b)
{
	for (uint32_t t = 0; t < b->trials && b->trial; t++) {
		free(b->trial[t].point);
		free(b->trial[t].truth);
		free(b->trial[t].measure);
	}
	free(b->trial);
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

static bsdfrbf_status bench_make(bsdfrbf_context *context, rbf_fitted *m, float lambertian, bench *b)
{
	b->fitted = m;
	b->trials = 0;
	b->trial = calloc(TRIALS_MAX + 1, sizeof *b->trial);
	if (!b->trial)
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
	if (m->bases < 3)
		return BSDFRBF_OK;
	const uint32_t step = (m->bases + TRIALS_MAX - 1) / TRIALS_MAX;
	/* those inside the mesh of the others; if there are none, those outside it as well */
	for (int outside = 0; outside < 2 && !b->trials; outside++)
		for (uint32_t base = step / 2; base < m->bases; base += step) {
			rbf_mesh mesh;
			rbf_component shell = {0};
			rbf_site site;
			RBF_TRY(rbf_mesh_build(context, m->symmetry, m->bases, m->direction, base, &mesh));
			trial *t = &b->trial[b->trials];
			memset(t, 0, sizeof *t);
			for (int n = 0; n < 3; n++)
				t->incident[n] = (float)m->direction[3*base + (uint32_t)n];
			shell.mesh = mesh;
			rbf_site_turn(&shell, t->incident, &site);
			uint32_t corner[3];
			const uint32_t element = rbf_mesh_locate(&mesh, site.incident, corner, t->weight);
			for (int n = 0; n < 3; n++)
				t->vertex[n] = mesh.vertex[corner[n]];
			rbf_mesh_free(&mesh);
			if (((element & RBF_MESH_BORDER) != 0) != outside)
				continue;
			t->base = base;
			b->trials++; /* counted first: what it allocates is then freed in any case */
			if (trial_points(&m->lobes[base], lambertian, t))
				return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory");
			if (!(t->energy > 0)) {
				b->trials--;
				free(t->point);
				free(t->truth);
				free(t->measure);
			}
		}
	return BSDFRBF_OK;
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

static int trial_error(const rbf_fitted *m, const rbf_choice *choice, const rbf_component *c, const trial *t, float *error)
{
	rbf_site site;
	rbf_shift *store[3][2] = {{NULL}};
	const uint32_t y = rbf_luminance(m->channels);
	rbf_site_corners(c, t->incident, t->vertex, t->weight, &site);
	const int failed = choice->cap > 0 && trial_motion(m, choice, c, t, &site, store);
	double sum = 0;
	for (uint32_t p = 0; p < t->points && !failed; p++) {
		float folded[3], value[3];
		rbf_site_fold(&site, t->point[p], folded);
		rbf_site_dsf(&site, folded, value);
		sum += fabs((double)value[y] - (double)t->truth[p]) * (double)t->measure[p];
	}
	*error = (float)(sum / t->energy);
	for (int k = 0; k < 3; k++)
		for (int n = 0; n < 2; n++)
			free(store[k][n]);
	return failed ? -1 : 0;
}

/* Mean error over every step-th trial. */
static float mean_error(const bench *b, const rbf_choice *choice, uint32_t step)
{
	double sum = 0;
	uint32_t count = 0;
	for (uint32_t t = 0; t < b->trials; t += step, count++)
		sum += (double)choice->base_error[b->trial[t].base];
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
		c->share[kept++] = c->share[f];
	}
	c->frames = kept;
}

/* Labels a candidate, and measures its error. If `best` is given, a few trials are made first, and the others only if the
 * candidate is not clearly worse there: otherwise its error is INFINITY. */
static int measure(const bench *b, rbf_choice *choice, const rbf_choice *best)
{
	const rbf_fitted *m = b->fitted;
	rbf_component c = {0};
	choice->label = malloc(((size_t)choice->frames * m->lobe_first[m->bases] + 1) * sizeof *choice->label);
	choice->base_error = malloc((m->bases + 1) * sizeof *choice->base_error);
	if (!choice->label || !choice->base_error)
		return -1;
	rbf_label(m, choice->frames, choice->frame, choice->belief, choice->label, choice->share);
	if (choice->belief.settled && rbf_settle(m, choice->frames, choice->frame, choice->label, choice->share))
		return -1;
	drop_empty(choice, m->lobe_first[m->bases]);
	if (rbf_assemble_sets(m, choice->frames, choice->frame, choice->label, &c))
		return -1;
	for (uint32_t i = 0; i < m->bases; i++)
		choice->base_error[i] = -1;
	int failed = 0;
	const int screen = best && b->trials >= 3 * SCREEN;
	choice->error = INFINITY;
	for (int pass = !screen; pass < 2 && !failed; pass++) {
		uint32_t list[TRIALS_MAX], count = 0;
		float error[TRIALS_MAX];
		for (uint32_t t = 0; t < b->trials; t++)
			if (screen ? (t % SCREEN == 0) != pass : 1)
				list[count++] = t;
		#pragma omp parallel for schedule(dynamic) reduction(|:failed)
		for (int64_t i = 0; i < (int64_t)count; i++)
			if (rbf_team_mine(m->team, (uint64_t)i))
				failed |= trial_error(m, choice, &c, &b->trial[list[i]], &error[i]) != 0;
		failed = rbf_team_failed(m->team, failed) || rbf_team_share_rows(m->team, count, sizeof *error, error);
		for (uint32_t i = 0; i < count && !failed; i++)
			choice->base_error[b->trial[list[i]].base] = error[i];
		if (!pass && mean_error(b, choice, SCREEN) > SCREEN_LOSS * mean_error(b, best, SCREEN))
			break;
		if (pass)
			choice->error = mean_error(b, choice, 1);
	}
	rbf_assemble_release(&c);
	return failed ? -1 : 0;
}

void rbf_choice_free(rbf_choice *c)
{
	free(c->label);
	free(c->base_error);
	memset(c, 0, sizeof *c);
}

/* `next` in the place of `best`. */
static void replace(rbf_choice *best, rbf_choice *next)
{
	rbf_choice_free(best);
	*best = *next;
	memset(next, 0, sizeof *next);
}

/* Measures `next`; the better of the two stays in `best`. against: what it has to beat in any case, or NULL. */
static int contest(const bench *b, rbf_choice *best, rbf_choice next, const rbf_choice *against)
{
	if (measure(b, &next, against)) {
		rbf_choice_free(&next);
		return -1;
	}
	if (!best->frames || next.error < best->error)
		replace(best, &next);
	else
		rbf_choice_free(&next);
	return 0;
}

/* Without an incidence to leave out: the map that predicts the neighbours best. */
static unsigned best_prediction(const rbf_fitted *m)
{
	unsigned best = RBF_MAP_MIRROR;
	double top = -INFINITY;
	for (unsigned map = 0; map < RBF_MAPS_LISTED; map++) {
		double sum = 0;
		for (uint32_t b = 0; b < m->bases; b++)
			for (uint32_t i = 0; i < m->lobes[b].count; i++)
				sum += m->lobes[b].mass[i] * (double)m->candidate[map].prediction[m->lobe_first[b] + i];
		if (sum > top + 1e-9 * fabs(top)) {
			top = sum;
			best = map;
		}
	}
	return m->bases < 2 ? RBF_MAP_MIRROR : best;
}

/* Search for the coefficients of a learned frame that lower the leave-one-out error itself. */
typedef struct refinement {
	const bench *bench;
	rbf_lesson *lesson;
	rbf_choice *best;       /* so far */
	rbf_linear linear, of_best;
	uint32_t candidate;
	uint32_t frames, frame[RBF_MAX_FRAMES];
	int failed;
} refinement;

static double error_with(void *data, const double x[])
{
	refinement *r = data;
	rbf_fitted *m = r->bench->fitted;
	rbf_choice next = {.frames = r->frames, .belief = r->best->belief};
	memcpy(next.frame, r->frame, sizeof next.frame);
	rbf_learn_set(r->lesson, m->candidate[r->candidate].map, x, &r->linear);
	r->failed = r->failed || rbf_label_change(m, r->candidate, &r->linear) || measure(r->bench, &next, r->best);
	const double error = r->failed ? INFINITY : (double)next.error;
	if (!r->failed && next.error < r->best->error) {
		replace(r->best, &next);
		r->of_best = r->linear;
	} else
		rbf_choice_free(&next);
	return error;
}

/* choice: the last candidate is one of its frames, and changes with it. */
static int refine(const bench *b, rbf_lesson *lesson, rbf_choice *choice)
{
	rbf_fitted *m = b->fitted;
	refinement r = {.bench = b, .lesson = lesson, .best = choice, .candidate = m->candidates - 1, .frames = choice->frames};
	rbf_candidate *c = &m->candidate[r.candidate];
	double x[RBF_SIMPLEX_MAX];
	memcpy(r.frame, choice->frame, sizeof r.frame);
	r.linear = r.of_best = c->linear;
	const uint32_t d = rbf_learn_get(lesson, c->map, &r.linear, x);
	rbf_simplex(error_with, &r, d, x, REFINE_STEP, REFINE_ROUNDS * d, REFINE_END);
	return r.failed || rbf_label_change(m, r.candidate, &r.of_best);
}

/* Learns a frame besides `others`. If the energy that is then predicted exceeds `known`, the frames are measured with it, and join in
 * `best` if they are clearly better. *found: the frame's beam, for a further start. */
static int contest_learned(const bench *b, rbf_lesson *lesson, rbf_choice *best, unsigned map, const rbf_choice *others,
	double known, const rbf_linear *start, rbf_linear *found)
{
	rbf_fitted *m = b->fitted;
	const double with = rbf_learn(lesson, map, start, found);
	if (rbf_learn_failed(lesson))
		return -1;
	if (with < known + LEARN_GAIN || m->candidates == RBF_CANDIDATES)
		return 0;
	if (rbf_label_add(m, map, found))
		return -1;
	rbf_choice next = {.frames = others->frames + 1, .belief = others->belief}, round = {0};
	memcpy(next.frame, others->frame, sizeof next.frame);
	next.frame[others->frames] = m->candidates - 1;
	if (contest(b, &round, next, NULL))
		return -1;
	int holds = 0;
	for (uint32_t f = 0; f < round.frames; f++)
		holds |= round.frame[f] == m->candidates - 1;
	if (holds && round.error < best->error && refine(b, lesson, &round)) {
		rbf_choice_free(&round);
		return -1;
	}
	if (round.error < LEARNED_GAIN * best->error)
		replace(best, &round);
	else
		rbf_choice_free(&round);
	return 0;
}

/* Frames learned from the data: one in the place of all, one more, then each anew. */
static int learn(const bench *b, rbf_choice *best)
{
	static const unsigned map[2] = {RBF_MAP_LEARNED_SHIFT, RBF_MAP_LEARNED_TURN};
	rbf_lesson *lesson = rbf_learn_begin(b->fitted);
	int failed = !lesson;
	for (int more = 0; more < 2 && !failed && best->frames < RBF_MAX_FRAMES; more++) {
		rbf_choice others = {.belief = best->belief};
		rbf_linear found[2];
		const double known = rbf_learn_after(lesson, best->frames, best->frame);
		if (more) {
			others.frames = best->frames;
			memcpy(others.frame, best->frame, sizeof others.frame);
		} else
			rbf_learn_after(lesson, 0, NULL);
		for (int n = 0; n < 2 && !failed; n++)
			failed = contest_learned(b, lesson, best, map[n], &others, known, n ? &found[0] : NULL, &found[n]);
	}
	for (uint32_t f = 0; f < best->frames && !failed; f++) {
		const rbf_candidate *c = &b->fitted->candidate[best->frame[f]];
		const rbf_map_row *row = rbf_map_get(c->map);
		if (row->kind != RBF_KIND_TURN && row->kind != RBF_KIND_SHIFT)
			continue;
		rbf_linear found, start = c->linear;
		if (!rbf_map_learned(c->map))
			start = (rbf_linear){{{row->along[0]}, {0, row->along[1]}}};
		rbf_choice others = {.belief = best->belief};
		for (uint32_t g = 0; g < best->frames; g++)
			if (g != f)
				others.frame[others.frames++] = best->frame[g];
		const double known = rbf_learn_after(lesson, best->frames, best->frame);
		rbf_learn_after(lesson, others.frames, others.frame);
		failed = contest_learned(b, lesson, best, map[row->kind == RBF_KIND_TURN], &others, known, &start, &found);
	}
	rbf_learn_end(lesson);
	return failed;
}

/* Adds listed frames to `best`, one at a time, as long as each lowers the error clearly. */
static int add_frames(const bench *b, rbf_choice *best)
{
	const int plane = b->fitted->symmetry == RBF_ISOTROPIC;
	int better = 1, failed = 0;
	while (better && !failed && best->frames < FRAMES_MAX) {
		rbf_choice round = {0};
		for (unsigned map = 0; map < RBF_MAPS_LISTED && !failed; map++) {
			rbf_choice next = {.frames = best->frames + 1, .belief = best->belief};
			int there = plane && !rbf_map_get(map)->plane;
			for (uint32_t f = 0; f < best->frames; f++) {
				next.frame[f] = best->frame[f];
				there |= best->frame[f] == map;
			}
			next.frame[best->frames] = map;
			if (!there)
				failed = contest(b, &round, next, best);
		}
		better = !failed && round.frames && round.error < GAIN * best->error;
		if (better)
			replace(best, &round);
		else
			rbf_choice_free(&round);
	}
	return failed;
}

static bsdfrbf_status choose(bsdfrbf_context *context, const bench *b, float fit_error, double from, double to, rbf_choice *choice)
{
	const double step = (to - from) / (RBF_MAPS_LISTED + 3);
	rbf_choice best = {.belief = BELIEF};
	int failed = 0;
	if (!b->trials) {
		best.frames = 1;
		best.frame[0] = best_prediction(b->fitted);
		failed = measure(b, &best, NULL);
		*choice = best;
		return failed ? rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory") : BSDFRBF_OK;
	}
	const int plane = b->fitted->symmetry == RBF_ISOTROPIC;
	for (unsigned map = 0; map < RBF_MAPS_LISTED && !failed; map++) {
		if (plane && !rbf_map_get(map)->plane)
			continue;
		failed = contest(b, &best, (rbf_choice){.frames = 1, .frame = {map}, .belief = BELIEF}, best.frames ? &best : NULL);
		*choice = best;
		if (rbf_progress(context, "frames", from + step * map))
			return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	}
	rbf_choice first = {.frames = 1, .frame = {best.frame[0]}, .belief = {BELIEF.sharpness, 1}}, faint = {0};
	failed = failed || add_frames(b, &best);
	*choice = best;
	if (rbf_progress(context, "frames", from + step * RBF_MAPS_LISTED))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	if (!failed && best.error > ENOUGH * fit_error) {
		failed = contest(b, &faint, first, NULL) || add_frames(b, &faint);
		if (!failed && faint.error < GAIN * best.error)
			replace(&best, &faint);
		else
			rbf_choice_free(&faint);
		*choice = best;
	}
	if (rbf_progress(context, "frames", from + step * (RBF_MAPS_LISTED + 1)))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	const rbf_choice listed = best; /* its labels and errors are not used below */
	int learned = 0;
	if (!failed && best.error > ENOUGH * fit_error) {
		failed = learn(b, &best);
		learned = best.error < listed.error;
		failed = failed || (learned && add_frames(b, &best));
		*choice = best;
	}
	if (rbf_progress(context, "learned frames", from + step * (RBF_MAPS_LISTED + 2)))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	/* three other beliefs */
	const rbf_belief had = best.belief;
	for (int n = 0; n < 3 && !failed && best.frames > 1; n++) {
		rbf_choice next = {.frames = best.frames, .belief = best.belief};
		if (n < 2)
			next.belief.sharpness = n ? had.sharpness / SHARPER : had.sharpness * SHARPER;
		next.belief.settled = n == 2;
		memcpy(next.frame, best.frame, sizeof next.frame);
		failed = contest(b, &best, next, &best);
		*choice = best;
	}
	/* what is left moves as the transport has it, if that helps: between the frames, between those without what was learned, or all of it */
	const float caps[2] = {.6f, 1.f};
	const rbf_choice still[3] = {best, listed, {.frames = 1, .frame = {RBF_MAP_FIXED}, .belief = best.belief}};
	for (int n = 0; n < 5 && !failed; n++) {
		const rbf_choice *frames = &still[n / 2];
		rbf_choice next = {.frames = frames->frames, .cap = n < 4 ? caps[n % 2] : 2, .belief = frames->belief};
		memcpy(next.frame, frames->frame, sizeof next.frame);
		if (n / 2 != 1 || learned)
			failed = contest(b, &best, next, &best);
		*choice = best;
		if (rbf_progress(context, "residual transport", from + step * (RBF_MAPS_LISTED + 2 + n * .2)))
			return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	}
	*choice = best;
	return failed ? rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory") : BSDFRBF_OK;
}

bsdfrbf_status rbf_choose(bsdfrbf_context *context, rbf_fitted *fitted, float lambertian, float fit_error, double progress_from,
	double progress_to, rbf_choice *choice)
{
	bench b = {0};
	memset(choice, 0, sizeof *choice);
	bsdfrbf_status status = bench_make(context, fitted, lambertian, &b);
	if (status == BSDFRBF_OK)
		status = choose(context, &b, fit_error, progress_from, progress_to, choice);
	bench_free(&b);
	if (status != BSDFRBF_OK)
		rbf_choice_free(choice);
	return status;
}
