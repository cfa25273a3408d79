/* SPDX-License-Identifier: BSD-3-Clause */
/* Symmetry of a measurement and the mesh of its incident directions. Incident directions have z >= 0. */
#ifndef RBF_MESH_H
#define RBF_MESH_H
#include "status.h"
#include "vector.h"

/* Mirror operations are bits, so that composing two is their exclusive or. */
enum { RBF_OP_NONE = 0, RBF_OP_X = 1, RBF_OP_Y = 2, RBF_OP_XY = 3 };

/* Symmetry groups. */
typedef enum rbf_symmetry {
	RBF_ANISOTROPIC = 'A',  /* {none} */
	RBF_BILATERAL_X = 'x',  /* {none, X}: x -> -x maps the material onto itself */
	RBF_BILATERAL_Y = 'y',  /* {none, Y} */
	RBF_UP = 'U',           /* {none, XY}: rotation by 180 degrees */
	RBF_QUADRILATERAL = 'Q',/* {none, X, Y, XY} */
	RBF_ISOTROPIC = 'I'     /* any rotation about z (and mirroring) */
} rbf_symmetry;

/* Writes the group's operations to op[4]; returns how many (1, 2 or 4; 1 if isotropic). */
int rbf_symmetry_ops(rbf_symmetry symmetry, int op[4]);

/* Operation that takes `direction` into the group's fundamental domain (e.g. y >= 0 for RBF_BILATERAL_Y,
 * y > 0 or (y = 0 and x >= 0) for RBF_UP, x, y >= 0 for RBF_QUADRILATERAL). Not for RBF_ISOTROPIC. */
static inline int rbf_symmetry_fold(rbf_symmetry symmetry, const float d[3])
{
	switch (symmetry) {
	case RBF_BILATERAL_X: return (d[0] < 0) * RBF_OP_X;
	case RBF_BILATERAL_Y: return (d[1] < 0) * RBF_OP_Y;
	case RBF_UP: return ((d[1] < 0) | ((d[1] == 0) & (d[0] < 0))) * RBF_OP_XY;
	case RBF_QUADRILATERAL: return (d[0] < 0) * RBF_OP_X | (d[1] < 0) * RBF_OP_Y;
	default: return RBF_OP_NONE;
	}
}

typedef struct rbf_vertex {
	float direction[3];  /* unit, z >= 0 */
	uint32_t base;       /* measured incidence it is a mirror image of */
	uint32_t op;         /* operation that takes the measured direction to this one */
} rbf_vertex;

/* One mesh element: a spherical triangle, counter-clockwise seen from outside, or, if isotropic, a segment in theta
 * (v[2] == v[1]). weights(w) = inverse . w for an incident direction w, clipped at 0 and normalised to sum 1. */
typedef struct rbf_element {
	uint32_t v[3];
	float inverse[3][3]; /* inverse of the matrix with the vertices as columns; if isotropic: [0][0] is theta at v[0],
	                        [0][1] is 1 / (theta at v[1] - theta at v[0]), the rest is 0 */
} rbf_element;

#define RBF_MESH_GRID 64 /* cells a side of the locator, over the disc of rbf_disc_from_direction() in vector.h */

typedef struct rbf_mesh {
	rbf_symmetry symmetry;
	uint32_t bases;          /* measured incidences */
	uint32_t vertices, elements;
	rbf_vertex *vertex;      /* those that elements and borders use. If isotropic: y = 0, sorted by x; all at azimuth 0, but
	                            where normal incidence is missing vertex 0 is the image of vertex 1 (op RBF_OP_X) */
	rbf_element *element;    /* those that reach into the fundamental domain, then any others that borders belong to */
	uint32_t borders;        /* boundary edges, for directions outside: border[i] = two vertices, in the cyclic order of the
	                            element they belong to, and that element (RBF_MESH_NO_ELEMENT in a chain) */
	uint32_t (*border)[3];
	/* locator: cell (ix, iy) lists elements cell_first[c] .. cell_first[c+1]-1 of cell_element, c = iy*RBF_MESH_GRID+ix, or if
	 * isotropic c = ix, one row over theta.
	 * Every element that overlaps the cell, first those that hold most of it; for a cell that is wholly or partly outside the
	 * mesh also bit 31 set on entries that are BORDER indices: the candidates nearest to some point of that cell. */
	uint32_t *cell_first;    /* rbf_mesh_cells() + 1 */
	uint32_t *cell_element;
	uint32_t cell_entries;
} rbf_mesh;

