/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * A learned map's beam is linear in the incident direction (map.h). Its coefficients are those under which neighbouring
 * incidences predict each other best, judged at probes: lobe centres of every incidence, drawn by energy. A pair of probe and
 * neighbour scores the ratio of the smaller value to the larger, or what the frames that are there already score, if that is
 * more: a new frame is learned from what they leave. Narrow beams meet only where the coefficients are nearly right, so that
 * the search begins with lobes widened by a blur, and goes on with ever less of it.
 */
#include "learn.h"
#include "simplex.h"

#include <stdlib.h>
#include <string.h>

enum { PROBES = 480, PROBES_BASE = 24, LEVELS = 3, STARTS = 3, STEPS = 15 };
static const float BLUR[LEVELS] = {.25f, .08f, 0}; /* radians */
static const double FIRST_STEP[LEVELS] = {.3, .12, .04}, TOLERANCE[LEVELS] = {1e-3, 3e-4, 1e-4};
static const double WORTH_THREADS = 1e5; /* lobes to add up, a tenth of a millisecond: less is done before threads have met */
static const double WORTH_TEAM = 2e5; /* the same for processes, which meet more slowly */
static const uint32_t EVERY[LEVELS] = {4, 2, 1}; /* probes in use */

typedef struct probe {
	uint32_t base, lobe;
	double weight;
} probe;

struct rbf_lesson {
	const rbf_fitted *fitted;
	rbf_lobes *lobes[LEVELS];  /* [bases], widened; the last level's are borrowed */
	uint32_t probes;
	probe *probe;
	uint32_t *first;           /* [probes + 1]: where a probe's pairs start */
	float *self[LEVELS];       /* [probes] own value */
	float *known[LEVELS];      /* [pairs] score of the frames that are there */
	float *score;              /* [pairs] room */
	uint64_t *part[LEVELS];    /* for a team: where the pairs of a probe in use start, bytes */
	int failed;                /* the team's */
	int free;                  /* 1: coefficients need not be those that a mirror image leaves alone */
	double work;               /* lobes that a judgement of all pairs adds up */
};

static int widen(const rbf_lobes *from, float blur, rbf_lobes *to)
{
	if (rbf_lobes_new(to, from->count, from->channels))
		return -1;
	for (uint32_t i = 0; i < from->count; i++) {
		float c[3];
		const float kappa = rbf_lobe_kappa(from, i);
		const float wide = kappa > 0 ? 1 / (1 / kappa + blur * blur) : 0;
		rbf_lobe_centre(from, i, c);
		rbf_lobe_set(to, i, c, wide);
		for (uint32_t n = 0; n < from->channels; n++)
			to->amplitude[n * to->blocks + i / RBF_LANES].a[i % RBF_LANES] = kappa > 0 ? rbf_lobe_amplitude(from, n, i) * wide / kappa : 0;
	}
	return rbf_lobes_finish(to);
}

/* Places of the coefficients that are free; what a mirror symmetry turns into its opposite is 0. */
static uint32_t places(const rbf_lesson *s, unsigned map, uint32_t place[])
{
	static const struct { rbf_symmetry symmetry; uint8_t free[RBF_SIMPLEX_MAX]; } row[] = {
		{RBF_ISOTROPIC, {1}},
		{RBF_QUADRILATERAL, {1, 0, 0, 0, 0, 1}},
		{RBF_BILATERAL_Y, {1, 0, 1, 1, 0, 1}},
		{RBF_BILATERAL_X, {1, 0, 0, 0, 0, 1, 1, 1}},
		{RBF_UP, {1, 1, 0, 0, 1, 1}},
		{RBF_ANISOTROPIC, {1, 1, 1, 1, 1, 1, 1, 1}},
	};
	const rbf_symmetry kept = s->free ? RBF_ANISOTROPIC : s->fitted->symmetry;
	uint32_t count = 0;
	for (size_t r = 0; r < sizeof row / sizeof *row; r++)
		for (uint32_t n = 0; n < RBF_SIMPLEX_MAX && row[r].symmetry == kept; n++)
			if (row[r].free[n] && (n % 4 != 3 || map == RBF_MAP_LEARNED_TURN)) /* a shift has no use for the constant */
				place[count++] = n;
	return count;
}

