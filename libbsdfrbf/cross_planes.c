/* SPDX-License-Identifier: BSD-3-Clause */
#include "cross_scans.h"
#include "model.h"
#include "one_plane.h"
#include "small_system.h"
#include "vector3.h"

#include <stdlib.h>
#include <string.h>

enum { RINGS = 60, AROUND = 36, AROUND_IT = 4, LEVELS = 4 /* of contours, below the middle */ };
static const double NEAREST = .003, FARTHEST = 4; /* of the rings */
static const double BESIDE = .15;   /* sine of the azimuth to the plane: what is nearer is measured */
static const double WIDEST = 1.7;   /* rad: azimuths that tell what is between */
static const double STEEPEST = 4;   /* a power by which light falls off where it was not seen to */
static const double FAINT = 1e-6;   /* of the highest */
static const double STRETCH = 4;    /* the widest axis may be twice as wide as seen */
static const double RIDGE = 1e-6;   /* for azimuths that do not tell of an ellipse */

/* Where light is guessed: one incidence, and how far its parts spread. */
typedef struct target {
	const rbf_cross_scans *of;
	rbf_cross_source from;
	double reach[RBF_CROSS_PARTS][RINGS][RBF_PLANE_CHANNELS]; /* the most at a ring or beyond, at any azimuth */
} target;

static double ring(int r)
{
	return NEAREST * pow(FARTHEST / NEAREST, (r + .5) / RINGS);
}

/* The squared distance at which so much light is found at most, and the other way round. What is between azimuths is read off these: if contours are
 * ellipses, it is, over the squared distance of the place, a quadratic form of its direction. */
static double square_of(const double reach[RINGS][RBF_PLANE_CHANNELS], int c, double f)
{
	const double top = reach[0][c], most = fmax(f, FAINT * top);
	int r = RINGS - 1;
	while (r >= 0 && reach[r][c] < most)
		r--;
	if (r < 0)
		return ring(0) * ring(0);
	if (r == RINGS - 1 || !(reach[r + 1][c] > FAINT * top))
		return pow(ring(r) * pow(reach[r][c] / most, 1 / STEEPEST), 2);
	const double t = reach[r][c] > reach[r + 1][c] ? log(reach[r][c] / most) / log(reach[r][c] / reach[r + 1][c]) : 0;
	return pow(ring(r) * pow(ring(r + 1) / ring(r), t), 2);
}

static double light_at(const double reach[RINGS][RBF_PLANE_CHANNELS], int c, double square)
{
	const double distance = sqrt(square), top = reach[0][c];
	int r = 0;
	while (r + 1 < RINGS && ring(r + 1) <= distance && reach[r + 1][c] > FAINT * top)
		r++;
	if (distance <= ring(0))
		return top;
	if (r == RINGS - 1 || !(reach[r + 1][c] > FAINT * top))
		return reach[r][c] * pow(ring(r) / distance, STEEPEST);
	const double t = log(distance / ring(r)) / log(ring(r + 1) / ring(r));
	return reach[r][c] * pow(reach[r + 1][c] / reach[r][c], t);
}

/* Between the middle two of four azimuths, of which the first and last may be missing: a cubic that does not go beyond them (Fritsch and Butland, 1984). */
static double between(const double a[AROUND_IT], const double v[AROUND_IT], const int known[AROUND_IT], double at)
{
	double rise[AROUND_IT - 1], tangent[2];
	for (int n = 0; n < AROUND_IT - 1; n++)
		rise[n] = known[n] && known[n + 1] && a[n + 1] > a[n] ? (v[n + 1] - v[n]) / (a[n + 1] - a[n]) : 0;
	for (int n = 0; n < 2; n++)
		tangent[n] = rise[n] * rise[n + 1] > 0 ? 2 * rise[n] * rise[n + 1] / (rise[n] + rise[n + 1]) : 0;
	const double wide = a[2] - a[1], t = wide > 0 ? (at - a[1]) / wide : 0, u = 1 - t;
	return u*u * ((1 + 2*t) * v[1] + t * wide * tangent[0]) + t*t * ((1 + 2*u) * v[2] - u * wide * tangent[1]);
}

