/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Sources of the formulas
 *   GGX distribution and refraction at rough surfaces: Walter, Marschner, Li, Torrance, "Microfacet Models for
 *     Refraction through Rough Surfaces", EGSR 2007 (eq. 20, 21, 33).
 *   Anisotropic GGX and the height-correlated Smith term: Heitz, "Understanding the Masking-Shadowing Function",
 *     JCGT 3(2), 2014 (eq. 72, 85, 99).
 *   Schlick's approximation of Fresnel's reflectance: Schlick, Eurographics 1994.
 *   Threads: cones of Marschner et al., "Light Scattering from Human Hair Fibers", SIGGRAPH 2003, section 4.
 *   Single scattering in a slab: Chandrasekhar, "Radiative Transfer", 1960; phase function of Henyey and
 *     Greenstein, Astrophysical Journal 93, 1941.
 *   Thin film: Airy's sum, Born and Wolf, "Principles of Optics", section 7.6.
 *   CIE 1931 observer: Gaussian fits of Wyman, Sloan, Shirley, JCGT 2(2), 2013 (single-lobe set).
 */
#include "materials.h"
#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
#define COUNT(a) ((int)(sizeof(a) / sizeof *(a)))

static double dot(const double a[3], const double b[3]) { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]; }
static double square(double x) { return x*x; }
static double clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }
static void set(double v[3], double x, double y, double z) { v[0] = x; v[1] = y; v[2] = z; }
static void grey(double xyz[3], double f) { set(xyz, f, f, f); }

static double normalize(double v[3])
{
	const double length = sqrt(dot(v, v));
	if (length > 0)
		for (int i = 0; i < 3; i++)
			v[i] /= length;
	return length;
}

static double schlick(double f0, double cosine) { return f0 + (1 - f0) * pow(clamp(1 - cosine, 0, 1), 5); }

/* Unpolarised Fresnel reflectance of a dielectric; ratio = index before / index behind; 1 at total reflection. */
static double fresnel(double cosine, double ratio)
{
	const double s2 = ratio*ratio*(1 - cosine*cosine);
	if (s2 >= 1)
		return 1;
	const double t = sqrt(1 - s2), s = (ratio*cosine - t) / (ratio*cosine + t), p = (ratio*t - cosine) / (ratio*t + cosine);
	return .5 * (s*s + p*p);
}

static double ggx(const double h[3], double ax, double ay)
{
	return 1 / (PI*ax*ay * square(square(h[0]/ax) + square(h[1]/ay) + h[2]*h[2]));
}

static double smith(const double v[3], double ax, double ay)
{
	const double c2 = v[2]*v[2];
	return c2 > 0 ? .5 * (sqrt(1 + (square(ax*v[0]) + square(ay*v[1])) / c2) - 1) : 1e30;
}

/* Reflecting microfacets with Fresnel's factor left to the caller; *cosine = i.h. */
static double facets(const double i[3], const double o[3], double ax, double ay, double *cosine)
{
	double h[3] = {i[0] + o[0], i[1] + o[1], i[2] + o[2]};
	*cosine = 0;
	if (i[2] <= 1e-6 || o[2] <= 1e-6 || normalize(h) == 0)
		return 0;
	*cosine = dot(i, h);
	return ggx(h, ax, ay) / (1 + smith(i, ax, ay) + smith(o, ax, ay)) / (4*i[2]*o[2]);
}

static double metal(const double i[3], const double o[3], double ax, double ay, double f0)
{
	double c;
	const double f = facets(i, o, ax, ay, &c);
	return f * schlick(f0, c);
}

/* Normalised beam about `axis`: von Mises and Fisher's density, sr^-1. */
static double beam(const double axis[3], const double v[3], double kappa)
{
	return kappa / (2*PI) * exp(-.5*kappa * (square(axis[0]-v[0]) + square(axis[1]-v[1]) + square(axis[2]-v[2])));
}

