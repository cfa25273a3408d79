/* SPDX-License-Identifier: BSD-3-Clause */
#include "moves.h"
#include "cluster.h"

#include <stdlib.h>

enum { BACK = 128, GRID = 1 << 15 }; /* lobes that are looked at for a near one; steps of coordinates then */

/* Each edge's shifts run beside the blocks of the base it moves. Returns 0 where they do not, or where two runs meet. */
static int place(const rbf_component *c, uint32_t *block)
{
	for (uint32_t i = 0; i < c->shifts; i++)
		block[i] = RBF_MOVES_NONE;
	for (size_t slot = 0; slot < 6 * (size_t)c->mesh.elements; slot++) {
		const uint32_t at = c->shift_of[slot], vertex = c->mesh.element[slot / 6].v[slot % 6 / 2];
		if (at == RBF_NO_SHIFT)
			continue;
		if (vertex >= c->mesh.vertices || c->mesh.vertex[vertex].base >= c->mesh.bases)
			return 0;
		const rbf_set *set = c->set + (size_t)c->mesh.vertex[vertex].base * c->frames, *last = set + c->frames - 1;
		const uint32_t count = last->first + last->blocks - set->first;
		if (at > c->shifts || count > c->shifts - at)
			return 0;
		if (count && block[at] == set->first) /* another slot of the edge */
			continue;
		for (uint32_t n = 0; n < count; n++) {
			if (block[at + n] != RBF_MOVES_NONE)
				return 0;
			block[at + n] = set->first + n;
		}
	}
	return 1;
}

static int64_t apart(const int32_t a[3], const int32_t b[3])
{
	int64_t sum = 0;
	for (int n = 0; n < 3; n++)
		sum += ((int64_t)a[n] - b[n]) * ((int64_t)a[n] - b[n]);
	return sum;
}

/* The nearest of those told before, in whole numbers: machines that round otherwise find the same. */
static void find_before(const rbf_component *c, const rbf_set *set, rbf_moves *m, int32_t (*centre)[3])
{
	const uint32_t first = set->first * RBF_LANES, count = set->blocks * RBF_LANES;
	for (uint32_t i = 0; i < count; i++) {
		const rbf_block *b = &c->block[(first + i) / RBF_LANES];
		const float at[3] = {b->x[i % RBF_LANES], b->y[i % RBF_LANES], b->z[i % RBF_LANES]};
		int64_t least = INT64_MAX;
		for (int n = 0; n < 3; n++)
			centre[i][n] = (int32_t)lrintf(rbf_min(rbf_max(at[n], -2), 2) * GRID);
		m->before[first + i] = first + i;
		for (uint32_t k = i, seen = 0; k > 0 && seen < BACK; k--) {
			if (!m->steps[first + k - 1] || m->image[(first + k - 1) / RBF_LANES] != (first + k - 1) / RBF_LANES)
				continue;
			const int64_t away = apart(centre[i], centre[k - 1]);
			seen++;
			if (away < least) {
				least = away;
				m->before[first + i] = first + k - 1;
			}
		}
	}
}

const char *rbf_moves_find(const rbf_component *c, rbf_moves *m)
{
	const size_t lanes = (size_t)c->blocks * RBF_LANES;
	int32_t (*centre)[3] = malloc((lanes + 1) * sizeof *centre);
	*m = (rbf_moves){malloc((c->shifts + 1ull) * sizeof *m->block), malloc((c->blocks + 1ull) * sizeof *m->image),
		malloc((lanes + 1) * sizeof *m->before), malloc(lanes + 1)};
	const int room = centre && m->block && m->image && m->before && m->steps, good = room && place(c, m->block);
	for (uint32_t s = 0; s < c->sets && good; s++) {
		const rbf_set *set = &c->set[s];
		const uint32_t twins = rbf_pack_twins(c, set);
		for (uint32_t n = 0; n < set->blocks; n++) {
			const rbf_block *b = &c->block[set->first + n];
			m->image[set->first + n] = set->first + (n >= twins && n < 2 * twins ? 2 * twins - 1 - n : n);
			for (uint32_t lane = 0; lane < RBF_LANES; lane++) {
				const uint32_t kappa = rbf_pack_kappa(b->k[lane]);
				m->steps[(set->first + n) * RBF_LANES + lane] = (uint8_t)(kappa ? rbf_pack_steps(kappa) - RBF_MOVES_COARSER : 0);
			}
		}
		find_before(c, set, m, centre);
	}
	free(centre);
	return good ? NULL : room ? "shift" : rbf_unpack_memory;
}

