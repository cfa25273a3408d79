/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Tensor trees. An incident cell of the finest resolution gives a page: the mean of f over the cell for each finest exitant cell,
 * by adaptive quadrature (exitant.h). Pages are joined upwards (tree.h) where they do not differ. Blocks of incident cells are
 * worked on in parallel, and incident cells that a symmetry carries into others are not computed but mirrored.
 * Coordinates are those of Radiance's reader (common/bsdf_t.c, SDqueryTre): rank 4 (-incident, outgoing) on the square; rank 3
 * (1 - sin(theta)) / 2 and the outgoing direction turned so that the incident one has azimuth 180 degrees.
 */
#include "resample.h"
#include "shirley_chiu.h"
#include "tree.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EXTRA_LEVELS = 3, MOST_SUBDIVISIONS_3 = 4, MOST_SUBDIVISIONS_4 = 2 }; /* per rank */

typedef struct job {
	bsdfrbf_context *context;
	const bsdfrbf_resample_options *options;
	const rbf_component *component, *reverse; /* reverse: answers f(b, a) for the mean with f(a, b), or NULL */
	int inputs, log2, block_level;
	uint32_t blocks;            /* along one incident dimension */
	float keep;
	long pages, pages_done;
	int stop;                   /* failed or cancelled */
	double share, share_from;   /* of the progress */
} job;

/* What one thread works with. */
typedef struct worker {
	job *job;
	rbf_exitant exitant;
	const float *incident;
	double share;               /* weight of the incidence that is being integrated */
	double *page;               /* channels x 4^log2 */
	rbf_tree tree;
} worker;

static void to_page(void *user, const rbf_exitant_leaf *leaf)
{
	worker *w = user;
	const job *j = w->job;
	const uint32_t channels = j->component->channels;
	const int g = j->log2;
	double mean[3] = {0};
	for (int n = 0; n < 4; n++)
		for (uint32_t c = 0; c < channels; c++)
			mean[c] += .25 * w->share * (double)leaf->value[n][c];
	if (j->reverse)
		for (int n = 0; n < 4; n++) {
			rbf_site site;
			float back[3];
			rbf_site_locate(j->reverse, leaf->direction[n], &site);
			rbf_site_eval(&site, w->incident, back);
			for (uint32_t c = 0; c < channels; c++)
				mean[c] += .25 * w->share * ((double)back[c] - (double)leaf->value[n][c]) / 2;
		}
	for (uint32_t c = 0; c < channels; c++) {
		double *page = w->page + ((size_t)c << 2 * g);
		if (leaf->level >= g) {
			const int deeper = leaf->level - g;
			page[(size_t)(leaf->y >> deeper) << g | leaf->x >> deeper] += mean[c] / (double)(1 << 2 * deeper);
			continue;
		}
		const int wide = g - leaf->level;
		for (uint32_t y = leaf->y << wide; y < (leaf->y + 1) << wide; y++)
			for (uint32_t x = leaf->x << wide; x < (leaf->x + 1) << wide; x++)
				page[(size_t)y << g | x] += mean[c];
	}
}

/* Incident direction at a point of the incident cells. */
static void incident_at(const job *j, double x, double y, float d[3])
{
	if (j->inputs == 1) {
		const double s = fmin(fmax(1 - 2*x, 0), .99999);
		d[0] = (float)-s;
		d[1] = 0;
		d[2] = (float)sqrt(1 - s*s);
	} else {
		rbf_direction_from_cell(x, y, d);
		d[0] = -d[0];
		d[1] = -d[1];
	}
}

