/* SPDX-License-Identifier: BSD-3-Clause */
/* One component's build: its incidences, and their fits. */
#ifndef RBF_JOB_H
#define RBF_JOB_H
#include "folded.h"
#include "left_out.h"
#include "measure.h"

/* What one component's build holds until it is done. */
typedef struct rbf_job {
	const char *name;       /* of the component, for messages */
	int channels;
	uint32_t asked;         /* places of lobes in each fit; 0: chosen from the data */
	rbf_measured measured;  /* chosen incidences; samples borrowed, unless turned */
	int turned;             /* samples are our own copies */
	rbf_measured own;       /* or those of joined or mirrored images are, in here */
	int transmits;          /* of transmission */
	double *direction;
	rbf_symmetry_choice symmetry;
	float *fit_error;
	uint32_t *lobes;        /* places of lobes in each fit, if they are ours */
	float *scatter, *missed; /* errors of the fits by fit_error.h, if they are ours: by noise, and what they miss alike */
	unsigned char *coarse;  /* [bases] 1: most light stands on a single sample (tell.h); NULL: not asked yet */
	float azimuths;         /* by how much other azimuths tell otherwise, turned about the normal, beyond noise (isotropy.h); < 0: not asked, or they do not tell */
	float *guess;           /* error of what was guessed beside one plane, or NULL */
	float *doubt;           /* error of what was not measured (unknown.h), or NULL */
	float held_out;         /* mean error of fits against samples left out, < 0: not measured */
	rbf_fitted fitted;
	float *scale;           /* of each incidence (scale.h), or NULL where all are 1 */
	rbf_left_out left_out;  /* between the first frames and the others, which it is for; its `fitted` is this job's */
	rbf_choice choice;
	uint32_t filled, mirrored; /* as of rbf_component */
} rbf_job;

/* Incidences worth fitting: not grazing, not the same twice. Errors: DATA, MEMORY. */
bsdfrbf_status rbf_job_select(bsdfrbf_context *context, const rbf_measured *all, rbf_job *job);

/* Fits all of them, in place of former fits, and the Lambertian part into component->lambertian. Errors: DATA, MEMORY, CANCELLED. Opens OpenMP regions. */
bsdfrbf_status rbf_job_fit(bsdfrbf_context *context, double progress, rbf_job *job, rbf_component *component);

/* Fits all of them once more, isotropic and turned to azimuth 0, with twins (twins.h), unless these are farther from held-out samples than the
 * fits there are. Errors: MEMORY. Opens OpenMP regions. */
bsdfrbf_status rbf_job_pair(bsdfrbf_context *context, rbf_job *job, const rbf_component *component);

/* Fits of incidences that images were joined with (folded.h), from those of the former job; what was not joined is copied. The Lambertian part stays. Returns 0,
 * or -1 when out of memory. Opens an OpenMP region. */
int rbf_job_fit_joined(const rbf_job *former, const rbf_fold *fold, const float lambertian[3], rbf_job *job);

/* The same incidences once more, for other fits. Samples and mesh are borrowed, samples copied if `own`. Returns 0, or -1 when out of memory; to be freed in
 * any case. */
int rbf_job_copy(const rbf_job *job, int own, rbf_job *other);
void rbf_job_free(rbf_job *job);

/* Mean leave-one-out error, before and after, of incidences that both a job and another know of that has images joined. fold: of the former's. By what joined
 * measurements differ counts: what they have in common may be less than there is. Returns 0 if there are none. */
int rbf_job_compare(const rbf_job *job, const rbf_job *joined, const rbf_fold *fold, float lambertian, double error[2]);

static inline void rbf_job_angles(const double d[3], double *theta, double *phi)
{
	*theta = atan2(hypot(d[0], d[1]), d[2]) * 180 / RBF_PI;
	*phi = *theta < 1e-3 ? 0 : fmod(atan2(d[1], d[0]) * 180 / RBF_PI + 360, 360);
}
#endif
