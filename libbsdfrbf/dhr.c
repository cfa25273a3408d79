/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "clones.h"
#include "dhr.h"
#include "mesh_inside.h"

/* First node of the piece that holds x (in steps), an even number, and the rest. */
static inline uint32_t piece_of(float x, uint32_t steps, float *rest)
{
	const uint32_t last = steps / 2 - 1;
	const float half = .5f * x;
	const uint32_t piece = half > 0 ? half < (float)last ? (uint32_t)half : last : 0; /* also for what is not a number */
	*rest = x - (float)(2 * piece);
	return 2 * piece;
}

static inline void limit(uint32_t channels, float value[3])
{
	for (uint32_t n = 0; n < channels; n++)
		value[n] = value[n] > 0 ? value[n] : 0; /* a quadratic piece may swing below */
}

/* channels: those of the component, a constant where it is inlined */
static inline __attribute__((always_inline)) void inside(const rbf_component *c, uint32_t channels, uint32_t element, const float weight[3],
	float value[3])
{
	const uint32_t steps = c->dhr_steps;
	const float *table = c->dhr + (size_t)element * rbf_dhr_element_nodes(c) * channels;
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		float t, part[3];
		const uint32_t at = piece_of(weight[1] * (float)steps, steps, &t);
		rbf_quadratic(t, part);
		for (uint32_t n = 0; n < channels; n++)
			value[n] = part[0] * table[at * channels + n] + part[1] * table[(at + 1) * channels + n] + part[2] * table[(at + 2) * channels + n];
	} else {
		float x, y;
		uint32_t p = piece_of(weight[1] * (float)steps, steps, &x), q = piece_of(weight[2] * (float)steps, steps, &y);
		while (p + q > steps - 2) { /* rounding at the far side */
			if (p)
				p -= 2, x += 2;
			else
				q -= 2, y += 2;
		}
		/* rows q to q + 2 of the lattice from column p on. Weights of the small triangle's corners, which are (0, 0), (2, 0), (0, 2) or, if
		 * it is flipped, (2, 2), (0, 2), (2, 0): which it is is chance, so that nothing here branches on it */
		const uint32_t row0 = rbf_dhr_lattice(steps, p, q), row1 = row0 + steps + 1 - q, row2 = row1 + steps - q;
		const uint32_t flipped = (x + y > 2) & (p + q + 4 <= steps);
		const float turn = (float)flipped, sign = .5f - turn, b = turn + sign * x, g = turn + sign * y, a = 1 - b - g;
		const float *at_a = table + (flipped ? row2 + 2 : row0) * channels, *at_b = table + (flipped ? row2 : row0 + 2) * channels;
		const float *at_g = table + (flipped ? row0 + 2 : row2) * channels, *at_ab = table + (flipped ? row2 + 1 : row0 + 1) * channels;
		const float *at_bg = table + (row1 + 1) * channels, *at_ag = table + (flipped ? row1 + 2 : row1) * channels;
		for (uint32_t n = 0; n < channels; n++)
			value[n] = a * (2*a - 1) * at_a[n] + b * (2*b - 1) * at_b[n] + g * (2*g - 1) * at_g[n]
				+ 4 * (a * b * at_ab[n] + b * g * at_bg[n] + a * g * at_ag[n]);
	}
	limit(channels, value);
}

void rbf_dhr_inside(const rbf_component *c, uint32_t element, const float weight[3], float value[3])
{
	inside(c, c->channels, element, weight, value);
}

RBF_CLONES static int quick(const rbf_component *c, const float incident[3], float value[3])
{
	float d[3], weight[3];
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		d[0] = sqrtf(incident[0]*incident[0] + incident[1]*incident[1]);
		d[1] = 0;
		d[2] = incident[2];
	} else
		rbf_mirror((unsigned)rbf_symmetry_fold(c->mesh.symmetry, incident), incident, d);
	const uint32_t element = rbf_mesh_inside(&c->mesh, d, weight);
	if (element == RBF_MESH_NO_ELEMENT)
		return 0;
	const float scale = 1 / rbf_max(d[2], RBF_DHR_Z);
	if (c->channels == 1) {
		inside(c, 1, element, weight, value);
		value[0] *= scale;
		return 1;
	}
	inside(c, 3, element, weight, value);
	for (int n = 0; n < 3; n++)
		value[n] *= scale;
	return 1;
}