/* Items of one finest incident cell, and its mean DHR. */
static void make_page(worker *w, uint32_t x, uint32_t y, rbf_tree_item *item, double dhr[3])
{
	const job *j = w->job;
	const rbf_component *c = j->component;
	const size_t cells = (size_t)1 << 2 * j->log2;
	const double size = 1. / (double)(1 << j->log2);
	float incident[3];
	rbf_site site;
	incident_at(j, (x + .5) * size, (y + .5) * size, incident);
	rbf_site_locate(c, incident, &site);
	/* the peak's way across the incident cell, against its width */
	const double steps = 2 * size / fmax((double)incident[2], .3) / (1.5 * rbf_exitant_width(&site));
	const int most = j->inputs == 1 ? MOST_SUBDIVISIONS_3 : MOST_SUBDIVISIONS_4;
	const int n = steps > most ? most : steps > 1 ? (int)ceil(steps) : 1, rows = j->inputs == 2 ? n : 1;
	double at[MOST_SUBDIVISIONS_3], share[MOST_SUBDIVISIONS_3], at_row[MOST_SUBDIVISIONS_3], row_share[MOST_SUBDIVISIONS_3];
	rbf_resample_points(n, at, share);
	rbf_resample_points(rows, at_row, row_share);
	memset(w->page, 0, cells * c->channels * sizeof *w->page);
	dhr[0] = dhr[1] = dhr[2] = 0;
	for (int v = 0; v < rows; v++)
		for (int u = 0; u < n; u++) {
			double one[3];
			incident_at(j, (x + at[u]) * size, (y + at_row[v]) * size, incident);
			rbf_resample_site(c, incident, fmax(.5 * j->options->error, 2e-4), &site, one, &w->exitant);
			w->incident = incident;
			w->share = share[u] * row_share[v];
			rbf_exitant_run(&w->exitant, &site);
			for (uint32_t k = 0; k < c->channels; k++)
				dhr[k] += w->share * one[k];
		}
	memset(item, 0, cells * sizeof *item);
	for (uint32_t k = 0; k < c->channels; k++) {
		const double *page = w->page + k * cells;
		double sum = 0, lambertian = (double)c->lambertian[k];
		for (size_t i = 0; i < cells; i++)
			sum += page[i];
		if (j->reverse)
			lambertian = .5 * (lambertian + (double)j->reverse->lambertian[k]);
		const double scale = j->reverse ? 1 : rbf_resample_correction(dhr[k], sum * RBF_PI / (double)cells);
		for (size_t i = 0; i < cells; i++)
			item[i].value[k] = (float)(page[i] * scale + lambertian / RBF_PI);
		dhr[k] += lambertian;
	}
	for (size_t i = 0; i < cells; i++)
		item[i].child = RBF_TREE_LEAF;
	/* Where Radiance's reader takes a diffuse part out of a coloured tree of rank 3, it loses the colour (bsdf_t.c: the unused
	 * half leaves the new u' and v' trees incomplete). One dark cell, at grazing incidence and exitance, keeps it from that. */
	if (j->inputs == 1 && c->channels == 3 && x == 0) {
		for (int k = 0; k < 3; k++)
			item[0].value[k] *= .001f;
		item[0].error = RBF_TREE_KEEP;
	}
}

static int may_go_on(job *j)
{
	long done;
	int stop;
#pragma omp atomic capture
	done = ++j->pages_done;
	if (omp_get_thread_num() == 0 && rbf_progress(j->context, "tree", j->share_from + j->share * (double)done / (double)j->pages)) {
#pragma omp atomic write
		j->stop = 1;
	}
#pragma omp atomic read
	stop = j->stop;
	return !stop;
}

/* Items of the incident cell (x, y) of a level: 4^level of them, to be freed; NULL on failure. */
static rbf_tree_item *make_items(worker *w, int level, uint32_t x, uint32_t y, double dhr[3])
{
	const job *j = w->job;
	rbf_tree_item *item = malloc(sizeof *item << 2 * level), *below[4] = {NULL};
	const int children = 1 << j->inputs;
	double scale[3];
	if (!item)
		return NULL;
	if (level == j->log2) {
		if (may_go_on(w->job)) {
			make_page(w, x, y, item, dhr);
			return item;
		}
		free(item);
		return NULL;
	}
	int good = 1;
	dhr[0] = dhr[1] = dhr[2] = 0;
	for (int n = 0; n < children && good; n++) {
		double one[3] = {0};
		below[n] = make_items(w, level + 1, 2*x + (uint32_t)(n & 1), j->inputs == 2 ? 2*y + (uint32_t)(n >> 1) : 0, one);
		good = below[n] != NULL;
		for (int k = 0; k < 3; k++)
			dhr[k] += one[k] / children;
	}
	for (int k = 0; k < 3; k++)
		scale[k] = dhr[k] > 1e-6 ? RBF_PI / dhr[k] : 0;
	good = good && rbf_tree_join(&w->tree, level, below, scale, j->keep, item);
	for (int n = 0; n < children; n++)
		free(below[n]);
	if (good)
		return item;
	free(item);
	return NULL;
}

