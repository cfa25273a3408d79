/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Radiance evaluates a recorded interpolant (.rbf file) directly: this file is compiled inside a Radiance source tree
 * and answers the five calls of an SDFunc table (common/bsdf.h) from libbsdfrbf.
 *
 * What Radiance expects, and how it is met
 *   Values    The Lambertian part goes into the SDData; getBSDFs answers the rest, f in sr^-1.
 *   Samples   SDsampComponent() weighs a sample with cTotal and nothing else, so that samples must be distributed as
 *             f cos / DHR: bsdfrbf_sample() does that, and cTotal is bsdfrbf_dhr_scatter().
 *   Sides     The renderer may swap its two vectors, and asks tf where tb is missing; the library answers by reciprocity.
 *   Colour    Coefficients are luminances of three fixed primaries, see rbf_primary.
 *   Through   aBSDF sends one ray straight through for a peak that it finds by probing; see rbf_find_through().
 *   Caches    SDfreeCumulativeCache() calls free() on cdList, and loadBSDF() keeps everything: cdList stays NULL, and
 *             getCDist() answers from a small ring.
 *   Forks     Renderers fork (-n); a model is immutable and nothing here opens a thread.
 *
 * Written in C90 with declarations first, as Radiance's own build asks of its files.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include "bsdf.h"
#include "bsdf_rbf.h"
#include "bsdfrbf.h"

#define RBF_DETAIL	256	/* size of SDerrorDetail, bsdf.c */
#define RBF_PRUNE	.001	/* components below this are dropped, as SDloadFile() does with its own */
#define RBF_RING	16	/* states that live at once: SDsampBSDF() holds one per component of both sides */

#if defined(__GNUC__)
#define RBF_THREAD	__thread
#else
#define RBF_THREAD
#endif

#define RBF_THETAS	16	/* cells of the table of through peaks */
#define RBF_PHIS	24

/* One file: the components share its model, and the last one to go closes it. */
typedef struct {
	bsdfrbf_model	*model;
	int		users;
	int		channels;	/* 1 or 3 */
	int		any_through;
	float		through[2][RBF_THETAS][RBF_PHIS];	/* see rbf_find_through(); 0: no peak; [1]: front */
} RBFfile;

/* What SDComponent.dist points to. */
typedef struct {
	RBFfile		*file;
	int		front;		/* incident side, for reflection */
	int		transmit;
	double		probe;		/* SDSpectralDF.minProjSA, from which m_bsdf.c spaces its probes */
	double		diffuse[2];	/* Lambertian f (luminance) for incidence from the back, front */
	RREAL		seen[3];	/* incidence that the rest belongs to */
	double		peak_f, peak_psa;	/* probes of the peak: smallest f, answer for each */
	double		surround_f[2], surround_psa[2];	/* the two probes that stand for the surround */
} RBFpart;

/* State between getCDist and sampCDist. */
typedef struct {
	SD_CDIST_BASE(SDCDst_s);	/* first, as Radiance asks; next stays NULL */
	const RBFpart	*part;
	float		incident[3];
} RBFstate;

static RBF_THREAD RBFstate	rbf_ring[RBF_RING];
static RBF_THREAD unsigned	rbf_ring_next;

/*
 * Chromaticities (x, y) of the primaries. Radiance mixes colours by chromaticity and luminance, so that a primary needs
 * some luminance: X and Z themselves (y = 0) will not do. This triangle holds every colour whose y is at least
 * RBF_PRIMARY_Y (the spectrum locus goes down to .005), so that coefficients are never negative.
 */
#define RBF_PRIMARY_Y	.001
static const double	rbf_primary[3][2] = {
	{1. - RBF_PRIMARY_Y, RBF_PRIMARY_Y}, {0., 1.}, {0., RBF_PRIMARY_Y}
};

