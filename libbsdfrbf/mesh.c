/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Mesh of incident directions: mirror images, hull, what of it reaches into the fundamental domain, borders.
 *
 * The mirrored set is meshed as a whole, so that elements may straddle a mirror axis; then only what a folded
 * direction can meet is kept.
 */
#include "mesh_build.h"

#include <stdlib.h>
#include <string.h>

/* Points within this angle of one great circle make a chain, not triangles. */
#define ONE_CIRCLE 1e-3
/* An element that reaches less far than this into the domain is not needed there. */
#define REACH 1e-6

/* ------------------------------------------------------------------ vertices */

/* Spatial hash of unit vectors, so that thousands of mirrored incidences need no pairwise search. */
typedef struct hash {
	uint32_t mask, *head, *next;
} hash;

#define HASH_CELLS 1024.0 /* a unit length: cells 10 times wider than RBF_MESH_SAME */

static uint32_t hash_slot(const hash *h, const int cell[3])
{
	const uint32_t key = (uint32_t)cell[0] * 73856093u ^ (uint32_t)cell[1] * 19349663u ^ (uint32_t)cell[2] * 83492791u;
	return (key ^ key >> 15) & h->mask;
}

/* Is there a point within RBF_MESH_SAME of p? */
static int hash_find(const hash *h, const double (*points)[3], const double p[3])
{
	int low[3], high[3], cell[3];
	for (int i = 0; i < 3; i++) {
		low[i] = (int)floor((p[i] - RBF_MESH_SAME) * HASH_CELLS);
		high[i] = (int)floor((p[i] + RBF_MESH_SAME) * HASH_CELLS);
	}
	for (cell[0] = low[0]; cell[0] <= high[0]; cell[0]++)
		for (cell[1] = low[1]; cell[1] <= high[1]; cell[1]++)
			for (cell[2] = low[2]; cell[2] <= high[2]; cell[2]++)
				for (uint32_t i = h->head[hash_slot(h, cell)]; i; i = h->next[i - 1]) {
					const double *q = points[i - 1];
					const double d[3] = { p[0] - q[0], p[1] - q[1], p[2] - q[2] };
					if (rbf_dot3(d, d) < RBF_MESH_SAME * RBF_MESH_SAME)
						return 1;
				}
	return 0;
}

static void hash_add(hash *h, const double p[3], uint32_t index)
{
	const int cell[3] = { (int)floor(p[0] * HASH_CELLS), (int)floor(p[1] * HASH_CELLS), (int)floor(p[2] * HASH_CELLS) };
	const uint32_t slot = hash_slot(h, cell);
	h->next[index] = h->head[slot];
	h->head[slot] = index + 1;
}

/* Puts a direction that is on a mirror axis, or a centre of rotation, up to the device's precision exactly there. */
static void snap(rbf_symmetry symmetry, double d[3])
{
	if ((symmetry == RBF_BILATERAL_X || symmetry == RBF_QUADRILATERAL) && fabs(d[0]) < RBF_MESH_SAME / 2)
		d[0] = 0;
	if ((symmetry == RBF_BILATERAL_Y || symmetry == RBF_QUADRILATERAL) && fabs(d[1]) < RBF_MESH_SAME / 2)
		d[1] = 0;
	if (symmetry == RBF_UP && hypot(d[0], d[1]) < RBF_MESH_SAME / 2)
		d[0] = d[1] = 0;
}

/* The incidences that a mesh is made of. */
typedef struct places {
	size_t count;
	const double *direction;
	const unsigned char *out; /* as rbf_mesh_build() takes it */
	rbf_mesh_judge *judge;    /* of diagonals, or NULL */
	void *data;
} places;

/* All images of all incidences into mesh->vertex and p (4 count entries each). Incidences measured inside the
 * fundamental domain come first: where the measurement covers more than the symmetry needs, theirs are the images
 * that stay, and the mesh keeps the symmetry. */