/* The operation that carries a block's incident directions into those that are computed. */
static unsigned block_op(const job *j, uint32_t x, uint32_t y)
{
	float d[3];
	if (j->inputs == 1)
		return RBF_OP_NONE;
	incident_at(j, (x + .5) / j->blocks, (y + .5) / j->blocks, d);
	return (unsigned)rbf_symmetry_fold(j->component->mesh.symmetry, d);
}

/* Items of a block from those of its mirror image. */
static void mirror_items(const rbf_tree_item *from, int level, unsigned op, rbf_tree_item *to)
{
	const uint32_t last = (1u << level) - 1, mask = (op & RBF_OP_X ? 5u : 0) | (op & RBF_OP_Y ? 10u : 0);
	for (uint32_t y = 0; y <= last; y++)
		for (uint32_t x = 0; x <= last; x++) {
			rbf_tree_item *item = &to[(size_t)y << level | x];
			*item = from[(size_t)(op & RBF_OP_Y ? last - y : y) << level | (op & RBF_OP_X ? last - x : x)];
			if (item->child != RBF_TREE_LEAF)
				item->child ^= mask << 28;
		}
}

/* All blocks of one component into a tree. dhr: the largest over the blocks, luminance, for the report. */
static int make_blocks(job *j, rbf_tree_item **items, double (*dhr)[3], rbf_tree *tree)
{
	const uint32_t rows = j->inputs == 2 ? j->blocks : 1, total = j->inputs == 2 ? j->blocks * rows : j->blocks / 2;
	const int level = j->block_level;
	rbf_tree *part = calloc(total, sizeof *part);
	if (!part)
		return 0;
#pragma omp parallel num_threads(rbf_resample_threads(j->options))
	{
		worker w = {.job = j};
		const int ready = rbf_exitant_begin(&w.exitant, 2, j->log2, j->log2 + EXTRA_LEVELS)
			&& (w.page = malloc(sizeof *w.page * j->component->channels << 2 * j->log2)) != NULL;
		w.exitant.points = 1;
		w.exitant.leaf = to_page;
		w.exitant.user = &w;
#pragma omp for schedule(dynamic, 1)
		for (uint32_t b = 0; b < total; b++) {
			const uint32_t x = b % j->blocks, y = b / j->blocks;
			if (block_op(j, x, y) != RBF_OP_NONE)
				continue;
			w.tree = (rbf_tree){.inputs = j->inputs, .channels = (int)j->component->channels};
			items[b] = ready ? make_items(&w, level, x, y, dhr[b]) : NULL;
			part[b] = w.tree;
			if (!items[b]) {
#pragma omp atomic write
				j->stop = 1;
			}
		}
		rbf_exitant_end(&w.exitant);
		free(w.page);
	}
	int good = !j->stop;
	for (uint32_t b = 0; b < total; b++) {
		if (good && items[b])
			good = rbf_tree_take(tree, &part[b], (size_t)1 << 2 * level, items[b]);
		free(part[b].item);
	}
	for (uint32_t b = 0; b < total && good; b++) {
		const unsigned op = block_op(j, b % j->blocks, b / j->blocks);
		if (op == RBF_OP_NONE)
			continue;
		const uint32_t x = b % j->blocks, y = b / j->blocks;
		const uint32_t from = (op & RBF_OP_Y ? rows - 1 - y : y) * j->blocks + (op & RBF_OP_X ? j->blocks - 1 - x : x);
		good = items[from] && (items[b] = malloc(sizeof **items << 2 * level)) != NULL;
		if (good) {
			mirror_items(items[from], level, op, items[b]);
			memcpy(dhr[b], dhr[from], sizeof *dhr);
		}
	}
	free(part);
	return good;
}

