/* SPDX-License-Identifier: BSD-3-Clause */
/* Compiled for AVX-512: four pairs at once, each in as many lanes as one takes elsewhere. */
#include "pairs.h"

#if defined(__AVX512F__) && defined(__AVX512VL__) && defined(__AVX512DQ__)
#define RBF_ABREAST RBF_PAIRS_ABREAST
#include "bounds.h"
#include "cells.h"
#include "even.h"
#include "fan.h"
#include "shares.h"

#include <stddef.h>

/* One of four numbers of each pair, in all of its lanes. */
#define SPREAD(v, n) (rbf_lanes)_mm512_permute_ps((__m512)(v), 0x55 * (n))

/* Four numbers of each pair. */
static inline __attribute__((always_inline)) rbf_lanes read_row(const rbf_pair *pair, size_t member)
{
	const float *row[RBF_ABREAST];
	for (int n = 0; n < RBF_ABREAST; n++)
		row[n] = (const float *)(const void *)((const char *)(pair + n) + member);
	return rbf_lanes_rows(row);
}

static inline __attribute__((always_inline)) void read_direction(const rbf_pair *pair, size_t member, rbf_lanes d[3])
{
	const rbf_lanes all = read_row(pair, member);
	d[0] = SPREAD(all, 0);
	d[1] = SPREAD(all, 1);
	d[2] = SPREAD(all, 2);
}

/* The same of as many pairs as there are lanes, one lane each. */
static inline __attribute__((always_inline)) void read_columns(const rbf_pair *pair, size_t member, rbf_lanes column[4])
{
	const float *of[RBF_WIDTH];
	for (int n = 0; n < RBF_WIDTH; n++)
		of[n] = (const float *)(const void *)((const char *)(pair + n) + member);
	rbf_lanes_columns(of, column);
}

static inline __attribute__((always_inline)) void write_columns(rbf_pair *pair, size_t member, const rbf_lanes column[4])
{
	rbf_lanes row[4] = {column[0], column[1], column[2], column[3]};
	rbf_lanes_transpose(row);
	for (int n = 0; n < RBF_WIDTH; n++)
		memcpy((char *)(pair + n) + member, (const float *)&row[n % 4] + n / 4 * 4, 4 * sizeof(float));
}

/* As rbf_polar_angle(). */
static inline __attribute__((always_inline)) rbf_lanes polar_angle(const rbf_lanes d[3])
{
	const rbf_lanes z = rbf_lanes_max(d[2], rbf_lanes_all(0)), sine = rbf_lanes_sqrt(d[0]*d[0] + d[1]*d[1]);
	const rbf_lanes t = rbf_lanes_min(sine, z) / rbf_lanes_max(rbf_lanes_max(sine, z), rbf_lanes_all(1e-30f)), s = t * t;
	const rbf_lanes over = RBF_ARCTANGENT_OVER(s), quarter = rbf_lanes_all((float)(RBF_PI / 2));
	return rbf_lanes_select(sine < z, t * over, (rbf_lanes)_mm512_fnmadd_ps((__m512)t, (__m512)over, (__m512)quarter));
}

/* As rbf_mesh_column(). */
static inline __attribute__((always_inline)) rbf_lane_mask columns(rbf_lanes coordinate)
{
	const rbf_lanes t = (coordinate + 1) * (RBF_MESH_GRID / 2);
	return __builtin_convertvector(rbf_lanes_min(rbf_lanes_max(t, rbf_lanes_all(0)), rbf_lanes_all(RBF_MESH_GRID - .5f)), rbf_lane_mask);
}

/* As rbf_mesh_cell(). */
static inline __attribute__((always_inline)) rbf_lane_mask mesh_cells(const rbf_mesh *mesh, const rbf_lanes d[3], rbf_lanes *theta)
{
	if (mesh->symmetry == RBF_ISOTROPIC) {
		*theta = polar_angle(d);
		const rbf_lane_mask column = columns(*theta * (float)(2 / RBF_PI)) - RBF_MESH_GRID / 2;
		return column & (column > 0);
	}
	const rbf_lanes scale = 1 / rbf_lanes_sqrt(1 + rbf_lanes_max(d[2], rbf_lanes_all(0)));
	return columns(d[1] * scale) * RBF_MESH_GRID + columns(d[0] * scale);
}

