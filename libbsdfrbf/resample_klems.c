/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Klems matrices: the mean of f over an incident and an outgoing patch. For each of several incident directions of a patch the
 * exitant hemisphere is integrated adaptively (exitant.h) into the patches (division.h). The sum over outgoing patches is then
 * brought to the mean DHR of the incident patch. Where the azimuth of incidence only turns the exitant hemisphere (isotropic), one
 * integral, kept by ring and azimuth, serves all patches of an incident ring, turned.
 * Patches of Radiance's common/bsdf_m.c: incident vectors are looked up with x and y negated, outgoing ones as they are.
 */
#include "division.h"
#include "klems.h"
#include "resample.h"
#include "xml_write.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST = 4, FINEST = 5, DEEPEST = 8, MOST_STEPS = 6, MOST_STEPS_RING = 16 };
enum { AZIMUTHS = 480 };           /* a multiple of twice the count of every ring: patches begin and end between two of them */

/* Means of f by channel, outgoing and incident patch. */
typedef struct matrix {
	double f[3][RBF_KLEMS_PATCHES][RBF_KLEMS_PATCHES];
} matrix;

typedef struct worker {
	const rbf_klems *basis;
	const rbf_component *component;
	const rbf_division *division;      /* into patches, or rings and azimuths */
	rbf_exitant exitant;
	double share;                      /* weight of the incidence that is being integrated */
	double *sum;                       /* integrals of f by channel and part of the division */
} worker;

static int patch_of(const void *user, const float d[3])
{
	return rbf_klems_find(user, d);
}

static int azimuth_of(const void *user, const float d[3])
{
	double turn;
	const int ring = rbf_klems_place(user, d, &turn);
	return ring * AZIMUTHS + (int)((turn - floor(turn)) * AZIMUTHS) % AZIMUTHS;
}

static void to_parts(void *user, const rbf_exitant_leaf *leaf)
{
	const worker *w = user;
	rbf_division_add(w->division, leaf, w->component->channels, w->share, w->sum);
}

static void start_column(worker *w)
{
	memset(w->sum, 0, 3 * (size_t)w->division->parts * sizeof *w->sum);
}

/* Adds the exitant integral for an incidence, with a weight; dhr: grows by `share` of the DHR there. */
static void add_incidence(worker *w, float incident[3], double share, double dhr[3])
{
	double one[3];
	rbf_site site;
	incident[0] = -incident[0];
	incident[1] = -incident[1];
	rbf_resample_site(w->component, incident, .2, &site, one, &w->exitant);
	w->share = share;
	rbf_exitant_run(&w->exitant, &site);
	for (uint32_t k = 0; k < w->component->channels; k++)
		dhr[k] += share * one[k];
}

/* Column i of the matrix from the means over outgoing patches. */
static void end_column(const worker *w, int i, double mean[3][RBF_KLEMS_PATCHES], const double dhr[3], matrix *m)
{
	const rbf_klems *b = w->basis;
	for (uint32_t k = 0; k < w->component->channels; k++) {
		double total = 0;
		for (int o = 0; o < b->patches; o++)
			total += mean[k][o] * rbf_klems_omega(b, o);
		const double scale = rbf_resample_correction(dhr[k], total);
		for (int o = 0; o < b->patches; o++)
			m->f[k][o][i] = mean[k][o] * scale + (double)w->component->lambertian[k] / RBF_PI;
	}
}

/* How many steps of about the lobes' width cover a patch: along theta, and around. */
static void steps(const worker *w, int ring, int patch, double *along, double *around)
{
	const rbf_klems *b = w->basis;
	const double tall = (b->theta[ring + 1] - b->theta[ring]) * (RBF_PI / 180), middle = (b->theta[ring + 1] + b->theta[ring]) * (RBF_PI / 360);
	const double wide = 2 * RBF_PI * (ring ? sin(middle) : .5 * tall) / (ring ? b->count[ring] : 4);
	float incident[3];
	rbf_site site;
	rbf_klems_point(b, patch, .5, .5, incident);
	incident[0] = -incident[0];
	incident[1] = -incident[1];
	rbf_site_locate(w->component, incident, &site);
	const double width = 1.5 * rbf_exitant_width(&site);
	/* not fewer than show the way of the DHR */
	*along = fmax(ceil(tall / width), ring == b->rings - 1 ? 4 : 3);
	*around = fmax(ceil(wide / width), 2);
}