/* Joins the blocks up to the root. */
static int join_blocks(job *j, rbf_tree_item **items, double (*dhr)[3], rbf_tree *tree, rbf_tree_item *root)
{
	const int last = j->inputs == 1 ? 1 : 0; /* rank 3: the half of the first dimension that is in use */
	for (int level = j->block_level - 1; level >= last; level--) {
		const uint32_t size = 1u << level, rows = j->inputs == 2 ? size : 1, columns = j->inputs == 2 ? size : size / 2;
		for (uint32_t y = 0; y < rows; y++)
			for (uint32_t x = 0; x < columns; x++) {
				rbf_tree_item *below[4] = {NULL}, *above = malloc(sizeof *above << 2 * level);
				double mean[3] = {0}, scale[3];
				const int children = 1 << j->inputs;
				for (int n = 0; n < children; n++) {
					const size_t from = (size_t)(2*y + (uint32_t)(n >> 1)) * (2 * size) + 2*x + (uint32_t)(n & 1);
					below[n] = items[from];
					items[from] = NULL;
					for (int k = 0; k < 3; k++)
						mean[k] += dhr[from][k] / children;
				}
				for (int k = 0; k < 3; k++)
					scale[k] = mean[k] > 1e-6 ? RBF_PI / mean[k] : 0;
				const int good = above && rbf_tree_join(tree, level, below, scale, j->keep, above);
				for (int n = 0; n < children; n++)
					free(below[n]);
				/* (x, y) of this level comes before what is still to be read of the level below */
				items[(size_t)y * size + x] = above;
				memcpy(dhr[(size_t)y * size + x], mean, sizeof mean);
				if (!good)
					return 0;
			}
	}
	if (j->inputs == 2) {
		*root = items[0][0];
		return 1;
	}
	rbf_tree_item nothing[4] = {{.child = RBF_TREE_LEAF}, {.child = RBF_TREE_LEAF}, {.child = RBF_TREE_LEAF}, {.child = RBF_TREE_LEAF}};
	rbf_tree_item *const halves[2] = {items[0], nothing};
	const double zero[3] = {0};
	if (!rbf_tree_join(tree, 0, halves, zero, -1, root))
		return 0;
	root->error = INFINITY; /* always a branch: the reader looks for the minimum in the half that is in use */
	return 1;
}

static bsdfrbf_status make_tree(job *j, rbf_tree *tree, rbf_tree_item *root)
{
	j->blocks = 1u << j->block_level;
	const size_t total = (size_t)j->blocks * (j->inputs == 2 ? j->blocks : 1);
	rbf_tree_item **items = calloc(total, sizeof *items);
	double (*dhr)[3] = calloc(total, sizeof *dhr);
	*tree = (rbf_tree){.inputs = j->inputs, .channels = (int)j->component->channels};
	j->pages = j->inputs == 2 ? 1l << 2 * j->log2 : 1l << (j->log2 - 1);
	if (j->inputs == 2)
		j->pages /= j->component->mesh.symmetry == RBF_QUADRILATERAL ? 4 : block_op(j, 0, 0) != block_op(j, j->blocks - 1, j->blocks - 1) ? 2 : 1;
	j->pages_done = 0;
	const int good = items && dhr && make_blocks(j, items, dhr, tree) && join_blocks(j, items, dhr, tree, root);
	for (size_t b = 0; items && b < total; b++)
		free(items[b]);
	free(items);
	free(dhr);
	if (good)
		return BSDFRBF_OK;
	if (rbf_progress(j->context, "tree", j->share_from))
		return rbf_fail(j->context, BSDFRBF_ERR_CANCELLED, "the tree was cancelled");
	return rbf_fail(j->context, BSDFRBF_ERR_MEMORY, "out of memory for a tree of 2^%d a side", j->log2);
}

static void write_component(const rbf_tree *tree, const rbf_tree_item *root, float limit, bsdfrbf_component component, rbf_xml *xml)
{
	static const char *const what[3] = {"Visible", "CIE-u", "CIE-v"};
	for (int q = 0; q < (tree->channels == 3 ? 3 : 1); q++) {
		rbf_xml_data_begin(xml, component, what[q], "\t\t\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n");
		rbf_tree_write(tree, root, limit, q, xml);
		rbf_xml_data_end(xml);
	}
}

/* Component that f(b, a) is read from. */
static const rbf_component *reverse_of(const bsdfrbf_model *model, unsigned n)
{
	const rbf_component *c = &model->component[n == BSDFRBF_TF ? BSDFRBF_TB : n == BSDFRBF_TB ? BSDFRBF_TF : n];
	return c->present ? c : NULL;
}