static inline uint32_t rbf_mesh_cells(const rbf_mesh *mesh)
{
	return mesh->symmetry == RBF_ISOTROPIC ? RBF_MESH_GRID / 2 : RBF_MESH_GRID * RBF_MESH_GRID;
}

#define RBF_MESH_BORDER 0x80000000u
#define RBF_MESH_NO_ELEMENT 0xffffffffu

/* What the azimuths of the incident directions say. */
typedef struct rbf_symmetry_choice {
	rbf_symmetry symmetry;
	rbf_symmetry other;  /* that the coverage and what was asked for allow as well: the other mirror axis, or half a turn; or the same */
	char text[160];      /* e.g. "bilateral, mirror y (azimuths 0 to 180 measured)" */
} rbf_symmetry_choice;

/* Finds the symmetry from coverage: all directions (beyond a degree from the normal) at one azimuth: isotropic;
 * within one quadrant: quadrilateral; within one half bounded by the x or the y axis: bilateral, mirrored
 * across that axis (or unchanged by half a turn, "up": the data tell, or asked); the full circle: anisotropic. `asked` is 0, 'I', 'Q',
 * 'B', 'U' or 'A' (as -s of pabopto2bsdf(1)) and wins, with DATA error if the coverage cannot support it.
 * Where nothing fits else, what hangs over by a small arc counts as an image, with a warning.
 * Coverage that fits nothing: DATA error that lists the azimuths that are missing. directions: count x 3. */
bsdfrbf_status rbf_symmetry_choose(bsdfrbf_context *context, size_t count, const double *directions, char asked,
	rbf_symmetry_choice *choice);

/* Another symmetry in its place, that the data have and the coverage allows. */
void rbf_symmetry_found(rbf_symmetry symmetry, rbf_symmetry_choice *choice);

/* Mesh over the directions (count x 3, unit, z >= 0, no duplicates) mirrored by the group. count >= 1.
 * out: of each incidence, 1 if it is left out with its mirror images, or NULL; vertex[].base still numbers the incidences as given.
 * Degenerate input (fewer than 3 vertices, all on one great circle) gives a mesh with 0 elements and borders that chain the vertices (one
 * border (v, v) for a single vertex).
 * Errors: DATA, MEMORY, INTERNAL. */
bsdfrbf_status rbf_mesh_build(bsdfrbf_context *context, rbf_symmetry symmetry, size_t count, const double *directions,
	const unsigned char *out, rbf_mesh *mesh);

/* An incidence, and others to tell it from: vertices as a site takes them, that of the incidence in the fundamental domain. */
typedef struct rbf_mesh_trial {
	rbf_vertex vertex, from[3];
	float weight[3];
} rbf_mesh_trial;

/* Tells how wrong each is told. Returns 0, or -1 when out of memory. */
typedef int rbf_mesh_judge(void *data, size_t count, const rbf_mesh_trial *trial, float *error);

/* The same mesh of all directions, but for which diagonals cut quadrilaterals whose corners are on one circle: those along which the judge
 * finds incidences told better. Not for RBF_ISOTROPIC. */
bsdfrbf_status rbf_mesh_build_judged(bsdfrbf_context *context, rbf_symmetry symmetry, size_t count, const double *directions,
	rbf_mesh_judge *judge, void *data, rbf_mesh *mesh);
void rbf_mesh_free(rbf_mesh *mesh);

/* Marks what is to be left out if an incidence is, as one tells nothing new of the other: all that was measured at the same place or at an
 * image of it, within a quarter of an even spacing. directions: count x 3; out: [count]. */
void rbf_mesh_leave_out(rbf_symmetry symmetry, size_t count, const double *directions, size_t which, unsigned char *out);

/* Mean length (radians) of the elements' sides, each as often as elements have it; 0 without elements. */
double rbf_mesh_spacing(const rbf_mesh *mesh);

/* Corners and barycentric weights for incident direction d (unit, z >= 0, folded into the fundamental domain,
 * or y = 0, x >= 0 if isotropic). Returns the element index, or RBF_MESH_BORDER | border index when outside (then weights
 * are those of the nearest point, by angle, of the boundary: continuous with the inside). corner[3], weight[3];
 * unused corners have weight 0 and repeat a used vertex. */
uint32_t rbf_mesh_locate(const rbf_mesh *mesh, const float d[3], uint32_t corner[3], float weight[3]);

/* The same for a direction that is in none of the first two elements of its cell (mesh_inside.h): most of those are outside. */
uint32_t rbf_mesh_search(const rbf_mesh *mesh, const float d[3], uint32_t corner[3], float weight[3]);
#endif