/* Luminances of the primaries that add up to the given colour. All but black get a positive sum. */
static void
rbf_coefficients(float coef[3], const float xyz[3])
{
	const double	ratio = RBF_PRIMARY_Y / (1. - RBF_PRIMARY_Y);
	double		x = xyz[0] > 0 ? ratio*xyz[0] : 0;
	double		z = xyz[2] > 0 ? ratio*xyz[2] : 0;
	double		y = xyz[1];

	if (!(y > 0))			/* black, but SDsampComponent() still asks for its colour: grey */
		y = x = z = 1e-30;
	else if (x + z > .9*y) {	/* no real colour; noise can make one */
		double	s = .9*y / (x + z);
		x *= s; z *= s;
	}
	coef[0] = x;
	coef[1] = y - x - z;
	coef[2] = z;
}

/* Radiance's value with colour for X, Y, Z (or Y alone). */
static void
rbf_value(SDValue *value, const float *xyz, int channels)
{
	double	sum;

	value->spec = c_dfcolor;
	value->cieY = xyz[channels == 3];
	if (!(value->cieY > 0))
		value->cieY = 0;
	else if (channels == 3) {
		sum = (double)xyz[0] + xyz[1] + xyz[2];
		c_cset(&value->spec, xyz[0]/sum, xyz[1]/sum);
	}
}

static SDError
rbf_error(bsdfrbf_status status, const char *message)
{
	SDerrorDetail[0] = '\0';
	strncat(SDerrorDetail, message, RBF_DETAIL-1);
	switch (status) {
	case BSDFRBF_OK:
		return SDEnone;
	case BSDFRBF_ERR_MEMORY:
		return SDEmemory;
	case BSDFRBF_ERR_IO:
		return SDEfile;
	case BSDFRBF_ERR_FORMAT:
	case BSDFRBF_ERR_SYNTAX:
		return SDEformat;
	case BSDFRBF_ERR_ARGUMENT:
		return SDEargument;
	case BSDFRBF_ERR_DATA:
		return SDEdata;
	case BSDFRBF_ERR_VERSION:
	case BSDFRBF_ERR_UNSUPPORTED:
		return SDEsupport;
	case BSDFRBF_ERR_INTERNAL:
		return SDEinternal;
	default:
		return SDEunknown;
	}
}

/* Does the part answer for this pair? (z = 0 counts as the back, as in bsdf.c.) */
static int
rbf_serves(const RBFpart *part, const FVECT v1, const RREAL *v2)
{
	const int	front = v1[2] > 0;

	if (part->transmit)
		return v2 == NULL || front != (v2[2] > 0);
	return front == part->front && (v2 == NULL || front == (v2[2] > 0));
}

/* SDFunc.getBSDFs */
static int
rbf_get_bsdfs(float coef[SDmaxCh], const FVECT inVec, const FVECT outVec, SDComponent *sdc)
{
	const RBFpart	*part = (const RBFpart *)sdc->dist;
	float		incident[3], outgoing[3], value[3];

	if (part == NULL || !rbf_serves(part, inVec, outVec))
		return 0;
	VCOPY(incident, inVec);
	VCOPY(outgoing, outVec);
	bsdfrbf_eval_scatter(part->file->model, incident, outgoing, value);
	if (part->file->channels == 1)
		coef[0] = value[0];
	else
		rbf_coefficients(coef, value);
	return part->file->channels;
}

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
static void
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
static double
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
				f[n++] = diffuse + rbf_scatter(part->file, v, out);
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
static double
rbf_through_psa(RBFpart *part, const RREAL *v1, const RREAL *v2, double smallest)
{
	const double	radius2 = rbf_through(part->file, v1);
	double		f, psa = 0;
	int		i;

	if (radius2 <= 0)
		return smallest > 2*part->probe ? smallest : 2*part->probe;
	if ((v1[0] != part->seen[0]) | (v1[1] != part->seen[1]) | (v1[2] != part->seen[2]))
		rbf_set_probes(part, v1, radius2);
	f = part->diffuse[v1[2] > 0] + rbf_scatter(part->file, v1, v2);
	if (f >= (1 - 1e-6)*part->peak_f)
		psa = part->peak_psa;
	else
		for (i = 0; i < 2; i++)
			if (fabs(f - part->surround_f[i]) <= 1e-6*f)
				psa += part->surround_psa[i];
	return psa > 0 ? psa : smallest;
}