uint32_t rbf_learn_get(const rbf_lesson *s, unsigned map, const rbf_linear *linear, double x[])
{
	uint32_t place[RBF_SIMPLEX_MAX];
	const uint32_t count = places(s, map, place);
	for (uint32_t n = 0; n < count; n++)
		x[n] = (double)linear->row[place[n] / 4][place[n] % 4];
	return count;
}

void rbf_learn_set(const rbf_lesson *s, unsigned map, const double x[], rbf_linear *linear)
{
	uint32_t place[RBF_SIMPLEX_MAX];
	const uint32_t count = places(s, map, place);
	for (uint32_t n = 0; n < count; n++)
		linear->row[place[n] / 4][place[n] % 4] = (float)x[n];
}

/* Probes in use. */
static uint32_t used(const rbf_lesson *s, int level)
{
	return (s->probes + EVERY[level] - 1) / EVERY[level];
}

rbf_lesson *rbf_learn_begin(const rbf_fitted *m)
{
	rbf_lesson *s = calloc(1, sizeof *s);
	if (!s)
		return NULL;
	s->fitted = m;
	s->lobes[LEVELS - 1] = m->lobes;
	int failed = 0;
	for (int level = 0; level < LEVELS - 1 && !failed; level++) {
		s->lobes[level] = calloc((size_t)m->bases + 1, sizeof **s->lobes);
		failed = !s->lobes[level];
		for (uint32_t b = 0; b < m->bases && !failed; b++)
			failed = widen(&m->lobes[b], BLUR[level], &s->lobes[level][b]) != 0;
	}
	const uint32_t step = (m->bases + PROBES / 8 - 1) / (PROBES / 8), bases = (m->bases + step - 1) / step;
	const uint32_t each = PROBES / bases < PROBES_BASE ? PROBES / bases : PROBES_BASE;
	s->probe = calloc((size_t)bases * each + 1, sizeof *s->probe);
	s->first = calloc((size_t)bases * each + 1, sizeof *s->first);
	failed |= !s->probe || !s->first;
	for (uint32_t b = step / 2; b < m->bases && !failed; b += step) {
		const rbf_lobes *l = &m->lobes[b];
		double total = 0, running = 0;
		uint32_t i = 0;
		for (uint32_t j = 0; j < l->count; j++)
			total += l->mass[j];
		for (uint32_t n = 0; n < each && total > 0; n++) {
			const double at = (n + .5) / each * total;
			while (i + 1 < l->count && running + l->mass[i] <= at)
				running += l->mass[i++];
			s->probe[s->probes++] = (probe){.base = b, .lobe = i, .weight = 1. / ((double)bases * each)};
		}
	}
	uint32_t pairs = 0;
	for (uint32_t p = 0; p < s->probes && !failed; p++) {
		const uint32_t b = s->probe[p].base, count = m->neighbour_first[b + 1] - m->neighbour_first[b];
		s->first[p] = pairs;
		pairs += count;
		for (uint32_t n = 0; n < count; n++)
			s->work += m->lobes[m->neighbour[m->neighbour_first[b] + n].base].count;
		s->probe[p].weight /= count ? count : 1;
	}
	if (!failed)
		s->first[s->probes] = pairs;
	s->score = calloc((size_t)pairs + 1, sizeof *s->score);
	failed |= !s->score;
	for (int level = 0; level < LEVELS && !failed; level++) {
		s->self[level] = malloc((s->probes + 1) * sizeof(float));
		s->known[level] = malloc((pairs + 1) * sizeof(float));
		s->part[level] = malloc((s->probes + 2) * sizeof(uint64_t));
		failed = !s->self[level] || !s->known[level] || !s->part[level];
		for (uint32_t i = 0; i <= used(s, level) && !failed; i++)
			s->part[level][i] = s->first[i * EVERY[level] < s->probes ? i * EVERY[level] : s->probes] * sizeof(float);
		for (uint32_t p = 0; p < s->probes && !failed; p++) {
			float c[3], v[3];
			rbf_lobe_centre(&m->lobes[s->probe[p].base], s->probe[p].lobe, c);
			rbf_lobes_sum(&s->lobes[level][s->probe[p].base], c, v);
			s->self[level][p] = v[rbf_luminance(m->channels)];
		}
	}
	if (failed) {
		rbf_learn_end(s);
		return NULL;
	}
	return s;
}