int rbf_dhr_quick(const rbf_component *c, const float incident[3], float value[3])
{
	return quick(c, incident, value);
}

/* The arc's ends, its unit tangent `along` at a point p and the outward normal of its plane, which is the same everywhere on it:
 * elements are counter-clockwise, so that outwards is to the right of the way from a to b. A point has a circle of latitude's. */
typedef struct arc { float a[3], b[3], out[3]; int point; } arc;

static inline __attribute__((always_inline)) arc arc_of(const rbf_mesh *mesh, uint32_t border)
{
	arc r;
	for (int n = 0; n < 3; n++) {
		r.a[n] = mesh->vertex[rbf_bound_vertex(mesh, mesh->border[border][0])].direction[n];
		r.b[n] = mesh->vertex[rbf_bound_vertex(mesh, mesh->border[border][1])].direction[n];
	}
	const float e[3] = {r.b[0] - r.a[0], r.b[1] - r.a[1], r.b[2] - r.a[2]};
	rbf_cross(e, r.a, r.out);
	r.point = !(rbf_dot(r.out, r.out) > 0);
	if (r.point) {
		const float s = sqrtf(r.a[0]*r.a[0] + r.a[1]*r.a[1]);
		r.out[0] = s > 0 ? r.a[2] * r.a[0] / s : r.a[2];
		r.out[1] = s > 0 ? r.a[2] * r.a[1] / s : 0;
		r.out[2] = -s;
	}
	return r;
}

/* Angle to the horizon from a point at height z along a tangent that sinks, both for a unit vector or times the same. */
static inline float to_horizon(float z, float sinks)
{
	return rbf_max(rbf_upper_angle(z, sinks), 1e-4f);
}

/* Where a direction lies beyond a border. Angles do not depend on lengths: none but those of the nearest point of the arc, *z, and of the way
 * from it is worked out. */
static inline __attribute__((always_inline)) rbf_dhr_polar beyond(const rbf_mesh *mesh, uint32_t border, const float weight[2],
	const float d[3], float *z)
{
	const arc r = arc_of(mesh, border);
	float p[3], g[3], along[3];
	for (int n = 0; n < 3; n++)
		p[n] = weight[0] * r.a[n] + weight[1] * r.b[n];
	const float square = rbf_dot(p, p), length = sqrtf(square), toward = rbf_dot(d, p);
	for (int n = 0; n < 3; n++)
		g[n] = d[n] * square - toward * p[n];
	const float far = sqrtf(rbf_dot(g, g)), near = toward * length;
	*z = p[2] / length;
	rbf_cross(p, r.out, along);
	const float outward = rbf_dot(g, r.out), forward = rbf_dot(g, along);
	const float turn = rbf_upper_angle(fabsf(forward), outward * length) * (float)(1 / RBF_PI);
	rbf_dhr_polar point = {0, 0};
	if (weight[0] > 0 && weight[1] > 0)
		point.around = outward < 0 ? 2 + weight[0] : weight[1];
	else if (r.point ? forward > 0 : !(weight[0] > 0))
		point.around = 1 + turn;
	else
		point.around = turn > 0 ? 4 - turn : 0;
	if (far > 0)
		point.out = rbf_min(rbf_upper_angle(far, near) / to_horizon(p[2] * far, -g[2] * length), 1.f);
	return point;
}

