/* SPDX-License-Identifier: BSD-3-Clause */
#include "difference.h"
#include "sample.h"

enum { POINTS = 256 };

static double total_mass(const rbf_lobes *l)
{
	double total = 0;
	for (uint32_t i = 0; i < l->count; i++)
		total += l->mass[i];
	return total;
}

/* One of the two: its lobes, and what Lambertian part it has that the other lacks. */
typedef struct light {
	const rbf_lobes *lobes;
	double mass, more;
} light;

/* Mean of |f - g'| / (f + g') over directions drawn from f, those of `where`; *counted: of f, how much that is. back: g' is g as seen by the
 * inverse of turn. */
static double drawn(const light *f, const light *g, const float turn[9], int back, const rbf_compared *where, double *counted)
{
	const rbf_lobes *l = f->lobes;
	const uint32_t y = rbf_luminance(l->channels);
	const double total = f->mass + f->more;
	double sum = 0, running = l->count ? l->mass[0] : 0;
	uint32_t lobe = 0;
	int left_out = 0;
	for (int p = 0; p < POINTS && total > 0; p++) {
		const double at = (p + .5) / POINTS * total, u = fmod(p * .7548776662 + .5, 1), v = fmod(p * .5698402910, 1);
		float centre[3], o[3], image[3], a[3], b[3];
		while (lobe + 1 < l->count && running < at)
			running += l->mass[++lobe];
		if (f->more > 0 && at > f->mass) {
			const double r = sqrt(u);
			o[0] = (float)(r * cos(2 * RBF_PI * v));
			o[1] = (float)(r * sin(2 * RBF_PI * v));
			o[2] = (float)sqrt(1 - u);
		} else {
			rbf_lobe_centre(l, lobe, centre);
			rbf_lobe_draw(centre, rbf_lobe_kappa(l, lobe), u, v, o);
		}
		if (!(o[2] > 0))
			continue;
		for (int n = 0; n < 3; n++)
			image[n] = !turn ? o[n] : back ? turn[n]*o[0] + turn[3 + n]*o[1] + turn[6 + n]*o[2]
			         : turn[3*n]*o[0] + turn[3*n + 1]*o[1] + turn[3*n + 2]*o[2];
		if (where && !where->both(where->user, back ? image : o, back ? o : image)) {
			left_out++;
			continue;
		}
		rbf_lobes_sum(l, o, a);
		rbf_lobes_sum(g->lobes, image, b);
		const double own = (double)a[y] + f->more * (double)o[2] / RBF_PI, other = (double)b[y] + g->more * (double)o[2] / RBF_PI;
		sum += fabs(own - other) / fmax(own + other, 1e-30) / POINTS;
	}
	*counted = 1 - (double)left_out / POINTS;
	return sum;
}

/* Directions are drawn from both, so that what only one of them has counts as well, and no quotient is large. */
float rbf_difference_where(const rbf_lobes *a, const rbf_lobes *b, const float turn[9], float lambertian, float more, const rbf_compared *where)
{
	const light of_a = {a, total_mass(a), fmax(-(double)more, 0)}, of_b = {b, total_mass(b), fmax((double)more, 0)};
	const double part[2] = {of_a.mass + of_a.more, of_b.mass + of_b.more};
	double counted[2];
	const double from_a = drawn(&of_a, &of_b, turn, 0, where, &counted[0]), from_b = drawn(&of_b, &of_a, turn, 1, where, &counted[1]);
	const double mean = .5 * (part[0] * counted[0] + part[1] * counted[1]) + (double)lambertian * (where ? (double)where->share : 1);
	return mean > 0 ? (float)((part[0] * from_a + part[1] * from_b) / mean) : 0;
}

float rbf_difference(const rbf_lobes *a, const rbf_lobes *b, const float turn[9], float lambertian, float more)
{
	return rbf_difference_where(a, b, turn, lambertian, more, NULL);
}
