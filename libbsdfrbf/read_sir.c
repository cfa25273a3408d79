/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Radiance .sir files: a finished interpolant of one pair of sides, as pabopto2bsdf(1) writes it.
 *
 * After a text header that ends with an empty line come two bytes of magic, then one entry for each measured incidence, then the
 * entry with the number -1, then the migrations along edges. Incidences and lobes are taken; the migrations are not read, as
 * frames and transport are derived anew. Integers are big-endian; a real number is four bytes of mantissa and one of exponent.
 * BSDFMIN is a floor that the lobes lie above nearly everywhere: it is contained in them, not added.
 */
#include "read.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
enum { INCIDENCES_MOST = 10000, LOBES_MOST = 20000, GRID_MOST = 65536, LOBE_BYTES = 13 };

typedef struct header {
	int in, out;       /* sides: 1 front, -1 back */
	int channels;
	int isotropic;
	long grid;
	char name[256];
	int format;        /* FORMAT=BSDF_RBFmesh was seen */
} header;

/* The value behind "KEY=" and blanks, or NULL. */
static const char *value_of(const char *line, const char *key)
{
	const size_t length = strlen(key);
	if (strncmp(line, key, length) || line[length] != '=')
		return NULL;
	line += length + 1;
	return line + strspn(line, " \t");
}

static int side_ok(long side)
{
	return side == 1 || side == -1;
}

static bsdfrbf_status header_line(const rbf_text *text, header *h)
{
	const char *v;
	char *end;
	if ((v = value_of(text->line, "IO_SIDES"))) {
		const long in = strtol(v, &end, 10), out = strtol(end, NULL, 10);
		if (!side_ok(in) || !side_ok(out))
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "IO_SIDES must be two of 1 (front) and -1 (back)");
		h->in = (int)in;
		h->out = (int)out;
	} else if ((v = value_of(text->line, "SYMMETRY"))) {
		const long coverage = strtol(v, &end, 10);
		h->isotropic = end != v && coverage == 0;
	} else if ((v = value_of(text->line, "COLORIMETRY"))) {
		h->channels = !strncmp(v, "CIE-XYZ", 7) ? 3 : !strncmp(v, "CIE-Y", 5) || !strncmp(v, "Unknown", 7) ? 1 : 0;
		if (!h->channels)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_UNSUPPORTED, "COLORIMETRY is none of CIE-Y, CIE-XYZ, Unknown");
	} else if ((v = value_of(text->line, "GRIDRES"))) {
		h->grid = strtol(v, NULL, 10);
		if (h->grid < 2 || h->grid > GRID_MOST)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "GRIDRES must be 2 to %d", GRID_MOST);
	} else if ((v = value_of(text->line, "NAME"))) {
		size_t length = strlen(v);
		length = length < sizeof h->name ? length : sizeof h->name - 1;
		memcpy(h->name, v, length);
		h->name[length] = 0;
	} else if ((v = value_of(text->line, "FORMAT")))
		h->format = !strcmp(v, "BSDF_RBFmesh");
	return BSDFRBF_OK;
}

static bsdfrbf_status read_header(rbf_text *text, header *h)
{
	int more;
	*h = (header){.channels = 1};
	for (;;) {
		RBF_TRY(rbf_text_line(text, &more));
		if (!more)
			return rbf_text_fail(text, text->number, BSDFRBF_ERR_SYNTAX, "the file ends within its header: it is cut off; "
				"make or copy it anew");
		if (!text->length)
			break;
		RBF_TRY(header_line(text, h));
	}
	if (!h->format)
		return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "this is a Radiance file (a picture or octree?), neither measurement text nor a .sir "
			"interpolant: give the measurement files it was made from");
	const char *missing = !h->in ? "IO_SIDES" : !h->grid ? "GRIDRES" : NULL;
	if (missing)
		return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "the header of this .sir file lacks %s: make it anew with pabopto2bsdf(1)", missing);
	return BSDFRBF_OK;
}

static uint32_t big(const unsigned char *b, int bytes)
{
	uint32_t v = 0;
	for (int i = 0; i < bytes; i++)
		v = v << 8 | b[i];
	return v;
}

static double real(const unsigned char *b)
{
	const double m = (int32_t)big(b, 4);
	return m == 0 ? 0 : ldexp((m + (m > 0 ? .5 : -.5)) / 0x7fffffff, (signed char)b[4]);
}

static bsdfrbf_status damaged(const rbf_text *text, uint64_t at, const char *what)
{
	return rbf_text_fail(text, 0, BSDFRBF_ERR_SYNTAX, "byte %llu: %s: the file is damaged; make or copy it anew",
		(unsigned long long)at, what);
}

/* Centre of a grid cell on the hemisphere: square to disk by the concentric map (Shirley and Chiu 1997), disk to hemisphere with
 * equal area. */
static void centre_of(double gx, double gy, double grid, double centre[3])
{
	const double a = 2 * (gx + .5) / grid - 1, b = 2 * (gy + .5) / grid - 1;
	const int wide = fabs(a) > fabs(b);
	const double radius = wide ? a : b, turn = wide ? PI / 4 * b / a : b == 0 ? 0 : PI / 2 - PI / 4 * a / b;
	const double spread = sqrt(2 - radius * radius);
	centre[0] = radius * cos(turn) * spread;
	centre[1] = radius * sin(turn) * spread;
	centre[2] = 1 - radius * radius;
}