/* One column of the matrix: incident patch i. */
static void make_column(worker *w, int i, matrix *m)
{
	int within;
	double along, around, dhr[3] = {0}, mean[3][RBF_KLEMS_PATCHES];
	double u[MOST_STEPS], v[MOST_STEPS], along_share[MOST_STEPS], around_share[MOST_STEPS];
	steps(w, rbf_klems_ring(w->basis, i, &within), i, &along, &around);
	const int rows = (int)fmin(along, MOST_STEPS), columns = (int)fmin(around, MOST_STEPS);
	rbf_resample_points(rows, u, along_share);
	rbf_resample_points(columns, v, around_share);
	start_column(w);
	for (int r = 0; r < rows; r++)
		for (int k = 0; k < columns; k++) {
			float incident[3];
			rbf_klems_point(w->basis, i, u[r], v[k], incident);
			add_incidence(w, incident, along_share[r] * around_share[k], dhr);
		}
	for (uint32_t k = 0; k < w->component->channels; k++)
		for (int o = 0; o < w->basis->patches; o++)
			mean[k][o] = w->sum[k * (size_t)w->division->parts + (size_t)o] / w->division->area[o];
	end_column(w, i, mean, dhr, m);
}

/* Means over the outgoing patches when what was summed turns over the azimuths of the incident patch `within` its ring. */
static void turn(const worker *w, int count, int within, double mean[3][RBF_KLEMS_PATCHES])
{
	const rbf_klems *b = w->basis;
	const int wide = AZIMUTHS / count, parts = w->division->parts;
	double hit[RBF_KLEMS_PATCHES] = {0};
	memset(mean, 0, sizeof *mean * 3);
	for (int part = 0; part < parts; part++) {
		const int ring = part / AZIMUTHS, first = part % AZIMUTHS + within * wide - (count > 1 ? wide / 2 : 0) + AZIMUTHS;
		for (int n = 0; n <= wide; n++) {
			const double share = (n == 0 || n == wide ? .5 : 1) / wide; /* trapezoidal rule */
			const int o = rbf_klems_at(b, ring, (first + n + .5) / AZIMUTHS);
			hit[o] += share * w->division->area[part];
			for (uint32_t k = 0; k < w->component->channels; k++)
				mean[k][o] += share * w->sum[k * (size_t)parts + (size_t)part];
		}
	}
	for (int o = 0; o < b->patches; o++)
		for (uint32_t k = 0; k < w->component->channels; k++)
			mean[k][o] /= hit[o];
}

/* The columns of the first quarter of an incident ring, which starts at patch i; isotropic components. */
static void make_ring(worker *w, int i, matrix *m)
{
	int within;
	const int ring = rbf_klems_ring(w->basis, i, &within), count = w->basis->count[ring];
	double along, around, dhr[3] = {0}, u[MOST_STEPS_RING], share[MOST_STEPS_RING], mean[3][RBF_KLEMS_PATCHES];
	steps(w, ring, i, &along, &around);
	const int rows = (int)fmin(along, MOST_STEPS_RING);
	rbf_resample_points(rows, u, share);
	start_column(w);
	for (int r = 0; r < rows; r++) {
		float incident[3];
		rbf_klems_point(w->basis, i, u[r], .5, incident); /* azimuth 0, the middle of the first patch */
		add_incidence(w, incident, share[r], dhr);
	}
	for (int column = 0; column < (count + 3) / 4; column++) {
		turn(w, count, column, mean);
		end_column(w, i + column, mean, dhr, m);
	}
}

/* The incident patch that stands for patch i, and how i comes from it: mirrored (op) or turned. Incident vectors are the patch's
 * with x and y negated, which changes nothing about mirrors and turns of both. */
static int canonical(const rbf_klems *b, const rbf_component *c, int i, unsigned *op, int *quarters)
{
	int within;
	const int ring = rbf_klems_ring(b, i, &within), count = b->count[ring];
	*op = 0;
	*quarters = 0;
	if (c->mesh.symmetry == RBF_ISOTROPIC) {
		*quarters = count == 1 ? 0 : within / (count / 4);
		return i - (count == 1 ? 0 : *quarters * (count / 4));
	}
	int best = i, ops[4];
	const int some = rbf_symmetry_ops(c->mesh.symmetry, ops);
	for (int n = 0; n < some; n++) {
		const int image = rbf_klems_mirror(b, i, (unsigned)ops[n]);
		if (image < best) {
			best = image;
			*op = (unsigned)ops[n];
		}
	}
	return best;
}

