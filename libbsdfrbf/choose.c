/* SPDX-License-Identifier: BSD-3-Clause */
#include "choose.h"
#include "contest.h"
#include "learn.h"
#include "simplex.h"

#include <stdlib.h>
#include <string.h>

enum { FRAMES_MAX = 3 };
static const rbf_belief BELIEF = {.sharpness = 4};
static const float SHARPER = 2; /* times as sharp, and as blunt, are tried once the frames are chosen */
static const float ENOUGH = 1.25f; /* times the error of the fits: no better frame is looked for */
static const float FAILED = 4; /* and above this the frames have failed: they are looked for once more */
static const double LEARN_GAIN = .01; /* of the energy, that a learned frame must add to what is predicted */
static const float GAIN = .97f; /* another frame must lower the error to this share */
static const float MOVED_GAIN = .95f; /* and residual transport to this: it takes more bytes than all the rest, and time */
static const float SETTLED_LOSS = 1.01f;
static const float LIMIT_GAIN = .99f; /* other limits of shares must lower the error to this share */
static const float EVEN_GAIN = .99f; /* evened levels must lower the error to this share */
static const float TUNE_GAIN = .95f; /* and tuned light to this: it is less sure where incidences are dense */
static const double CLEARLY = 1.1; /* times what the best of the list adds to what is predicted, that a learned frame must */
static const float LEARNED_GAIN = .92f; /* a learned one to this: it has six coefficients, and nothing is known of it beyond the mesh */
enum { REFINE_ROUNDS = 3 }; /* for each coefficient */
static const double REFINE_STEP = .05, REFINE_END = .02; /* of a coefficient; of the error, between the simplex's corners */

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
	const rbf_left_out *left_out;
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
	rbf_fitted *m = r->left_out->fitted;
	rbf_choice next = {.frames = r->frames, .belief = r->best->belief};
	memcpy(next.frame, r->frame, sizeof next.frame);
	rbf_learn_set(r->lesson, m->candidate[r->candidate].map, x, &r->linear);
	r->failed = r->failed || rbf_label_change(m, r->candidate, &r->linear) || rbf_left_out_error(r->left_out, &next, r->best);
	const double error = r->failed ? INFINITY : (double)next.error;
	if (!r->failed && next.error < r->best->error) {
		rbf_contest_replace(r->best, &next);
		r->of_best = r->linear;
	} else
		rbf_choice_free(&next);
	return error;
}