void rbf_moves_release(rbf_moves *m)
{
	free(m->block);
	free(m->image);
	free(m->before);
	free(m->steps);
}

/* Two directions across a lobe's centre. */
static void basis(const rbf_component *c, uint32_t block, uint32_t lane, float centre[3], float t[3], float s[3])
{
	const rbf_block *b = &c->block[block];
	centre[0] = b->x[lane];
	centre[1] = b->y[lane];
	centre[2] = b->z[lane];
	rbf_basis(centre, t, s);
}

void rbf_moves_encode(const rbf_component *c, const rbf_moves *m, const rbf_shift *shift, uint32_t block, uint32_t lane, int32_t at[2])
{
	static const float LEAST = .25f; /* of the centre's part: from there on a shift is shorter than it should be */
	const float move[3] = {shift->x[lane], shift->y[lane], shift->z[lane]};
	float centre[3], across[2][3];
	const uint32_t steps = m->steps[block * RBF_LANES + lane];
	at[0] = at[1] = 0;
	if (!steps)
		return;
	basis(c, block, lane, centre, across[0], across[1]);
	const float scale = (float)(1u << steps) / rbf_max(1 + rbf_dot(move, centre), LEAST), most = (float)(1u << steps);
	for (int n = 0; n < 2; n++)
		at[n] = (int32_t)lrintf(rbf_min(rbf_max(rbf_dot(move, across[n]) * scale, -most), most));
}

void rbf_moves_decode(const rbf_component *c, const rbf_moves *m, const int32_t at[2], uint32_t block, uint32_t lane, rbf_shift *shift)
{
	const uint32_t steps = m->steps[block * RBF_LANES + lane];
	const float u = (float)at[0] / (float)(1u << steps), v = (float)at[1] / (float)(1u << steps);
	float centre[3], t[3], s[3];
	basis(c, block, lane, centre, t, s);
	shift->x[lane] = steps ? u * t[0] + v * s[0] : 0;
	shift->y[lane] = steps ? u * t[1] + v * s[1] : 0;
	shift->z[lane] = steps ? u * t[2] + v * s[2] : 0;
}

void rbf_moves_reflect(const rbf_shift *from, rbf_shift *to)
{
	for (int lane = 0; lane < RBF_LANES; lane++) {
		to->x[lane] = from->x[lane];
		to->y[lane] = -from->y[lane];
		to->z[lane] = from->z[lane];
	}
}

/* The mean of a shift and of the image of its image's: both should be the same, but that several plans of transport may cost as little. */
static void join(const rbf_shift *image, rbf_shift *to)
{
	for (int lane = 0; lane < RBF_LANES; lane++) {
		to->x[lane] = .5f * (to->x[lane] + image->x[lane]);
		to->y[lane] = .5f * (to->y[lane] - image->y[lane]);
		to->z[lane] = .5f * (to->z[lane] + image->z[lane]);
	}
}

/* Puts lobes into blocks; was: as rbf_cluster() takes it. Returns 0, or -1 when out of memory. */
static int cluster(const rbf_component *c, uint32_t *was)
{
	int failed = 0;
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++)
		was[i] = i;
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (uint32_t s = 0; s < c->sets; s++)
		failed |= rbf_cluster(c, &c->set[s], (rbf_block *)c->block, (rbf_amplitude *)c->amplitude, was);
	return failed;
}