/* Start p, direction g (unit) and length up to the horizon of the line at `around`. */
static float line_at(const arc *r, float around, float weight[2], float p[3], float g[3])
{
	const float unit = 1 / sqrtf(rbf_dot(r->out, r->out)); /* of r->out */
	const int section = (int)around;
	const float t = around - (float)section;
	float along[3];
	weight[1] = section == 0 ? t : section == 1 ? 1 : section == 2 ? 1 - t : 0;
	weight[0] = 1 - weight[1];
	for (int n = 0; n < 3; n++)
		p[n] = weight[0] * r->a[n] + weight[1] * r->b[n];
	rbf_normalize(p);
	rbf_cross(p, r->out, along);
	const float turn = (float)RBF_PI * (section == 0 ? 0 : section == 1 ? t : section == 2 ? 1 : t - 1);
	const float outward = cosf(turn), forward = sinf(turn);
	for (int n = 0; n < 3; n++)
		g[n] = unit * (outward * r->out[n] + forward * along[n]);
	return to_horizon(p[2], -g[2]);
}

void rbf_dhr_beyond_direction(const rbf_mesh *mesh, uint32_t border, rbf_dhr_polar point, float weight[2], float d[3])
{
	const arc r = arc_of(mesh, border);
	float p[3], g[3];
	const float angle = point.out * line_at(&r, point.around, weight, p, g), ca = cosf(angle), sa = sinf(angle);
	for (int n = 0; n < 3; n++)
		d[n] = ca * p[n] + sa * g[n];
}

float rbf_dhr_line(const rbf_mesh *mesh, uint32_t border, float around, float weight[2], float direction[3])
{
	const arc r = arc_of(mesh, border);
	float p[3];
	return line_at(&r, around, weight, p, direction);
}

/* channels: as in inside() */
static inline __attribute__((always_inline)) void outside(const rbf_component *c, uint32_t channels, uint32_t border, const float weight[2],
	const float direction[3], rbf_dhr_edge *at)
{
	const uint32_t steps = c->dhr_steps, columns = steps + 1, lines = 4 * steps;
	const float *table = c->dhr + ((size_t)c->mesh.elements * rbf_dhr_element_nodes(c) + (size_t)border * rbf_dhr_border_nodes(c)) * channels;
	float x, y, along[3], out[3];
	const rbf_dhr_polar point = beyond(&c->mesh, border, weight, direction, &at->z);
	const uint32_t row = piece_of(point.around * (float)steps, lines, &x), column = piece_of(point.out * (float)steps, steps, &y);
	const uint32_t third = row + 2 < lines ? row + 2 : 0; /* once around, the first line is the last one as well */
	const float *line[3] = {table + (size_t)row * columns * channels, table + (size_t)(row + 1) * columns * channels,
		table + (size_t)third * columns * channels};
	rbf_quadratic(x, along);
	rbf_quadratic(y, out);
	at->trend = 0;
	if (c->trend) {
		const float *trend = c->trend + (size_t)border * lines;
		at->trend = (along[0] * trend[row] + along[1] * trend[row + 1] + along[2] * trend[third]) * point.out * (2 - point.out);
	}
	for (uint32_t n = 0; n < channels; n++) {
		at->value[n] = at->edge[n] = 0;
		for (int i = 0; i < 3; i++) {
			const float *a = line[i] + n, *b = a + (size_t)column * channels;
			at->edge[n] += along[i] * a[0];
			at->value[n] += along[i] * (out[0] * b[0] + out[1] * b[channels] + out[2] * b[2 * channels]);
		}
	}
	limit(channels, at->value);
	limit(channels, at->edge);
}

RBF_CLONES static void outside_any(const rbf_component *c, uint32_t border, const float weight[2], const float direction[3], rbf_dhr_edge *at)
{
	if (c->channels == 1)
		outside(c, 1, border, weight, direction, at);
	else
		outside(c, 3, border, weight, direction, at);
}

void rbf_dhr_outside(const rbf_component *c, uint32_t border, const float weight[2], const float direction[3], rbf_dhr_edge *at)
{
	outside_any(c, border, weight, direction, at);
}
