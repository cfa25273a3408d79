/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * libbsdfrbf: measured bidirectional scattering as moving Gaussian lobes.
 *
 * Conventions (those of Radiance's bsdf.h)
 *   Directions  unit vectors that point away from the surface. +Z is the front
 *               (room) normal, +X is right as seen from the front, +Y is up.
 *               Any non-zero length is accepted and normalised.
 *   Angles      radians, unless a name ends in _deg.
 *   Values      BSDF f in sr^-1, WITHOUT the cosine. DSF = f |cos(theta_o)|.
 *               DHR = integral of f |cos(theta_o)| over the exitant hemisphere.
 *   Channels    1 (CIE Y) or 3 (CIE X, Y, Z, in this order).
 *   Components  rf, rb, tf, tb: named by the incident side (front or back) and
 *               by what happens there (reflection, transmission). tf takes an
 *               incident vector with z > 0 to exitant vectors with z < 0.
 *               A transmission side that was not measured is answered from the
 *               other one by reciprocity, f(a, b) = f(b, a).
 *
 * Errors        Functions that can fail return a bsdfrbf_status and leave a
 *               message, with file, line and remedy where they apply, in the
 *               context. The library never prints, never exits, and keeps no
 *               mutable globals.
 * Threads       A context belongs to one thread at a time. A bsdfrbf_model is
 *               immutable once built or opened: any number of threads and of
 *               forked processes may evaluate and sample it together (what it
 *               works out when first asked, for DHR and samples by reciprocity,
 *               it keeps, safely for all threads; up to some 10 MB). OpenMP
 *               is used only inside bsdfrbf_build() and the bsdfrbf_write_ functions.
 * Ownership     Who gets a pointer from a *_new, *_open or *_build function
 *               releases it with the matching *_free or *_close, which take
 *               NULL. Everything else stays the callee's.
 */
#ifndef BSDFRBF_H
#define BSDFRBF_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define BSDFRBF_API __attribute__((visibility("default")))
#else
#define BSDFRBF_API
#endif

#define BSDFRBF_VERSION_MAJOR 0
#define BSDFRBF_VERSION_MINOR 1
#define BSDFRBF_VERSION_PATCH 0

/* "0.1.0": version of the library that is loaded. */
BSDFRBF_API const char *bsdfrbf_version(void);

/* ------------------------------------------------------------------ status */

/* Numbers are pinned: they never change their meaning. */
typedef enum bsdfrbf_status {
	BSDFRBF_OK = 0,
	BSDFRBF_ERR_ARGUMENT = 1,    /* a caller's mistake */
	BSDFRBF_ERR_MEMORY = 2,      /* out of memory */
	BSDFRBF_ERR_IO = 3,          /* cannot open, read, write or rename */
	BSDFRBF_ERR_SYNTAX = 4,      /* text input that does not follow its format */
	BSDFRBF_ERR_DATA = 5,        /* well-formed measurements that cannot be used */
	BSDFRBF_ERR_FORMAT = 6,      /* not an .rbf file, or a damaged one */
	BSDFRBF_ERR_VERSION = 7,     /* an .rbf file from a later, incompatible version */
	BSDFRBF_ERR_UNSUPPORTED = 8, /* valid, but not supported */
	BSDFRBF_ERR_CANCELLED = 9,   /* the progress callback asked to stop */
	BSDFRBF_ERR_INTERNAL = 10    /* a defect of the library */
} bsdfrbf_status;

/* Short English text for a status; never NULL. */
BSDFRBF_API const char *bsdfrbf_status_text(bsdfrbf_status status);

/* Holds the message of the last failure, and where warnings and progress go. */
typedef struct bsdfrbf_context bsdfrbf_context;

/* New context, or NULL when out of memory. */
BSDFRBF_API bsdfrbf_context *bsdfrbf_context_new(void);
/* Releases it; NULL: nothing to do. */
BSDFRBF_API void bsdfrbf_context_free(bsdfrbf_context *context);

/* Message of the last failure, "" if none; valid until the next call with this context. */
BSDFRBF_API const char *bsdfrbf_message(const bsdfrbf_context *context);

/* `warn` is called, from the calling thread, with one line of text (no newline) for each thing
 * that a user should know but that does not stop the work. NULL: warnings are dropped. */
BSDFRBF_API void bsdfrbf_set_warning(bsdfrbf_context *context,
	void (*warn)(void *user, const char *text), void *user);

/* `progress` is called, from the calling thread, with the stage's name and the share done in [0, 1]
 * of the whole build; a non-zero answer cancels. NULL: none. */
BSDFRBF_API void bsdfrbf_set_progress(bsdfrbf_context *context,
	int (*progress)(void *user, const char *stage, double done), void *user);

/* ------------------------------------------------------------ measurements */

/* Measured samples, gathered per incident direction, component and colour. */
typedef struct bsdfrbf_data bsdfrbf_data;

/* Incident side and what happens there. */
typedef enum bsdfrbf_component {
	BSDFRBF_RF = 0, /* reflection of what comes from the front */
	BSDFRBF_RB = 1, /* reflection of what comes from the back */
	BSDFRBF_TF = 2, /* transmission from the front to the back */
	BSDFRBF_TB = 3  /* transmission from the back to the front */
} bsdfrbf_component;

/* What measured values are. */
typedef enum bsdfrbf_quantity {
	BSDFRBF_QUANTITY_BSDF = 0, /* sr^-1, no cosine */
	BSDFRBF_QUANTITY_DSF = 1   /* BSDF times |cos(theta_o)| */
} bsdfrbf_quantity;

/* Empty measurements, or NULL when out of memory. */
BSDFRBF_API bsdfrbf_data *bsdfrbf_data_new(bsdfrbf_context *context);

/* Releases them; NULL: nothing to do. */
BSDFRBF_API void bsdfrbf_data_free(bsdfrbf_data *data);

/* Reads one measurement file: Mountain (PAB-Opto) text as described in pabopto2bsdf(1), or Zemax
 * tabular BSDF text, or a finished Radiance .sir interpolant, which then is the only file of its component, has lobes instead
 * of samples and is not fitted again; recognised from its content. Several measurement files may describe one incidence.
 * On failure `data` is as it was. Errors: IO, SYNTAX, DATA, MEMORY. */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_read(bsdfrbf_context *context, bsdfrbf_data *data, const char *path);

/* Adds `count` samples measured at one incident direction. outgoing: count x 3; values: count x
 * channels, row by row. Samples on both sides of the surface may be mixed.
 * On failure `data` is as it was. Errors: ARGUMENT, DATA (a value that is not finite), MEMORY. */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_add(bsdfrbf_context *context, bsdfrbf_data *data,
	const double incident[3], size_t count, const double *outgoing, const double *values,
	int channels, bsdfrbf_quantity quantity);

/* Channels of what has been read: 0 while empty, then 1 or 3. */
BSDFRBF_API int bsdfrbf_data_channels(const bsdfrbf_data *data);

/* Number of incident directions at which a component was measured. */
BSDFRBF_API size_t bsdfrbf_data_incidences(const bsdfrbf_data *data, bsdfrbf_component component);

/* Samples of one incident direction, seen from the component's own sides: all vectors have z > 0, x and y are kept.
 * The arrays are the data's, valid until it is changed or freed. */
typedef struct bsdfrbf_samples {
	double direction[3];    /* incident, unit */
	size_t count;           /* of samples */
	const double *outgoing; /* count x 3, unit */
	const float *dsf;       /* count x channels, f |cos(theta_o)|, sr^-1, with noise that may be negative */
} bsdfrbf_samples;

/* Fills `samples` with those of incident direction `index` of a component. Errors: ARGUMENT (no such incidence). */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_get(const bsdfrbf_data *data, bsdfrbf_component component, size_t index,
	bsdfrbf_samples *samples);

/* 1: all samples of that incident direction lie in one plane, as one scan of an instrument's arm gives them; what lies beside it was not
 * measured. 0: they do not, or there is no such incidence. */
BSDFRBF_API int bsdfrbf_data_in_plane(const bsdfrbf_data *data, bsdfrbf_component component, size_t index);

/* Share of the exitant hemisphere that is farther from all samples of that incident direction than these are from each other. 0: there is no such
 * incidence, or it was not measured here. */
BSDFRBF_API double bsdfrbf_data_unmeasured(const bsdfrbf_data *data, bsdfrbf_component component, size_t index);

/* Turns the sample front to back about its vertical (y) axis, as for one that was mounted the other way round:
 * front and back change places and left becomes right; up stays up. */
BSDFRBF_API void bsdfrbf_data_reverse(bsdfrbf_data *data);

/* Removes the samples whose exitant direction is nearer than `limit_deg` to grazing (elevation above the surface). A
 * negative limit stands for the elevation of the most grazing incident direction, taken per component: what
 * lies beyond the measured incidences is often noise and edge effects. removed (may be NULL): how many samples.
 * Errors: ARGUMENT (limit over 90), DATA (an incidence would be left without samples, or comes from a .sir file; `data` is as it was). */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_cull(bsdfrbf_context *context, bsdfrbf_data *data, double limit_deg, size_t *removed);

/* ------------------------------------------------------------------- build */

/* An interpolant: up to four components. Immutable, shareable by threads and forked processes. */
typedef struct bsdfrbf_model bsdfrbf_model;

/* Hands round blocks of bytes among the processes of a team; all call it together. `blocks` has room for those of all processes,
 * bytes[0] to bytes[size - 1] long, in the order of ranks; the caller's own is in its place, the others are to be filled in.
 * Returns 0, or anything else if a process has given up: a build that fails here while it goes on elsewhere leaves the others
 * waiting, so who starts the team must tell them. */
typedef int (*bsdfrbf_gather)(void *user, void *blocks, const size_t *bytes);

/* Processes that build one model together, each with the same measurements and options, such as the ranks of an MPI program: each
 * does its part of every loop over incidences and edges, and all end with the same model. */
typedef struct bsdfrbf_team {
	int rank;              /* of this process, from 0 */
	int size;              /* how many there are */
	bsdfrbf_gather gather; /* how they tell each other what each has done */
	void *user;            /* handed to that function */
} bsdfrbf_team;

/* How an interpolant is built. */
typedef struct bsdfrbf_build_options {
	size_t size;      /* sizeof(bsdfrbf_build_options), set by bsdfrbf_build_defaults() */
	int threads;      /* 0: as many as OpenMP offers */
	char symmetry;    /* 0: found from the data; 'I' isotropic, 'Q' quadrilateral, 'B' bilateral,
	                     'U' 180 degrees ("up"), 'A' anisotropic */
	int lobes;        /* places of lobes that each incidence starts with; 0: chosen from the data */
	const bsdfrbf_team *team; /* NULL: this process alone */
} bsdfrbf_build_options;

/* Fills in the defaults: everything found from the data. */
BSDFRBF_API void bsdfrbf_build_defaults(bsdfrbf_build_options *options);

/* Builds the interpolant of every component that `data` has. options NULL: defaults.
 * Samples far above all around them, which other incidences show nothing like, count as spikes, and those that are zero here and there amid light as
 * not read: they are left out, and a warning and the model's texts "spikes" and "unread" say how many.
 * The result is the same for any number of threads and processes.
 * On success *model is to be closed by the caller; on failure *model is NULL.
 * Errors: ARGUMENT, DATA, MEMORY, CANCELLED, INTERNAL. */
BSDFRBF_API bsdfrbf_status bsdfrbf_build(bsdfrbf_context *context, const bsdfrbf_data *data,
	const bsdfrbf_build_options *options, bsdfrbf_model **model);

/* ------------------------------------------------------------------ record */

/* Writes the model to `path`: a temporary file beside it, fsync, rename. On failure the old file, if
 * any, is intact and no temporary file is left. Errors: ARGUMENT, IO, MEMORY. */
BSDFRBF_API bsdfrbf_status bsdfrbf_save(bsdfrbf_context *context, const bsdfrbf_model *model, const char *path);

/* Maps the file into memory. `path` may also be BSDF XML that carries an interpolant, or points to one (`embed` and `link` below); a
 * file that is pointed to must be the one that the XML was made with. Replace the file by rename, as bsdfrbf_save() does: the model
 * keeps the old one; if it is shortened in place while it is open, reading it raises SIGBUS. Errors: IO, FORMAT, VERSION, MEMORY. */
BSDFRBF_API bsdfrbf_status bsdfrbf_open(bsdfrbf_context *context, const char *path, bsdfrbf_model **model);

/* Releases a model that was built or opened; NULL: nothing to do. */
BSDFRBF_API void bsdfrbf_close(bsdfrbf_model *model);

/* 1 if the file starts with the magic number of an .rbf file, 0 if not or if it cannot be read. */
BSDFRBF_API int bsdfrbf_is_rbf(const char *path);

/* 1 if the file is BSDF XML that carries an interpolant or points to one, 0 if not or if it cannot be read. Whether
 * bsdfrbf_open() will take it is not looked at. */
BSDFRBF_API int bsdfrbf_is_carrier(const char *path);

/* Checksum of all content of an opened model, as recorded; 0 for one that was built and not opened. */
BSDFRBF_API uint64_t bsdfrbf_checksum(const bsdfrbf_model *model);

/* ---------------------------------------------------------------- evaluate */

/* 1 if the component was built from measurements, else 0. */
BSDFRBF_API int bsdfrbf_has(const bsdfrbf_model *model, bsdfrbf_component component);

/* Channels of the values: 1 or 3, the same for all components. */
BSDFRBF_API int bsdfrbf_channels(const bsdfrbf_model *model);

/* Lambertian part of the component: its constant DHR per channel, `value[channels]`. It is contained
 * in what bsdfrbf_eval() and bsdfrbf_dhr() answer, and never in what the _scatter functions answer. */
BSDFRBF_API void bsdfrbf_lambertian(const bsdfrbf_model *model, bsdfrbf_component component, float *value);

/* f(incident, outgoing), sr^-1, Lambertian part included, into value[channels].
 * 0 where a component is missing or a vector is zero or in the surface's plane. */
BSDFRBF_API void bsdfrbf_eval(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value);

/* The same for `count` pairs (count x 3 each), quicker than one by one; values: count x channels. */
BSDFRBF_API void bsdfrbf_eval_many(const bsdfrbf_model *model, size_t count,
	const float *incident, const float *outgoing, float *values);

/* The same for one incident and `count` outgoing directions: faster, as the incidence is located once. */
BSDFRBF_API void bsdfrbf_eval_exitant(const bsdfrbf_model *model, const float incident[3],
	size_t count, const float *outgoing, float *values);

/* As bsdfrbf_eval() without the Lambertian part. */
BSDFRBF_API void bsdfrbf_eval_scatter(const bsdfrbf_model *model, const float incident[3], const float outgoing[3], float *value);

/* Directional-hemispherical reflectance (transmit 0) or transmittance (transmit 1) at this incidence,
 * Lambertian part included, into value[channels]. */
BSDFRBF_API void bsdfrbf_dhr(const bsdfrbf_model *model, const float incident[3], int transmit, float *value);

/* The same for `count` incident directions (count x 3); values: count x channels. */
BSDFRBF_API void bsdfrbf_dhr_many(const bsdfrbf_model *model, size_t count, const float *incident, int transmit, float *values);

/* As bsdfrbf_dhr() without the Lambertian part. */
BSDFRBF_API void bsdfrbf_dhr_scatter(const bsdfrbf_model *model, const float incident[3], int transmit, float *value);

/* Draws an outgoing direction with a density, per solid angle, proportional to the luminance (channel Y,
 * or the only one) of bsdfrbf_eval_scatter() times |cos(theta_o)|. u in [0, 1): stratified u give
 * stratified directions. Returns 1, or 0 if there is nothing to sample (outgoing is then 0). */
BSDFRBF_API int bsdfrbf_sample(const bsdfrbf_model *model, const float incident[3], int transmit, double u, float outgoing[3]);

/* Density, sr^-1, with which bsdfrbf_sample() returns `outgoing`. */
BSDFRBF_API float bsdfrbf_pdf(const bsdfrbf_model *model, const float incident[3], const float outgoing[3]);

/* As bsdfrbf_sample() for `count` incident directions (count x 3) with a number u each; outgoing: count x 3. Where the same incident
 * direction follows itself this is twice as fast, and the directions are the same but for rounding (which, once in ten thousand
 * samples, decides otherwise whether one is kept). Returns how many were drawn; the others are 0. */
BSDFRBF_API size_t bsdfrbf_sample_many(const bsdfrbf_model *model, size_t count, const float *incident, int transmit,
	const double *u, float *outgoing);

/* Density for `count` pairs (count x 3 each); densities: count. */
BSDFRBF_API void bsdfrbf_pdf_many(const bsdfrbf_model *model, size_t count, const float *incident, const float *outgoing,
	float *densities);

/* Resolution: smallest and largest projected solid angle (sr) over which the scattering near this pair
 * may be taken as constant; both > 0. With outgoing NULL: over all outgoing directions of the side
 * given by `transmit`, otherwise `transmit` is ignored. */
BSDFRBF_API void bsdfrbf_resolution(const bsdfrbf_model *model, const float incident[3],
	const float *outgoing, int transmit, float *smallest, float *largest);

/* ------------------------------------------------------- at one incidence */

/* One incident direction, made ready for several questions: what depends on it alone is worked out once, when it is first needed. It is
 * the caller's memory and takes no other; it may be copied, needs no release, belongs to one thread at a time, and answers until
 * the model is closed. */
typedef struct bsdfrbf_incidence {
	uint64_t room[656]; /* the library's */
} bsdfrbf_incidence;

/* Fills `at`, with whatever in it, for this incident direction. */
BSDFRBF_API void bsdfrbf_prepare(const bsdfrbf_model *model, const float incident[3], bsdfrbf_incidence *at);

/* As bsdfrbf_eval() at this incidence. */
BSDFRBF_API void bsdfrbf_incidence_eval(bsdfrbf_incidence *at, const float outgoing[3], float *value);

/* As bsdfrbf_eval_scatter(). bsdfrbf_incidence_resolution() at the same outgoing direction then costs nothing. */
BSDFRBF_API void bsdfrbf_incidence_eval_scatter(bsdfrbf_incidence *at, const float outgoing[3], float *value);

/* As bsdfrbf_dhr(). */
BSDFRBF_API void bsdfrbf_incidence_dhr(bsdfrbf_incidence *at, int transmit, float *value);

/* As bsdfrbf_dhr_scatter(). */
BSDFRBF_API void bsdfrbf_incidence_dhr_scatter(bsdfrbf_incidence *at, int transmit, float *value);

/* As bsdfrbf_sample(). */
BSDFRBF_API int bsdfrbf_incidence_sample(bsdfrbf_incidence *at, int transmit, double u, float outgoing[3]);

/* As bsdfrbf_pdf(). */
BSDFRBF_API float bsdfrbf_incidence_pdf(bsdfrbf_incidence *at, const float outgoing[3]);

/* As bsdfrbf_resolution(). */
BSDFRBF_API void bsdfrbf_incidence_resolution(bsdfrbf_incidence *at, const float *outgoing, int transmit,
	float *smallest, float *largest);

/* ---------------------------------------------------------------- resample */

/* Angle basis of a matrix: LBNL/Klems. */
typedef enum bsdfrbf_basis {
	BSDFRBF_KLEMS_FULL = 0,   /* 145 patches */
	BSDFRBF_KLEMS_HALF = 1,   /* 77 patches, as in Radiance's bsdf_m.c */
	BSDFRBF_KLEMS_QUARTER = 2 /* 41 patches */
} bsdfrbf_basis;

/* How a model is turned into BSDF XML (WindowElement). Texts may be NULL; they are the caller's. */
typedef struct bsdfrbf_resample_options {
	size_t size;              /* sizeof(bsdfrbf_resample_options), set by bsdfrbf_resample_defaults() */
	int threads;              /* 0: as many as OpenMP offers */
	unsigned components;      /* bit 1 << bsdfrbf_component for each one wanted; 0: all that the model has */
	/* where to */
	const char *path;         /* a file that is replaced when all is written, */
	int (*write)(void *user, const void *data, size_t bytes); /* or else a function that answers 0 unless it failed */
	void *user;               /* handed to that function */
	/* for the file's head */
	const char *name;         /* NULL: the model's text "name" */
	const char *manufacturer; /* NULL: "Manufacturer" */
	const char *comment;      /* e.g. the command */
	double thickness;         /* metres; 0: left out */
	double width;             /* the same */
	double height;            /* the same */
	int embed;                /* 1: the XML carries the interpolant as well, in a comment (an opened model only) */
	const char *link;         /* or it points to this .rbf file: a path from the folder of the XML, or from the root */
	/* tree */
	int log2;                 /* the finest resolution is 2^log2 a side, 2 to 8 (4 dimensions: to 7); 0: 6 (5) */
	double error;             /* differences that are averaged out add at most this share of L1 */
	double cull;              /* per cent of the finest cells that are to be saved at least; 0: as `error` gives */
	int reciprocal;           /* 1: the mean of f(a, b) and f(b, a) is written, where both were measured */
	/* matrix */
	bsdfrbf_basis basis;      /* of the incident and of the outgoing directions */
	int window;               /* 1: for WINDOW: all four components, Visible and, if there is one, Solar */
	const bsdfrbf_model *solar; /* model that the Solar block of WINDOW is from, or NULL; may be the visible one */
} bsdfrbf_resample_options;

/* Fills in the defaults: all components, error .03, full basis, no texts; the caller adds where to. */
BSDFRBF_API void bsdfrbf_resample_defaults(bsdfrbf_resample_options *options);

/* Writes a tensor tree as Radiance's SDloadFile() reads it: of rank 3 if all components are isotropic, else of rank 4.
 * Values are averages over cells, Lambertian part included; the energy of each incidence is kept.
 * Errors: ARGUMENT, IO, MEMORY, CANCELLED, UNSUPPORTED (nothing to write). */
BSDFRBF_API bsdfrbf_status bsdfrbf_write_tree(bsdfrbf_context *context, const bsdfrbf_model *model,
	const bsdfrbf_resample_options *options);

/* Writes Klems matrices: averages over incident and outgoing patches; columns add up to the mean DHR of the patch.
 * Errors: as above. */
BSDFRBF_API bsdfrbf_status bsdfrbf_write_klems(bsdfrbf_context *context, const bsdfrbf_model *model,
	const bsdfrbf_resample_options *options);

/* -------------------------------------------------------------------- info */

/* A measured total of reflection and transmission above 1 by less than this is no better known. Nothing is ever scaled. */
#define BSDFRBF_EXCESS .005f

/* Facts about a component; strings belong to the model. */
typedef struct bsdfrbf_component_info {
	char symmetry;           /* 'I', 'Q', 'B', 'U' or 'A' */
	const char *symmetry_text; /* e.g. "bilateral, mirror y" */
	int incidences;          /* measured incident directions */
	int vertices;            /* after mirroring */
	int triangles;           /* of the mesh, or segments if isotropic */
	int edges;               /* directed edges with recorded residual transport */
	uint64_t lobes;          /* all lobes of all incidences */
	int frames;              /* number of maps in use */
	const char *frame_name[8]; /* their names */
	float frame_share[8];    /* energy share of each */
	int residual;            /* 1: residual transport is used */
	float residual_deg;      /* its energy-weighted mean, degrees */
	float fit_error;         /* mean relative L1 of the lobe fit against held-out samples, by solid angle; < 0 unknown */
	float loo_error;         /* mean leave-one-incidence-out L1, < 0 unknown */
	float asymmetry;         /* relative L1 of the data against the symmetry, < 0 not measurable */
	float theta_max_deg;     /* largest measured polar angle */
	int mirror_x;            /* 1: x -> -x maps the material onto itself */
	int mirror_y;            /* 1: so does y -> -y */
	int half_turn;           /* 1: so does half a turn about z */
	int frame_learned[8];    /* 1: not of the list, but found from the data */
	float frame_beam[8][2][4]; /* of a learned one: its beam's tangential components at incidence i, e[n] = b[n][0] i_x + b[n][1] i_y
	                              + b[n][2] i_z + b[n][3]; "learned shift" moves by their change, "learned turn" turns as they do */
	int excess;              /* incidences at which more light leaves than arrives, by BSDFRBF_EXCESS at least */
	float expected_error;    /* relative L1 to expect between measured incidences, < 0 unknown */
	float even;              /* how far what incidences send is carried to a common level between them, 0 to 1 */
	int tuned;               /* 1: light between incidences is tuned to the DHR that those around expect */
	float filled;            /* largest share of the exitant hemisphere that an incidence was not measured in, but those around it show; 0: none */
	float frame_limit[8];    /* how much a corner of the mesh counts at most where others know nothing, 1 or more: found from the data; 0: as in
	                            the map's definition, or nothing moves */
	float mirrored;          /* largest share of the exitant hemisphere that an incidence was not measured in, but its image by symmetry was; 0: none */
} bsdfrbf_component_info;

/* Fills in the facts. Errors: ARGUMENT (the component is missing). */
BSDFRBF_API bsdfrbf_status bsdfrbf_get_component_info(const bsdfrbf_model *model, bsdfrbf_component component,
	bsdfrbf_component_info *info);

/* Facts about incidence `index` of a component. */
typedef struct bsdfrbf_incidence_info {
	float direction[3];  /* as measured, seen from the component's incident side: z > 0 */
	int lobes;           /* fitted to it */
	float dhr;           /* luminance, from the fit */
	float fit_error;     /* relative L1 against held-out samples, < 0 unknown */
	float loo_error;     /* leave-one-incidence-out L1, < 0 unknown */
	float total;         /* dhr of this component and that of the other one that is lit from the same side, if there is one */
	float expected_error; /* relative L1 to expect in the triangles around it, < 0 unknown */
} bsdfrbf_incidence_info;

/* Fills in the facts. Errors: ARGUMENT (no such component or incidence). */
BSDFRBF_API bsdfrbf_status bsdfrbf_get_incidence_info(const bsdfrbf_model *model, bsdfrbf_component component,
	int index, bsdfrbf_incidence_info *info);

/* Vertex `index`, below `vertices`, of the mesh of incident directions. */
typedef struct bsdfrbf_vertex_info {
	float direction[3];  /* seen from the component's incident side: z > 0; azimuth 0 or 180 degrees if isotropic */
	int incidence;       /* the measured incidence that it is, or is a mirror image of */
	int mirrored;        /* 1: an image */
} bsdfrbf_vertex_info;

/* Fills in the facts. Errors: ARGUMENT (no such component or vertex). */
BSDFRBF_API bsdfrbf_status bsdfrbf_get_vertex_info(const bsdfrbf_model *model, bsdfrbf_component component,
	int index, bsdfrbf_vertex_info *info);

/* Vertices of triangle `index`, below `triangles`, counter-clockwise seen from outside. Those of an isotropic
 * component are segments: corner[2] is corner[1]. */
BSDFRBF_API bsdfrbf_status bsdfrbf_get_triangle(const bsdfrbf_model *model, bsdfrbf_component component,
	int index, int corner[3]);

/* Disagreement of a triangle's corners, above which it holds a cut-off. */
#define BSDFRBF_CUTOFF 0.8f

/* How far the corners of triangle `index`, below `triangles`, disagree about the incident direction in its middle: each corner's
 * measurement alone is carried there, and compared with what all say together; the largest relative L1, at most 3. Smooth
 * materials have a few tenths. Above BSDFRBF_CUTOFF a beam that some corners know ends, or begins, within the triangle (total
 * internal reflection, the edge of a slat), and further incidences should be measured there. < 0: bad argument. */
BSDFRBF_API float bsdfrbf_get_disagreement(const bsdfrbf_model *model, bsdfrbf_component component, int index);

/* How far measured incidence `index` is from reciprocity: difference of f(i, o) and f(o, i) relative to their mean, over exitant
 * directions as grazing as any that was measured; the integral of |difference| |cos| over that of the mean. < 0: bad argument, or only
 * one side of a transmission was measured. */
BSDFRBF_API float bsdfrbf_get_reciprocity(const bsdfrbf_model *model, bsdfrbf_component component, int index);

/* Moves samples to the mean of f(a, b) and f(b, a), as far as `model`, which was built from them, knows both: each is multiplied by
 * what the model's own two values tell, at most by 3/2 and at least by 3/4. What was measured beyond the most grazing incidence stays
 * (within 10 degrees, in part). A model built from the result is more reciprocal, if not wholly. Opens OpenMP regions.
 * Errors: ARGUMENT (NULL), DATA (lobes of a .sir file; `data` is as it was). */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_symmetrize(bsdfrbf_context *context, bsdfrbf_data *data, const bsdfrbf_model *model);

/* Gains of measured incidences: by what factor the whole scan at each is off, as lamps drift and samples are set up anew, from what f(i, o) and
 * f(o, i) of all pairs of them differ by. model: built from `data`. gain: as many as bsdfrbf_data_incidences(); that of most is 1, and so is
 * what does not stand out from the error of fits, or cannot be told, as where one side of a transmission was measured. Opens an OpenMP
 * region. Returns how many are not 1, or < 0: bad argument, or out of memory. */
BSDFRBF_API int bsdfrbf_data_gains(const bsdfrbf_data *data, const bsdfrbf_model *model, bsdfrbf_component component, float *gain);

/* Multiplies what was measured at incident direction `index` by a factor: 1 over its gain, say.
 * Errors: ARGUMENT (no such incidence, a factor that is not above 0). */
BSDFRBF_API bsdfrbf_status bsdfrbf_data_scale(bsdfrbf_context *context, bsdfrbf_data *data, bsdfrbf_component component, size_t index,
	double factor);

/* A lobe of the incidence at one vertex, and where it is when the incident direction has moved to another. */
typedef struct bsdfrbf_lobe_info {
	float direction[3];  /* its centre; outgoing directions are seen from the component's outgoing side: z > 0 */
	float moved[3];      /* its centre there, by frame and residual transport; below the horizon z < 0; 0: it ends on the way */
	float sigma;         /* spread, radians */
	float energy;        /* luminance, sr: amplitude times solid angle; those of an incidence add up to about its DHR */
	int frame;           /* index into frame_name[] */
} bsdfrbf_lobe_info;

/* Lobes of vertex `from`, moved to vertex `to` (which may be the same, or any other; residual transport is known along
 * edges of triangles). Fills at most `capacity` entries and returns how many lobes there are; 0 for a bad argument. */
BSDFRBF_API size_t bsdfrbf_get_lobes(const bsdfrbf_model *model, bsdfrbf_component component, int from, int to,
	size_t capacity, bsdfrbf_lobe_info *lobes);

/* Free text recorded with the model, e.g. key "name" (sample name) or "source" (files); "" if absent. */
BSDFRBF_API const char *bsdfrbf_get_text(const bsdfrbf_model *model, const char *key);

/* Sets such a text on a model that bsdfrbf_build() made, before it is saved and shared. Errors: ARGUMENT
 * (an opened model, or a text over 65535 bytes), MEMORY. */
BSDFRBF_API bsdfrbf_status bsdfrbf_set_text(bsdfrbf_context *context, bsdfrbf_model *model, const char *key, const char *text);

/* Sections of the record as they are, or would be, stored. Returns the number of sections; fills entry
 * `index` if index is below it. name belongs to the library. */
BSDFRBF_API int bsdfrbf_get_section(const bsdfrbf_model *model, int index, const char **name,
	int *component, uint64_t *bytes);

#ifdef __cplusplus
}
#endif
#endif