/* A product that is rounded before it is added to another. */
static inline __attribute__((always_inline)) rbf_lanes product(rbf_lanes a, rbf_lanes b)
{
	rbf_lanes v = a * b;
	__asm__("" : "+v"(v));
	return v;
}

/* As rbf_site_turn() and rbf_site_fold(), to the bit: these are compiled without fused products. */
static inline __attribute__((always_inline)) void fold(rbf_symmetry symmetry, rbf_lanes i[3], rbf_lanes o[3])
{
	const rbf_lanes zero = rbf_lanes_all(0);
	if (symmetry == RBF_ISOTROPIC) {
		const rbf_lanes s = rbf_lanes_sqrt(product(i[0], i[0]) + product(i[1], i[1]));
		const rbf_lanes cosine = rbf_lanes_select(s > 0, i[0] / s, rbf_lanes_all(1)), sine = rbf_lanes_select(s > 0, i[1] / s, zero);
		const rbf_lanes x = product(cosine, o[0]) + product(sine, o[1]);
		o[1] = product(cosine, o[1]) - product(sine, o[0]);
		o[0] = x;
		i[0] = s;
		i[1] = zero;
		return;
	}
	const int up = symmetry == RBF_UP, both = symmetry == RBF_QUADRILATERAL;
	const rbf_lane_mask left = i[0] < 0, low = up ? (i[1] < 0) | ((i[1] == 0) & left) : i[1] < 0, sign = (rbf_lane_mask)rbf_lanes_all(-0.f);
	const rbf_lane_mask flip[2] = {symmetry == RBF_BILATERAL_X || both ? left & sign : up ? low & sign : (rbf_lane_mask)zero,
		symmetry == RBF_BILATERAL_Y || both || up ? low & sign : (rbf_lane_mask)zero};
	for (int n = 0; n < 2; n++) {
		i[n] = (rbf_lanes)((rbf_lane_mask)i[n] ^ flip[n]);
		o[n] = (rbf_lanes)((rbf_lane_mask)o[n] ^ flip[n]);
	}
}

/* Weights in elements, still to be scaled, and the lowest, as rbf_mesh_inside() has them. */
static inline __attribute__((always_inline)) void try_elements(const rbf_mesh *mesh, __m512i element, const rbf_lanes d[3], rbf_lanes theta,
	rbf_lanes w[4])
{
	const float *row[RBF_WIDTH];
	uint32_t at[RBF_WIDTH];
	rbf_lanes part[3][4];
	_mm512_storeu_si512(at, element);
	for (int k = 0; k < 3; k++) {
		for (int n = 0; n < RBF_WIDTH; n++)
			row[n] = (const float *)(const void *)&mesh->element[at[n]] + 4 * k;
		rbf_lanes_columns(row, part[k]);
	}
	if (mesh->symmetry == RBF_ISOTROPIC) {
		w[1] = (theta - part[0][3]) * part[1][0];
		w[0] = 1 - w[1];
		w[2] = rbf_lanes_all(0);
		w[3] = rbf_lanes_min(w[1], w[0]);
		return;
	}
	w[0] = part[0][3]*d[0] + part[1][0]*d[1] + part[1][1]*d[2];
	w[1] = part[1][2]*d[0] + part[1][3]*d[1] + part[2][0]*d[2];
	w[2] = part[2][1]*d[0] + part[2][2]*d[1] + part[2][3]*d[2];
	w[3] = rbf_lanes_min(rbf_lanes_min(w[0], w[1]), w[2]);
}

_Static_assert(sizeof(rbf_element) == 48 && offsetof(rbf_element, inverse) == 12, "three rows of four");