void rbf_learn_end(rbf_lesson *s)
{
	if (!s)
		return;
	for (int level = 0; level < LEVELS; level++) {
		for (uint32_t b = 0; b < s->fitted->bases && level < LEVELS - 1 && s->lobes[level]; b++)
			rbf_lobes_free(&s->lobes[level][b]);
		if (level < LEVELS - 1)
			free(s->lobes[level]);
		free(s->self[level]);
		free(s->known[level]);
		free(s->part[level]);
	}
	free(s->probe);
	free(s->first);
	free(s->score);
	free(s);
}

/* Scores of all pairs under a map. */
static void judge(rbf_lesson *s, int level, unsigned map, const rbf_linear *linear, float *score)
{
	const rbf_fitted *m = s->fitted;
	const rbf_team *team = s->work > WORTH_TEAM * EVERY[level] ? m->team : NULL;
	if (s->failed)
		return;
	#pragma omp parallel for schedule(dynamic, 16) if (rbf_team_part(team, s->work) > WORTH_THREADS * EVERY[level])
	for (int64_t i = 0; i < (int64_t)used(s, level); i++) {
		if (!rbf_team_mine(team, (uint64_t)i))
			continue;
		const uint32_t p = (uint32_t)i * EVERY[level], b = s->probe[p].base;
		const float k[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]};
		const float self = s->self[level][p] + 1e-12f;
		float c[3];
		rbf_lobe_centre(&m->lobes[b], s->probe[p].lobe, c);
		for (uint32_t n = s->first[p]; n < s->first[p + 1]; n++) {
			const rbf_vertex *v = &m->neighbour[m->neighbour_first[b] + n - s->first[p]];
			rbf_warp warp;
			float mapped[3];
			rbf_warp_set(&warp, map, linear, k, v->direction);
			const float gain = rbf_warp_forward(&warp, c, mapped);
			const float value = rbf_label_judge(&s->lobes[level][v->base], v->op, mapped, gain);
			score[n] = value < self ? value / self : self / value;
		}
	}
	s->failed |= rbf_team_share(team, used(s, level), s->part[level], score) != 0;
}

/* Share that is predicted, by the known frames (score: NULL) or by the better of them and score. */
static double sum_up(const rbf_lesson *s, int level, const float *score)
{
	double sum = 0;
	for (uint32_t p = 0; p < s->probes; p += EVERY[level])
		for (uint32_t n = s->first[p]; n < s->first[p + 1]; n++)
			sum += EVERY[level] * s->probe[p].weight * (double)(score ? fmaxf(s->known[level][n], score[n]) : s->known[level][n]);
	return sum;
}

static double quality(rbf_lesson *s, int level, unsigned map, const rbf_linear *linear)
{
	for (int n = 0; n < 8; n++)
		if (!(fabsf(linear->row[n / 4][n % 4]) < 4))
			return -1; /* no beam moves like that */
	judge(s, level, map, linear, s->score);
	return sum_up(s, level, s->score);
}

/* A place in the simplex search. */
typedef struct ascent {
	rbf_lesson *lesson;
	int level;
	unsigned map;
	rbf_linear linear;
} ascent;

static double descent(void *data, const double x[])
{
	ascent *a = data;
	rbf_learn_set(a->lesson, a->map, x, &a->linear);
	return -quality(a->lesson, a->level, a->map, &a->linear);
}

/* linear: start and result. */
static double climb(rbf_lesson *s, int level, unsigned map, rbf_linear *linear)
{
	ascent a = {s, level, map, *linear};
	double x[RBF_SIMPLEX_MAX];
	const uint32_t d = rbf_learn_get(s, map, linear, x);
	const double value = rbf_simplex(descent, &a, d, x, FIRST_STEP[level], STEPS * d, TOLERANCE[level]);
	rbf_learn_set(s, map, x, linear);
	return -value;
}

