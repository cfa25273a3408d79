/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Virtual goniophotometer: measures a material of materials.c and writes one Mountain text file per incident
 * direction (format: pabopto2bsdf(1)). The same arguments give the same files.
 *
 * A base scan along arcs covers the hemisphere; further samples lie where f cos is large, their density
 * proportional to its square root, as an operator refines a scan near peaks; a beam too narrow for that is scanned
 * by a raster of .3 degrees. Noise is relative and Gaussian.
 *
 * With -held N also written, all float32: query.bin (rows: incident x y z, outgoing x y z) for N incident directions
 * between the measured ones, on a grid of equal projected solid angle; truth.bin (f, or X Y Z if coloured); and
 * beams.bin and beams_truth.bin, the same at the maxima that the material declares. With -measured the questions are
 * at N of the measured incident directions instead: the error of the fit alone. With -incidences N the material is measured
 * at N directions spread evenly over the hemisphere, whatever its symmetry.
 */
#include "materials.h"
#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define PI 3.14159265358979323846
#define RADIAN (PI / 180)

static void die(const char *what, const char *name)
{
	fprintf(stderr, "goniometer: %s%s%s\n", what, name ? ": " : "", name ? name : "");
	exit(1);
}

/* SplitMix64: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014. */
static uint64_t state;
static double uniform(void)
{
	uint64_t z = state += 0x9e3779b97f4a7c15u;
	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static double normal(void)
{
	const double r = sqrt(-2 * log(1 - uniform())), phi = 2*PI * uniform();
	return r * cos(phi);
}

static void seed(uint64_t seed_number, uint64_t stream)
{
	state = seed_number * 1000003u + stream;
	uniform();
}

static void direction(double theta_deg, double phi_deg, double v[3])
{
	const double t = theta_deg * RADIAN, p = phi_deg * RADIAN;
	v[0] = sin(t) * cos(p);
	v[1] = sin(t) * sin(p);
	v[2] = cos(t);
}

static struct {
	uint64_t seed;
	double noise, maxout, hole, theta[2], spoil;
	int every, held, grid, base, peak, xyz, measured, incidences;
} option = {7, .02, 90, 0, {0, -1}, 0, 1, 0, 64, 2500, 3000, 0, 0, 0};

static const struct material *material;

static int incidences(void)
{
	return option.incidences ? option.incidences : 1 + material->steps.thetas * material->steps.phis;
}

/* Normal incidence first. With -incidences, a spiral with the golden angle: each stands for the same solid angle. */
static void incidence(int index, double *theta_deg, double *phi_deg)
{
	const struct steps *s = &material->steps;
	*theta_deg = *phi_deg = 0;
	if (index && option.incidences) {
		const double most = s->theta[s->thetas - 1] * RADIAN;
		*theta_deg = acos(1 - (1 - cos(most)) * index / (option.incidences - 1)) / RADIAN;
		*phi_deg = fmod(index * 137.50776405003785, 360);
	} else if (index) {
		*theta_deg = s->theta[(index - 1) / s->phis];
		*phi_deg = s->phi0 + (index - 1) % s->phis * s->phi_step;
	}
}

/* One sample, unless it is out of the detector's reach. */
static void measure(FILE *out, const double in[3], const double at[3])
{
	double v[3] = {at[0], at[1], material->transmits ? -fabs(at[2]) : fabs(at[2])}, f[3];
	if (fabs(v[2]) < cos(option.maxout * RADIAN) || fabs(v[2]) < 1e-3)
		return;
	if (option.hole > 0 && v[0]*in[0] + v[1]*in[1] + v[2]*in[2] > cos(option.hole * RADIAN))
		return;
	material->f(in, v, f);
	double phi = atan2(v[1], v[0]) / RADIAN;
	if (phi < 0)
		phi += 360;
	fprintf(out, "%.3f %.3f", acos(v[2]) / RADIAN, phi);
	const double error = 1 + option.noise * normal();
	const double spoilt = option.spoil > 0 && uniform() < option.spoil ? (uniform() < .5 ? 0 : 10) : 1;
	for (int k = option.xyz ? 0 : 1; k < (option.xyz ? 3 : 2); k++)
		fprintf(out, " %.6g", f[k] * error * spoilt);
	fputc('\n', out);
}

static void scan_base(FILE *out, const double in[3])
{
	const int arcs = 50, steps = option.base / arcs;
	for (int a = 0; a < arcs; a++)
		for (int s = 0; s < steps; s++) {
			double v[3];
			direction(86. * s / fmax(steps - 1, 1) + fmax(-1, fmin(1, .3 * normal())), 360. * a / arcs + .5 * normal(), v);
			measure(out, in, v);
		}
}

/* A point `x`, `y` radians beside the direction v, along two tangents. */
static void beside(const double v[3], double x, double y, double out[3])
{
	const double s = v[2] >= 0 ? 1 : -1, a = -1 / (s + v[2]), b = v[0] * v[1] * a; /* Duff et al., JCGT 6(1), 2017 */
	const double t[3] = {1 + s*v[0]*v[0]*a, s*b, -s*v[0]}, u[3] = {b, s + v[1]*v[1]*a, -v[1]};
	double length = 0;
	for (int k = 0; k < 3; k++) {
		out[k] = v[k] + x*t[k] + y*u[k];
		length += out[k] * out[k];
	}
	for (int k = 0; k < 3; k++)
		out[k] /= sqrt(length);
}

static void scan_peaks(FILE *out, const double in[3])
{
	enum { CANDIDATES = 60000 };
	static double candidate[CANDIDATES][3], sum[CANDIDATES];
	const double spread = sqrt(2*PI / CANDIDATES); /* mean distance of candidates: no gaps between them */
	double total = 0;
	for (int k = 0; k < CANDIDATES; k++) {
		double f[3], *v = candidate[k];
		const double z = (k + uniform()) / CANDIDATES, phi = 2*PI * uniform(), r = sqrt(1 - z*z);
		v[0] = r * cos(phi);
		v[1] = r * sin(phi);
		v[2] = material->transmits ? -z : z;
		material->f(in, v, f);
		sum[k] = total += sqrt(f[1] * z);
	}
	for (int n = 0; n < option.peak; n++) {
		double v[3];
		const double pick = (n + uniform()) / option.peak * total; /* stratified */
		int lo = 0, hi = CANDIDATES - 1;
		while (lo < hi) {
			const int middle = (lo + hi) / 2;
			if (sum[middle] < pick)
				lo = middle + 1;
			else
				hi = middle;
		}
		beside(candidate[lo], spread * normal(), spread * normal(), v);
		if ((v[2] < 0) == material->transmits)
			measure(out, in, v);
	}
}

static void scan_fine(FILE *out, const double in[3])
{
	double beam[4][3], v[3];
	const int beams = material->beams(in, beam), reach = 7;
	for (int b = 0; b < beams; b++)
		for (int x = -reach; x <= reach; x++)
			for (int y = -reach; y <= reach; y++) {
				beside(beam[b], (.3*x + .03*normal()) * RADIAN, (.3*y + .03*normal()) * RADIAN, v);
				if ((v[2] < 0) == material->transmits)
					measure(out, in, v);
			}
}

static FILE *create(const char *folder, const char *name)
{
	char path[4096];
	if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path)
		die("name too long", folder);
	FILE *f = fopen(path, "wb");
	if (!f)
		die(strerror(errno), path);
	return f;
}

