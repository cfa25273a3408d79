/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Locator of the mesh: which elements, and outside which borders, a cell of the disc can meet.
 *
 * Everything is tested against a cap (centre and angular radius) that encloses the cell, so that no curved cell
 * outline is ever needed and no candidate is missed; first for blocks of 8 x 8 cells, then for the cells of the
 * blocks that passed.
 */
#include "mesh_build.h"

#include <stdlib.h>
#include <string.h>

#define BLOCK 8 /* cells a side */
#define BLOCKS (RBF_MESH_GRID / BLOCK)
#define PROBES 4 /* a side of a cell, to see what covers it */
#define LISTED 64 /* elements of a cell that are put in order */
/* A query finds its cell in float arithmetic. */
#define SLACK 1e-5

typedef struct cap {
	double centre[3], cosine, sine; /* of the radius */
} cap;

typedef struct border_plane {
	double a[3], b[3];        /* ends */
	double normal[3];         /* of the arc's plane, unit; zero for a point */
	double from_a[3], to_b[3];/* both scalar products >= 0: the arc itself is nearest, not an end */
} border_plane;

typedef struct entry { uint32_t cell, item; } entry;

typedef struct builder {
	cap cell[RBF_MESH_GRID][RBF_MESH_GRID]; /* [iy][ix] */
	cap block[BLOCKS][BLOCKS];
	unsigned char inside[RBF_MESH_GRID][RBF_MESH_GRID]; /* the cell's centre lies in an element */
	unsigned first_x, first_y; /* first cell of the fundamental domain */
	entry *entry;
	size_t entries, room;
} builder;

/* Cap about the square of half width h around (x, y), or what the disc has of it. With r^2 = 1 - z a step along the radius is
 * sqrt(2 / (1 - r^2/2)) times as long on the sphere, one across it sqrt(2 - r^2) times. The disc is convex, and taking a
 * centre that lies outside to its edge brings it no further from any point inside. */
static cap enclose(double x, double y, double h)
{
	cap c;
	const double disc[2] = { x, y }, largest = fmin(hypot(fabs(x) + h, fabs(y) + h), 1);
	rbf_direction_from_disc(disc, c.centre);
	const double radius = fmin(h * sqrt(2) * sqrt(2 / (1 - largest * largest / 2)) + SLACK, RBF_PI / 2);
	c.cosine = cos(radius);
	c.sine = sin(radius);
	return c;
}

static void enclose_all(cap *out, int side)
{
	for (int j = 0; j < side; j++)
		for (int i = 0; i < side; i++)
			out[j * side + i] = enclose((2 * i + 1.) / side - 1, (2 * j + 1.) / side - 1, 1. / side);
}

static int add_entry(builder *g, uint32_t cell, uint32_t item)
{
	if (g->entries == g->room) {
		const size_t room = g->room ? 2 * g->room : 16384;
		entry *grown = realloc(g->entry, room * sizeof *grown);
		if (!grown)
			return 0;
		g->entry = grown;
		g->room = room;
	}
	g->entry[g->entries++] = (entry){ cell, item };
	return 1;
}

/* ------------------------------------------------------------------ elements */

typedef struct face {
	double side[3][3];            /* unit normals of the three sides' planes, inwards */
	double middle[3], cosine, sine; /* circumscribed circle: centre and angular radius */
} face;

static face face_of(const rbf_mesh *mesh, const rbf_element *e)
{
	face f;
	double p[3][3], ab[3], ac[3];
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 3; i++)
			p[k][i] = mesh->vertex[e->v[k]].direction[i];
	for (int k = 0; k < 3; k++) {
		rbf_cross3(p[(k + 1) % 3], p[(k + 2) % 3], f.side[k]);
		rbf_unit3(f.side[k]);
	}
	for (int i = 0; i < 3; i++) {
		ab[i] = p[1][i] - p[0][i];
		ac[i] = p[2][i] - p[0][i];
	}
	rbf_cross3(ab, ac, f.middle);
	rbf_unit3(f.middle);
	f.cosine = fmin(rbf_dot3(f.middle, p[0]), 1);
	f.sine = sqrt(fmax(1 - f.cosine * f.cosine, 0));
	return f;
}

/* May the cap and the face meet? Never a false no, seldom a false yes. */
static int meet(const cap *c, const face *f)
{
	return rbf_dot3(c->centre, f->middle) >= f->cosine * c->cosine - f->sine * c->sine - SLACK
		&& rbf_dot3(c->centre, f->side[0]) >= -c->sine
		&& rbf_dot3(c->centre, f->side[1]) >= -c->sine
		&& rbf_dot3(c->centre, f->side[2]) >= -c->sine;
}

/* Is d in the face, or on its edge? */
static int holds(const face *f, const double d[3])
{
	return rbf_dot3(d, f->side[0]) >= 0 && rbf_dot3(d, f->side[1]) >= 0 && rbf_dot3(d, f->side[2]) >= 0;
}