/* SDFunc.queryProjSA */
static SDError
rbf_query_proj_sa(double *psa, const FVECT v1, const RREAL *v2, int qflags, SDComponent *sdc)
{
	RBFpart		*part = sdc == NULL ? NULL : (RBFpart *)sdc->dist;
	float		incident[3], outgoing[3], low, high;
	double		smallest, largest, dx, dy;

	if ((psa == NULL) | (v1 == NULL) | (part == NULL))
		return SDEargument;
	if (!rbf_serves(part, v1, v2)) {
		strcpy(SDerrorDetail, "Vectors on the wrong side in rbf_query_proj_sa");
		return SDEinternal;
	}
	VCOPY(incident, v1);
	if (v2 != NULL) {
		VCOPY(outgoing, v2);
	}
	bsdfrbf_resolution(part->file->model, incident, v2 == NULL ? NULL : outgoing, part->transmit,
				&low, &high);
	smallest = low; largest = high;
	if (v2 == NULL) {
		if (smallest < (dx = rbf_through(part->file, v1)))
			smallest = dx;
	} else if (part->transmit) {
		dx = v1[0] + v2[0]; dy = v1[1] + v2[1];
		if (dx*dx + dy*dy <= 6.6*part->probe)	/* the farthest probe is at 2.55 roots */
			smallest = rbf_through_psa(part, v1, v2, smallest);
	}
	if (largest < smallest)
		largest = smallest;
	switch (qflags) {
	case SDqueryVal:
		psa[0] = smallest;
		break;
	case SDqueryMax:
		if (largest > psa[0])
			psa[0] = largest;
		break;
	case SDqueryMin+SDqueryMax:
		if (largest > psa[1])
			psa[1] = largest;
		/* fall through */
	case SDqueryMin:
		if ((smallest > 0) & (smallest < psa[0]))
			psa[0] = smallest;
		break;
	}
	return SDEnone;
}

/* SDFunc.getCDist */
static const SDCDst *
rbf_get_cdist(const FVECT inVec, SDComponent *sdc)
{
	const RBFpart	*part = sdc == NULL ? NULL : (const RBFpart *)sdc->dist;
	RBFstate	*state;
	float		value[3];

	if ((inVec == NULL) | (part == NULL) || !rbf_serves(part, inVec, NULL))
		return NULL;
	state = &rbf_ring[rbf_ring_next++ % RBF_RING];
	state->next = NULL;
	state->part = part;
	VCOPY(state->incident, inVec);
	bsdfrbf_dhr_scatter(part->file->model, state->incident, part->transmit, value);
	state->cTotal = value[part->file->channels == 3];
	return (const SDCDst *)state;
}

/* SDFunc.sampCDist */
static SDError
rbf_samp_cdist(FVECT ioVec, double randX, const SDCDst *cdp)
{
	const RBFstate	*state = (const RBFstate *)cdp;
	float		outgoing[3];

	if ((ioVec == NULL) | (state == NULL))
		return SDEargument;
	if (state->part == NULL)		/* SDemptyCD has nothing behind it */
		return SDEinternal;
	if (!(randX >= 0)) randX = 0;
	else if (randX >= 1.) randX = 1. - 1e-9;
	if (!bsdfrbf_sample(state->part->file->model, state->incident, state->part->transmit, randX, outgoing)) {
		/* DHR says there is energy: keep it, in the direction of the specular beam */
		outgoing[0] = -state->incident[0];
		outgoing[1] = -state->incident[1];
		outgoing[2] = state->part->transmit ? -state->incident[2] : state->incident[2];
	}
	VCOPY(ioVec, outgoing);
	return SDEnone;
}

