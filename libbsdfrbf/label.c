/* SPDX-License-Identifier: BSD-3-Clause */
#include "label.h"

#include <stdlib.h>
#include <string.h>

static const float SHARE_MIN = .03f, FAINT_MIN = .003f; /* frames that carry less are dropped */
static const float SAME = 1 - 1e-6f; /* cosine between a direction and another */
enum { ROUNDS = 6, TOGETHER = 128 };

float rbf_label_judge(const rbf_lobes *lobes, unsigned op, const float mapped[3], float gain)
{
	float p[3] = {mapped[0], mapped[1], mapped[2]}, q[3];
	if (!(gain > 0))
		return 0;
	if (p[2] < .02f) {
		const float r = hypotf(p[0], p[1]), s = r > 0 ? sqrtf(1 - .02f * .02f) / r : 0;
		p[0] *= s;
		p[1] *= s;
		p[2] = .02f;
	}
	rbf_mirror(op, p, q);
	return gain * rbf_lobes_luminance(lobes, q) * fminf(fmaxf(mapped[2] * 10, .05f), 1.f);
}

/* A base's vertex at a direction; operation op takes what was measured there. In the mesh, where it has one. */
static rbf_vertex vertex_at(const rbf_mesh *mesh, const uint32_t own[], uint32_t base, unsigned op, const float direction[3])
{
	rbf_vertex found = {.base = base, .op = op};
	memcpy(found.direction, direction, sizeof found.direction);
	if (op == RBF_OP_NONE && own[base] != UINT32_MAX)
		return mesh->vertex[own[base]];
	for (uint32_t w = 0; w < mesh->vertices; w++)
		if (mesh->vertex[w].base == base && rbf_dot(mesh->vertex[w].direction, direction) > SAME)
			return mesh->vertex[w];
	return found;
}

static int is_among(const rbf_vertex *list, uint32_t count, const rbf_vertex *one)
{
	for (uint32_t n = 0; n < count; n++)
		if (list[n].base == one->base && rbf_dot(list[n].direction, one->direction) > SAME)
			return 1;
	return 0;
}

static int find_neighbours(rbf_fitted *m)
{
	const rbf_mesh *mesh = &m->mesh;
	/* the unmirrored vertex of each base */
	uint32_t *own = malloc((m->bases + 1) * sizeof *own);
	m->neighbour_first = calloc((size_t)m->bases + 1, sizeof *m->neighbour_first);
	m->neighbour = malloc(((size_t)mesh->elements * 6 + (size_t)mesh->borders * 2 + 2 * (size_t)m->bases + 1) * 4 * sizeof *m->neighbour);
	if (!own || !m->neighbour_first || !m->neighbour) {
		free(own);
		return -1;
	}
	for (uint32_t b = 0; b < m->bases; b++)
		own[b] = UINT32_MAX;
	for (uint32_t v = 0; v < mesh->vertices; v++)
		if (mesh->vertex[v].op == RBF_OP_NONE)
			own[mesh->vertex[v].base] = v;
	/* Elements are kept only where they reach into the fundamental domain: a base may have neighbours only as another vertex's mirror image,
	 * and, if it was measured elsewhere, nothing but images. So any element that has an image of the base counts, mirrored back. */
	uint32_t at = 0;
	for (uint32_t b = 0; b < m->bases; b++) {
		m->neighbour_first[b] = at;
		for (uint32_t pass = 0; pass < mesh->elements + mesh->borders; pass++) {
			const uint32_t *v = pass < mesh->elements ? mesh->element[pass].v : mesh->border[pass - mesh->elements];
			const int corners = pass < mesh->elements ? 3 : 2;
			for (int i = 0; i < corners; i++) {
				if (mesh->vertex[v[i]].base != b)
					continue;
				for (int j = 0; j < corners; j++) {
					/* the neighbour as seen from the unmirrored base */
					float direction[3];
					if (i == j)
						continue;
					rbf_mirror(mesh->vertex[v[i]].op, mesh->vertex[v[j]].direction, direction);
					const rbf_vertex found = vertex_at(mesh, own, mesh->vertex[v[j]].base, mesh->vertex[v[j]].op ^ mesh->vertex[v[i]].op, direction);
					if (!is_among(m->neighbour + m->neighbour_first[b], at - m->neighbour_first[b], &found))
						m->neighbour[at++] = found;
				}
			}
		}
	}
	m->neighbour_first[m->bases] = at;
	free(own);
	return 0;
}

static void count_lobes(rbf_fitted *m)
{
	for (uint32_t b = 0; b < m->bases; b++)
		m->lobe_first[b + 1] = m->lobe_first[b] + m->lobes[b].count;
}

int rbf_label_prepare(rbf_fitted *m)
{
	if (find_neighbours(m))
		return -1;
	m->lobe_first = calloc((size_t)m->bases + 1, sizeof *m->lobe_first);
	if (!m->lobe_first)
		return -1;
	count_lobes(m);
	for (unsigned map = 0; map < RBF_MAPS_LISTED; map++)
		if (rbf_label_add(m, map, NULL))
			return -1;
	return 0;
}