void rbf_pairs_find_avx512(const rbf_component *c, rbf_pair pair[RBF_WIDTH])
{
	const rbf_mesh *mesh = &c->mesh;
	const __m512i one = _mm512_set1_epi32(1), none = _mm512_set1_epi32(-1);
	rbf_lanes i[4], o[4], w[2][4], theta = rbf_lanes_all(0);
	uint32_t item[RBF_WIDTH];
	read_columns(pair, offsetof(rbf_pair, incident), i);
	read_columns(pair, offsetof(rbf_pair, exitant), o);
	fold(mesh->symmetry, i, o);
	write_columns(pair, offsetof(rbf_pair, incident), i);
	write_columns(pair, offsetof(rbf_pair, exitant), o);
	const __m512i cell = (__m512i)mesh_cells(mesh, i, &theta), elements = _mm512_set1_epi32((int32_t)mesh->elements);
	const __m512i entries = _mm512_set1_epi32((int32_t)mesh->cell_entries);
	const __m512i last = _mm512_min_epu32(_mm512_i32gather_epi32(cell, mesh->cell_first + 1, 4), entries);
	const __m512i first = _mm512_min_epu32(_mm512_i32gather_epi32(cell, mesh->cell_first, 4), last), second = _mm512_add_epi32(first, one);
	const __m512i a = _mm512_mask_i32gather_epi32(none, _mm512_cmplt_epu32_mask(first, last), first, mesh->cell_element, 4);
	const __m512i b = _mm512_mask_i32gather_epi32(none, _mm512_cmplt_epu32_mask(second, last), second, mesh->cell_element, 4);
	const __mmask16 is_a = _mm512_cmplt_epu32_mask(a, elements), is_b = _mm512_cmplt_epu32_mask(b, elements);
	const __m512i at = _mm512_maskz_mov_epi32(is_a, a), beside = _mm512_mask_mov_epi32(at, is_b, b);
	try_elements(mesh, at, i, theta, w[0]);
	try_elements(mesh, beside, i, theta, w[1]);
	const rbf_lane_mask other = w[1][3] > w[0][3];
	for (int k = 0; k < 4; k++)
		w[0][k] = rbf_lanes_select(other, w[1][k], w[0][k]);
	const rbf_lanes scale = mesh->symmetry == RBF_ISOTROPIC ? rbf_lanes_all(1) : 1 / (w[0][0] + w[0][1] + w[0][2]);
	const rbf_lane_mask found = (w[0][3] >= 0) & (scale > 0) & (scale < INFINITY);
	const rbf_lanes which = rbf_lanes_select(found, rbf_lanes_select(other, (rbf_lanes)beside, (rbf_lanes)at), (rbf_lanes)none);
	_mm512_storeu_si512(item, _mm512_mask_mov_epi32(none, is_a, (__m512i)which));
	const rbf_lanes weight[4] = {w[0][0] * scale, w[0][1] * scale, w[0][2] * scale, rbf_lanes_all(0)};
	write_columns(pair, offsetof(rbf_pair, weight), weight);
	for (int n = 0; n < RBF_WIDTH; n++)
		pair[n].item = item[n];
}

/* Which blocks of eight sets matter, by masks at these bits from each set's first one. Below the horizon all of them do. */
static inline __attribute__((always_inline)) __m512i groups_at(const uint64_t *packed, __m256i first, __m256i blocks, __m256i bit,
	__mmask8 wanted, __mmask8 above)
{
	const __m512i ones = _mm512_set1_epi64(-1), start = _mm512_mul_epu32(_mm512_cvtepu32_epi64(first), _mm512_set1_epi64(RBF_CULL_STRIDE / 8));
	const __m512i at = _mm512_add_epi64(start, _mm512_cvtepu32_epi64(_mm256_srli_epi32(bit, 3)));
	const __m512i shift = _mm512_cvtepu32_epi64(_mm256_and_si256(bit, _mm256_set1_epi32(7)));
	const __m512i read = _mm512_mask_i64gather_epi64(ones, wanted & above, at, packed, 1);
	const __m512i all = _mm512_add_epi64(_mm512_sllv_epi64(_mm512_set1_epi64(1), _mm512_cvtepu32_epi64(blocks)), ones);
	return _mm512_maskz_and_epi64(wanted, all, _mm512_mask_srlv_epi64(ones, above, read, shift));
}