static void finish(FILE *f)
{
	if (ferror(f) | fclose(f))
		die("cannot write", strerror(errno));
}

static void measure_incidence(const char *folder, int index, double theta, double phi)
{
	char name[64];
	double in[3];
	const double wrapped = fmod(phi + 360, 360);
	snprintf(name, sizeof name, "%03d_t%02.0f_p%03.0f.txt", index, theta, wrapped);
	FILE *out = create(folder, name);
	fprintf(out, "#sample_name \"%s\"\n#format: theta phi %s\n", material->name, material->transmits ? "BTDF" : "BRDF");
	if (option.xyz)
		fputs("#colorimetry: CIE-XYZ\n", out);
	fprintf(out, "#upphi 90\n#intheta %g\n#inphi %g\n", theta, wrapped);
	direction(theta, phi, in);
	seed(option.seed, (uint64_t)index + 1); /* independent of the other incidences */
	scan_base(out, in);
	scan_peaks(out, in);
	if (material->fine > 0)
		scan_fine(out, in);
	finish(out);
}

/* Centre of a cell of the grid of equal projected solid angle: the concentric map of Shirley and Chiu, Journal of
 * Graphics Tools 2(3), 1997, lifted from the disk to the hemisphere. */
static void grid_direction(int ix, int iy, double v[3])
{
	const double a = (ix + .5) / option.grid * 2 - 1, b = (iy + .5) / option.grid * 2 - 1;
	double r = 0, phi = 0;
	if (a != 0 || b != 0) {
		r = fabs(a) > fabs(b) ? a : b;
		phi = fabs(a) > fabs(b) ? PI/4 * b/a : PI/2 - PI/4 * a/b;
	}
	v[0] = r * cos(phi);
	v[1] = r * sin(phi);
	v[2] = sqrt(fmax(1 - r*r, 1e-9)) * (material->transmits ? -1 : 1);
}

static void ask(FILE *query, FILE *truth, const double in[3], const double out[3])
{
	/* The truth is that of the rounded vectors: half a unit in the last place matters to no peak, but costs nothing. */
	const float row[6] = {(float)in[0], (float)in[1], (float)in[2], (float)out[0], (float)out[1], (float)out[2]};
	const double i[3] = {row[0], row[1], row[2]}, o[3] = {row[3], row[4], row[5]};
	double f[3];
	material->f(i, o, f);
	const float value[3] = {(float)f[0], (float)f[1], (float)f[2]};
	fwrite(row, sizeof *row, 6, query);
	if (option.xyz)
		fwrite(value, sizeof *value, 3, truth);
	else
		fwrite(value + 1, sizeof *value, 1, truth);
}

