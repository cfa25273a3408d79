/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Symmetry of a material from the azimuths at which it was lit.
 *
 * The rules follow the manual page pabopto2bsdf(1): one azimuth means isotropic, a quarter of the circle
 * quadrilateral, a half bilateral (or "up", which has the same coverage: the data decide, see build.c), the full circle
 * anisotropic. What that program accepts silently although a sector is missing is refused here, with the
 * missing azimuths named; asked for anisotropic, as for light from the sun's path alone, it is taken with a warning.
 */
#include "mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (RBF_PI / 180)
/* Closer to the normal than this, the azimuth is an accident of the device. */
#define NEAR_NORMAL (1.0 * DEGREE)
/* Azimuths that a plan meant to be equal, or to be on an axis. */
#define TOLERANCE 1.0
/* Arc by which incidences may hang over the edge of a sector where nothing else fits: devices err, samples are turned on their mounts. What hangs
 * over is the image of a place inside. */
#define OVERHANG 5.0

/* An azimuth sector without measurements, counter-clockwise, degrees: from in [0, 360), to > from. */
typedef struct sector { double from, to; } sector;

int rbf_symmetry_ops(rbf_symmetry symmetry, int op[4])
{
	int n = 0;
	op[n++] = RBF_OP_NONE;
	switch (symmetry) {
	case RBF_BILATERAL_X: op[n++] = RBF_OP_X; break;
	case RBF_BILATERAL_Y: op[n++] = RBF_OP_Y; break;
	case RBF_UP: op[n++] = RBF_OP_XY; break;
	case RBF_QUADRILATERAL: op[n++] = RBF_OP_X; op[n++] = RBF_OP_Y; op[n++] = RBF_OP_XY; break;
	default: break;
	}
	return n;
}