/* What planes of incidence show on one side, at a distance and an azimuth, by the ellipse, that may lie between theirs. */
static int side_at(const target *t, enum rbf_cross_part part, double distance, int side, double azimuth, double f[RBF_PLANE_CHANNELS])
{
	const rbf_cross_scans *p = t->of;
	double a[AROUND_IT], light[AROUND_IT][RBF_PLANE_CHANNELS], times;
	int known[AROUND_IT] = {0};
	size_t above = 0, from[AROUND_IT] = {0};
	const double plane = rbf_ellipse_off(&t->from.ellipse[part], azimuth, &times);
	while (above < p->groups && p->group[above].azimuth <= plane)
		above++;
	for (int up = 0; up < 2; up++)
		for (size_t n = 0, found = 0; n < p->groups && found < 2; n++) {
			const size_t g = up ? (above + n) % p->groups : (above + 2 * p->groups - 1 - n) % p->groups;
			const int at = up ? 2 + (int)found : 1 - (int)found;
			if (!(known[at] = rbf_cross_at(t->of, &t->from, g, part, distance, side, light[at])))
				continue;
			const double there = rbf_ellipse_on(&t->from.ellipse[part], p->group[g].azimuth, &times);
			a[at] = up ? azimuth + rbf_azimuth(there - azimuth) : azimuth - rbf_azimuth(azimuth - there);
			from[at] = g;
			found++;
		}
	if (!known[1] || !known[2] || rbf_azimuth(p->group[from[2]].azimuth - p->group[from[1]].azimuth) > WIDEST)
		return 0;
	for (int c = 0; c < p->channels; c++) {
		double v[AROUND_IT];
		for (int n = 0; n < AROUND_IT; n++)
			v[n] = known[n] ? square_of(t->reach[part], c, light[n][c]) : 0;
		f[c] = t->reach[part][0][c] > 0 ? light_at(t->reach[part], c, between(a, v, known, azimuth)) : 0;
	}
	return 1;
}

/* Adds what a part sends at a distance and an azimuth, by the ellipse. Returns whether it is known. */
static int add_part(const target *t, enum rbf_cross_part part, double distance, double azimuth, double f[RBF_PLANE_CHANNELS])
{
	double front[RBF_PLANE_CHANNELS], back[RBF_PLANE_CHANNELS];
	const int ahead = side_at(t, part, distance, 1, azimuth, front), behind = side_at(t, part, distance, -1, azimuth + RBF_PI, back);
	double times;
	const double share = ahead && behind ? .5 * (1 + cos(rbf_ellipse_off(&t->from.ellipse[part], azimuth, &times) - t->from.azimuth)) : ahead;
	for (int c = 0; c < t->of->channels; c++)
		f[c] += (ahead ? share * front[c] : 0) + (behind ? (1 - share) * back[c] : 0);
	return ahead || behind;
}

/* Along the plane of incidence, across it, and up. */
static void to_plane(const target *t, const double w[3], double local[3])
{
	const double c = cos(t->from.azimuth), s = sin(t->from.azimuth);
	local[0] = c * w[0] + s * w[1];
	local[1] = c * w[1] - s * w[0];
	local[2] = w[2];
}

static void from_plane(const target *t, const double local[3], double w[3])
{
	const double c = cos(t->from.azimuth), s = sin(t->from.azimuth), x = local[0], y = local[1];
	w[0] = c * x - s * y;
	w[1] = s * x + c * y;
	w[2] = local[2];
}

/* Distance and azimuth, by the ellipse, of a direction from the middle of a part, and the other way round, which returns 0 if there is no such direction. */
static void place_of(const target *t, enum rbf_cross_part part, const double w[3], double *distance, double *azimuth)
{
	double l[3], times;
	to_plane(t, w, l);
	rbf_falloff_place(t->from.by[part], part == RBF_CROSS_BACK ? t->from.theta : -t->from.theta, l, distance, azimuth);
	*azimuth = rbf_ellipse_on(&t->from.ellipse[part], t->from.azimuth + *azimuth, &times);
	*distance *= times;
}