static void to_frame(const double tilt, const double azimuth, const double v[3], double local[3])
{
	const double ct = cos(tilt), st = sin(tilt), ca = cos(azimuth), sa = sin(azimuth), along = ca*v[0] + sa*v[1];
	set(local, ct*along - st*v[2], ca*v[1] - sa*v[0], st*along + ct*v[2]); /* x down the slope, z its normal */
}

/* ---------------------------------------------------------------- in the spirit of the four bench materials */

static void brushed(const double i[3], const double o[3], double xyz[3])
{
	grey(xyz, o[2] > 0 ? .04/PI + metal(i, o, .25, .06, .75) : 0);
}

static int mirrored(const double i[3], double b[][3]) { set(b[0], -i[0], -i[1], i[2]); return 1; }
static int straight(const double i[3], double b[][3]) { set(b[0], -i[0], -i[1], -i[2]); return 1; }

static double slope(const double i[3], const double o[3], double tilt_deg, double azimuth_deg, double ax, double ay, double f0)
{
	double a[3], b[3];
	to_frame(tilt_deg*PI/180, azimuth_deg*PI/180, i, a);
	to_frame(tilt_deg*PI/180, azimuth_deg*PI/180, o, b);
	if (a[2] <= 0 || b[2] <= 0)
		return 0;
	return metal(a, b, ax, ay, f0) * a[2]*b[2] / fmax(i[2]*o[2], .02);
}

/* Ridges along y: a wide and a steep flank, mirrored by y alone. */
static void sawtooth(const double i[3], const double o[3], double xyz[3])
{
	grey(xyz, o[2] > 0 ? .02/PI + .55*slope(i, o, 14, 0, .07, .12, .65) + .3*slope(i, o, 33, 180, .09, .12, .65) : 0);
}

static void satin(const double i[3], const double o[3], double xyz[3])
{
	double b[1][3];
	straight(i, b);
	const double through = .9 * (1 - schlick(.04, i[2]));
	grey(xyz, o[2] < 0 ? through * (.4*beam(b[0], o, 700) + .25*beam(b[0], o, 40)) / fmax(sqrt(-i[2]*o[2]), .05) + .07/PI : 0);
}

/* Panel with reflecting cuts across y: part of the light goes straight on, part leaves with y turned over. */
static void redirect(const double i[3], const double o[3], double xyz[3])
{
	if (o[2] >= 0) {
		grey(xyz, 0);
		return;
	}
	const double on[3] = {-i[0], -i[1], -i[2]}, turned[3] = {-i[0], i[1], -i[2]};
	const double share = clamp(.1 + .8*fabs(i[1]) + .2*i[0]*i[1], .05, .95), loss = 1 - schlick(.05, i[2]);
	grey(xyz, loss * (.75*((1 - share)*beam(on, o, 400) + share*beam(turned, o, 200)) / fmax(-o[2], .05) + .06/PI));
}

/* ---------------------------------------------------------------- unlike them */

/* One family of rough prism facets seen from inside the film; `in` is the direction the light comes from there. */
static double prism_facet(const double in[3], const double o[3], double tilt, double azimuth, double alpha)
{
	const double n = 1.5;
	double a[3], b[3], h[3];
	to_frame(tilt, azimuth, in, a);
	to_frame(tilt, azimuth, o, b);
	if (a[2] <= 1e-3 || b[2] >= -1e-3)
		return 0;
	for (int k = 0; k < 3; k++)
		h[k] = -(n*a[k] + b[k]);
	if (normalize(h) == 0)
		return 0;
	if (h[2] < 0)
		set(h, -h[0], -h[1], -h[2]);
	const double ci = dot(a, h), co = dot(b, h);
	if (ci <= 0 || co >= 0)
		return 0;
	const double g = 1 / ((1 + smith(a, alpha, alpha)) * (1 + smith(b, alpha, alpha)));
	const double f = fabs(ci*co) / (a[2]*-b[2]) * (1 - fresnel(ci, n)) * g * ggx(h, alpha, alpha) / square(n*ci + co);
	return f * a[2]*-b[2] / (cos(tilt) * in[2] * fmax(-o[2], .02)); /* facet area over macroscopic area */
}

