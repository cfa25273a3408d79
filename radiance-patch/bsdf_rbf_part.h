/* SPDX-License-Identifier: BSD-3-Clause */
/* What bsdf_rbf.c and bsdf_rbf_through.c share: files of libbsdfrbf and their components. */
#ifndef BSDF_RBF_PART_H
#define BSDF_RBF_PART_H
#include "bsdfrbf.h"

#define RBF_THETAS	16	/* cells of the table of through peaks */
#define RBF_PHIS	24

/* One file: the components share its model, and the last one to go closes it. */
typedef struct {
	bsdfrbf_model	*model;
	unsigned long	serial;		/* no two files have the same, even one after the other in the same place */
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

/* f (luminance) of a transmission, Lambertian part included, added up as SDevalBSDF() does, to the last bit: m_bsdf.c counts equal values
 * once, and so must we. */
extern double	rbf_seen(const RBFpart *part, const RREAL *v1, const RREAL *v2);

/* Fills file->through. */
extern void	rbf_find_through(RBFfile *file);

/* Area of the through peak at incidence v, 0 if there is none. */
extern double	rbf_through(const RBFfile *file, const RREAL *v);

/* Answer of queryProjSA for v2 near -v1; smallest: that of the library. */
extern double	rbf_through_psa(RBFpart *part, const RREAL *v1, const RREAL *v2, double smallest);

/* What the environment asks for: 0 direct, -1 not understood, else 1: a tree of 2^*log2 cells a side (0: by default). */
extern int	rbf_form(int *log2);

/* XML of the model's tree, for Radiance's own loader; NULL on failure, with the reason in SDerrorDetail (room characters). */
extern const char *	rbf_tree_file(const bsdfrbf_model *model, int log2, size_t room);

#endif