/* X, Y, Z from Y and a code of two bytes, v' above u', in steps of 1/410 (CIE 1976 UCS). */
static int colour_of(uint32_t code, double y, float xyz[3])
{
	const double u = (code & 0xff) / 410., v = (code >> 8) / 410.;
	if (!(v > 0))
		return 0;
	/* x = 9u/d, y = 4v/d, d = 6u - 16v + 12 */
	xyz[0] = (float)(y * 9 * u / (4 * v));
	xyz[1] = (float)y;
	xyz[2] = (float)(y * fmax(12 - 3 * u - 20 * v, 0) / (4 * v));
	return 1;
}

static bsdfrbf_status read_lobe(rbf_text *text, const header *h, rbf_ready_lobe *lobe)
{
	unsigned char b[LOBE_BYTES];
	uint64_t at;
	RBF_TRY(rbf_text_bytes(text, b, sizeof b, &at));
	const double peak = real(b), radius = (big(b + 7, 2) + .5) * PI / 65536;
	const uint32_t x = big(b + 9, 2), y = big(b + 11, 2);
	if (!(peak >= 0) || peak > RBF_VALUE_MAX)
		return damaged(text, at, "a lobe is negative or beyond 1e12 per sr");
	if (x >= h->grid || y >= h->grid)
		return damaged(text, at + 9, "the centre of a lobe lies outside the grid");
	centre_of(x, y, (double)h->grid, lobe->centre);
	lobe->kappa = 1 / (radius * radius);
	lobe->dsf[0] = (float)peak;
	if (h->channels == 3 && !colour_of(big(b + 5, 2), peak, lobe->dsf))
		return damaged(text, at + 5, "the colour of a lobe is none");
	return BSDFRBF_OK;
}

/* Counts from the file allocate nothing: arrays grow with the bytes that are there. */
static bsdfrbf_status read_lobes(rbf_text *text, const header *h, uint32_t count, rbf_incidence *in)
{
	size_t capacity = 0;
	while (in->lobes < count) {
		if (in->lobes == capacity) {
			capacity = capacity ? 2 * capacity : 64;
			rbf_ready_lobe *grown = realloc(in->lobe, capacity * sizeof *grown);
			if (!grown)
				return rbf_text_fail(text, 0, BSDFRBF_ERR_MEMORY, "out of memory");
			in->lobe = grown;
		}
		RBF_TRY(read_lobe(text, h, &in->lobe[in->lobes]));
		in->lobes++;
	}
	return BSDFRBF_OK;
}

/* One incidence; *more is 0 behind the last. */
static bsdfrbf_status read_incidence(rbf_text *text, const header *h, rbf_incidence *in, int *more)
{
	unsigned char b[24];
	uint64_t at;
	RBF_TRY(rbf_text_bytes(text, b, 4, &at));
	*more = big(b, 4) < 0x80000000u;
	if (!*more)
		return BSDFRBF_OK;
	RBF_TRY(rbf_text_bytes(text, b, sizeof b, &at));
	double length = 0;
	for (int a = 0; a < 3; a++) {
		in->direction[a] = real(b + 5 * a);
		length += in->direction[a] * in->direction[a];
	}
	length = sqrt(length);
	if (!(fabs(length - 1) < .01))
		return damaged(text, at, "an incident direction is not a unit vector");
	if (in->direction[2] * h->in < 0)
		return damaged(text, at, "an incident direction is on the other side than IO_SIDES says");
	for (int a = 0; a < 3; a++)
		in->direction[a] /= length;
	in->direction[2] = fabs(in->direction[2]);
	const uint32_t lobes = big(b + 20, 4);
	if (!lobes || lobes > LOBES_MOST)
		return damaged(text, at + 20, "the number of lobes is 0 or beyond 20000");
	return read_lobes(text, h, lobes, in);
}

static bsdfrbf_status read_body(rbf_text *text, const header *h, rbf_measured *ready)
{
	unsigned char magic[2];
	uint64_t at;
	size_t capacity = 0;
	int more = 1;
	RBF_TRY(rbf_text_bytes(text, magic, sizeof magic, &at));
	if (magic[0] != 'Z' || magic[1] != '<')
		return damaged(text, at, "the interpolant's magic number is not there");
	while (more) {
		if (ready->count == INCIDENCES_MOST)
			return rbf_text_fail(text, 0, BSDFRBF_ERR_UNSUPPORTED, "more than %d incident directions", INCIDENCES_MOST);
		if (ready->count == capacity) {
			capacity = capacity ? 2 * capacity : 64;
			rbf_incidence *grown = realloc(ready->incidence, capacity * sizeof *grown);
			if (!grown)
				return rbf_text_fail(text, 0, BSDFRBF_ERR_MEMORY, "out of memory");
			ready->incidence = grown;
		}
		rbf_incidence *in = &ready->incidence[ready->count++]; /* counted first: it is freed in any case */
		memset(in, 0, sizeof *in);
		RBF_TRY(read_incidence(text, h, in, &more));
	}
	ready->count--; /* the entry that ends the list */
	if (!ready->count)
		return rbf_text_fail(text, 0, BSDFRBF_ERR_DATA, "this .sir file has no incident direction");
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_read_sir(rbf_text *text, bsdfrbf_data *data, const char *path)
{
	header h;
	rbf_measured ready = {.ready = 1};
	RBF_TRY(read_header(text, &h));
	ready.isotropic = h.isotropic;
	bsdfrbf_status status = read_body(text, &h, &ready);
	if (status == BSDFRBF_OK) {
		const int component = (h.in == h.out ? BSDFRBF_RF : BSDFRBF_TF) + (h.in < 0);
		status = rbf_data_join_ready(text->context, data, component, h.channels, &ready, path, *h.name ? h.name : NULL);
	}
	rbf_measured_free(&ready);
	return status;
}