bsdfrbf_status bsdfrbf_write_tree(bsdfrbf_context *context, const bsdfrbf_model *model, const bsdfrbf_resample_options *options)
{
	static const char *const name[4] = {"rf", "rb", "tf", "tb"};
	unsigned wanted;
	RBF_TRY(rbf_resample_check(context, model, options, "bsdfrbf_write_tree", &wanted));
	job j = {.context = context, .options = options, .inputs = 1, .log2 = options->log2};
	unsigned parts = 0;
	for (unsigned n = 0; n < 4; n++)
		if (wanted >> n & 1) {
			parts++;
			if (model->component[n].mesh.symmetry != RBF_ISOTROPIC)
				j.inputs = 2;
		}
	if (!j.log2)
		j.log2 = j.inputs == 2 ? 5 : 6;
	if (j.log2 < 2 || j.log2 > (j.inputs == 2 ? 7 : 8))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "a tree of rank %d has a resolution of 2^2 to 2^%d, not 2^%d", j.inputs + 2,
			j.inputs == 2 ? 7 : 8, j.log2);
	j.block_level = j.inputs == 2 ? (j.log2 < 4 ? j.log2 - 1 : 3) : j.log2 < 6 ? j.log2 : 6;
	/* what is culled to a given size needs smaller differences to choose from */
	j.keep = (float)(options->cull > 0 ? fmin(options->error, 1e-4) : options->error);
	j.share = 1. / parts;

	rbf_tree tree[4];
	rbf_tree_item root[4];
	float limit[4];
	char facts[1024];
	int at = snprintf(facts, sizeof facts, "tensor tree of rank %d, resolution 2^%d, error limit %g, cull %g %%", j.inputs + 2, j.log2,
		options->error, options->cull);
	bsdfrbf_status status = BSDFRBF_OK;
	memset(tree, 0, sizeof tree);
	for (unsigned n = 0; n < 4 && status == BSDFRBF_OK; n++) {
		if (!(wanted >> n & 1))
			continue;
		j.component = &model->component[n];
		j.reverse = options->reciprocal ? reverse_of(model, n) : NULL;
		status = make_tree(&j, &tree[n], &root[n]);
		j.share_from += j.share;
		if (status != BSDFRBF_OK)
			break;
		double leaves, error;
		const double finest = ldexp(j.inputs == 1 ? .5 : 1, (j.inputs + 2) * j.log2);
		limit[n] = (float)options->error;
		if (options->cull > 0)
			limit[n] = fmaxf(limit[n], rbf_tree_limit(&tree[n], &root[n], finest * (1 - options->cull / 100)));
		rbf_tree_count(&tree[n], &root[n], limit[n], &leaves, &error);
		if (j.inputs == 1)
			error *= 2;
		at += snprintf(facts + at, sizeof facts - (size_t)at, "\n%s: %.0f leaves of %.0f; averaging them out adds at most %.4f to the L1 error",
			name[n], leaves, finest, error);
	}
	rbf_xml *xml = NULL;
	if (status == BSDFRBF_OK && !(xml = malloc(sizeof *xml)))
		status = rbf_fail(context, BSDFRBF_ERR_MEMORY, "bsdfrbf_write_tree: out of memory");
	if (status == BSDFRBF_OK)
		status = rbf_xml_begin(context, options, xml);
	if (status == BSDFRBF_OK) {
		rbf_xml_head(xml, model, options, facts);
		rbf_xml_put(xml, "\t<DataDefinition>\n\t\t<IncidentDataStructure>TensorTree%d</IncidentDataStructure>\n\t</DataDefinition>\n", j.inputs + 2);
		for (unsigned n = 0; n < 4; n++)
			if (wanted >> n & 1)
				write_component(&tree[n], &root[n], limit[n], (bsdfrbf_component)n, xml);
		rbf_xml_tail(xml, model, options);
		status = rbf_xml_finish(xml);
	}
	free(xml);
	for (unsigned n = 0; n < 4; n++)
		free(tree[n].item);
	if (status == BSDFRBF_OK)
		rbf_progress(context, "tree", 1);
	return status;
}
