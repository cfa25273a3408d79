/* SPDX-License-Identifier: BSD-3-Clause */
#include "advect.h"
#include "transport.h"

#include <stdlib.h>
#include <string.h>

static const float REACH_MIN = .10472f; /* 6 degrees */
static const float SMOOTHING = 1.5f;    /* in units of the two lobes' mean width */
static const float REGULAR = .02f;      /* share of unmoved mass that holds a lobe back */

typedef struct side {
	uint32_t count;
	float (*centre)[3], *sigma;
	double *mass;
} side;

static int gather(const rbf_lobes *l, unsigned op, side *s)
{
	s->count = l->count;
	s->centre = malloc((l->count + 1) * sizeof *s->centre);
	s->sigma = malloc((l->count + 1) * sizeof *s->sigma);
	s->mass = l->mass;
	if (!s->centre || !s->sigma)
		return -1;
	for (uint32_t i = 0; i < l->count; i++) {
		float c[3];
		rbf_lobe_centre(l, i, c);
		rbf_mirror(op, c, s->centre[i]);
		s->sigma[i] = 1 / sqrtf(rbf_lobe_kappa(l, i));
	}
	return 0;
}

static float chord2(const float a[3], const float b[3])
{
	const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return x*x + y*y + z*z;
}

int rbf_advect(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], const float *label, uint32_t from,
	const rbf_vertex *to, float cap, float (*motion)[3], float *mean)
{
	const uint32_t all = m->lobe_first[m->bases];
	const float origin[3] = {(float)m->direction[3*from], (float)m->direction[3*from + 1], (float)m->direction[3*from + 2]};
	side a = {0}, b = {0};
	*mean = 0;
	memset(motion, 0, m->lobes[from].count * sizeof *motion);
	int failed = gather(&m->lobes[from], RBF_OP_NONE, &a) || gather(&m->lobes[to->base], to->op, &b);
	const size_t n = a.count, k = b.count;
	float (*mapped)[3] = malloc((frames * k + 1) * sizeof *mapped), (*drift)[3] = calloc(n + 1, sizeof *drift);
	uint8_t *valid = calloc(frames * k + 1, 1), *main_frame = malloc(n + 1);
	double *moved = calloc(n + 1, sizeof *moved);
	rbf_arc *arc = malloc((n * k + 1) * sizeof *arc);
	rbf_move *move = malloc((n * k + n + k + 1) * sizeof *move);
	failed |= !mapped || !drift || !valid || !main_frame || !moved || !arc || !move;
	if (failed || !n || !k)
		goto end;

	for (uint32_t f = 0; f < frames; f++) {
		rbf_warp warp;
		rbf_warp_set(&warp, m->candidate[frame[f]].map, &m->candidate[frame[f]].linear, to->direction, origin);
		for (size_t j = 0; j < k; j++)
			valid[f * k + j] = rbf_warp_forward(&warp, b.centre[j], mapped[f * k + j]) > 0;
	}
	const float edge = rbf_angle(origin, to->direction);
	const float reach = fmaxf(cap * edge, REACH_MIN), limit = reach * reach;
	size_t arcs = 0, moves = 0;
	for (size_t i = 0; i < n; i++) {
		uint8_t f = 0;
		for (uint32_t g = 1; g < frames; g++)
			if (label[(size_t)g * all + m->lobe_first[from] + i] > label[(size_t)f * all + m->lobe_first[from] + i])
				f = (uint8_t)g;
		main_frame[i] = f;
		const float (*to_here)[3] = (const float (*)[3])mapped + f * k;
		for (size_t j = 0; j < k; j++) {
			const float chord = chord2(a.centre[i], to_here[j]), spread = a.sigma[i] - b.sigma[j];
			if (!(chord + spread * spread < limit) || !valid[f * k + j]) /* a chord is shorter than its arc */
				continue;
			const float angle = 2 * asinf(fminf(.5f * sqrtf(chord), 1.f)), cost = angle * angle + spread * spread;
			if (angle < reach && cost < limit)
				arc[arcs++] = (rbf_arc){(uint32_t)i, (uint32_t)j, cost};
		}
	}
	double cost, total = 0;
	for (size_t i = 0; i < n; i++)
		total += a.mass[i];
	const int status = rbf_transport_solve(n, a.mass, k, b.mass, arcs, arc, limit, move, &moves, &cost, NULL, NULL, NULL);
	if (status == -1) {
		failed = 1;
		goto end;
	}
	if (status)
		goto end; /* a side without energy: nothing to move */
	for (size_t p = 0; p < moves; p++) {
		const uint32_t i = move[p].source;
		const float *target = mapped[main_frame[i] * k + move[p].target];
		moved[i] += move[p].mass;
		for (int x = 0; x < 3; x++)
			drift[i][x] += (float)move[p].mass * (target[x] - a.centre[i][x]);
	}
	/* smooth over lobes of the same frame: single lobes are not features, groups are */
	for (size_t i = 0; i < n; i++) {
		double sum[3] = {0}, weight = 0, base = 0;
		for (size_t j = 0; j < n; j++) {
			if (main_frame[j] != main_frame[i])
				continue;
			const float width = SMOOTHING * SMOOTHING * a.sigma[i] * a.sigma[j];
			const float q = chord2(a.centre[i], a.centre[j]) / width;
			if (q > 18)
				continue;
			const double kernel = exp(-.5 * (double)q) * (double)(fminf(a.sigma[i], a.sigma[j]) / fmaxf(a.sigma[i], a.sigma[j]));
			weight += kernel * moved[j];
			base += kernel * a.mass[j] / total;
			for (int x = 0; x < 3; x++)
				sum[x] += kernel * (double)drift[j][x];
		}
		double length = 0;
		for (int x = 0; x < 3; x++) {
			motion[i][x] = (float)(sum[x] / (weight + (double)REGULAR * base + 1e-12));
			length += (double)motion[i][x] * (double)motion[i][x];
		}
		*mean += (float)(sqrt(length) * a.mass[i] / total);
	}
end:
	free(a.centre);
	free(a.sigma);
	free(b.centre);
	free(b.sigma);
	free(mapped);
	free(drift);
	free(valid);
	free(main_frame);
	free(moved);
	free(arc);
	free(move);
	return failed ? -1 : 0;
}
