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
 *   Through   aBSDF sends one ray straight through for a peak that it finds by probing; see bsdf_rbf_through.c.
 *   Caches    SDfreeCumulativeCache() calls free() on cdList, and loadBSDF() keeps everything: cdList stays NULL, and
 *             getCDist() answers from a small ring.
 *   Forks     Renderers fork (-n); a model is immutable and nothing here opens a thread.
 *   Form      BSDFRBF_FORM in the environment may ask for a tensor tree instead; see bsdf_rbf_form.c.
 *
 * Written in C90 with declarations first, as Radiance's own build asks of its files.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include "bsdf.h"
#include "bsdf_rbf.h"
#include "bsdf_rbf_part.h"

#define RBF_DETAIL	256	/* size of SDerrorDetail, bsdf.c */
#define RBF_PRUNE	.001	/* components below this are dropped, as SDloadFile() does with its own */
#define RBF_RING	16	/* states that live at once: SDsampBSDF() holds one per component of both sides */

#if defined(__GNUC__)
#define RBF_THREAD	__thread
#define RBF_NEXT(n)	__sync_add_and_fetch(&(n), 1)
#else
#define RBF_THREAD
#define RBF_NEXT(n)	(++(n))
#endif

static unsigned long	rbf_files;	/* loaded so far */

/* State between getCDist and sampCDist. */
typedef struct {
	SD_CDIST_BASE(SDCDst_s);	/* first, as Radiance asks; next stays NULL */
	const RBFpart	*part;
	float		incident[3];
} RBFstate;

static RBF_THREAD RBFstate	rbf_ring[RBF_RING];
static RBF_THREAD unsigned	rbf_ring_next;

/* The incidence asked last: a hit asks a dozen questions about one, and specular sampling many more. */
static RBF_THREAD struct {
	unsigned long		serial;		/* of the file, 0: none */
	float			incident[3];
	bsdfrbf_incidence	at;
} rbf_last;

static bsdfrbf_incidence *
rbf_at(const RBFfile *file, const float incident[3])
{
	if ((rbf_last.serial != file->serial) | (rbf_last.incident[0] != incident[0]) |
			(rbf_last.incident[1] != incident[1]) | (rbf_last.incident[2] != incident[2])) {
		bsdfrbf_prepare(file->model, incident, &rbf_last.at);
		VCOPY(rbf_last.incident, incident);
		rbf_last.serial = file->serial;
	}
	return &rbf_last.at;
}

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

/* Coefficients of f without the Lambertian part; returns how many. */
static int
rbf_eval(float coef[], const RBFfile *file, const RREAL *v1, const RREAL *v2)
{
	float	incident[3], outgoing[3], value[3];

	VCOPY(incident, v1);
	VCOPY(outgoing, v2);
	bsdfrbf_incidence_eval_scatter(rbf_at(file, incident), outgoing, value);
	if (file->channels == 1)
		coef[0] = value[0];
	else
		rbf_coefficients(coef, value);
	return file->channels;
}

double
rbf_seen(const RBFpart *part, const RREAL *v1, const RREAL *v2)
{
	float	coef[3];
	int	n = rbf_eval(coef, part->file, v1, v2);
	double	f = part->diffuse[v1[2] > 0];

	while (n > 0)
		f += coef[--n];
	return f;
}