/* Coefficients all over the plane: what is multiplied by a along an axis and by b across it. Returns how many good ones it kept. */
static int search(rbf_lesson *s, unsigned map, rbf_linear kept[STARTS])
{
	const int axes = s->free || s->fitted->symmetry == RBF_UP || s->fitted->symmetry == RBF_ANISOTROPIC ? 4 : 1;
	const int across = s->fitted->symmetry == RBF_ISOTROPIC ? 1 : 5;
	double value[STARTS];
	int count = 0;
	for (int n = 0; n < axes * 5 * across; n++) {
		const double a = n % 5 * .5 - 1, b = across > 1 ? n / 5 % 5 * .5 - 1 : a, turn = RBF_PI / 8 * (n / 25);
		const double c = cos(turn), q = sin(turn);
		if (n >= 25 && a == b)
			continue;
		const rbf_linear at = {{{(float)(a*c*c + b*q*q), (float)((a - b)*c*q)}, {(float)((a - b)*c*q), (float)(a*q*q + b*c*c)}}};
		double v = quality(s, 0, map, &at);
		/* by value; of near ones, only the best */
		rbf_linear moving = at;
		for (int k = 0; k < count && v > 0; k++) {
			double apart = 0;
			for (int m = 0; m < 8; m++)
				apart += pow((double)(moving.row[m / 4][m % 4] - kept[k].row[m / 4][m % 4]), 2);
			const int near = apart < .6;
			if (v > value[k]) {
				const rbf_linear t = kept[k];
				const double u = value[k];
				kept[k] = moving;
				value[k] = v;
				moving = t;
				v = near ? -1 : u;
			} else if (near)
				v = -1;
		}
		if (v > 0 && count < STARTS) {
			kept[count] = moving;
			value[count++] = v;
		}
	}
	return count;
}

/* The constant of a beam: where the energy is that follows it. */
static void centre_beam(rbf_lesson *s, int level, unsigned map, rbf_linear *linear)
{
	const rbf_fitted *m = s->fitted;
	double sum[2] = {0, 0}, weight = 0;
	linear->row[0][3] = linear->row[1][3] = 0;
	judge(s, level, RBF_MAP_LEARNED_SHIFT, linear, s->score);
	for (uint32_t p = 0; p < s->probes; p += EVERY[level]) {
		const uint32_t b = s->probe[p].base;
		const float k[3] = {(float)m->direction[3*b], (float)m->direction[3*b + 1], (float)m->direction[3*b + 2]};
		float c[3], e[2];
		rbf_lobe_centre(&m->lobes[b], s->probe[p].lobe, c);
		rbf_map_beam(map, linear, k, e);
		for (uint32_t n = s->first[p]; n < s->first[p + 1]; n++) {
			const double w = s->probe[p].weight * (double)fmaxf(s->score[n] - s->known[level][n], 0);
			weight += w;
			for (int a = 0; a < 2; a++)
				sum[a] += w * (double)(c[a] - e[a]);
		}
	}
	uint32_t place[RBF_SIMPLEX_MAX];
	const uint32_t count = places(s, map, place);
	for (uint32_t n = 0; n < count && weight > 0; n++)
		if (place[n] % 4 == 3)
			linear->row[place[n] / 4][3] = (float)(sum[place[n] / 4] / weight);
}

double rbf_learn_after(rbf_lesson *s, uint32_t frames, const uint32_t frame[])
{
	const uint32_t pairs = s->first[s->probes];
	for (int level = 0; level < LEVELS; level++) {
		memset(s->known[level], 0, (size_t)pairs * sizeof(float));
		for (uint32_t f = 0; f < frames; f++) {
			const rbf_candidate *c = &s->fitted->candidate[frame[f]];
			judge(s, level, c->map, &c->linear, s->score);
			for (uint32_t n = 0; n < pairs; n++)
				s->known[level][n] = fmaxf(s->known[level][n], s->score[n]);
		}
	}
	return sum_up(s, LEVELS - 1, NULL);
}

double rbf_learn_with(rbf_lesson *s, uint32_t frame)
{
	const rbf_candidate *c = &s->fitted->candidate[frame];
	return quality(s, LEVELS - 1, c->map, &c->linear);
}

double rbf_learn(rbf_lesson *s, unsigned map, const rbf_linear *start, rbf_linear *found)
{
	rbf_linear tried[STARTS];
	int count = 1;
	memset(found, 0, sizeof *found);
	if (!start)
		count = search(s, map, tried);
	else {
		tried[0] = *start;
		if (map == RBF_MAP_LEARNED_TURN) {
			tried[count] = *start;
			centre_beam(s, 1, map, &tried[count++]);
		}
	}
	double top = -1;
	for (int n = 0; n < count; n++) {
		if (!start)
			climb(s, 0, map, &tried[n]);
		const double value = climb(s, 1, map, &tried[n]);
		if (value > top) {
			top = value;
			*found = tried[n];
		}
	}
	return climb(s, LEVELS - 1, map, found);
}

void rbf_learn_loosen(rbf_lesson *s)
{
	s->free = s->fitted->symmetry != RBF_ISOTROPIC;
}

int rbf_learn_failed(const rbf_lesson *s)
{
	return s->failed;
}