static bsdfrbf_status make_matrix(bsdfrbf_context *context, const bsdfrbf_resample_options *options, const rbf_klems *b,
	const rbf_component *c, double from, double share, matrix *m)
{
	const int isotropic = c->mesh.symmetry == RBF_ISOTROPIC;
	int failed = 0, cancelled = 0, done = 0;
	rbf_division division;
	if (!rbf_division_make(&division, isotropic ? b->rings * AZIMUTHS : b->patches, isotropic ? azimuth_of : patch_of, b))
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "bsdfrbf_write_klems: out of memory");
#pragma omp parallel num_threads(rbf_resample_threads(options))
	{
		worker w = {.basis = b, .component = c, .division = &division};
		w.sum = malloc(3 * (size_t)division.parts * sizeof *w.sum);
		const int ready = rbf_exitant_begin(&w.exitant, FIRST, FINEST, DEEPEST) && w.sum;
		w.exitant.leaf = to_parts;
		w.exitant.user = &w;
#pragma omp for schedule(dynamic, 1)
		for (int n = 0; n < b->patches; n++) {
			const int i = b->patches - 1 - n; /* the slowest first */
			unsigned op;
			int quarters, stop, count, within;
#pragma omp atomic read
			stop = cancelled;
			if (!ready) {
#pragma omp atomic write
				failed = 1;
			} else if (!stop && isotropic) {
				rbf_klems_ring(b, i, &within);
				if (!within)
					make_ring(&w, i, m);
			} else if (!stop && canonical(b, c, i, &op, &quarters) == i)
				make_column(&w, i, m);
#pragma omp atomic capture
			count = ++done;
			if (omp_get_thread_num() == 0 && rbf_progress(context, "matrix", from + share * count / b->patches)) {
#pragma omp atomic write
				cancelled = 1;
			}
		}
		rbf_exitant_end(&w.exitant);
		free(w.sum);
	}
	rbf_division_free(&division);
	if (failed)
		return rbf_fail(context, BSDFRBF_ERR_MEMORY, "bsdfrbf_write_klems: out of memory");
	if (cancelled)
		return rbf_fail(context, BSDFRBF_ERR_CANCELLED, "the matrix was cancelled");
	for (int i = 0; i < b->patches; i++) {
		unsigned op;
		int quarters;
		const int source = canonical(b, c, i, &op, &quarters);
		for (int o = 0; o < b->patches && source != i; o++) {
			const int to = quarters ? rbf_klems_turn(b, o, quarters) : rbf_klems_mirror(b, o, op);
			for (uint32_t k = 0; k < c->channels; k++)
				m->f[k][to][i] = m->f[k][o][source];
		}
	}
	return BSDFRBF_OK;
}

/* The other transmission side by reciprocity: f(a, b) = f(b, a). Outgoing patch o there is the incident patch opposite of o here. */
static void reverse(const rbf_klems *b, const matrix *from, matrix *to)
{
	for (int o = 0; o < b->patches; o++)
		for (int i = 0; i < b->patches; i++)
			for (int k = 0; k < 3; k++)
				to->f[k][o][i] = from->f[k][rbf_klems_mirror(b, i, 3)][rbf_klems_mirror(b, o, 3)];
}

static void write_basis(rbf_xml *xml, const rbf_klems *b)
{
	rbf_xml_put(xml, "\t<DataDefinition>\n\t\t<IncidentDataStructure>Columns</IncidentDataStructure>\n\t\t<AngleBasis>\n"
		"\t\t\t<AngleBasisName>%s</AngleBasisName>\n", b->name);
	for (int r = 0; r < b->rings; r++) {
		rbf_xml_put(xml, "\t\t\t<AngleBasisBlock>\n\t\t\t\t<Theta>");
		rbf_xml_number(xml, r ? (b->theta[r] + b->theta[r + 1]) / 2 : 0);
		rbf_xml_put(xml, "</Theta>\n\t\t\t\t<nPhis>%d</nPhis>\n\t\t\t\t<ThetaBounds>\n\t\t\t\t\t<LowerTheta>", b->count[r]);
		rbf_xml_number(xml, b->theta[r]);
		rbf_xml_put(xml, "</LowerTheta>\n\t\t\t\t\t<UpperTheta>");
		rbf_xml_number(xml, b->theta[r + 1]);
		rbf_xml_put(xml, "</UpperTheta>\n\t\t\t\t</ThetaBounds>\n\t\t\t</AngleBasisBlock>\n");
	}
	rbf_xml_put(xml, "\t\t</AngleBasis>\n\t</DataDefinition>\n");
}

static void write_matrix(rbf_xml *xml, const rbf_klems *b, const matrix *m, int channel, bsdfrbf_component component, const char *what)
{
	char basis[256];
	snprintf(basis, sizeof basis, "\t\t\t<ColumnAngleBasis>%s</ColumnAngleBasis>\n\t\t\t<RowAngleBasis>%s</RowAngleBasis>\n", b->name, b->name);
	rbf_xml_data_begin(xml, component, what, basis);
	for (int o = 0; o < b->patches; o++)
		for (int i = 0; i < b->patches; i++) {
			rbf_xml_number(xml, fmax(m->f[channel][o][i], 0));
			rbf_xml_put(xml, i + 1 < b->patches ? ",\t" : ",\n");
		}
	rbf_xml_data_end(xml);
}