static int add_elements(const rbf_mesh *mesh, builder *g)
{
	for (uint32_t i = 0; i < mesh->elements; i++) {
		const face f = face_of(mesh, &mesh->element[i]);
		for (unsigned by = g->first_y / BLOCK; by < BLOCKS; by++)
			for (unsigned bx = g->first_x / BLOCK; bx < BLOCKS; bx++) {
				if (!meet(&g->block[by][bx], &f))
					continue;
				for (unsigned y = by * BLOCK; y < (by + 1) * BLOCK; y++)
					for (unsigned x = bx * BLOCK; x < (bx + 1) * BLOCK; x++) {
						const cap *c = &g->cell[y][x];
						if (!meet(c, &f))
							continue;
						if (!add_entry(g, y * RBF_MESH_GRID + x, i))
							return 0;
						g->inside[y][x] |= holds(&f, c->centre);
					}
			}
	}
	return 1;
}

/* ------------------------------------------------------------------- borders */

static border_plane plane_of(const rbf_mesh *mesh, const uint32_t border[3])
{
	border_plane p;
	for (int i = 0; i < 3; i++) {
		p.a[i] = mesh->vertex[border[0]].direction[i];
		p.b[i] = mesh->vertex[border[1]].direction[i];
	}
	rbf_cross3(p.a, p.b, p.normal);
	if (!(rbf_unit3(p.normal) > 1e-9))
		memset(p.normal, 0, sizeof p.normal);
	rbf_cross3(p.normal, p.a, p.from_a);
	rbf_cross3(p.b, p.normal, p.to_b);
	return p;
}

/* Cosine of the angle between d and the nearest point of the arc. */
static double border_cosine(const border_plane *p, const double d[3])
{
	const double from_a = rbf_dot3(p->from_a, d), to_b = rbf_dot3(p->to_b, d);
	if (from_a > 0 && to_b > 0) {
		const double sine = rbf_dot3(p->normal, d);
		return sqrt(fmax(1 - sine * sine, 0));
	}
	return fmax(rbf_dot3(p->a, d), rbf_dot3(p->b, d));
}

/* Borders, out of `count` listed, that can be nearest to some point of the cap: by the triangle inequality those
 * at most two radii further from its centre than the nearest one. Returns how many; *nearest gets the cosine of
 * the smallest distance. cosine: scratch. */
static uint32_t candidates(const cap *c, const border_plane *plane, uint32_t count, const uint32_t *listed,
	double *cosine, uint32_t *out, double *nearest)
{
	double best = -1;
	for (uint32_t i = 0; i < count; i++) {
		cosine[i] = border_cosine(&plane[listed[i]], c->centre);
		best = fmax(best, cosine[i]);
	}
	best = fmin(best, 1);
	const double cos2 = c->cosine * c->cosine - c->sine * c->sine, sin2 = 2 * c->sine * c->cosine;
	const double limit = best <= -cos2 ? -1 : best * cos2 - sqrt(1 - best * best) * sin2;
	uint32_t n = 0;
	for (uint32_t i = 0; i < count; i++)
		if (cosine[i] >= limit - 1e-9)
			out[n++] = listed[i];
	*nearest = best;
	return n;
}

static int add_borders(const rbf_mesh *mesh, builder *g, unsigned char *used)
{
	const uint32_t n = mesh->borders;
	border_plane *plane = malloc((n + 1) * sizeof *plane);
	double *cosine = malloc((n + 1) * sizeof *cosine);
	uint32_t *list = malloc(3 * (n + 1) * sizeof *list);
	int done = plane && cosine && list;
	uint32_t *of_block = list + n, *of_cell = of_block + n;
	for (uint32_t i = 0; done && i < n; i++) {
		plane[i] = plane_of(mesh, mesh->border[i]);
		list[i] = i;
	}
	for (unsigned by = g->first_y / BLOCK; done && n && by < BLOCKS; by++)
		for (unsigned bx = g->first_x / BLOCK; bx < BLOCKS; bx++) {
			double nearest;
			const uint32_t near_block = candidates(&g->block[by][bx], plane, n, list, cosine, of_block, &nearest);
			for (unsigned y = by * BLOCK; y < (by + 1) * BLOCK; y++)
				for (unsigned x = bx * BLOCK; x < (bx + 1) * BLOCK; x++) {
					const cap *c = &g->cell[y][x];
					const uint32_t near_cell = candidates(c, plane, near_block, of_block, cosine, of_cell, &nearest);
					if (g->inside[y][x] && nearest < c->cosine)
						continue; /* the cell is wholly inside */
					for (uint32_t i = 0; done && i < near_cell; i++) {
						done = add_entry(g, y * RBF_MESH_GRID + x, RBF_MESH_BORDER | of_cell[i]);
						used[of_cell[i]] = 1;
					}
				}
		}
	free(plane);
	free(cosine);
	free(list);
	return done;
}

