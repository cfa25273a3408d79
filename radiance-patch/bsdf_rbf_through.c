/* SPDX-License-Identifier: BSD-3-Clause */
/* libbsdfrbf: the view straight through an aBSDF. Answers of queryProjSA that let m_bsdf.c find a peak and conserve energy. */
#include <stdio.h>
#include <stdlib.h>
#include <math.h>
#include "bsdf.h"
#include "bsdf_rbf_part.h"

/*
 * aBSDF (m_bsdf.c, compute_through) looks for a narrow peak straight ahead, -v: it evaluates f on a star of 29 directions
 * spaced by .6 sqrt(minProjSA). Those that stand out are the peak: f times their projected solid angles, added up, goes
 * straight through, and samples closer than the root of the smallest projected solid angle of v are dropped. The others
 * are the surround: their mean, weighted by projected solid angles, replaces f for a light source within
 * 1.8 (sqrt(minProjSA) + sqrt(source)), whose light comes straight through already. That is made for the cells of a tree;
 * for a smooth function the answers of queryProjSA must be chosen so that energy is conserved:
 *   - the area of a peak (file->through) is that of a disk of RBF_PEAK sigma about -v; it holds 96 % of a Gaussian;
 *   - minProjSA is the smallest such area, which puts the probes 1.5 sigma apart;
 *   - each probe of the peak gets the one value with which their sum is the energy in the disk;
 *   - two probes of the surround get nearly all its weight, so that its mean stands for the energy between the disk and
 *     the limit for sources.
 * Where there is no narrow peak, the answer is more than the 1.5 minProjSA that m_bsdf.c accepts.
 */
#define RBF_PEAK	2.5	/* radius of a peak, in sigmas */
#define RBF_NARROW	.025	/* largest sigma of a peak, radians: more is haze, not a view */
#define RBF_CONTRAST	.1	/* f at four sigmas, relative to the peak, must be below this */
#define RBF_PROBES	29
#define RBF_SUN		6.8e-5	/* solid angle of the source that a view through matters most for */

/* Luminance of f without the Lambertian part. */
static double
rbf_scatter(const RBFfile *file, const RREAL *v1, const RREAL *v2)
{
	float	incident[3], outgoing[3], value[3];

	VCOPY(incident, v1);
	VCOPY(outgoing, v2);
	bsdfrbf_eval_scatter(file->model, incident, outgoing, value);
	return value[file->channels == 3];
}

/* f at an angle r to both sides of -v, across the plane of incidence. */
static double
rbf_beside(const RBFfile *file, const RREAL *v, double r)
{
	const double	l = sqrt(v[0]*v[0] + v[1]*v[1]);
	FVECT		out;
	double		x = 1, y = 0, sum = 0;
	int		i;

	if (l > 1e-6) {
		x = -v[1]/l; y = v[0]/l;
	}
	for (i = -1; i <= 1; i += 2) {
		out[0] = -v[0] + i*r*x;
		out[1] = -v[1] + i*r*y;
		out[2] = -v[2];
		normalize(out);
		sum += .5*rbf_scatter(file, v, out);
	}
	return sum;
}

/* Area of the through peak at incidence v, or 0. */
static double
rbf_peak_area(const RBFfile *file, const RREAL *v)
{
	const double	peak = rbf_beside(file, v, 0.), target = peak*exp(-.5);	/* f at one sigma */
	double		low = .001, high = RBF_NARROW, sigma = 0;
	int		i;

	if (!(peak > 0) || rbf_beside(file, v, high) > target)
		return 0;
	for (i = 0; i < 9; i++) {			/* to .5 % */
		sigma = sqrt(low*high);
		if (rbf_beside(file, v, sigma) > target)
			low = sigma;
		else
			high = sigma;
	}
	if (rbf_beside(file, v, 4*sigma) > RBF_CONTRAST*peak)
		return 0;
	return RBF_PEAK*RBF_PEAK*sigma*sigma;
}

/* Fills the table of through peaks. */
void
rbf_find_through(RBFfile *file)
{
	FVECT	v;
	double	theta, phi;
	int	side, i, j;

	file->any_through = 0;
	for (side = 0; side < 2; side++)
		for (i = 0; i < RBF_THETAS; i++)
			for (j = 0; j < RBF_PHIS; j++) {
				theta = .5*M_PI * (i + .5) / RBF_THETAS;
				phi = 2*M_PI * (j + .5) / RBF_PHIS;
				v[0] = sin(theta)*cos(phi);
				v[1] = sin(theta)*sin(phi);
				v[2] = side ? cos(theta) : -cos(theta);
				file->through[side][i][j] = rbf_peak_area(file, v);
				file->any_through |= file->through[side][i][j] > 0;
			}
}