int rbf_label_share(const rbf_fitted *m, uint32_t each, float *rows)
{
	if (!m->team)
		return 0;
	uint64_t *first = malloc(((size_t)m->bases + 1) * sizeof *first);
	for (uint32_t b = 0; b <= m->bases && first; b++)
		first[b] = (uint64_t)m->lobe_first[b] * each * sizeof *rows;
	const int failed = !first || rbf_team_share(m->team, m->bases, first, rows);
	free(first);
	return failed ? -1 : 0;
}

float rbf_label_prediction(const rbf_fitted *m, const rbf_candidate *to, const rbf_lobes part[], uint32_t base, const float c[3], float self)
{
	const uint32_t from = m->neighbour_first[base], end = m->neighbour_first[base + 1];
	const float k[3] = {(float)m->direction[3*base], (float)m->direction[3*base + 1], (float)m->direction[3*base + 2]};
	float sum = 0;
	for (uint32_t n = from; n < end; n++) {
		const rbf_vertex *v = &m->neighbour[n];
		rbf_warp warp;
		float mapped[3];
		rbf_warp_set(&warp, to->map, &to->linear, k, v->direction);
		const float gain = rbf_warp_forward(&warp, c, mapped);
		const float value = rbf_label_judge(&part[v->base], v->op, mapped, gain);
		sum += logf(fminf(value, self) + 1e-3f * self);
	}
	return end > from ? sum / (float)(end - from) : logf(self);
}

static int predict(const rbf_fitted *m, rbf_candidate *to)
{
	#pragma omp parallel for schedule(dynamic)
	for (int64_t b = 0; b < (int64_t)m->bases; b++)
		for (uint32_t i = 0; i < m->lobes[b].count && rbf_team_mine(m->team, (uint64_t)b); i++) {
			float c[3];
			rbf_lobe_centre(&m->lobes[b], i, c);
			const float self = rbf_lobes_luminance(&m->lobes[b], c) + 1e-9f;
			to->prediction[m->lobe_first[b] + i] = rbf_label_prediction(m, to, m->lobes, (uint32_t)b, c, self);
		}
	return rbf_label_share(m, 1, to->prediction);
}

int rbf_label_add(rbf_fitted *m, unsigned map, const rbf_linear *linear)
{
	rbf_candidate *added = &m->candidate[m->candidates];
	*added = (rbf_candidate){.map = map, .linear = linear ? *linear : (rbf_linear){{{0}}}};
	added->prediction = calloc((size_t)m->lobe_first[m->bases] + 1, sizeof(float));
	if (!added->prediction)
		return -1;
	m->candidates++;
	return predict(m, added);
}

int rbf_label_change(rbf_fitted *m, uint32_t candidate, const rbf_linear *linear)
{
	m->candidate[candidate].linear = *linear;
	return predict(m, &m->candidate[candidate]);
}

int rbf_label_renew(rbf_fitted *m, uint32_t keep)
{
	const uint32_t candidates = m->candidates;
	int failed = 0;
	count_lobes(m);
	m->candidates = 0;
	for (uint32_t i = 0; i < candidates; i++) {
		const rbf_candidate former = m->candidate[i];
		free(former.prediction);
		m->candidate[i].prediction = NULL;
		failed = failed || (i < keep && rbf_label_add(m, former.map, &former.linear));
	}
	return failed;
}

void rbf_label_release(rbf_fitted *m)
{
	free(m->neighbour_first);
	free(m->neighbour);
	free(m->lobe_first);
	for (uint32_t i = 0; i < m->candidates; i++)
		free(m->candidate[i].prediction);
}

/* What the predictions of lobe i say for each frame that counts, against the best of these: into its column of `evidence`. */
static void weigh(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], float sharpness, const int counts[], uint32_t i, float *evidence)
{
	const size_t lobes = m->lobe_first[m->bases];
	float top = -INFINITY;
	for (uint32_t f = 0; f < frames; f++)
		if (counts[f])
			top = fmaxf(top, m->candidate[frame[f]].prediction[i]);
	for (uint32_t f = 0; f < frames; f++) {
		const float below = m->candidate[frame[f]].prediction[i] - top;
		evidence[f * lobes + i] = !counts[f] ? 0 : below < 0 ? expf(sharpness * below) : 1;
	}
}

/* r_f ~ prediction_f^sharpness prior_f, normalised over the frames. */
static void responsibilities(uint32_t lobes, uint32_t frames, const float *evidence, const float prior[], uint32_t i, float r[])
{
	float sum = 0;
	for (uint32_t f = 0; f < frames; f++)
		sum += r[f] = evidence[(size_t)f * lobes + i] * prior[f];
	for (uint32_t f = 0; f < frames; f++)
		r[f] /= sum;
}

void rbf_label_parts_free(const rbf_fitted *m, rbf_lobes *parts)
{
	for (uint32_t b = 0; parts && b < m->bases; b++)
		free(parts[b].amplitude);
	free(parts);
}