static int add_vertices(rbf_mesh *mesh, const places *from, double (*p)[3])
{
	const size_t count = from->count;
	int op[4];
	const int ops = rbf_symmetry_ops(mesh->symmetry, op);
	hash h = { 63, NULL, NULL };
	while (h.mask < 4 * count)
		h.mask = 2 * h.mask + 1;
	h.head = calloc((size_t)h.mask + 1, sizeof *h.head);
	h.next = calloc(4 * count, sizeof *h.next);
	if (!h.head || !h.next) {
		free(h.head);
		free(h.next);
		return 0;
	}
	for (int outside = 0; outside < 2; outside++)
		for (size_t i = 0; i < count; i++) {
			const double *own = from->direction + 3 * i;
			double d[3] = { own[0], own[1], fmax(own[2], 0) };
			if ((from->out && from->out[i]) || !(rbf_unit3(d) > 0))
				continue;
			snap(mesh->symmetry, d);
			const float f[3] = { (float)d[0], (float)d[1], (float)d[2] };
			if ((rbf_symmetry_fold(mesh->symmetry, f) != RBF_OP_NONE) != outside)
				continue;
			for (int k = 0; k < ops; k++) {
				const double image[3] = { op[k] & RBF_OP_X ? -d[0] : d[0], op[k] & RBF_OP_Y ? -d[1] : d[1], d[2] };
				if (hash_find(&h, p, image))
					continue;
				rbf_vertex *v = &mesh->vertex[mesh->vertices];
				memcpy(p[mesh->vertices], image, sizeof image);
				rbf_mirror((unsigned)op[k], f, v->direction);
				v->base = (uint32_t)i;
				v->op = (uint32_t)op[k];
				hash_add(&h, image, mesh->vertices++);
			}
		}
	free(h.head);
	free(h.next);
	return 1;
}

/* ----------------------------------------------------------------- isotropic */

static int by_theta(const void *a, const void *b)
{
	const rbf_vertex *v = a, *w = b;
	const float s = v->direction[0], t = w->direction[0];
	if (s != t)
		return s < t ? -1 : 1;
	return v->direction[2] > w->direction[2] ? -1 : v->direction[2] < w->direction[2] ? 1 : 0;
}

/* Segments in theta. Without normal incidence, the mirror image of the first vertex closes the gap about the normal. */
static void add_segments(rbf_mesh *mesh, const places *from)
{
	rbf_vertex *v = mesh->vertex;
	uint32_t n = 0;
	for (size_t i = 0; i < from->count; i++) {
		const double *d = from->direction + 3 * i;
		if (from->out && from->out[i])
			continue;
		const double theta = rbf_theta3(d);
		v[n].direction[0] = theta < RBF_MESH_SAME / 2 ? 0 : (float)sin(theta);
		v[n].direction[1] = 0;
		v[n].direction[2] = d[2] > 0 ? (float)cos(theta) : 0;
		v[n].base = (uint32_t)i;
		v[n++].op = RBF_OP_NONE;
	}
	qsort(v, n, sizeof *v, by_theta);
	uint32_t unique = 0;
	for (uint32_t i = 0; i < n; i++) {
		const float *a = v[i].direction, *b = v[unique ? unique - 1 : 0].direction;
		if (!unique || hypot((double)a[0] - b[0], (double)a[2] - b[2]) > RBF_MESH_SAME)
			v[unique++] = v[i];
	}
	if (unique && v[0].direction[0] > 0) {
		memmove(v + 1, v, unique * sizeof *v);
		unique++;
		v[0] = v[1];
		v[0].direction[0] = -v[0].direction[0];
		v[0].op = RBF_OP_X;
	}
	mesh->vertices = unique;
	for (uint32_t i = 0; i + 1 < unique; i++) {
		rbf_element *e = &mesh->element[mesh->elements++];
		const float *a = v[i].direction, *b = v[i + 1].direction;
		const double theta = atan2(a[0], a[2]);
		memset(e, 0, sizeof *e);
		e->v[0] = i;
		e->v[1] = e->v[2] = i + 1;
		e->inverse[0][0] = (float)theta;
		e->inverse[0][1] = (float)(1 / (atan2(b[0], b[2]) - theta));
	}
	if (unique) {
		mesh->border[0][0] = mesh->border[0][1] = unique - 1;
		mesh->border[0][2] = mesh->elements ? mesh->elements - 1 : RBF_MESH_NO_ELEMENT;
		mesh->borders = 1;
	}
}

/* --------------------------------------------------------------------- chain */

typedef struct link { double angle; uint32_t vertex; } link;

static int by_angle(const void *a, const void *b)
{
	const double x = ((const link *)a)->angle, y = ((const link *)b)->angle;
	return (x > y) - (x < y);
}

/* Are the points on one great circle? Then its pole. */
static int on_one_circle(size_t n, const double (*p)[3], double pole[3])
{
	double best = -1;
	pole[0] = pole[1] = pole[2] = 0;
	for (size_t i = 1; i < n; i++) {
		double c[3];
		rbf_cross3(p[0], p[i], c);
		const double length = rbf_dot3(c, c);
		if (length > best) {
			best = length;
			memcpy(pole, c, sizeof c);
		}
	}
	if (n < 3 && !(rbf_unit3(pole) > 1e-9)) { /* a point, or two opposite ones: any circle through them */
		const double up[3] = { 0, 0, 1 }, right[3] = { 1, 0, 0 };
		rbf_cross3(p[0], fabs(p[0][2]) < .9 ? up : right, pole);
	}
	rbf_unit3(pole);
	for (size_t i = 0; i < n; i++)
		if (fabs(rbf_dot3(pole, p[i])) > ONE_CIRCLE)
			return 0;
	return 1;
}