/* SDFunc.getBSDFs */
static int
rbf_get_bsdfs(float coef[SDmaxCh], const FVECT inVec, const FVECT outVec, SDComponent *sdc)
{
	const RBFpart	*part = (const RBFpart *)sdc->dist;

	if (part == NULL || !rbf_serves(part, inVec, outVec))
		return 0;
	return rbf_eval(coef, part->file, inVec, outVec);
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
	bsdfrbf_incidence_resolution(rbf_at(part->file, incident), v2 == NULL ? NULL : outgoing, part->transmit,
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
	bsdfrbf_incidence_dhr_scatter(rbf_at(part->file, state->incident), part->transmit, value);
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
	if (!bsdfrbf_incidence_sample(rbf_at(state->part->file, state->incident), state->part->transmit, randX, outgoing)) {
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
 * sides; its DHR is looked at from the measured side only: the other side's tables are made only for the directions that rays need. */
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

/* Fills sd from the model, which is its own from here on. */
static SDError
rbf_fill(SDData *sd, bsdfrbf_model *model)
{
	RBFfile		*file;
	SDSpectralDF	**slot[4];
	SDError		ec = SDEnone;
	int		i;

	if ((file = (RBFfile *)malloc(sizeof(RBFfile))) == NULL) {
		bsdfrbf_close(model);
		return rbf_error(BSDFRBF_ERR_MEMORY, "Out of memory in rbf_fill");
	}
	SDerrorDetail[0] = '\0';
	file->model = model;
	file->serial = RBF_NEXT(rbf_files);
	file->users = 1;			/* ourselves */
	file->channels = bsdfrbf_channels(model);
	rbf_find_through(file);
	sd->matn[0] = sd->makr[0] = '\0';
	strncat(sd->matn, bsdfrbf_get_text(model, "name"), SDnameLn-1);
	sd->mgf = NULL;
	sd->dim[0] = sd->dim[1] = sd->dim[2] = 0;
	rbf_diffuse(&sd->rLambFront, model, BSDFRBF_RF, BSDFRBF_RF);
	rbf_diffuse(&sd->rLambBack, model, BSDFRBF_RB, BSDFRBF_RB);
	rbf_diffuse(&sd->tLambFront, model, BSDFRBF_TF, BSDFRBF_TB);
	rbf_diffuse(&sd->tLambBack, model, BSDFRBF_TB, BSDFRBF_TF);
	slot[BSDFRBF_RF] = &sd->rf;
	slot[BSDFRBF_RB] = &sd->rb;
	slot[BSDFRBF_TF] = &sd->tf;
	slot[BSDFRBF_TB] = &sd->tb;
	for (i = 0; ec == SDEnone && i < 4; i++)
		if (bsdfrbf_has(model, (bsdfrbf_component)i))
			ec = rbf_component(sd, slot[i], file, (bsdfrbf_component)i);
	if (--file->users == 0) {		/* purely Lambertian, or failed */
		bsdfrbf_close(model);
		free(file);
	}
	if (ec != SDEnone)
		SDfreeBSDF(sd);
	return ec;
}

int
SDloadRbf(SDError *ec, SDData *sd, const char **fname)
{
	const int	carrier = bsdfrbf_is_carrier(*fname);
	bsdfrbf_context	*context;
	bsdfrbf_model	*model = NULL;
	bsdfrbf_status	status = BSDFRBF_ERR_MEMORY;
	const char	*tree;
	int		log2, form;

	if (!carrier && !bsdfrbf_is_rbf(*fname))
		return 0;
	if ((context = bsdfrbf_context_new()) != NULL)
		status = bsdfrbf_open(context, *fname, &model);
	if (status != BSDFRBF_OK) {
		if (carrier)			/* what Radiance can read is still there */
			fprintf(stderr, "warning - BSDF \"%s\" is used as resampled, not as interpolated: %s\n",
					*fname, bsdfrbf_message(context));
		else
			*ec = rbf_error(status, context == NULL ? "Out of memory in SDloadRbf" : bsdfrbf_message(context));
		bsdfrbf_context_free(context);
		return !carrier;
	}
	bsdfrbf_context_free(context);
	if ((form = rbf_form(&log2)) == 0) {
		*ec = rbf_fill(sd, model);
		return 1;
	}
	if (form < 0) {
		strcpy(SDerrorDetail, "Environment: BSDFRBF_FORM is to be direct, ttree or ttree:g, g from 2 to 8");
		*ec = SDEargument;
	} else if ((tree = rbf_tree_file(model, log2, RBF_DETAIL)) != NULL)
		*fname = tree;
	else {
		*ec = SDEdata;
		form = -1;
	}
	bsdfrbf_close(model);
	return form < 0;
}