static int compare_doubles(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static double wrap(double degrees)
{
	degrees = fmod(degrees, 360);
	if (degrees < 0)
		degrees += 360;
	return degrees >= 360 ? 0 : degrees;
}

/* Adds the images of `n` azimuths under the group, sorts, and merges what is equal within the tolerance.
 * out has room for 4 n. */
static size_t mirrored_azimuths(rbf_symmetry symmetry, size_t n, const double *azimuth, double *out)
{
	int op[4];
	const int ops = rbf_symmetry_ops(symmetry, op);
	size_t count = 0;
	for (size_t i = 0; i < n; i++)
		for (int k = 0; k < ops; k++) {
			double a = azimuth[i];
			if (op[k] & RBF_OP_X)
				a = 180 - a;
			if (op[k] & RBF_OP_Y)
				a = -a;
			out[count++] = wrap(a);
		}
	qsort(out, count, sizeof *out, compare_doubles);
	size_t unique = 0;
	for (size_t i = 0; i < count; i++)
		if (!unique || out[i] - out[unique - 1] > TOLERANCE)
			out[unique++] = out[i];
	if (unique > 1 && out[0] + 360 - out[unique - 1] <= TOLERANCE)
		unique--;
	return unique;
}

/* Sectors that are much wider than the plan's own spacing, so that the plan cannot have meant them to be
 * interpolated: above 2.5 times the median spacing, but never below 60 or beyond 120 degrees. `widest` gets the
 * widest sector, missing or not. Returns the number of missing sectors, at most `room` of them written. */
static int missing_sectors(rbf_symmetry symmetry, size_t n, const double *azimuth, double *scratch,
	sector *missing, int room, sector *widest)
{
	const size_t count = mirrored_azimuths(symmetry, n, azimuth, scratch);
	double *gap = scratch + count; /* scratch has room for 12 n: images, gaps, sorted gaps */
	for (size_t i = 0; i < count; i++)
		gap[i] = (i + 1 < count ? scratch[i + 1] : scratch[0] + 360) - scratch[i];
	*widest = (sector){ 0, 0 };
	for (size_t i = 0; i < count; i++)
		if (gap[i] > widest->to - widest->from + 1e-6)
			*widest = (sector){ scratch[i], scratch[i] + gap[i] };
	double *sorted = gap + count;
	memcpy(sorted, gap, count * sizeof *gap);
	qsort(sorted, count, sizeof *sorted, compare_doubles);
	const double limit = fmin(fmax(2.5 * sorted[count / 2], 60), 120) + TOLERANCE;
	int found = 0;
	for (size_t i = 0; i < count; i++)
		if (gap[i] > limit) {
			if (found < room)
				missing[found] = (sector){ scratch[i], scratch[i] + gap[i] };
			found++;
		}
	return found;
}

/* Where a sector ends, as it is told: at most 360. */
static double shown(double to)
{
	return to > 360 + TOLERANCE ? to - 360 : to;
}

/* "90 to 180, 270 to 360" */
static const char *list_sectors(int count, const sector *missing, char *text, size_t size)
{
	size_t used = 0;
	text[0] = 0;
	for (int i = 0; i < count && used < size; i++)
		used += (size_t)snprintf(text + used, size - used, "%s%.0f to %.0f", i ? ", " : "", missing[i].from, shown(missing[i].to));
	return text;
}

/* "azimuth 0", "azimuths 0 and 180", "azimuths 270 to 90". Returns whether all lie in one plane that holds the normal. */
static int tell_measured(size_t n, const double *azimuth, int one_azimuth, double *scratch, char *text, size_t size)
{
	sector widest;
	const int gaps = missing_sectors(RBF_ANISOTROPIC, n, azimuth, scratch, NULL, 0, &widest);
	const double apart = widest.to - widest.from, first = wrap(widest.to);
	const size_t count = mirrored_azimuths(RBF_ANISOTROPIC, n, azimuth, scratch);
	if (one_azimuth)
		snprintf(text, size, "azimuth %.0f", first);
	else if (count == 2)
		snprintf(text, size, "azimuths %.0f and %.0f", scratch[0], scratch[1]);
	else if (gaps)
		snprintf(text, size, "azimuths %.0f to %.0f", first, shown(first + 360 - apart));
	else
		snprintf(text, size, "azimuths 0 to 360");
	return one_azimuth || (count == 2 && fabs(scratch[1] - scratch[0] - 180) <= TOLERANCE);
}

/* Incidences that have an azimuth: that, and the sine of the polar angle. */
typedef struct lit {
	size_t n;
	const double *azimuth, *sine;
	double across; /* arc by which they leave the meridian of the one furthest from the normal */
} lit;

/* Arc by which azimuths hang over the edges of [start, start + width]. */
static double overhang(const lit *l, double start, double width)
{
	double most = 0;
	for (size_t i = 0; i < l->n; i++) {
		const double beyond = wrap(l->azimuth[i] - start) - width; /* < 0: inside */
		if (beyond > 0)
			most = fmax(most, l->sine[i] * fmin(beyond, 360 - width - beyond));
	}
	return most;
}

static const char *name_of(rbf_symmetry symmetry)
{
	switch (symmetry) {
	case RBF_ISOTROPIC: return "isotropic";
	case RBF_QUADRILATERAL: return "quadrilateral, mirrors x and y";
	case RBF_BILATERAL_X: return "bilateral, mirror x";
	case RBF_BILATERAL_Y: return "bilateral, mirror y";
	case RBF_UP: return "180 degrees (up)";
	default: return "anisotropic";
	}
}

/* What coverage suggests if an arc of `most` may hang over; *over: how much does. */
static rbf_symmetry from_coverage(const lit *l, double most, double *over)
{
	static const struct { rbf_symmetry symmetry; double from, width; } sector[] = {
		{RBF_QUADRILATERAL, 0, 90}, {RBF_QUADRILATERAL, 90, 90}, {RBF_QUADRILATERAL, 180, 90}, {RBF_QUADRILATERAL, 270, 90},
		{RBF_BILATERAL_Y, 0, 180}, {RBF_BILATERAL_Y, 180, 180}, {RBF_BILATERAL_X, -90, 180}, {RBF_BILATERAL_X, 90, 180}
	};
	*over = l->across;
	if (*over <= most)
		return RBF_ISOTROPIC;
	for (size_t i = 0; i < sizeof sector / sizeof *sector; i++) {
		*over = overhang(l, sector[i].from, sector[i].width);
		if (*over <= most)
			return sector[i].symmetry;
	}
	*over = 0;
	return RBF_ANISOTROPIC;
}

/* The same: more hangs over where sectors would be missing without. */
static rbf_symmetry find(const lit *l, double *scratch, double *over)
{
	sector widest;
	const rbf_symmetry strict = from_coverage(l, TOLERANCE, over);
	if (strict == RBF_ISOTROPIC || !missing_sectors(strict, l->n, l->azimuth, scratch, NULL, 0, &widest))
		return strict;
	const rbf_symmetry loose = from_coverage(l, OVERHANG, over);
	return loose == RBF_ISOTROPIC || !missing_sectors(loose, l->n, l->azimuth, scratch, NULL, 0, &widest) ? loose : strict;
}

static bsdfrbf_status choose(bsdfrbf_context *context, const lit *l, double *scratch, char asked, rbf_symmetry_choice *choice)
{
	const size_t n = l->n;
	const double *azimuth = l->azimuth;
	const int one_azimuth = l->across <= TOLERANCE;
	enum { ROOM = 6 };
	sector missing[ROOM], widest;
	char sectors[160], measured[64];
	double over;
	int found;
	const int plane = tell_measured(n, azimuth, one_azimuth, scratch, measured, sizeof measured);

	rbf_symmetry symmetry = find(l, scratch, &over);
	switch (asked) {
	case 'I': symmetry = RBF_ISOTROPIC; break;
	case 'Q': symmetry = RBF_QUADRILATERAL; break;
	case 'U': symmetry = RBF_UP; break;
	case 'A': symmetry = RBF_ANISOTROPIC; break;
	case 'B':
		/* Coverage of a half says which axis. With more than that either would do: y unless it leaves a hole. */
		if (symmetry != RBF_BILATERAL_X && symmetry != RBF_BILATERAL_Y) {
			symmetry = RBF_BILATERAL_Y;
			if (missing_sectors(RBF_BILATERAL_Y, n, azimuth, scratch, missing, 0, &widest)
					&& !missing_sectors(RBF_BILATERAL_X, n, azimuth, scratch, missing, 0, &widest))
				symmetry = RBF_BILATERAL_X;
		}
		break;
	default: break;
	}
	if (symmetry != RBF_ISOTROPIC) {
		found = missing_sectors(symmetry, n, azimuth, scratch, missing, ROOM, &widest);
		list_sectors(found < ROOM ? found : ROOM, missing, sectors, sizeof sectors);
		if (found && asked == 'A')
			rbf_warn(context, "nothing was measured at incident azimuths %s%s%s, where a material without symmetry may do anything: "
				"there the nearest measured incidences are carried on; measure these, if light comes from there",
				plane ? "other than those in one plane (" : "", plane ? measured : sectors, plane ? ")" : "");
		else if (plane)
			return rbf_fail(context, BSDFRBF_ERR_DATA, "all incident directions are in one plane (%s), but a material that is %s looks "
				"different from elsewhere: measure the azimuths missing between, or, if the material is so, ask for -s I; -s A carries the "
				"nearest measured on", measured, name_of(symmetry));
		else if (found) {
			char remedy[120] = "";
			static const struct { rbf_symmetry symmetry; char letter; } other[] = {
				{ RBF_QUADRILATERAL, 'Q' }, { RBF_BILATERAL_Y, 'B' }, { RBF_BILATERAL_X, 'B' },
				{ RBF_UP, 'U' }, { RBF_ANISOTROPIC, 'A' }
			};
			size_t used = (size_t)snprintf(remedy, sizeof remedy, "-s I");
			char listed = 0;
			sector ignored;
			for (size_t i = 0; i < sizeof other / sizeof *other; i++)
				if (other[i].symmetry != symmetry && other[i].letter != listed && !one_azimuth
						&& !missing_sectors(other[i].symmetry, n, azimuth, scratch, missing, 0, &ignored)) {
					used += (size_t)snprintf(remedy + used, sizeof remedy - used, ", -s %c", other[i].letter);
					listed = other[i].letter;
				}
			return rbf_fail(context, BSDFRBF_ERR_DATA,
				"incident %s degrees do not cover a material that is %s: missing %s; "
				"measure these, or, if the material is so, ask for %s%s", measured, name_of(symmetry), sectors, remedy,
				listed == 'A' ? "" : "; -s A carries the nearest measured on");
		} else if (widest.to - widest.from > 60 + TOLERANCE)
			rbf_warn(context, "no incident azimuth between %.0f and %.0f degrees, mirror images included: "
				"the result is interpolated across a wide gap; if the material is isotropic, ask for -s I", widest.from, shown(widest.to));
	}
	if (over > TOLERANCE && !asked)
		rbf_warn(context, "incident %s degrees are off %s by an arc of up to %.1f degrees: taken as %s, and what is beyond as its image; if the sample "
			"was turned on its mount, #upphi of its files corrects that; -s decides otherwise", measured, symmetry == RBF_ISOTROPIC ? "one azimuth"
			: symmetry == RBF_QUADRILATERAL ? "a quadrant between the axes" : "a half between the axes", over, name_of(symmetry));
	choice->symmetry = choice->other = symmetry;
	const rbf_symmetry across = symmetry == RBF_BILATERAL_X ? RBF_BILATERAL_Y : RBF_BILATERAL_X;
	if (symmetry == RBF_BILATERAL_X || symmetry == RBF_BILATERAL_Y) {
		if (!asked)
			choice->other = RBF_UP;
		else if (!missing_sectors(across, n, azimuth, scratch, missing, 0, &widest))
			choice->other = across;
	}
	snprintf(choice->text, sizeof choice->text, "%s%s (%s measured)", name_of(symmetry), asked ? ", asked for" : "", measured);
	return BSDFRBF_OK;
}

void rbf_symmetry_found(rbf_symmetry symmetry, rbf_symmetry_choice *choice)
{
	char measured[sizeof choice->text] = "";
	const char *tail = strstr(choice->text, " (azimuths");
	if (tail)
		memcpy(measured, tail, strlen(tail) + 1);
	choice->symmetry = symmetry;
	snprintf(choice->text, sizeof choice->text, "%s, by the data%.*s", name_of(symmetry), 100, measured);
}

bsdfrbf_status rbf_symmetry_choose(bsdfrbf_context *context, size_t count, const double *directions, char asked,
	rbf_symmetry_choice *choice)
{
	if (asked && !strchr("IQBUA", asked))
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "symmetry '%c' is none of I, Q, B, U, A", asked);
	if (!count)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "no incident directions");
	double *azimuth = malloc(count * 14 * sizeof *azimuth);
	if (!azimuth)
		return rbf_out_of_memory(context);
	double *sine = azimuth + count;
	lit l = {0, azimuth, sine, 0};
	const double *pivot = NULL; /* the direction furthest from the normal has the most certain azimuth */
	for (size_t i = 0; i < count; i++) {
		const double *d = directions + 3 * i;
		if (atan2(hypot(d[0], d[1]), d[2]) <= NEAR_NORMAL)
			continue;
		azimuth[l.n] = wrap(atan2(d[1], d[0]) / DEGREE);
		sine[l.n++] = hypot(d[0], d[1]);
		if (!pivot || d[2] < pivot[2])
			pivot = d;
	}
	/* By angle on the sphere, and on the pivot's side of the normal. */
	for (size_t i = 0; pivot && i < count; i++) {
		const double *d = directions + 3 * i, r = hypot(pivot[0], pivot[1]);
		const double along = (d[0]*pivot[0] + d[1]*pivot[1]) / r, across = (d[1]*pivot[0] - d[0]*pivot[1]) / r;
		if (hypot(along, across) > sin(NEAR_NORMAL))
			l.across = fmax(l.across, along < 0 ? 180 : asin(fmin(fabs(across), 1)) / DEGREE);
	}
	bsdfrbf_status status = BSDFRBF_OK;
	if (!l.n) {
		/* Normal incidence alone says nothing about azimuth. */
		choice->symmetry = RBF_ISOTROPIC;
		switch (asked) {
		case 'Q': choice->symmetry = RBF_QUADRILATERAL; break;
		case 'B': choice->symmetry = RBF_BILATERAL_Y; break;
		case 'U': choice->symmetry = RBF_UP; break;
		case 'A': choice->symmetry = RBF_ANISOTROPIC; break;
		default: break;
		}
		choice->other = choice->symmetry;
		snprintf(choice->text, sizeof choice->text, "%s%s (normal incidence only)", name_of(choice->symmetry),
			asked ? ", asked for" : "");
	} else
		status = choose(context, &l, sine + l.n, asked, choice);
	free(azimuth);
	return status;
}