/* Borders that link the points along their circle; arcs of half a circle and more stay open. False: no memory. */
static int add_chain(rbf_mesh *mesh, const double (*p)[3], const double pole[3])
{
	const uint32_t n = mesh->vertices;
	if (n == 1) {
		mesh->border[0][0] = mesh->border[0][1] = 0;
		mesh->border[0][2] = RBF_MESH_NO_ELEMENT;
		mesh->borders = 1;
		return 1;
	}
	link *order = malloc(n * sizeof *order);
	if (!order)
		return 0;
	double side[3];
	rbf_cross3(pole, p[0], side);
	for (uint32_t i = 0; i < n; i++)
		order[i] = (link){ atan2(rbf_dot3(p[i], side), rbf_dot3(p[i], p[0])), i };
	qsort(order, n, sizeof *order, by_angle);
	double widest = -1;
	uint32_t opening = 0; /* the link that stays open */
	for (uint32_t i = 0; i < n; i++) {
		const double gap = i + 1 < n ? order[i + 1].angle - order[i].angle
			: order[0].angle + 2 * RBF_PI - order[i].angle;
		if (gap > widest + 1e-9) {
			widest = gap;
			opening = i;
		}
	}
	const int closed = widest < RBF_PI - ONE_CIRCLE;
	for (uint32_t i = 0; i < n; i++)
		if (closed || i != opening) {
			uint32_t *border = mesh->border[mesh->borders++];
			border[0] = order[i].vertex;
			border[1] = order[(i + 1) % n].vertex;
			border[2] = RBF_MESH_NO_ELEMENT;
		}
	free(order);
	return 1;
}

/* ----------------------------------------------------------------- triangles */

/* Does the cone over these corners (3: triangle, 2: arc) reach into the fundamental domain's inside? The domain is
 * bounded by planes through the origin, so that the flat polygon can be clipped in place of the spherical one. */
static int reaches(rbf_symmetry symmetry, const double *const corner[], int corners)
{
	double polygon[2][8][3];
	int n = corners, from = 0;
	for (int i = 0; i < n; i++)
		memcpy(polygon[0][i], corner[i], sizeof polygon[0][i]);
	for (int axis = 0; axis < 2; axis++) {
		if (axis == 0 ? symmetry != RBF_BILATERAL_X && symmetry != RBF_QUADRILATERAL
				: symmetry != RBF_BILATERAL_Y && symmetry != RBF_QUADRILATERAL && symmetry != RBF_UP)
			continue;
		double (*in)[3] = polygon[from], (*out)[3] = polygon[1 - from];
		double furthest = 0;
		int m = 0;
		for (int i = 0; i < n; i++) {
			const double *a = in[i], *b = in[(i + 1) % n];
			furthest = fmax(furthest, a[axis]);
			if (a[axis] >= 0)
				memcpy(out[m++], a, sizeof *out);
			if ((a[axis] >= 0) != (b[axis] >= 0)) {
				const double t = a[axis] / (a[axis] - b[axis]);
				for (int k = 0; k < 3; k++)
					out[m][k] = a[k] + t * (b[k] - a[k]);
				m++;
			}
		}
		/* An arc may lie on the axis; a triangle has to come off it. */
		if (!m || (corners == 3 && furthest < REACH))
			return 0;
		n = m;
		from = 1 - from;
	}
	if (corners == 3)
		return 1;
	double length = 0; /* of the arc that is left: meeting the domain in a point is not enough */
	for (int i = 1; i < n; i++)
		for (int k = 0; k < 3; k++)
			length = fmax(length, fabs(polygon[from][i][k] - polygon[from][0][k]));
	return length > REACH;
}

static void set_inverse(const rbf_vertex *vertex, rbf_element *e)
{
	double p[3][3], row[3];
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 3; i++)
			p[k][i] = vertex[e->v[k]].direction[i];
	rbf_cross3(p[1], p[2], row);
	const double determinant = rbf_dot3(row, p[0]);
	for (int k = 0; k < 3; k++) {
		rbf_cross3(p[(k + 1) % 3], p[(k + 2) % 3], row);
		for (int i = 0; i < 3; i++)
			e->inverse[k][i] = (float)(row[i] / determinant);
	}
}

