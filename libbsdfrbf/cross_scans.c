/* SPDX-License-Identifier: BSD-3-Clause */
#include "cross_scans.h"
#include "model.h"
#include "one_plane.h"
#include "vector3.h"

#include <stdlib.h>
#include <string.h>

enum { OPS = 4 };
static int by_azimuth(const void *a, const void *b)
{
	const rbf_cross_scan *s = a, *t = b;
	return s->azimuth > t->azimuth ? 1 : s->azimuth < t->azimuth ? -1 : (s->base > t->base) - (s->base < t->base);
}

static int by_theta(const void *a, const void *b)
{
	const rbf_cross_scan *s = a, *t = b;
	return s->theta > t->theta ? 1 : s->theta < t->theta ? -1 : by_azimuth(a, b);
}

/* What a scan shows at a distance to one side: to 1 from its middle towards the source, to -1 away from it. 0: nothing is known. */
static int scan_at(const rbf_cross_scans *p, const rbf_cross_scan *s, enum rbf_cross_part part, enum rbf_falloff by, double distance, int side, double f[RBF_PLANE_CHANNELS])
{
	const double middle = part == RBF_CROSS_BACK ? s->theta : -s->theta;
	const double place = rbf_falloff_along(by, middle, distance, side);
	for (int c = 0; c < p->channels; c++)
		f[c] = 0;
	if (!s->part[part]) /* nothing goes there, as far as was measured */
		return fabs(place) < 1;
	if (!rbf_plane_at(s->part[part], s->count, p->channels, place, f))
		return 0;
	const double times = rbf_falloff_carried(by, sqrt(fmax(1 - place * place, 0)), cos(s->theta));
	for (int c = 0; c < p->channels; c++)
		f[c] *= times;
	return 1;
}

int rbf_cross_at(const rbf_cross_scans *p, const rbf_cross_source *t, size_t which, enum rbf_cross_part part, double distance, int side,
	double f[RBF_PLANE_CHANNELS])
{
	const rbf_cross_group *g = &p->group[which];
	double times;
	rbf_ellipse_on(&t->ellipse[part], side > 0 ? g->azimuth : g->azimuth + RBF_PI, &times);
	distance /= times;
	const rbf_cross_scan *s = p->scan + g->first, *low = NULL, *top = NULL;
	for (size_t n = 0; n < g->count; n++) {
		low = s[n].base != t->without && s[n].theta <= t->theta ? &s[n] : low;
		top = s[n].base != t->without && s[n].theta >= t->theta && !top ? &s[n] : top;
	}
	low = low ? low : top;
	top = top ? top : low;
	if (!low)
		return 0;
	double a[RBF_PLANE_CHANNELS], b[RBF_PLANE_CHANNELS];
	const int known_low = scan_at(p, low, part, t->by[part], distance, side, a), known_top = scan_at(p, top, part, t->by[part], distance, side, b);
	const double wide = top->theta - low->theta;
	double share = wide > 0 ? (t->theta - low->theta) / wide : 0;
	share = known_low && known_top ? share : known_top;
	for (int c = 0; c < p->channels; c++)
		f[c] = fmax((1 - share) * a[c] + share * b[c], 0);
	return known_low || known_top;
}

/* Samples of an incidence in its plane, and which of them go back. half: of normal incidence, the one or the other, towards which azimuths are counted. */
static int make_scan(const rbf_cross_scans *p, const rbf_incidence *in, size_t base, int half, rbf_cross_scan *s)
{
	const double sine = hypot(in->direction[0], in->direction[1]);
	double normal[3], place[RBF_PLANE_PEAKS];
	if (!rbf_one_plane_only(in, normal))
		return 0;
	const double length = hypot(normal[0], normal[1]);
	double along[2] = {normal[1] / length, -normal[0] / length};
	const int turn = sine > RBF_CROSS_NORMAL ? in->direction[0] * along[0] + in->direction[1] * along[1] < 0 : half;
	along[0] = turn ? -along[0] : along[0];
	along[1] = turn ? -along[1] : along[1];
	rbf_plane_point *all = malloc(in->count * sizeof *all), *row = malloc((RBF_PLANE_PEAKS + 1) * in->count * sizeof *row);
	if (!all || !row) {
		free(all);
		free(row);
		return -1;
	}
	*s = (rbf_cross_scan){.azimuth = rbf_azimuth(sine > RBF_CROSS_NORMAL ? atan2(in->direction[1], in->direction[0]) : atan2(along[1], along[0])), .theta = rbf_theta3(in->direction),
		.base = base, .part = {all}};
	const rbf_incidence measured = {.count = in->count - in->guessed, .outgoing = in->outgoing, .dsf = in->dsf};
	s->count = rbf_plane_points(&measured, p->channels, normal, along, all);
	for (size_t i = 0; i < s->count; i++)
		for (int c = 0; c < p->channels; c++)
			all[i].f[c] -= p->floor[c];
	memcpy(row, all, s->count * sizeof *all);
	const int peaks = rbf_plane_peaks(row, s->count, p->channels, place);
	for (int k = 0; k < peaks; k++) {
		if (p->transmits || !rbf_plane_goes_back(place[k], sine))
			continue;
		if (!s->part[RBF_CROSS_BACK] && !(s->part[RBF_CROSS_BACK] = calloc(s->count, sizeof *all))) {
			free(row);
			return -1;
		}
		for (size_t i = 0; i < s->count; i++) {
			const rbf_plane_point *own = row + (size_t)k * s->count + i;
			s->part[RBF_CROSS_BACK][i].s = own->s;
			for (int c = 0; c < p->channels; c++) {
				s->part[RBF_CROSS_BACK][i].f[c] += own->f[c];
				all[i].f[c] -= own->f[c];
			}
		}
	}
	free(row);
	return 0;
}