static int direction_at(const target *t, enum rbf_cross_part part, double distance, double azimuth, double w[3])
{
	double l[3], times;
	azimuth = rbf_ellipse_off(&t->from.ellipse[part], azimuth, &times) - t->from.azimuth;
	const int some = rbf_falloff_direction(t->from.by[part], part == RBF_CROSS_BACK ? t->from.theta : -t->from.theta, distance * times, azimuth, l);
	from_plane(t, l, w);
	return some;
}

/* How far off light is that much fainter than in the middle; 0: it is not known, or it is that faint in the middle. */
static double width_at(const target *t, enum rbf_cross_part part, size_t g, int side, double least)
{
	const int y = (int)rbf_luminance((uint32_t)t->of->channels);
	double f[RBF_PLANE_CHANNELS], last = 0;
	for (int r = 0; r < RINGS; r++) {
		if (!rbf_cross_at(t->of, &t->from, g, part, ring(r), side, f))
			return 0;
		if (f[y] < least)
			return r ? ring(r - 1) * pow(ring(r) / ring(r - 1), log(last / least) / log(last / fmax(f[y], FAINT * least))) : 0;
		last = f[y];
	}
	return 0;
}

/* Adds what widths at a level tell to the normal equations of a quadratic form of the azimuth's direction, a + b cos 2 azimuth + c sin 2 azimuth, which is to be 1
 * over the squared width; all over that of their mean. Returns the least of that. */
static double add_widths(const target *t, enum rbf_cross_part part, double level, double m[3][3], double right[3])
{
	const rbf_cross_scans *p = t->of;
	double mean = 0, widest = 0;
	size_t known = 0;
	for (int pass = 0; pass < 2; pass++) {
		if (pass && known < p->groups) /* of both sides */
			return 0;
		for (size_t g = 0; g < p->groups; g++)
			for (int side = -1; side <= 1; side += 2) {
				const double width = width_at(t, part, g, side, level), square = pow(width / exp(pass ? mean / (double)known : 0), 2);
				const double row[3] = {square, square * cos(2 * p->group[g].azimuth), square * sin(2 * p->group[g].azimuth)};
				if (!(width > 0))
					continue;
				mean += pass ? 0 : log(width);
				known += !pass;
				widest = pass ? fmax(widest, square) : 0;
				for (int i = 0; i < 3 && pass; i++) {
					for (int n = 0; n < 3; n++)
						m[i][n] += row[i] * row[n];
					right[i] += row[i];
				}
			}
	}
	return 1 / widest;
}

/* The ellipse, as large as a circle, that is like contours about the middle. */
static void set_ellipse(target *t, enum rbf_cross_part part)
{
	const rbf_cross_scans *p = t->of;
	const int y = (int)rbf_luminance((uint32_t)p->channels);
	double top = 0, m[3][3] = {{RIDGE}, {0, RIDGE}, {0, 0, RIDGE}}, x[3] = {0}, f[RBF_PLANE_CHANNELS], least = 0;
	int tops = 0;
	for (size_t g = 0; g < p->groups; g++)
		for (int side = -1; side <= 1; side += 2)
			if (rbf_cross_at(t->of, &t->from, g, part, ring(0), side, f)) {
				top += f[y];
				tops++;
			}
	for (int n = 1; n <= LEVELS && top > 0; n++) {
		const double found = add_widths(t, part, top / tops * n / (LEVELS + 1), m, x);
		least = least > 0 && found > 0 ? fmin(least, found) : fmax(least, found);
	}
	if (!rbf_small_system_solve(3, m[0], x, 0) || !(least > 0))
		return;
	const double wide = fmax(x[0] - hypot(x[1], x[2]), least / STRETCH), narrow = x[0] + hypot(x[1], x[2]);
	if (narrow > wide)
		t->from.ellipse[part] = (rbf_ellipse){.5 * atan2(x[2], x[1]), pow(narrow / wide, .25), pow(wide / narrow, .25)};
}