static void hold_out(const char *folder)
{
	const struct steps *s = &material->steps;
	const double lo = option.theta[0], hi = option.theta[1] >= 0 ? option.theta[1] : s->theta[s->thetas - 1] - 4;
	FILE *query = create(folder, "query.bin"), *truth = create(folder, "truth.bin");
	FILE *beams = create(folder, "beams.bin"), *beams_truth = create(folder, "beams_truth.bin");
	seed(option.seed, 0);
	for (int n = 0; n < option.held; n++) {
		double in[3], out[3], beam[4][3];
		const double z = cos(lo * RADIAN) - uniform() * (cos(lo * RADIAN) - cos(hi * RADIAN)), phi = 360 * uniform();
		direction(acos(z) / RADIAN, phi, in);
		if (option.measured) {
			double theta_deg, phi_deg;
			incidence((int)((n + .5) * incidences() / option.held), &theta_deg, &phi_deg);
			direction(theta_deg, phi_deg, in);
		}
		for (int y = 0; y < option.grid; y++)
			for (int x = 0; x < option.grid; x++) {
				grid_direction(x, y, out);
				ask(query, truth, in, out);
			}
		for (int b = 0, count = material->beams ? material->beams(in, beam) : 0; b < count; b++)
			ask(beams, beams_truth, in, beam[b]);
	}
	finish(query);
	finish(truth);
	finish(beams);
	finish(beams_truth);
}

/* Name, symmetry, reflection or transmission, incidences, largest polar angle. */
static void list(void)
{
	for (int k = 0; k < materials_count; k++)
		printf("%-12s %-14s %c %3d %3g  %s\n", materials[k].name, materials[k].symmetry, materials[k].transmits ? 'T' : 'R',
			1 + materials[k].steps.thetas * materials[k].steps.phis,
			materials[k].steps.theta[materials[k].steps.thetas - 1], materials[k].about);
	exit(0);
}

static void usage(void)
{
	fputs("usage: goniometer [-seed S] [-noise SHARE] [-spoil SHARE] [-every K] [-maxout DEG] [-hole DEG]\n"
		"                  [-held N] [-grid N] [-theta LO HI] [-measured]\n"
		"                  [-incidences N] [-samples BASE PEAK] [-xyz] MATERIAL OUTDIR\n"
		"       goniometer -list\n", stderr);
	exit(1);
}

static double number(char ***argument)
{
	char *end;
	const char *text = *++*argument;
	if (!text)
		usage();
	const double value = strtod(text, &end);
	if (end == text || *end || !isfinite(value))
		die("not a number", text);
	return value;
}

int main(int argc, char **argv)
{
	(void)argc;
	for (argv++; *argv && **argv == '-'; argv++) {
		const char *o = *argv + 1;
		if (!strcmp(o, "list"))
			list();
		else if (!strcmp(o, "xyz"))
			option.xyz = 1;
		else if (!strcmp(o, "measured"))
			option.measured = 1;
		else if (!strcmp(o, "seed"))
			option.seed = (uint64_t)number(&argv);
		else if (!strcmp(o, "noise"))
			option.noise = number(&argv);
		else if (!strcmp(o, "spoil"))
			option.spoil = number(&argv);
		else if (!strcmp(o, "every"))
			option.every = (int)fmax(number(&argv), 1);
		else if (!strcmp(o, "maxout"))
			option.maxout = number(&argv);
		else if (!strcmp(o, "hole"))
			option.hole = number(&argv);
		else if (!strcmp(o, "incidences"))
			option.incidences = (int)fmax(number(&argv), 2);
		else if (!strcmp(o, "held"))
			option.held = (int)number(&argv);
		else if (!strcmp(o, "grid"))
			option.grid = (int)fmax(number(&argv), 2);
		else if (!strcmp(o, "theta")) {
			option.theta[0] = number(&argv);
			option.theta[1] = number(&argv);
		} else if (!strcmp(o, "samples")) {
			option.base = (int)number(&argv);
			option.peak = (int)number(&argv);
		} else
			usage();
	}
	if (!argv[0] || !argv[1] || argv[2])
		usage();
	if (!(material = material_find(argv[0])))
		die("no such material (see goniometer -list)", argv[0]);
	const char *folder = argv[1];
	if (mkdir(folder, 0777) && errno != EEXIST)
		die(strerror(errno), folder);
	option.xyz |= material->coloured;

	for (int index = 0; index < incidences(); index += option.every) {
		double theta, phi;
		incidence(index, &theta, &phi);
		measure_incidence(folder, index, theta, phi);
	}
	if (option.held > 0)
		hold_out(folder);
	FILE *note = create(folder, "sample");
	fprintf(note, "%s %s %c %d\n", material->name, material->symmetry, material->transmits ? 'T' : 'R', option.xyz ? 3 : 1);
	finish(note);
	return 0;
}