/* Prism film: refraction at a flat front, then at rough facets of two slopes, with total reflection there. */
static void prism(const double i[3], const double o[3], double xyz[3])
{
	const double n = 1.5, in[3] = {i[0]/n, i[1]/n, sqrt(1 - (1 - i[2]*i[2]) / (n*n))};
	if (o[2] >= 0) {
		grey(xyz, 0);
		return;
	}
	const double f = .6*prism_facet(in, o, 32*PI/180, PI/2, .09) + .4*prism_facet(in, o, 45*PI/180, -PI/2, .09);
	grey(xyz, (1 - fresnel(i[2], 1/n)) * f + .02/PI);
}

/* Share of a beam that passes between flat slats of width 1.1 times their distance, tilted by 25 degrees: parallel
 * projection on the profile plane, as in EN ISO 52022-3. */
#define SLAT_TILT (25*PI/180)
static double slat_gap(const double v[3])
{
	const double profile = atan2(v[1], fabs(v[2]));
	return fmax(0, 1 - 1.1*fabs(sin(profile - SLAT_TILT)) / fmax(cos(profile), .05));
}

/* Slats: what passes goes on, what hits is reflected in the slat's plane, half of it diffusely; a beam ends where
 * the gap closes or where the reflected direction would turn back. */
static void slats(const double i[3], const double o[3], double xyz[3])
{
	const double ny = cos(SLAT_TILT), nz = -sin(SLAT_TILT), along = 2*(i[1]*ny + i[2]*nz);
	const double on[3] = {-i[0], -i[1], -i[2]}, turned[3] = {-i[0], -i[1] + along*ny, -i[2] + along*nz};
	const double back[3] = {-o[0], -o[1], -o[2]};
	double f = 0;
	if (o[2] < 0) {
		const double gap = slat_gap(i);
		f = .95*gap*beam(on, o, 350) / fmax(-o[2], .05) + .3*(1 - gap)*(.25 + slat_gap(back)) / PI;
		if (turned[2] < 0)
			f += .35*(1 - gap)*beam(turned, o, 120) / fmax(-o[2], .05);
	}
	grey(xyz, f);
}

static int slats_beams(const double i[3], double b[][3])
{
	straight(i, b);
	return slat_gap(i) > .05;
}

/* A thread scatters into the cone about itself that holds the incident light. */
static double thread(const double along_i, const double along_o, double sigma)
{
	return exp(-.5*square((along_i + along_o) / sigma)) / (PI*sigma*sqrt(2*PI));
}

static void cloth(const double i[3], const double o[3], double xyz[3])
{
	if (o[2] <= 0) {
		grey(xyz, 0);
		return;
	}
	const double shade = 4*i[2]*o[2] / square(i[2] + o[2]); /* neighbours hide a thread from grazing views */
	grey(xyz, .15/PI + shade * (.18*thread(i[0], o[0], .12) + .12*thread(i[1], o[1], .25)));
}

/* The peak of f above its surroundings is .12 sr^-1 at normal incidence: a weak one, that fits tend to lose. */
static double retro_peak(const double i[3], const double o[3])
{
	return .12 * fmax(0, 1 - square(acos(clamp(i[2], -1, 1)) / (70*PI/180))) * exp(400*(dot(i, o) - 1));
}

static void retro(const double i[3], const double o[3], double xyz[3])
{
	grey(xyz, o[2] > 0 ? .2/PI + metal(i, o, .12, .12, .04) + retro_peak(i, o) : 0);
}

static int retro_beams(const double i[3], double b[][3])
{
	set(b[0], i[0], i[1], i[2]);
	return i[2] > cos(60*PI/180);
}

/* Full width at half maximum .6 degrees: kappa = 8 ln 2 / fwhm^2. */
static void narrow(const double i[3], const double o[3], double xyz[3])
{
	const double kappa = 8*log(2) / square(.6*PI/180);
	double b[1][3];
	mirrored(i, b);
	grey(xyz, o[2] > 0 ? .1/PI + .25*metal(i, o, .35, .35, .9) + .3*beam(b[0], o, kappa) / fmax(sqrt(i[2]*o[2]), .05) : 0);
}