/* Entry of the table. */
double
rbf_through(const RBFfile *file, const RREAL *v)
{
	int	i, j;

	if (!file->any_through)
		return 0;
	i = acos(fabs(v[2]) < 1 ? fabs(v[2]) : 1.) * (2/M_PI*RBF_THETAS);
	j = (atan2(v[1], v[0]) + M_PI) * (RBF_PHIS/(2*M_PI)) + RBF_PHIS/2;
	return file->through[v[2] > 0][i < RBF_THETAS ? i : RBF_THETAS-1][j % RBF_PHIS];
}

/* Abscissas in (-1, 1) and weights of the eight-point Gauss-Legendre rule. */
#define RBF_GAUSS	8
static const double	rbf_gauss[RBF_GAUSS][2] = {
	{-.9602898564975363, .1012285362903763}, {-.7966664774136267, .2223810344533745},
	{-.5255324099163290, .3137066458778873}, {-.1834346424956498, .3626837833783620},
	{.1834346424956498, .3626837833783620}, {.5255324099163290, .3137066458778873},
	{.7966664774136267, .2223810344533745}, {.9602898564975363, .1012285362903763}
};
#define RBF_TURNS	12

/* Sum of weights times f without the Lambertian part at -v + (x, y) of each of n points. */
static double
rbf_weighted(const RBFfile *file, const RREAL *v, int n, const double (*point)[3], double diffuse)
{
	float	incident[3], out[RBF_GAUSS*RBF_TURNS][3], value[RBF_GAUSS*RBF_TURNS*3];
	double	weight[RBF_GAUSS*RBF_TURNS], x, y, z2, sum = 0;
	int	i, count = 0;

	for (i = 0; i < n; i++) {
		x = point[i][0] - v[0]; y = point[i][1] - v[1];
		if ((z2 = 1 - x*x - y*y) <= 0)
			continue;
		out[count][0] = x; out[count][1] = y;
		out[count][2] = v[2] > 0 ? -sqrt(z2) : sqrt(z2);
		weight[count++] = point[i][2];
	}
	if (!count)
		return 0;
	VCOPY(incident, v);
	bsdfrbf_eval_exitant(file->model, incident, count, out[0], value);
	for (i = 0; i < count; i++)
		sum += weight[i]*(value[file->channels*i + (file->channels == 3)] - diffuse);
	return sum;
}

/* Energy in the disk of the given area about -v: the integral of f over projected solid angle, which is plain area in
 * the (x, y) of directions. A peak is an ellipse there, cos(theta) times narrower in the plane of incidence. */
static double
rbf_disk_energy(const RBFfile *file, const RREAL *v, double radius2, double diffuse)
{
	const double	radius = sqrt(radius2), l = sqrt(v[0]*v[0] + v[1]*v[1]);
	double		ux = 1, uy = 0, a, b, wide, high, point[RBF_GAUSS*RBF_GAUSS][3];
	int		i, j, n = 0;

	if (l > 1e-6) {
		ux = v[0]/l; uy = v[1]/l;
	}
	wide = 4/RBF_PEAK*radius*fabs(v[2]);
	if (wide > radius) wide = radius;
	for (i = 0; i < RBF_GAUSS; i++) {
		a = wide*rbf_gauss[i][0];
		high = sqrt(radius2 - a*a);
		for (j = 0; j < RBF_GAUSS; j++, n++) {
			b = high*rbf_gauss[j][0];
			point[n][0] = a*ux - b*uy;
			point[n][1] = a*uy + b*ux;
			point[n][2] = wide*rbf_gauss[i][1] * high*rbf_gauss[j][1];
		}
	}
	return rbf_weighted(file, v, n, (const double (*)[3])point, diffuse);
}

static int
rbf_descending(const void *a, const void *b)
{
	const double	d = *(const double *)b - *(const double *)a;

	return (d > 0) - (d < 0);
}