/* Shifts to where their lobes are. */
static void follow(const rbf_moves *m, uint32_t count, const uint32_t *was, const rbf_shift *from, rbf_shift *to)
{
	for (uint32_t i = 0; i < count; i++)
		for (uint32_t lane = 0; lane < RBF_LANES && m->block[i] != RBF_MOVES_NONE; lane++) {
			const uint32_t old = was[m->block[i] * RBF_LANES + lane], at = i - (m->block[i] - old / RBF_LANES);
			to[i].x[lane] = from[at].x[old % RBF_LANES];
			to[i].y[lane] = from[at].y[old % RBF_LANES];
			to[i].z[lane] = from[at].z[old % RBF_LANES];
		}
}

int rbf_moves_round(rbf_component *c)
{
	rbf_moves m = {0};
	uint32_t *was = malloc(((size_t)c->blocks * RBF_LANES + 1) * sizeof *was);
	rbf_shift *shift = (rbf_shift *)c->shift, *before = malloc((c->shifts + 1ull) * sizeof *before);
	rbf_pack_round(c);
	const char *wrong = !was || !before || cluster(c, was) ? rbf_unpack_memory : rbf_moves_find(c, &m);
	if (!wrong) {
		memcpy(before, shift, c->shifts * sizeof *before);
		follow(&m, c->shifts, was, before, shift);
	}
	for (uint32_t i = 0; i < c->shifts && !wrong; i++)
		if (m.block[i] != RBF_MOVES_NONE && rbf_moves_source(&m, i) != i)
			join(&shift[i], &shift[rbf_moves_source(&m, i)]);
	for (uint32_t i = 0; i < c->shifts && !wrong; i++)
		for (uint32_t lane = 0; lane < RBF_LANES && m.block[i] != RBF_MOVES_NONE; lane++) {
			int32_t at[2];
			rbf_moves_encode(c, &m, &shift[i], m.block[i], lane, at);
			rbf_moves_decode(c, &m, at, m.block[i], lane, &shift[i]);
		}
	for (uint32_t i = 0; i < c->shifts && !wrong; i++)
		if (m.block[i] != RBF_MOVES_NONE && rbf_moves_source(&m, i) != i)
			rbf_moves_reflect(&shift[rbf_moves_source(&m, i)], &shift[i]);
	rbf_moves_release(&m);
	free(was);
	free(before);
	return wrong == rbf_unpack_memory ? -1 : 0;
}

const char *rbf_moves_unpack(rbf_bits *b, const rbf_component *c, uint32_t order, rbf_shift *to)
{
	rbf_moves m;
	int32_t (*at)[2] = calloc((size_t)c->shifts * RBF_LANES + 1, sizeof *at);
	const char *wrong = rbf_moves_find(c, &m);
	const uint32_t images = rbf_bits_take(b, 1);
	if (!at)
		wrong = rbf_unpack_memory;
	memset(to, 0, c->shifts * sizeof *to);
	for (uint32_t i = 0; i < c->shifts && !wrong; i++) {
		const uint32_t block = m.block[i], source = block == RBF_MOVES_NONE ? i : rbf_moves_source(&m, i);
		if (block == RBF_MOVES_NONE)
			continue;
		if (images && source != i) {
			rbf_moves_reflect(&to[source], &to[i]);
			continue;
		}
		for (uint32_t lane = 0; lane < RBF_LANES; lane++) {
			const uint32_t own = block * RBF_LANES + lane, near = m.before[own], steps = m.steps[own];
			const size_t here = (size_t)i * RBF_LANES + lane, there = here - (own - near);
			for (int n = 0; n < 2 && steps; n++) {
				const int64_t number = (near == own ? 0 : rbf_pack_scaled(at[there][n], m.steps[near], steps)) + rbf_bits_difference(b, order);
				if (number < -(1ll << steps) || number > 1ll << steps)
					wrong = "shift";
				else
					at[here][n] = (int32_t)number;
			}
			rbf_moves_decode(c, &m, at[here], block, lane, &to[i]);
		}
		if (b->at > b->count)
			wrong = "shift";
	}
	rbf_moves_release(&m);
	free(at);
	return wrong;
}