/* Adds a scan and its mirror images, but for those that are there; none, if it is there itself. Returns whether it was not. */
static int add_images(rbf_cross_scans *p, const rbf_cross_scan *own, rbf_symmetry symmetry)
{
	int op[OPS];
	const int ops = rbf_symmetry_ops(symmetry, op);
	int added = 0;
	for (int k = 0; k < ops; k++) {
		rbf_cross_scan image = *own;
		image.azimuth = op[k] & RBF_OP_X ? RBF_PI - image.azimuth : image.azimuth;
		image.azimuth = rbf_azimuth(op[k] & RBF_OP_Y ? -image.azimuth : image.azimuth);
		image.image = k > 0;
		int same = 0;
		for (size_t n = 0; n < p->scans; n++)
			same |= p->scan[n].base == own->base && cos(p->scan[n].azimuth - image.azimuth) > cos(RBF_CROSS_SAME);
		if (same && !k)
			break;
		if (same)
			continue;
		p->scan[p->scans++] = image;
		added = 1;
	}
	return added;
}

static void make_groups(rbf_cross_scans *p)
{
	qsort(p->scan, p->scans, sizeof *p->scan, by_azimuth);
	for (size_t n = 0; n < p->scans; n++) { /* just below a full turn is none */
		const double over = p->scan[n].azimuth - 2 * RBF_PI;
		p->scan[n].azimuth = over > -RBF_CROSS_SAME ? over : p->scan[n].azimuth;
	}
	qsort(p->scan, p->scans, sizeof *p->scan, by_azimuth);
	for (size_t n = 0; n < p->scans; n++) {
		if (!n || p->scan[n].azimuth - p->group[p->groups - 1].azimuth > RBF_CROSS_SAME)
			p->group[p->groups++] = (rbf_cross_group){.azimuth = p->scan[n].azimuth, .first = n};
		p->group[p->groups - 1].count++;
	}
	for (size_t g = 0; g < p->groups; g++)
		qsort(p->scan + p->group[g].first, p->group[g].count, sizeof *p->scan, by_theta);
}

void rbf_cross_end(rbf_cross_scans *p)
{
	for (size_t n = 0; n < p->scans; n++)
		for (int part = 0; part < RBF_CROSS_PARTS && !p->scan[n].image; part++)
			free(p->scan[n].part[part]);
	free(p->scan);
	free(p->group);
}

int rbf_cross_begin(const rbf_measured *measured, const rbf_cross_plan *plan, enum rbf_falloff by, rbf_cross_scans *p)
{
	*p = (rbf_cross_scans){.channels = plan->channels, .by = by, .transmits = plan->transmits};
	p->scan = malloc((2 * OPS * measured->count + 1) * sizeof *p->scan);
	p->group = malloc((2 * OPS * measured->count + 1) * sizeof *p->group);
	int failed = !p->scan || !p->group;
	for (int c = 0; c < p->channels; c++)
		p->floor[c] = (double)plan->lambertian[c] / RBF_PI;
	for (size_t b = 0; b < measured->count && !failed; b++) {
		const rbf_incidence *in = &measured->incidence[b];
		for (int half = 0; half < (hypot(in->direction[0], in->direction[1]) > RBF_CROSS_NORMAL ? 1 : 2) && !failed; half++) {
			rbf_cross_scan own = {0};
			failed = make_scan(p, in, b, half, &own) != 0;
			if (!failed && own.part[RBF_CROSS_MIRRORED] && add_images(p, &own, plan->symmetry))
				continue;
			for (int part = 0; part < RBF_CROSS_PARTS; part++)
				free(own.part[part]);
		}
	}
	if (!failed)
		make_groups(p);
	return failed ? -1 : 0;
}