/* Mean of f over the disk within which a source is taken to come straight through, without the disk of the peak. */
static double
rbf_surround(const RBFfile *file, const RREAL *v, double radius2, double probe, double diffuse)
{
	const double	inner = sqrt(radius2);
	const double	outer = sqrt(10/M_PI) * (sqrt(probe) + sqrt(RBF_SUN*fabs(v[2])));
	double		r, point[RBF_GAUSS*RBF_TURNS][3];
	int		i, j, n = 0;

	if (outer <= inner)
		return 0;
	for (i = 0; i < RBF_GAUSS; i++)
		for (j = 0; j < RBF_TURNS; j++, n++) {
			r = inner + .5*(outer - inner)*(1 + rbf_gauss[i][0]);
			point[n][0] = r*cos(j*(2*M_PI/RBF_TURNS));
			point[n][1] = r*sin(j*(2*M_PI/RBF_TURNS));
			point[n][2] = r*rbf_gauss[i][1];
		}
	return rbf_weighted(file, v, n, (const double (*)[3])point, diffuse) * (outer - inner) / (RBF_TURNS*outer*outer);
}

/* Works out the answers for the probes at an incidence with a peak. */
static void
rbf_set_probes(RBFpart *part, const RREAL *v, double radius2)
{
	static const float	offset[5] = {0, 0.6f, 1.2f, 1.8f, 2.4f};
	const double		spacing = sqrt(part->probe), diffuse = part->diffuse[v[2] > 0];
	double			f[RBF_PROBES], sum = 0, peak = 0, mean, share;
	FVECT			out;
	int			ring, x, y, n = 0, used = 0, first = 0, i;

	for (ring = 0; ring < 5; ring++)
		for (x = -1; x <= 1; x++)
			for (y = -1; y <= 1; y++) {
				if (ring ? (!x & !y) | (ring == 4 && x && y) : x | y)
					continue;
				out[0] = -v[0] + x*(double)offset[ring]*spacing;
				out[1] = -v[1] + y*(double)offset[ring]*spacing;
				out[2] = -v[2];
				normalize(out);
				f[n++] = rbf_seen(part, v, out);
			}
	qsort(f, n, sizeof(f[0]), rbf_descending);
	for (i = 0; i < n && sum <= 8*f[i]*used; i++) {	/* the peak ends at an eighth of its mean */
		first = i + 1;
		if (i && f[i] == f[i-1])
			continue;			/* equal values count once */
		sum += f[i];
		peak += f[i] - diffuse;
		used++;
	}
	VCOPY(part->seen, v);
	part->peak_f = f[0];
	part->peak_psa = 0;
	part->surround_psa[0] = part->surround_psa[1] = 0;
	if ((peak <= 0) | (first >= n))
		return;					/* m_bsdf.c will find no surround */
	part->peak_f = f[first-1];
	part->peak_psa = rbf_disk_energy(part->file, v, radius2, diffuse) / peak;
	mean = diffuse + rbf_surround(part->file, v, radius2, part->probe, diffuse);
	for (i = first; i < n-2 && f[i+1] >= mean; i++)
		;
	if (i > n-2)
		i = n-2 < first ? first : n-2;
	part->surround_f[0] = f[i];
	part->surround_f[1] = f[i+1 < n ? i+1 : i];
	share = part->surround_f[0] > part->surround_f[1] ?
			(mean - part->surround_f[1]) / (part->surround_f[0] - part->surround_f[1]) : 1;
	if (share < 0) share = 0;
	if (share > 1) share = 1;
	part->surround_psa[0] = 1e4*part->peak_psa*share;
	part->surround_psa[1] = 1e4*part->peak_psa*(1 - share);
}

/* Answer of queryProjSA for v2 near -v1; smallest: that of the library. */
double
rbf_through_psa(RBFpart *part, const RREAL *v1, const RREAL *v2, double smallest)
{
	const double	radius2 = rbf_through(part->file, v1);
	double		f, psa = 0;
	int		i;

	if (radius2 <= 0)
		return smallest > 2*part->probe ? smallest : 2*part->probe;
	if ((v1[0] != part->seen[0]) | (v1[1] != part->seen[1]) | (v1[2] != part->seen[2]))
		rbf_set_probes(part, v1, radius2);
	f = rbf_seen(part, v1, v2);
	if (f >= (1 - 1e-6)*part->peak_f)
		psa = part->peak_psa;
	else
		for (i = 0; i < 2; i++)
			if (fabs(f - part->surround_f[i]) <= 1e-6*f)
				psa += part->surround_psa[i];
	return psa > 0 ? psa : smallest;
}