/* ------------------------------------------------------------------ isotropic */

/* Directions have y = 0, x >= 0: one row of cells, linear in theta. */
static int add_row(const rbf_mesh *mesh, builder *g)
{
	const unsigned half = RBF_MESH_GRID / 2;
	const double width = RBF_PI / 2 / half;
	const float *last = mesh->vertex[mesh->vertices - 1].direction;
	for (unsigned x = 0; x < half; x++) {
		const double low = x * width - SLACK, high = (x + 1) * width + SLACK;
		for (uint32_t i = 0; i < mesh->elements; i++) {
			const double from = mesh->element[i].inverse[0][0], to = from + 1 / mesh->element[i].inverse[0][1];
			if (from <= high && to >= low && !add_entry(g, x, i))
				return 0;
		}
		if (atan2(last[0], last[2]) <= high && !add_entry(g, x, RBF_MESH_BORDER | 0))
			return 0;
	}
	return 1;
}

/* ---------------------------------------------------------------------- lists */

/* Puts first what holds most of a cell: most directions are found in one of two (mesh_inside.h). `count` elements are listed. */
static void largest_first(const rbf_mesh *mesh, uint32_t cell, uint32_t *list, uint32_t count)
{
	int points[LISTED];
	double probe[PROBES * PROBES][3];
	for (int n = 0; n < PROBES * PROBES; n++) {
		const double disc[2] = { (cell % RBF_MESH_GRID + (n % PROBES + .5) / PROBES) * (2. / RBF_MESH_GRID) - 1,
			(cell / RBF_MESH_GRID + (n / PROBES + .5) / PROBES) * (2. / RBF_MESH_GRID) - 1 };
		rbf_direction_from_disc(disc, probe[n]);
	}
	for (uint32_t i = 0; i < count && i < LISTED; i++) {
		const uint32_t item = list[i];
		const face f = face_of(mesh, &mesh->element[item]);
		int here = 0;
		uint32_t to = i;
		for (int n = 0; n < PROBES * PROBES; n++)
			here += holds(&f, probe[n]);
		for (; to && points[to - 1] < here; to--) {
			points[to] = points[to - 1];
			list[to] = list[to - 1];
		}
		points[to] = here;
		list[to] = item;
	}
}

/* Sorts the entries by cell. Elements were entered before borders and each in ascending order. */
static int store(const builder *g, rbf_mesh *mesh)
{
	const uint32_t cells = rbf_mesh_cells(mesh);
	uint32_t *first = calloc(cells + 1, sizeof *first), *list = malloc((g->entries + 1) * sizeof *list);
	mesh->cell_first = first;
	mesh->cell_element = list;
	mesh->cell_entries = (uint32_t)g->entries;
	if (!first || !list)
		return 0;
	for (size_t i = 0; i < g->entries; i++)
		first[g->entry[i].cell]++;
	for (uint32_t c = 1; c <= cells; c++)
		first[c] += first[c - 1];
	for (size_t i = g->entries; i-- > 0;)
		list[--first[g->entry[i].cell]] = g->entry[i].item;
	for (uint32_t c = 0; c < cells && mesh->symmetry != RBF_ISOTROPIC; c++) {
		uint32_t elements = 0;
		while (first[c] + elements < first[c + 1] && !(list[first[c] + elements] & RBF_MESH_BORDER))
			elements++;
		if (elements > 2)
			largest_first(mesh, c, list + first[c], elements);
	}
	return 1;
}

bsdfrbf_status rbf_mesh_grid(bsdfrbf_context *context, rbf_mesh *mesh, unsigned char *used)
{
	builder *g = malloc(sizeof *g);
	int done = g != NULL;
	if (g) {
		const rbf_symmetry s = mesh->symmetry;
		memset(g->inside, 0, sizeof g->inside);
		g->entry = NULL;
		g->entries = g->room = 0;
		g->first_x = s == RBF_BILATERAL_X || s == RBF_QUADRILATERAL ? RBF_MESH_GRID / 2 : 0;
		g->first_y = s == RBF_BILATERAL_Y || s == RBF_UP || s == RBF_QUADRILATERAL ? RBF_MESH_GRID / 2 : 0;
		if (s == RBF_ISOTROPIC)
			done = add_row(mesh, g);
		else {
			enclose_all(&g->cell[0][0], RBF_MESH_GRID);
			enclose_all(&g->block[0][0], BLOCKS);
			done = add_elements(mesh, g) && add_borders(mesh, g, used);
		}
		done = done && g->entries < RBF_MESH_BORDER && store(g, mesh);
		free(g->entry);
		free(g);
	}
	return done ? BSDFRBF_OK : rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory for the mesh of incident directions");
}