/* The jobs of one frame. Returns the blocks of the largest set. */
static inline __attribute__((always_inline)) __m512i set_jobs(const rbf_component *c, const rbf_set *const set[RBF_WIDTH],
	const rbf_lanes d[3], rbf_lanes weight, rbf_kernel_frame *frame)
{
	const float *row[RBF_WIDTH];
	rbf_lanes of[4], at[4] = {d[0], d[1], d[2], weight};
	for (int n = 0; n < RBF_WIDTH; n++)
		row[n] = (const float *)(const void *)set[n];
	rbf_lanes_columns(row, of);
	__m512i first = (__m512i)of[0], blocks = (__m512i)of[1];
	const __m512i room = _mm512_set1_epi32((int32_t)c->blocks);
	/* as rbf_bound_to(); the first block, if there is none, is one that exists if any does */
	const __mmask16 within = _mm512_cmple_epu32_mask(blocks, room) & _mm512_cmple_epu32_mask(first, _mm512_sub_epi32(room, blocks));
	blocks = _mm512_maskz_mov_epi32(within, blocks);
	first = _mm512_maskz_mov_epi32(_mm512_test_epi32_mask(blocks, blocks), first);
	const __m512i many = _mm512_set1_epi32(58), most = _mm512_set1_epi32(60); /* as rbf_cull_width() */
	__m512i width = _mm512_mask_mov_epi32(blocks, _mm512_cmpgt_epu32_mask(blocks, many), most);
	width = _mm512_mask_mov_epi32(width, _mm512_cmpgt_epu32_mask(blocks, most), _mm512_set1_epi32(RBF_CULL_BITS));
	const __m512i bit = _mm512_mullo_epi32(width, (__m512i)rbf_cells_at(d));
	const __mmask16 above = _mm512_cmp_ps_mask((__m512)d[2], _mm512_setzero_ps(), _CMP_GT_OQ);
	const __mmask16 wanted = _mm512_cmp_ps_mask((__m512)weight, _mm512_setzero_ps(), _CMP_GT_OQ) & _mm512_test_epi32_mask(blocks, blocks);
	const __m512i low = groups_at(c->cull, _mm512_castsi512_si256(first), _mm512_castsi512_si256(blocks), _mm512_castsi512_si256(bit),
		(__mmask8)wanted, (__mmask8)above);
	const __m512i high = groups_at(c->cull, _mm512_extracti32x8_epi32(first, 1), _mm512_extracti32x8_epi32(blocks, 1),
		_mm512_extracti32x8_epi32(bit, 1), (__mmask8)(wanted >> 8), (__mmask8)(above >> 8));
	/* corner by corner */
	_mm512_storeu_si512(frame->mask, _mm512_permutex2var_epi64(low, _mm512_set_epi64(13, 9, 5, 1, 12, 8, 4, 0), high));
	_mm512_storeu_si512(frame->mask + 8, _mm512_permutex2var_epi64(low, _mm512_set_epi64(15, 11, 7, 3, 14, 10, 6, 2), high));
	_mm512_storeu_si512(frame->first, _mm512_permutexvar_epi32(_mm512_set_epi32(15, 11, 7, 3, 14, 10, 6, 2, 13, 9, 5, 1, 12, 8, 4, 0), first));
	rbf_lanes_transpose(at);
	for (int k = 0; k < 4; k++)
		_mm512_storeu_ps(frame->direction[4*k], (__m512)at[k]);
	return blocks;
}

/* Corners of the items that pairs are in, the last one twice. */
typedef struct corners {
	const rbf_set *set[RBF_WIDTH];      /* of the first frame */
	const rbf_level *level[RBF_WIDTH];  /* NULL: none */
	rbf_lanes direction[4], flip[2];    /* as in rbf_site */
	rbf_lane_mask outside;              /* all lanes of pairs that are */
} corners;

static inline __attribute__((always_inline)) void find_corners(const rbf_component *c, const rbf_pair pair[RBF_ABREAST], corners *at)
{
	const float *row[RBF_WIDTH];
	int32_t ops[RBF_WIDTH], outside[RBF_WIDTH];
	rbf_lane_mask op;
	for (int n = 0; n < RBF_WIDTH; n += 4) {
		uint32_t corner[3];
		rbf_bound_corners(&c->mesh, pair[n / 4].item, corner);
		for (int k = 0; k < 4; k++) {
			const rbf_vertex *v = &c->mesh.vertex[corner[k < 3 ? k : 2]];
			const uint32_t base = rbf_bound_base(c, v);
			at->set[n + k] = c->set + (size_t)base * c->frames;
			at->level[n + k] = c->level ? c->level + base : NULL;
			outside[n + k] = -(int32_t)(pair[n / 4].item / RBF_MESH_BORDER);
			row[n + k] = v->direction; /* and what follows it */
			ops[n + k] = (int32_t)v->op;
		}
	}
	memcpy(&op, ops, sizeof op);
	memcpy(&at->outside, outside, sizeof outside);
	rbf_lanes_columns(row, at->direction);
	at->flip[0] = __builtin_convertvector(1 - 2 * (op & 1), rbf_lanes);
	at->flip[1] = __builtin_convertvector(1 - (op & 2), rbf_lanes);
}

