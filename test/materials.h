/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Materials whose scattering is known exactly: the truth that measurements are simulated from and judged by.
 * Directions are unit vectors away from the surface, incidence from the front (z > 0); values are f in sr^-1
 * without the cosine, CIE X, Y, Z (equal if the material is grey).
 */
#ifndef TEST_MATERIALS_H
#define TEST_MATERIALS_H

/* Incident directions as a goniophotometer would step them: normal incidence, then every theta at every phi. */
struct steps {
	int thetas, phis;
	double theta[16], phi0, phi_step; /* degrees */
};

struct material {
	const char *name, *about;
	const char *symmetry;    /* what the steps cover: isotropic, quadrilateral, bilateral, anisotropic */
	int transmits;           /* 1: f is non-zero for outgoing z < 0, else for z > 0 */
	int coloured;
	struct steps steps;
	double fine;             /* sigma of the narrowest beam in degrees if a base scan would miss it, else 0 */
	void (*f)(const double in[3], const double out[3], double xyz[3]);
	int (*beams)(const double in[3], double beam[][3]); /* directions of at most 4 maxima, or NULL */
};

extern const struct material materials[];
extern const int materials_count;

const struct material *material_find(const char *name);
#endif