rbf_lobes *rbf_label_parts(const rbf_fitted *m, const float label[], int luminance)
{
	const uint32_t y = rbf_luminance(m->channels), channels = luminance ? 1 : m->channels;
	rbf_lobes *part = calloc(m->bases + 1, sizeof *part);
	for (uint32_t b = 0; part && b < m->bases; b++) {
		const rbf_lobes *l = &m->lobes[b];
		part[b] = (rbf_lobes){.count = l->count, .channels = channels, .blocks = l->blocks, .block = l->block, .extent = l->extent};
		part[b].amplitude = calloc((size_t)l->blocks * channels + 1, sizeof *part[b].amplitude);
		if (!part[b].amplitude) {
			rbf_label_parts_free(m, part);
			return NULL;
		}
		for (uint32_t c = 0; c < channels; c++)
			for (uint32_t i = 0; i < l->count; i++)
				part[b].amplitude[c * l->blocks + i / RBF_LANES].a[i % RBF_LANES]
					= label[m->lobe_first[b] + i] * rbf_lobe_amplitude(l, luminance ? y : c, i);
	}
	return part;
}

void rbf_label_set(uint32_t lobes, uint32_t frames, float r[], uint32_t lobe, float *label)
{
	float sum = 0;
	for (uint32_t f = 0; f < frames; f++) {
		if (r[f] < 1e-3f)
			r[f] = 0;
		sum += r[f];
	}
	for (uint32_t f = 0; f < frames; f++)
		label[(size_t)f * lobes + lobe] = r[f] / sum;
}

/* The part of each frame in a base's light; < 0: it has none. */
static void shares_of(const rbf_fitted *m, uint32_t frames, const float *evidence, const float prior[], uint32_t base, double part[RBF_MAX_FRAMES])
{
	const rbf_lobes *l = &m->lobes[base];
	float r[RBF_MAX_FRAMES];
	double total = 0;
	for (uint32_t f = 0; f < frames; f++)
		part[f] = 0;
	for (uint32_t i = 0; i < l->count; i++) {
		responsibilities(m->lobe_first[m->bases], frames, evidence, prior, m->lobe_first[base] + i, r);
		total += l->mass[i];
		for (uint32_t f = 0; f < frames; f++)
			part[f] += r[f] * l->mass[i];
	}
	for (uint32_t f = 0; f < frames; f++)
		part[f] = total > 0 ? part[f] / total : -1;
}

void rbf_label(const rbf_fitted *m, uint32_t frames, const uint32_t frame[], rbf_belief belief, float *label, float share[])
{
	const float least = belief.faint ? FAINT_MIN : SHARE_MIN;
	const uint32_t lobes = m->lobe_first[m->bases];
	float prior[RBF_MAX_FRAMES];
	int counts[RBF_MAX_FRAMES], known = 0;
	if (frames == 1) {
		for (uint32_t i = 0; i < lobes; i++)
			label[i] = 1;
		share[0] = 1;
		return;
	}
	for (uint32_t f = 0; f < frames; f++) {
		prior[f] = 1 / (float)frames;
		counts[f] = 1;
	}
	for (int round = 0; round <= ROUNDS; round++) {
		double sum[RBF_MAX_FRAMES] = {0}, part[TOGETHER][RBF_MAX_FRAMES];
		uint32_t used = 0;
		if (!known) { /* labels are room until they are known */
			#pragma omp parallel for schedule(static)
			for (uint32_t i = 0; i < lobes; i++)
				weigh(m, frames, frame, belief.sharpness, counts, i, label);
			known = 1;
		}
		for (uint32_t first = 0; first < m->bases; first += TOGETHER) {
			const uint32_t count = m->bases - first < TOGETHER ? m->bases - first : TOGETHER;
			#pragma omp parallel for schedule(static)
			for (uint32_t n = 0; n < count; n++)
				shares_of(m, frames, label, prior, first + n, part[n]);
			for (uint32_t n = 0; n < count; n++) { /* in their order, for any number of threads */
				used += part[n][0] >= 0;
				for (uint32_t f = 0; f < frames; f++)
					sum[f] += fmax(part[n][f], 0);
			}
		}
		int kept = 0;
		for (uint32_t f = 0; f < frames; f++) {
			share[f] = used ? (float)(sum[f] / used) : 1 / (float)frames;
			kept += share[f] >= least;
		}
		if (round == ROUNDS)
			break;
		for (uint32_t f = 0; f < frames; f++) {
			prior[f] = share[f] < least * (float)(round + 1) / ROUNDS && kept ? 0 : belief.faint ? sqrtf(share[f]) : share[f];
			known &= counts[f] == (prior[f] > 0);
			counts[f] = prior[f] > 0;
		}
	}
	#pragma omp parallel for schedule(static)
	for (uint32_t i = 0; i < lobes; i++) {
		float r[RBF_MAX_FRAMES];
		responsibilities(lobes, frames, label, prior, i, r);
		rbf_label_set(lobes, frames, r, i, label);
	}
}