/* Elements and borders of the triangles that matter in the domain; number[t] is the element of triangle t, or none.
 * A border names its triangle until the locator has told which borders are used. */
static void add_elements(rbf_mesh *mesh, const double (*p)[3], size_t triangles, const rbf_triangle *triangle,
	uint32_t *number)
{
	for (size_t t = 0; t < triangles; t++) {
		const uint32_t *v = triangle[t].v;
		const double *const corner[3] = { p[v[0]], p[v[1]], p[v[2]] };
		number[t] = RBF_MESH_NO_ELEMENT;
		if (reaches(mesh->symmetry, corner, 3)) {
			number[t] = mesh->elements;
			memcpy(mesh->element[mesh->elements].v, v, sizeof triangle[t].v);
			set_inverse(mesh->vertex, &mesh->element[mesh->elements++]);
		}
		for (int k = 0; k < 3; k++) {
			const uint32_t a = v[(k + 1) % 3], b = v[(k + 2) % 3];
			const double *const end[2] = { p[a], p[b] };
			/* A mirror-symmetric mesh has the nearest rim point on the direction's own side; rotation by 180
			 * degrees does not promise that. */
			if (triangle[t].neighbour[k] < 0 && (mesh->symmetry == RBF_UP || reaches(mesh->symmetry, end, 2))) {
				uint32_t *border = mesh->border[mesh->borders++];
				border[0] = a;
				border[1] = b;
				border[2] = (uint32_t)t;
			}
		}
	}
}

/* Drops the borders that no cell lists, gives the others their elements, and drops unused vertices. */
static int tidy(rbf_mesh *mesh, const rbf_triangle *triangle, uint32_t *number, const unsigned char *used)
{
	uint32_t *renumber = calloc((size_t)mesh->vertices + mesh->borders + 1, sizeof *renumber);
	if (!renumber)
		return 0;
	uint32_t kept = 0;
	for (uint32_t i = 0; i < mesh->borders; i++) {
		if (!used[i])
			continue;
		const uint32_t t = mesh->border[i][2];
		if (triangle && number[t] == RBF_MESH_NO_ELEMENT) {
			number[t] = mesh->elements;
			memcpy(mesh->element[mesh->elements].v, triangle[t].v, sizeof triangle[t].v);
			set_inverse(mesh->vertex, &mesh->element[mesh->elements++]);
		}
		renumber[i] = kept;
		mesh->border[kept][0] = mesh->border[i][0];
		mesh->border[kept][1] = mesh->border[i][1];
		mesh->border[kept++][2] = triangle ? number[t] : RBF_MESH_NO_ELEMENT;
	}
	for (uint32_t i = 0; i < mesh->cell_entries; i++)
		if (mesh->cell_element[i] & RBF_MESH_BORDER)
			mesh->cell_element[i] = RBF_MESH_BORDER | renumber[mesh->cell_element[i] & ~RBF_MESH_BORDER];
	mesh->borders = kept;

	uint32_t vertices = 0;
	memset(renumber, 0, mesh->vertices * sizeof *renumber);
	for (uint32_t i = 0; i < mesh->elements; i++)
		for (int k = 0; k < 3; k++)
			renumber[mesh->element[i].v[k]] = 1;
	for (uint32_t i = 0; i < mesh->borders; i++)
		renumber[mesh->border[i][0]] = renumber[mesh->border[i][1]] = 1;
	for (uint32_t i = 0; i < mesh->vertices; i++)
		if (renumber[i]) {
			mesh->vertex[vertices] = mesh->vertex[i];
			renumber[i] = vertices++;
		}
	mesh->vertices = vertices;
	for (uint32_t i = 0; i < mesh->elements; i++)
		for (int k = 0; k < 3; k++)
			mesh->element[i].v[k] = renumber[mesh->element[i].v[k]];
	for (uint32_t i = 0; i < mesh->borders; i++)
		for (int k = 0; k < 2; k++)
			mesh->border[i][k] = renumber[mesh->border[i][k]];
	free(renumber);
	return 1;
}

static bsdfrbf_status out_of_memory(bsdfrbf_context *context)
{
	return rbf_fail(context, BSDFRBF_ERR_MEMORY, "out of memory for the mesh of incident directions");
}