/* choice: the last candidate is one of its frames, and changes with it. */
static int refine(const rbf_left_out *b, rbf_lesson *lesson, rbf_choice *choice)
{
	rbf_fitted *m = b->fitted;
	refinement r = {.left_out = b, .lesson = lesson, .best = choice, .candidate = m->candidates - 1, .frames = choice->frames};
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
static int contest_learned(const rbf_left_out *b, rbf_lesson *lesson, rbf_choice *best, unsigned map, const rbf_choice *others,
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
	if (rbf_contest(b, &round, next, NULL))
		return -1;
	int holds = 0;
	for (uint32_t f = 0; f < round.frames; f++)
		holds |= round.frame[f] == m->candidates - 1;
	if (holds && round.error < best->error && refine(b, lesson, &round)) {
		rbf_choice_free(&round);
		return -1;
	}
	rbf_contest_win(best, &round, LEARNED_GAIN);
	return 0;
}

/* Frames learned from the data: one in the place of the only one, one more, then each anew. */
static int learn(const rbf_left_out *b, rbf_lesson *lesson, rbf_choice *best)
{
	static const unsigned map[2] = {RBF_MAP_LEARNED_SHIFT, RBF_MAP_LEARNED_TURN};
	int failed = 0;
	for (int more = best->frames > 1; more < 2 && !failed && best->frames < RBF_MAX_FRAMES; more++) {
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
	return failed;
}

/* Whether a listed map may join the frames of a choice. */
static int may_join(const rbf_fitted *m, const rbf_choice *c, unsigned map)
{
	int may = m->symmetry != RBF_ISOTROPIC || rbf_map_get(map)->plane;
	for (uint32_t f = 0; f < c->frames; f++)
		may &= c->frame[f] != map;
	return may;
}

/* The frame that predicts most of what those of `rungs` leave, from the list, or learned where that is clearly more: a candidate.
 * *frame: RBF_CANDIDATES if there is none. */
static int best_addition(rbf_fitted *m, rbf_lesson *lesson, const rbf_choice *rungs, uint32_t *frame)
{
	const double known = rbf_learn_after(lesson, rungs->frames, rungs->frame);
	double top = known + LEARN_GAIN;
	*frame = RBF_CANDIDATES;
	for (unsigned map = 0; map < RBF_MAPS_LISTED; map++) {
		const double with = may_join(m, rungs, map) ? rbf_learn_with(lesson, map) : 0;
		if (with > top) {
			top = with;
			*frame = map;
		}
	}
	rbf_linear found[2], of_top;
	unsigned learned = 0;
	top = known + CLEARLY * (top - known);
	for (unsigned n = 0; n < 2; n++) {
		const double with = rbf_learn(lesson, RBF_MAP_LEARNED_SHIFT + n, n ? &found[0] : NULL, &found[n]);
		if (with > top) {
			top = with;
			of_top = found[n];
			learned = RBF_MAP_LEARNED_SHIFT + n;
		}
	}
	if (rbf_learn_failed(lesson))
		return -1;
	if (learned && m->candidates < RBF_CANDIDATES) {
		if (rbf_label_add(m, learned, &of_top))
			return -1;
		*frame = m->candidates - 1;
	}
	return 0;
}

/* Each frame in turn gives way to one of the list, if that lowers the error clearly. */
static int exchange(const rbf_left_out *b, rbf_choice *best)
{
	int failed = 0;
	for (uint32_t f = 0; f < best->frames && !failed; f++) {
		rbf_choice round = {0};
		for (unsigned map = 0; map < RBF_MAPS_LISTED && !failed; map++) {
			rbf_choice next = rbf_contest_again(best);
			next.frame[f] = map;
			if (may_join(b->fitted, best, map))
				failed = rbf_contest(b, &round, next, best);
		}
		rbf_contest_win(best, &round, failed ? 0 : GAIN);
	}
	return failed;
}

/* Frames anew, each what predicts most of what those before leave. Frames that joined by how much they lower the error began with a compromise
 * between beams, where there are several; and mirror images of a beam that is none of its own may be two of them. */
static int climb(const rbf_left_out *b, rbf_lesson *lesson, rbf_choice *best)
{
	rbf_choice rungs = {.belief = best->belief};
	int learned = 0, better = 0;
	rbf_learn_loosen(lesson);
	while (rungs.frames < RBF_MAX_FRAMES) {
		uint32_t frame;
		if (best_addition(b->fitted, lesson, &rungs, &frame))
			return -1;
		if (frame == RBF_CANDIDATES)
			break;
		learned |= frame >= RBF_MAPS_LISTED;
		rungs.frame[rungs.frames++] = frame;
		rbf_choice round = {0};
		if (rbf_contest(b, &round, rungs, NULL))
			return -1;
		better |= rbf_contest_win(best, &round, learned ? LEARNED_GAIN : GAIN);
	}
	return better ? exchange(b, best) : 0;
}

/* Adds listed frames to `best`, one at a time, as long as each lowers the error clearly. */
static int add_frames(const rbf_left_out *b, rbf_choice *best)
{
	int better = 1, failed = 0;
	while (better && !failed && best->frames < FRAMES_MAX) {
		rbf_choice round = {0};
		for (unsigned map = 0; map < RBF_MAPS_LISTED && !failed; map++) {
			rbf_choice next = rbf_contest_again(best);
			next.frame[next.frames++] = map;
			if (may_join(b->fitted, best, map))
				failed = rbf_contest(b, &round, next, best);
		}
		better = rbf_contest_win(best, &round, failed ? 0 : GAIN);
	}
	return failed;
}

/* Lobes are settled widely if that is clearly better, or else where beams coincide unless that is clearly worse, as few incidences tell. */
static int settle(const rbf_left_out *b, rbf_choice *best)
{
	rbf_choice wide = rbf_contest_again(best), once = rbf_contest_again(best), round = {0};
	wide.belief.settled = 2;
	once.belief.settled = 1;
	int failed = rbf_choice_label_widely(b->fitted, &wide, &once);
	if (failed) {
		rbf_choice_free(&wide);
		rbf_choice_free(&once);
		return failed;
	}
	failed = rbf_contest(b, &round, wide, best);
	if (failed || rbf_contest_win(best, &round, GAIN)) {
		rbf_choice_free(&once);
		return failed;
	}
	failed = rbf_contest(b, &round, once, best);
	rbf_contest_win(best, &round, failed ? 0 : SETTLED_LOSS);
	return failed;
}

/* Drops frames that no longer lower the error clearly: the first one chosen is what alone does best, which others may do better together. */
static int drop_frames(const rbf_left_out *b, rbf_choice *best)
{
	int better = 1, failed = 0;
	while (better && !failed && best->frames > 1) {
		rbf_choice round = {0};
		for (uint32_t f = 0; f < best->frames && !failed; f++) {
			rbf_choice next = rbf_contest_again(best);
			next.frames--;
			memmove(next.frame + f, next.frame + f + 1, (next.frames - f) * sizeof *next.frame);
			failed = rbf_contest(b, &round, next, NULL);
		}
		better = rbf_contest_win(best, &round, failed ? 0 : 1 / GAIN);
	}
	return failed;
}

/* The same frames, with the same labels: they do not depend on how much light is carried. */
static rbf_choice alike(const rbf_left_out *b, const rbf_choice *best)
{
	const size_t bytes = (size_t)best->frames * b->fitted->lobe_first[b->fitted->bases] * sizeof *best->label;
	rbf_choice next = rbf_contest_again(best);
	next.label = malloc(bytes + 1);
	if (next.label) /* else they are made anew */
		memcpy(next.label, best->label, bytes);
	return next;
}

/* Limits of shares, the same for all frames and then of each: a material's light at grazing exitance tells whether what is left there of
 * lobes from below the horizon counts. */
static int limit(const rbf_left_out *b, rbf_choice *best)
{
	static const float most[] = {1, 1.25f, 1.5f, 2, 3};
	int failed = 0;
	for (uint32_t of = 0; of <= best->frames && !failed; of++) { /* 0: all */
		rbf_choice round = {0};
		if (of && (best->frames < 2 || b->fitted->candidate[best->frame[of - 1]].map == RBF_MAP_FIXED))
			continue;
		for (size_t way = 0; way < sizeof most / sizeof *most && !failed; way++) {
			rbf_choice next = alike(b, best);
			for (uint32_t f = 0; f < next.frames; f++)
				if (!of || f == of - 1)
					next.limit[f] = most[way];
			failed = rbf_contest(b, &round, next, NULL);
		}
		rbf_contest_win(best, &round, failed ? 0 : LIMIT_GAIN);
	}
	return failed;
}

/* Evens levels, half or all the way, without slopes or with them, where that helps. */
static int even(const rbf_left_out *b, rbf_choice *best)
{
	rbf_choice round = {0};
	int failed = 0;
	for (int way = 0; way < 4 && !failed; way++) {
		rbf_choice next = alike(b, best);
		next.even = way % 2 ? 2 : 1;
		next.slopes = way / 2;
		failed = rbf_contest(b, &round, next, NULL);
	}
	rbf_contest_win(best, &round, failed ? 0 : EVEN_GAIN);
	return failed;
}

/* Tunes light to the DHR that is expected, each way, with levels evened or not, where that helps clearly: it makes up for what evening cannot
 * know where incidences are few. */
static int tune(const rbf_left_out *b, rbf_choice *best)
{
	enum { WAYS = 3, EVENS = 3 };
	rbf_choice next[WAYS * EVENS], *lowest = next;
	int failed = 0;
	for (uint32_t even = 0; even < EVENS; even++) {
		rbf_choice *some[WAYS];
		for (int way = 0; way < WAYS; way++) {
			some[way] = &next[way * EVENS + (int)even];
			*some[way] = rbf_contest_again(best);
			some[way]->even = even;
			some[way]->tune = 1 + way;
			some[way]->label = best->label; /* borrowed */
		}
		failed = failed || rbf_left_out_tuned(b, WAYS, some);
	}
	for (int n = 0; n < WAYS * EVENS; n++) {
		next[n].label = NULL;
		lowest = next[n].error < lowest->error ? &next[n] : lowest;
	}
	if (!failed && lowest->error < TUNE_GAIN * best->error) {
		lowest->label = best->label;
		best->label = NULL;
		rbf_contest_replace(best, lowest);
	}
	for (int n = 0; n < WAYS * EVENS; n++)
		rbf_choice_free(&next[n]);
	return failed;
}

/* What makes the best of frames that are chosen. */
static int finish(const rbf_left_out *b, rbf_choice *best)
{
	return drop_frames(b, best) || limit(b, best) || even(b, best) || tune(b, best);
}

/* Motion between rings tells nothing of other azimuths. Where it is worse than the frames across them, it is not taken: its error is
 * then INFINITY. */
static int ask_across(bsdfrbf_context *context, const rbf_left_out *b, float lambertian, const rbf_choice *still, rbf_choice *moved)
{
	rbf_left_out across;
	rbf_choice one = alike(b, still), other = alike(b, moved);
	int failed = rbf_left_out_make(context, b->fitted, lambertian, 1, &across) != BSDFRBF_OK;
	failed = failed || (across.trials && (rbf_left_out_error(&across, &one, NULL) || rbf_left_out_error(&across, &other, NULL)));
	if (!failed && across.trials && other.error > one.error)
		moved->error = INFINITY;
	rbf_left_out_free(&across);
	rbf_choice_free(&one);
	rbf_choice_free(&other);
	return failed;
}

/* From the list alone, one after the other, as long as each lowers the error clearly. */
static bsdfrbf_status choose_first(bsdfrbf_context *context, const rbf_left_out *b, double from, double to, rbf_choice *choice)
{
	const double step = (to - from) / (RBF_MAPS_LISTED + 3);
	rbf_choice best = {.belief = BELIEF};
	int failed = 0;
	if (!b->trials) {
		best.frames = 1;
		best.frame[0] = best_prediction(b->fitted);
		failed = rbf_left_out_error(b, &best, NULL);
		*choice = best;
		return failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
	}
	for (unsigned map = 0; map < RBF_MAPS_LISTED && !failed; map++) {
		if (!may_join(b->fitted, &best, map))
			continue;
		failed = rbf_contest(b, &best, (rbf_choice){.frames = 1, .frame = {map}, .belief = BELIEF}, best.frames ? &best : NULL);
		*choice = best;
		if (rbf_progress(context, "frames", from + step * map))
			return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	}
	failed = failed || add_frames(b, &best);
	*choice = best;
	if (rbf_progress(context, "frames", from + step * RBF_MAPS_LISTED))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	return failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
}

/* All the rest. */
static bsdfrbf_status choose(bsdfrbf_context *context, const rbf_left_out *b, float lambertian, float fit_error, double from, double to, rbf_choice *choice)
{
	const double step = (to - from) / (RBF_MAPS_LISTED + 3);
	rbf_choice best = *choice;
	int failed = 0;
	if (!b->trials)
		return BSDFRBF_OK;
	const int plane = b->fitted->symmetry == RBF_ISOTROPIC;
	rbf_choice first = {.frames = 1, .frame = {best.frame[0]}, .belief = {BELIEF.sharpness, 1}}, faint = {0};
	if (!failed && best.error > ENOUGH * fit_error) {
		failed = rbf_contest(b, &faint, first, NULL) || add_frames(b, &faint);
		rbf_contest_win(&best, &faint, failed ? 0 : GAIN);
		*choice = best;
	}
	if (rbf_progress(context, "frames", from + step * (RBF_MAPS_LISTED + 1)))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	const rbf_choice listed = best; /* its labels and errors are not used below */
	int learned = 0;
	if (!failed && best.error > ENOUGH * fit_error) {
		rbf_lesson *lesson = rbf_learn_begin(b->fitted);
		failed = !lesson || learn(b, lesson, &best) || (best.error > FAILED * fit_error && climb(b, lesson, &best));
		rbf_learn_end(lesson);
		learned = best.error < listed.error;
		failed = failed || (learned && add_frames(b, &best));
		*choice = best;
	}
	if (rbf_progress(context, "learned frames", from + step * (RBF_MAPS_LISTED + 2)))
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
	const rbf_belief had = best.belief;
	for (int n = 0; n < 2 && !failed && best.frames > 1; n++) { /* two other beliefs */
		rbf_choice next = rbf_contest_again(&best), round = {0};
		next.belief.sharpness = n ? had.sharpness / SHARPER : had.sharpness * SHARPER;
		failed = rbf_contest(b, &round, next, &best);
		rbf_contest_win(&best, &round, failed ? 0 : 1);
		*choice = best;
	}
	failed = failed || (best.frames > 1 && !best.belief.settled && settle(b, &best));
	*choice = best;
	failed = failed || finish(b, &best);
	*choice = best;
	if (learned && !failed) { /* it may have made up for levels that change */
		rbf_choice plain = {0};
		failed = rbf_contest(b, &plain, rbf_contest_again(&listed), NULL) || finish(b, &plain);
		learned = !rbf_contest_win(&best, &plain, failed ? 0 : 1);
		*choice = best;
	}
	/* what is left moves as the transport has it, if that helps: between the frames, between those without what was learned, or all of it */
	const float caps[2] = {.6f, 1.f};
	const rbf_choice still[3] = {best, listed, {.frames = 1, .frame = {RBF_MAP_FIXED}, .belief = best.belief}};
	rbf_choice moved = {0};
	for (int n = 0; n < 5 && !failed; n++) {
		const rbf_choice *frames = &still[n / 2];
		rbf_choice next = n < 2 ? alike(b, &best) : rbf_contest_again(frames);
		next.cap = n < 4 ? caps[n % 2] : 2;
		if (n / 2 != 1 || learned)
			failed = rbf_contest(b, &moved, next, &best);
		if (rbf_progress(context, "residual transport", from + step * (RBF_MAPS_LISTED + 2 + n * .2))) {
			rbf_choice_free(&moved);
			return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "cancelled");
		}
	}
	if (!failed && !plane && moved.error < MOVED_GAIN * best.error)
		failed = ask_across(context, b, lambertian, &best, &moved);
	rbf_contest_win(&best, &moved, failed ? 0 : MOVED_GAIN);
	*choice = best;
	return failed ? rbf_out_of_memory(context) : BSDFRBF_OK;
}

bsdfrbf_status rbf_choose_first(bsdfrbf_context *context, const rbf_left_out *left_out, double from, double to, rbf_choice *choice)
{
	memset(choice, 0, sizeof *choice);
	const bsdfrbf_status status = choose_first(context, left_out, from, to, choice);
	if (status != BSDFRBF_OK)
		rbf_choice_free(choice);
	return status;
}

bsdfrbf_status rbf_choose(bsdfrbf_context *context, const rbf_left_out *left_out, float lambertian, float fit_error, double from, double to,
	rbf_choice *choice)
{
	const bsdfrbf_status status = choose(context, left_out, lambertian, fit_error, from, to, choice);
	if (status != BSDFRBF_OK)
		rbf_choice_free(choice);
	return status;
}