/* How far the parts spread. */
static void set_reach(target *t)
{
	const rbf_cross_scans *p = t->of;
	memset(t->reach, 0, sizeof t->reach);
	for (int part = 0; part < RBF_CROSS_PARTS; part++)
		for (int r = RINGS - 1; r >= 0; r--) {
			double *most = t->reach[part][r], f[RBF_PLANE_CHANNELS];
			for (int c = 0; c < p->channels && r + 1 < RINGS; c++)
				most[c] = t->reach[part][r + 1][c];
			for (size_t g = 0; g < p->groups; g++)
				for (int side = -1; side <= 1; side += 2)
					if (rbf_cross_at(t->of, &t->from, g, (enum rbf_cross_part)part, ring(r), side, f))
						for (int c = 0; c < p->channels; c++)
							most[c] = fmax(most[c], f[c]);
		}
}

/* Rings about each part. Room is there. */
static void add_rings(const target *t, rbf_incidence *in)
{
	const rbf_cross_scans *p = t->of;
	const uint32_t y = rbf_luminance((uint32_t)p->channels);
	for (int part = 0; part < RBF_CROSS_PARTS; part++) {
		double times;
		const double own = rbf_ellipse_on(&t->from.ellipse[part], t->from.azimuth, &times);
		for (int r = 0; r < RINGS * AROUND && t->reach[part][0][y] > 0; r++) {
			const double azimuth = 2 * RBF_PI * (r % AROUND + .5) / AROUND;
			double w[3], sum[RBF_PLANE_CHANNELS] = {0};
			if (fabs(sin(azimuth)) < BESIDE || !direction_at(t, (enum rbf_cross_part)part, ring(r / AROUND), own + azimuth, w))
				continue;
			int known = 1;
			for (int of = 0; of < RBF_CROSS_PARTS && known; of++) {
				double distance, at, f[RBF_PLANE_CHANNELS] = {0};
				if (!(t->reach[of][0][y] > 0))
					continue;
				place_of(t, (enum rbf_cross_part)of, w, &distance, &at);
				known = add_part(t, (enum rbf_cross_part)of, distance, at, f) || of;
				for (int c = 0; c < p->channels; c++)
					sum[c] += f[c] / rbf_falloff_carried(t->from.by[of], w[2], cos(t->from.theta));
			}
			if (!known)
				continue;
			memcpy(in->outgoing + 3 * in->count, w, sizeof w);
			for (int c = 0; c < p->channels; c++)
				in->dsf[in->count * (size_t)p->channels + (size_t)c] = (float)((sum[c] + p->floor[c]) * w[2]);
			in->count++;
			in->guessed++;
		}
	}
}

static int complete(const rbf_cross_scans *p, rbf_incidence *in)
{
	double normal[3];
	rbf_one_plane_only(in, normal);
	const double sine = hypot(in->direction[0], in->direction[1]);
	const size_t room = in->count + RBF_CROSS_PARTS * RINGS * AROUND;
	target *t = malloc(sizeof *t);
	const int failed = rbf_incidence_reserve(in, (size_t)p->channels, room) || !t;
	if (!failed) {
		t->of = p;
		t->from.without = RBF_CROSS_NONE;
		t->from.theta = rbf_theta3(in->direction);
		t->from.azimuth = sine > RBF_CROSS_NORMAL ? atan2(in->direction[1], in->direction[0]) : atan2(-normal[0], normal[1]);
		t->from.by[RBF_CROSS_MIRRORED] = p->by;
		t->from.by[RBF_CROSS_BACK] = RBF_FALLOFF_ANGLES;
		for (int part = 0; part < RBF_CROSS_PARTS; part++) {
			t->from.ellipse[part] = RBF_ROUND;
			set_ellipse(t, (enum rbf_cross_part)part);
		}
		set_reach(t);
		add_rings(t, in);
	}
	free(t);
	return failed ? -1 : 0;
}