static void translucent(const double i[3], const double o[3], double xyz[3])
{
	if (o[2] >= 0) {
		grey(xyz, 0);
		return;
	}
	const double depth = 1.2, albedo = .95, g = .75, a = i[2], b = fmax(-o[2], 1e-4);
	const double phase = (1 - g*g) / (4*PI*pow(1 + g*g + 2*g*dot(i, o), 1.5)); /* scattering angle is from -i to o */
	const double single = fabs(a - b) > 1e-4 ? (exp(-depth/a) - exp(-depth/b)) / (a - b) : depth*exp(-depth/a) / (a*a);
	/* Light scattered more than once: linear limb darkening on both sides. */
	const double multiple = .3/PI * (.4 + .9*a) * (.55 + .675*b);
	grey(xyz, albedo*phase*single + multiple);
}

/* Gloss that grows to grazing incidence, over white. */
static void varnish(const double i[3], const double o[3], double xyz[3])
{
	const double f0 = .04, in = (1 - f0) * (1 - pow(1 - i[2], 5)), out = (1 - f0) * (1 - pow(1 - fmax(o[2], 0), 5));
	grey(xyz, o[2] > 0 ? .3/PI*in*out + metal(i, o, .06, .06, f0) : 0);
}

static void white(const double i[3], const double o[3], double xyz[3])
{
	double c;
	const double sheen = facets(i, o, .3, .3, &c);
	grey(xyz, o[2] > 0 ? .8/PI * (1 - schlick(.04, i[2])) * (1 - schlick(.04, o[2])) * 1.05 + sheen*schlick(.04, c) : 0);
}

/* Blazed grating (its side orders differ): orders shift the tangential components by a constant along x; an order whose components leave the unit
 * disk is evanescent. Gaussian in the components, so that f is carried unchanged. */
static const double grating_order[3][2] = {{0, .35}, {.38, .3}, {-.38, .15}};
static void grating(const double i[3], const double o[3], double xyz[3])
{
	double f = 0;
	if (o[2] < 0) {
		f = .05/PI;
		for (int k = 0; k < 3; k++)
			f += grating_order[k][1] / (2*PI*square(.045))
				* exp(-.5*(square(o[0] + i[0] - grating_order[k][0]) + square(o[1] + i[1])) / square(.045));
	}
	grey(xyz, f);
}

static int grating_beams(const double i[3], double b[][3])
{
	int count = 0;
	for (int k = 0; k < 3; k++) {
		const double x = grating_order[k][0] - i[0], y = -i[1], r2 = x*x + y*y;
		if (r2 < .85) {
			set(b[count], x, y, -sqrt(1 - r2));
			count++;
		}
	}
	return count;
}

/* Reflectance of a film (index 1.45, 420 nm) on a metal-like base, as X, Y, Z for equal energy; by cosine. */
static void film_colour(double cosine, double xyz[3])
{
	const double n = 1.45, inside = sqrt(1 - (1 - cosine*cosine) / (n*n)), r1 = -.18, r2 = -.6;
	double sum[3] = {0, 0, 0}, norm[3] = {0, 0, 0};
	for (double nm = 390; nm <= 720; nm += 10) {
		const double phase = 4*PI*n*420*inside / nm, c = cos(phase);
		const double r = (r1*r1 + r2*r2 + 2*r1*r2*c) / (1 + r1*r1*r2*r2 + 2*r1*r2*c);
		const double bar[3] = {1.065*exp(-.5*square((nm - 595.8)/33.33)) + .366*exp(-.5*square((nm - 446.8)/19.44)),
			1.014*exp(-.5*square(log(nm/556.3)/.075)), 1.839*exp(-.5*square(log(nm/449.8)/.051))};
		for (int k = 0; k < 3; k++) {
			sum[k] += bar[k]*r;
			norm[k] += bar[k];
		}
	}
	for (int k = 0; k < 3; k++)
		xyz[k] = sum[k] / norm[k];
}