/* What each corner sends, before shares and maps (rbf_site.part). */
static inline __attribute__((always_inline)) rbf_lanes parts_of(const rbf_component *c, const rbf_pair pair[RBF_ABREAST],
	const corners *corner, rbf_lanes weight, const rbf_lanes i[3])
{
	rbf_lanes part = weight;
	if (c->level) {
		rbf_lanes at[3] = {i[0], i[1], i[2]}, gain = rbf_lanes_all(0);
		int half = 0;
		for (uint32_t f = 0; f < c->frames; f++)
			half |= rbf_map_get(c->frame[f])->kind == RBF_KIND_HALF;
		if (half)
			gain = rbf_facet_gain(weight, rbf_half_gain(i, corner->direction));
		if (_mm512_movepi32_mask((__m512i)corner->outside)) {
			rbf_nearest(weight, corner->direction, at);
			for (int n = 0; n < 3; n++)
				at[n] = rbf_lanes_select(corner->outside, at[n], i[n]);
		}
		part = rbf_even_parts(c->even, corner->level, weight, corner->flip, half ? &gain : NULL, i, at);
	}
	if (c->tune) {
		float tune[RBF_WIDTH];
		for (int n = 0; n < RBF_WIDTH; n++)
			tune[n] = pair[n / 4].tune;
		part *= rbf_lanes_load(tune);
	}
	return part;
}

uint32_t rbf_pairs_jobs_avx512(const rbf_component *c, const rbf_pair pair[RBF_ABREAST], rbf_kernel_frame frame[RBF_MAX_FRAMES])
{
	corners at;
	rbf_lanes i[3], o[3];
	__m512i most = _mm512_setzero_si512();
	find_corners(c, pair, &at);
	read_direction(pair, offsetof(rbf_pair, incident), i);
	read_direction(pair, offsetof(rbf_pair, exitant), o);
	const rbf_lanes weight = rbf_lanes_max(read_row(pair, offsetof(rbf_pair, weight)), rbf_lanes_all(0));
	const rbf_lanes part = parts_of(c, pair, &at, weight, i);
	for (uint32_t f = 0; f < c->frames; f++) {
		rbf_fan fan;
		rbf_lanes d[3];
		rbf_fan_set(&fan, c->frame[f], rbf_frame_linear(c, f), i, at.direction);
		if (fan.kind == RBF_KIND_HALF)
			rbf_lanes_store(fan.gain, rbf_facet_gain(weight, rbf_lanes_load(fan.gain)));
		const rbf_lanes factor = rbf_fan_forward(&fan, i, at.direction, o, d);
		const rbf_lanes counts = part * rbf_shares(rbf_frame_limit(c, f), weight, d[2]) * factor;
		d[0] *= at.flip[0];
		d[1] *= at.flip[1];
		most = _mm512_max_epu32(most, set_jobs(c, at.set, d, counts, &frame[f]));
		for (int n = 0; n < RBF_WIDTH; n++)
			at.set[n]++;
	}
	return _mm512_reduce_max_epu32(most);
}
#else
void rbf_pairs_find_avx512(const rbf_component *c, rbf_pair pair[RBF_PAIRS_MOST])
{
	(void)c;
	for (int n = 0; n < RBF_PAIRS_MOST; n++)
		pair[n].item = RBF_MESH_NO_ELEMENT;
}

uint32_t rbf_pairs_jobs_avx512(const rbf_component *c, const rbf_pair pair[RBF_PAIRS_ABREAST], rbf_kernel_frame frame[RBF_MAX_FRAMES])
{
	(void)c;
	(void)pair;
	(void)frame;
	return UINT32_MAX;
}
#endif