/* SDFunc.freeSC */
static void
rbf_free_sc(void *dist)
{
	RBFpart	*part = (RBFpart *)dist;

	if (part == NULL)
		return;
	if (--part->file->users == 0) {
		bsdfrbf_close(part->file->model);
		free(part->file);
	}
	free(part);
}

static const SDFunc	SDhandleRbf = {
	&rbf_get_bsdfs,
	&rbf_query_proj_sa,
	&rbf_get_cdist,
	&rbf_samp_cdist,
	&rbf_free_sc
};

/* Finds the largest DHR and the smallest projected solid angle. A single transmission (both) answers for both incident
 * sides; its DHR is looked at from the measured side only, since the other one takes milliseconds each and differs little. */
static void
rbf_extrema(SDSpectralDF *df, const RBFpart *part, int both)
{
	const RBFfile	*file = part->file;
	float		incident[3], value[3], smallest, largest;
	double		theta, phi, peak = 0;
	int		i, j, side, front;

	df->maxHemi = 0;
	df->minProjSA = M_PI;
	for (side = 0; side < 1 + both; side++) {
		front = part->front ^ side;
		for (i = 0; i < 2*RBF_THETAS; i++)
			for (j = 0; j < (i ? 2*RBF_PHIS : 1); j++) {
				theta = .5*M_PI * i / (2*RBF_THETAS);
				phi = 2*M_PI * j / (2*RBF_PHIS);
				incident[0] = sin(theta) * cos(phi);
				incident[1] = sin(theta) * sin(phi);
				incident[2] = front ? cos(theta) : -cos(theta);
				if (!side) {
					bsdfrbf_dhr_scatter(file->model, incident, part->transmit, value);
					if (value[file->channels == 3] > df->maxHemi)
						df->maxHemi = value[file->channels == 3];
				}
				if (i % 4 || j % 4)
					continue;
				bsdfrbf_resolution(file->model, incident, NULL, part->transmit, &smallest, &largest);
				if ((smallest > 0) & (smallest < df->minProjSA))
					df->minProjSA = smallest;
			}
		for (i = 0; part->transmit && i < RBF_THETAS; i++)
			for (j = 0; j < RBF_PHIS; j++)
				if (file->through[front][i][j] > 0 && (peak == 0 || file->through[front][i][j] < peak))
					peak = file->through[front][i][j];
	}
	if (peak > 0)
		df->minProjSA = peak;
}

/* Makes one component; *dfp stays NULL if it would be too small to matter. */
static SDError
rbf_component(const SDData *sd, SDSpectralDF **dfp, RBFfile *file, bsdfrbf_component which)
{
	const int	transmit = (which == BSDFRBF_TF) | (which == BSDFRBF_TB);
	SDSpectralDF	*df;
	RBFpart		*part;
	int		i;

	if ((df = SDnewSpectralDF(1)) == NULL)
		return SDEmemory;
	if ((part = (RBFpart *)malloc(sizeof(RBFpart))) == NULL) {
		free(df);
		strcpy(SDerrorDetail, "Out of memory in rbf_component");
		return SDEmemory;
	}
	part->file = file;
	file->users++;
	part->front = (which == BSDFRBF_RF) | (which == BSDFRBF_TF);
	part->transmit = transmit;
	part->diffuse[0] = sd->tLambBack.cieY * (1./M_PI);	/* as SDevalBSDF() does */
	part->diffuse[1] = sd->tLambFront.cieY * (1./M_PI);
	part->seen[0] = part->seen[1] = part->seen[2] = 0;
	df->comp[0].func = &SDhandleRbf;
	df->comp[0].dist = part;
	df->comp[0].cspec[0] = c_dfcolor;
	for (i = 0; file->channels == 3 && i < 3; i++)	/* bsdf2klems tells colour by cspec[2].flags */
		c_cset(&df->comp[0].cspec[i], rbf_primary[i][0], rbf_primary[i][1]);
					/* a single transmission answers for both sides */
	rbf_extrema(df, part, transmit && !bsdfrbf_has(file->model, which == BSDFRBF_TF ? BSDFRBF_TB : BSDFRBF_TF));
	part->probe = df->minProjSA;
	if (df->maxHemi <= RBF_PRUNE)
		SDfreeSpectralDF(df);
	else
		*dfp = df;
	return SDEnone;
}