static void film(const double i[3], const double o[3], double xyz[3])
{
	enum { STEPS = 256 };
	static double table[STEPS + 1][3];
	static int ready;
	double c;
	const double f = facets(i, o, .15, .15, &c);
	if (!ready) { /* the spectral sum is slow; the program has one thread */
		for (int k = 0; k <= STEPS; k++)
			film_colour((double)k / STEPS, table[k]);
		ready = 1;
	}
	const double at = clamp(c, 0, 1) * STEPS;
	const int k = at < STEPS ? (int)at : STEPS - 1;
	for (int ch = 0; ch < 3; ch++)
		xyz[ch] = o[2] > 0 ? .03/PI + f * (table[k][ch] + (at - k) * (table[k + 1][ch] - table[k][ch])) : 0;
}

/* Brushed metal laid askew: symmetric under a half turn only, measured all round. */
static void askew(const double i[3], const double o[3], double xyz[3])
{
	const double c = cos(25*PI/180), s = sin(25*PI/180);
	const double a[3] = {c*i[0] + s*i[1], c*i[1] - s*i[0], i[2]}, b[3] = {c*o[0] + s*o[1], c*o[1] - s*o[0], o[2]};
	grey(xyz, o[2] > 0 ? .05/PI + metal(a, b, .3, .09, .7) : 0);
}

#define ISO {10, 1, {8, 16, 24, 32, 40, 48, 56, 64, 72, 80}, 0, 0}

const struct material materials[] = {
	{"brushed", "brushed metal", "quadrilateral", 0, 0, {8, 7, {10, 20, 30, 40, 50, 60, 70, 80}, 0, 15}, 0, brushed, mirrored},
	{"sawtooth", "reflecting sawtooth profile", "bilateral", 0, 0, {6, 10, {12, 24, 36, 48, 60, 72}, 0, 20}, 0, sawtooth, NULL},
	{"satin", "satin glass", "isotropic", 1, 0, ISO, 0, satin, straight},
	{"redirect", "light-redirecting panel", "anisotropic", 1, 0, {5, 15, {15, 30, 45, 60, 75}, 0, 24}, 0, redirect, NULL},
	{"prism", "prism film with total internal reflection", "bilateral", 1, 0, {6, 10, {12, 24, 36, 48, 60, 72}, -90, 20}, 0, prism, NULL},
	{"slats", "tilted slats with a cut-off", "bilateral", 1, 0, {6, 10, {12, 24, 36, 48, 60, 72}, -90, 20}, 0, slats, slats_beams},
	{"cloth", "woven cloth", "quadrilateral", 0, 0, {7, 7, {11, 22, 33, 44, 55, 66, 77}, 0, 15}, 0, cloth, NULL},
	{"retro", "retro-reflector over gloss", "isotropic", 0, 0, ISO, 0, retro, retro_beams},
	{"narrow", "peak of 0.6 degrees beside a broad base", "isotropic", 0, 0, ISO, .255, narrow, mirrored},
	{"translucent", "volume-scattering sheet", "isotropic", 1, 0, ISO, 0, translucent, NULL},
	{"varnish", "clear varnish over white", "isotropic", 0, 0, ISO, 0, varnish, mirrored},
	{"white", "diffuse white with sheen", "isotropic", 0, 0, ISO, 0, white, NULL},
	{"grating", "blazed grating with two side beams", "bilateral", 1, 0, {6, 10, {12, 24, 36, 48, 60, 70}, 0, 20}, 0, grating, grating_beams},
	{"film", "colour-shifting film", "isotropic", 0, 1, ISO, 0, film, mirrored},
	{"askew", "brushed metal turned by 25 degrees", "anisotropic", 0, 0, {5, 18, {15, 30, 45, 60, 75}, 0, 20}, 0, askew, mirrored},
};
const int materials_count = COUNT(materials);

const struct material *material_find(const char *name)
{
	for (int k = 0; k < materials_count; k++)
		if (!strcmp(materials[k].name, name))
			return &materials[k];
	return NULL;
}