static bsdfrbf_status build_surface(bsdfrbf_context *context, rbf_mesh *mesh, const places *from, double (*p)[3],
	rbf_triangle **triangle, uint32_t **number, unsigned char **used)
{
	size_t triangles = 0;
	double pole[3];
	if (!add_vertices(mesh, from, p))
		return out_of_memory(context);
	if (!mesh->vertices)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "no incident direction to make a mesh of");
	const int chain = on_one_circle(mesh->vertices, (const double (*)[3])p, pole);
	if (!chain)
		RBF_TRY(rbf_hull(context, mesh->vertices, (const double (*)[3])p, &triangles, triangle));
	if (triangles && from->judge)
		RBF_TRY(rbf_mesh_diagonals(context, mesh, (const double (*)[3])p, triangles, *triangle, from->judge, from->data));
	const size_t borders = chain ? mesh->vertices : 3 * triangles;
	mesh->element = calloc(triangles + 1, sizeof *mesh->element);
	mesh->border = calloc(borders + 1, sizeof *mesh->border);
	*number = calloc(triangles + 1, sizeof **number);
	*used = calloc(borders + 1, 1);
	if (!mesh->element || !mesh->border || !*number || !*used)
		return out_of_memory(context);
	if (chain) {
		if (!add_chain(mesh, (const double (*)[3])p, pole))
			return out_of_memory(context);
	} else
		add_elements(mesh, (const double (*)[3])p, triangles, *triangle, *number);
	RBF_TRY(rbf_mesh_grid(context, mesh, *used));
	return tidy(mesh, *triangle, *number, *used) ? BSDFRBF_OK : out_of_memory(context);
}

static bsdfrbf_status build(bsdfrbf_context *context, rbf_symmetry symmetry, const places *from, rbf_mesh *mesh)
{
	const size_t count = from->count;
	memset(mesh, 0, sizeof *mesh);
	if (!count || count > INT32_MAX / 16)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "cannot mesh %zu incident directions", count);
	mesh->symmetry = symmetry;
	mesh->bases = (uint32_t)count;
	mesh->vertex = calloc(4 * count, sizeof *mesh->vertex);
	bsdfrbf_status status;
	if (!mesh->vertex)
		status = out_of_memory(context);
	else if (symmetry == RBF_ISOTROPIC) {
		unsigned char used;
		mesh->element = calloc(count + 1, sizeof *mesh->element);
		mesh->border = calloc(1, sizeof *mesh->border);
		if (!mesh->element || !mesh->border)
			status = out_of_memory(context);
		else {
			add_segments(mesh, from);
			status = mesh->vertices ? rbf_mesh_grid(context, mesh, &used)
				: rbf_fail(context, BSDFRBF_ERR_DATA, "no incident direction to make a mesh of");
		}
	} else {
		double (*p)[3] = calloc(4 * count, sizeof *p);
		rbf_triangle *triangle = NULL;
		uint32_t *number = NULL;
		unsigned char *used = NULL;
		status = p ? build_surface(context, mesh, from, p, &triangle, &number, &used)
			: out_of_memory(context);
		free(p);
		free(triangle);
		free(number);
		free(used);
	}
	if (status != BSDFRBF_OK)
		rbf_mesh_free(mesh);
	return status;
}

bsdfrbf_status rbf_mesh_build(bsdfrbf_context *context, rbf_symmetry symmetry, size_t count, const double *directions,
	const unsigned char *out, rbf_mesh *mesh)
{
	const places from = {.count = count, .direction = directions, .out = out};
	return build(context, symmetry, &from, mesh);
}

bsdfrbf_status rbf_mesh_build_judged(bsdfrbf_context *context, rbf_symmetry symmetry, size_t count, const double *directions,
	rbf_mesh_judge *judge, void *data, rbf_mesh *mesh)
{
	const places from = {.count = count, .direction = directions, .judge = judge, .data = data};
	return build(context, symmetry, &from, mesh);
}

void rbf_mesh_free(rbf_mesh *mesh)
{
	if (!mesh)
		return;
	free(mesh->vertex);
	free(mesh->element);
	free(mesh->border);
	free(mesh->cell_first);
	free(mesh->cell_element);
	memset(mesh, 0, sizeof *mesh);
}

double rbf_mesh_spacing(const rbf_mesh *mesh)
{
	const int sides = mesh->symmetry == RBF_ISOTROPIC ? 1 : 3; /* a segment's other corner is repeated */
	double sum = 0;
	for (uint32_t e = 0; e < mesh->elements; e++)
		for (int k = 0; k < sides; k++)
			sum += (double)rbf_angle(mesh->vertex[mesh->element[e].v[k]].direction, mesh->vertex[mesh->element[e].v[(k + 1) % 3]].direction);
	return mesh->elements ? sum / ((double)sides * mesh->elements) : 0;
}