/* Lambertian part; a transmission that was not measured is that of the other side. */
static void
rbf_diffuse(SDValue *value, const bsdfrbf_model *model, bsdfrbf_component which, bsdfrbf_component other)
{
	float	xyz[3];

	xyz[0] = xyz[1] = xyz[2] = 0;
	if (bsdfrbf_has(model, which))
		bsdfrbf_lambertian(model, which, xyz);
	else if (other != which && bsdfrbf_has(model, other))
		bsdfrbf_lambertian(model, other, xyz);
	rbf_value(value, xyz, bsdfrbf_channels(model));
}

int
SDisRbf(const char *fname)
{
	return bsdfrbf_is_rbf(fname);
}

SDError
SDloadRbf(SDData *sd, const char *fname)
{
	bsdfrbf_context	*context;
	bsdfrbf_status	status;
	RBFfile		*file;
	SDSpectralDF	**slot[4];
	SDError		ec = SDEnone;
	int		i;

	file = (RBFfile *)malloc(sizeof(RBFfile));
	context = bsdfrbf_context_new();
	if ((file == NULL) | (context == NULL)) {
		free(file);
		bsdfrbf_context_free(context);
		return rbf_error(BSDFRBF_ERR_MEMORY, "Out of memory in SDloadRbf");
	}
	status = bsdfrbf_open(context, fname, &file->model);
	if (status != BSDFRBF_OK) {
		ec = rbf_error(status, bsdfrbf_message(context));
		bsdfrbf_context_free(context);
		free(file);
		return ec;
	}
	bsdfrbf_context_free(context);
	SDerrorDetail[0] = '\0';
	file->users = 1;			/* ourselves */
	file->channels = bsdfrbf_channels(file->model);
	rbf_find_through(file);
	sd->matn[0] = sd->makr[0] = '\0';
	strncat(sd->matn, bsdfrbf_get_text(file->model, "name"), SDnameLn-1);
	sd->mgf = NULL;
	sd->dim[0] = sd->dim[1] = sd->dim[2] = 0;
	rbf_diffuse(&sd->rLambFront, file->model, BSDFRBF_RF, BSDFRBF_RF);
	rbf_diffuse(&sd->rLambBack, file->model, BSDFRBF_RB, BSDFRBF_RB);
	rbf_diffuse(&sd->tLambFront, file->model, BSDFRBF_TF, BSDFRBF_TB);
	rbf_diffuse(&sd->tLambBack, file->model, BSDFRBF_TB, BSDFRBF_TF);
	slot[BSDFRBF_RF] = &sd->rf;
	slot[BSDFRBF_RB] = &sd->rb;
	slot[BSDFRBF_TF] = &sd->tf;
	slot[BSDFRBF_TB] = &sd->tb;
	for (i = 0; ec == SDEnone && i < 4; i++)
		if (bsdfrbf_has(file->model, (bsdfrbf_component)i))
			ec = rbf_component(sd, slot[i], file, (bsdfrbf_component)i);
	if (--file->users == 0) {		/* purely Lambertian, or failed */
		bsdfrbf_close(file->model);
		free(file);
	}
	if (ec != SDEnone)
		SDfreeBSDF(sd);
	return ec;
}