/* Matrices of the wanted components of a model; those that it does not have but WINDOW needs follow from the rest. */
static bsdfrbf_status make_matrices(bsdfrbf_context *context, const bsdfrbf_model *model, const bsdfrbf_resample_options *options,
	unsigned wanted, double from, double share, matrix *m)
{
	static const char *const name[4] = {"front reflection", "back reflection", "front transmission", "back transmission"};
	const rbf_klems *b = rbf_klems_basis(options->basis);
	int parts = 0;
	for (unsigned n = 0; n < 4; n++)
		parts += wanted >> n & 1;
	for (unsigned n = 0; n < 4; n++)
		if (wanted >> n & 1) {
			RBF_TRY(make_matrix(context, options, b, &model->component[n], from, share / parts, &m[n]));
			from += share / parts;
		}
	if (!options->window)
		return BSDFRBF_OK;
	for (unsigned n = 0; n < 4; n++) {
		const unsigned other = n == BSDFRBF_TF ? BSDFRBF_TB : BSDFRBF_TF;
		if (wanted >> n & 1)
			continue;
		if (n >= BSDFRBF_TF && wanted >> other & 1)
			reverse(b, &m[other], &m[n]);
		else
			rbf_warn(context, "the %s is written as zeros: WINDOW wants it, but there is none", name[n]);
	}
	return BSDFRBF_OK;
}

static bsdfrbf_status check_window(bsdfrbf_context *context, const bsdfrbf_resample_options *options, unsigned *solar)
{
	*solar = 0;
	if (options->solar && !options->window)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "a Solar block is for WINDOW files only");
	if (!options->window)
		return BSDFRBF_OK;
	if (options->basis != BSDFRBF_KLEMS_FULL)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "WINDOW wants the full Klems basis");
	if (!(options->thickness > 0))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "WINDOW wants the thickness of the material");
	if (!options->solar) {
		rbf_warn(context, "no Solar data: WINDOW may refuse a file with the Visible block alone");
		return BSDFRBF_OK;
	}
	return rbf_resample_check(context, options->solar, options, "bsdfrbf_write_klems, Solar", solar);
}

bsdfrbf_status bsdfrbf_write_klems(bsdfrbf_context *context, const bsdfrbf_model *model, const bsdfrbf_resample_options *options)
{
	unsigned wanted, solar;
	RBF_TRY(rbf_resample_check(context, model, options, "bsdfrbf_write_klems", &wanted));
	RBF_TRY(check_window(context, options, &solar));
	const rbf_klems *b = rbf_klems_basis(options->basis);
	if (!b)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_write_klems: no such basis");
	const int twice = solar && options->solar != model;
	matrix *m = calloc(twice ? 8 : 4, sizeof *m), *const sun = twice ? m + 4 : m;
	rbf_xml *xml = malloc(sizeof *xml);
	bsdfrbf_status status = m && xml ? BSDFRBF_OK : rbf_fail(context, BSDFRBF_ERR_MEMORY, "bsdfrbf_write_klems: out of memory");
	if (status == BSDFRBF_OK)
		status = make_matrices(context, model, options, wanted, 0, twice ? .5 : 1, m);
	if (status == BSDFRBF_OK && twice)
		status = make_matrices(context, options->solar, options, solar, .5, .5, sun);
	if (status == BSDFRBF_OK)
		status = rbf_xml_begin(context, options, xml);
	if (status == BSDFRBF_OK) {
		char facts[128];
		snprintf(facts, sizeof facts, "means over incident and outgoing patches of %s%s", b->name,
			solar && !twice ? "; Solar is a copy of Visible, as asked for" : "");
		rbf_xml_head(xml, model, options, facts);
		write_basis(xml, b);
		for (unsigned n = 0; n < 4; n++) {
			const int y = (int)rbf_luminance(model->channels);
			if (options->window || wanted >> n & 1)
				write_matrix(xml, b, &m[n], y, (bsdfrbf_component)n, "Visible");
			if (!options->window && wanted >> n & 1 && model->channels == 3) {
				write_matrix(xml, b, &m[n], 0, (bsdfrbf_component)n, "CIE-X");
				write_matrix(xml, b, &m[n], 2, (bsdfrbf_component)n, "CIE-Z");
			}
		}
		for (unsigned n = 0; n < 4 && solar; n++)
			write_matrix(xml, b, &sun[n], (int)rbf_luminance(options->solar->channels), (bsdfrbf_component)n, "Solar");
		rbf_xml_tail(xml, model, options);
		status = rbf_xml_finish(xml);
	}
	free(xml);
	free(m);
	if (status == BSDFRBF_OK)
		rbf_progress(context, "matrix", 1);
	return status;
}