int rbf_cross_planes_only(const rbf_measured *measured)
{
	int azimuths = 0;
	double first = 0, normal[3];
	for (size_t b = 0; b < measured->count; b++) {
		const double *d = measured->incidence[b].direction;
		if (!rbf_one_plane_only(&measured->incidence[b], normal) || fabs(rbf_dot3(normal, d)) > BESIDE * hypot(d[0], d[1]) + RBF_CROSS_NORMAL)
			return 0;
		if (hypot(d[0], d[1]) <= RBF_CROSS_NORMAL)
			continue;
		const double azimuth = atan2(d[1], d[0]);
		azimuths += !azimuths || (azimuths == 1 && fabs(sin(azimuth - first)) > RBF_CROSS_SAME);
		first = azimuths == 1 ? azimuth : first;
	}
	return azimuths > 1;
}

int rbf_cross_planes_complete(rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by)
{
	rbf_cross_scans p;
	for (size_t b = 0; b < measured->count; b++) {
		measured->incidence[b].count -= measured->incidence[b].guessed;
		measured->incidence[b].guessed = 0;
	}
	int failed = rbf_cross_begin(measured, plan, by, &p);
	#pragma omp parallel for schedule(dynamic) reduction(|:failed)
	for (int64_t b = 0; b < (int64_t)measured->count; b++)
		failed |= !failed && complete(&p, &measured->incidence[b]) != 0;
	rbf_cross_end(&p);
	return failed ? -1 : 0;
}

/* How far a scan is from what others tell, of all light, both as if it fell off alike all about the middle: those of a group at other polar angles, or, of the
 * opposite azimuth, at the same. */
static void add_difference(const rbf_cross_scans *p, const rbf_cross_scan *s, size_t group, int side, double *difference, double *light)
{
	const int y = (int)rbf_luminance((uint32_t)p->channels);
	const rbf_plane_point *point = s->part[RBF_CROSS_MIRRORED];
	target t = {.of = p, .from = {s->theta, s->azimuth, side > 0 ? s->base : RBF_CROSS_NONE, {p->by, RBF_FALLOFF_ANGLES}, {RBF_ROUND, RBF_ROUND}}};
	for (size_t i = 1; i + 1 < s->count; i++) {
		const double place = point[i].s, z = sqrt(fmax(1 - place * place, 0));
		const double w[3] = {place * cos(s->azimuth), place * sin(s->azimuth), z};
		double distance, azimuth, f[RBF_PLANE_CHANNELS];
		place_of(&t, RBF_CROSS_MIRRORED, w, &distance, &azimuth);
		if (!rbf_cross_at(p, &t.from, group, RBF_CROSS_MIRRORED, distance, cos(azimuth - s->azimuth) > 0 ? side : -side, f))
			continue;
		const double area = fabs(place + sin(s->theta)) * (point[i + 1].s - point[i - 1].s) * z;
		*difference += fabs(f[y] / rbf_falloff_carried(p->by, z, cos(s->theta)) - point[i].f[y]) * area;
		*light += (fmax(point[i].f[y], 0) + p->floor[y]) * area;
	}
}

/* The group at the opposite azimuth; as many as there are if none is. */
static size_t opposite(const rbf_cross_scans *p, size_t group)
{
	size_t g = 0;
	while (g < p->groups && cos(p->group[g].azimuth - p->group[group].azimuth) > -cos(RBF_CROSS_SAME))
		g++;
	return g;
}

int rbf_cross_planes_error(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by, double *error)
{
	rbf_cross_scans p;
	double difference[2] = {0}, light[2] = {0};
	const int failed = rbf_cross_begin(measured, plan, by, &p);
	for (size_t g = 0; g < p.groups && !failed; g++) {
		const size_t other = opposite(&p, g);
		for (size_t n = 0; n < p.group[g].count; n++) {
			const rbf_cross_scan *s = &p.scan[p.group[g].first + n];
			if (s->image)
				continue;
			if (p.group[g].count < 3 || (n && n + 1 < p.group[g].count)) /* between others, if any is */
				add_difference(&p, s, g, 1, &difference[0], &light[0]);
			if (other < p.groups)
				add_difference(&p, s, other, -1, &difference[1], &light[1]);
		}
	}
	*error = 0;
	for (int n = 0; n < 2; n++)
		*error += light[n] > 0 ? difference[n] / light[n] / (1 + n) : 0; /* half way between opposite ones, half of what they differ by */
	rbf_cross_end(&p);
	return failed ? -1 : 0;
}
