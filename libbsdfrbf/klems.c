/* SPDX-License-Identifier: BSD-3-Clause */
#include "klems.h"
#include "vector.h"

static const rbf_klems basis_list[3] = {
	{"LBNL/Klems Full", 145, 9, {0, 5, 15, 25, 35, 45, 55, 65, 75, 90}, {1, 8, 16, 20, 24, 24, 24, 16, 12}},
	{"LBNL/Klems Half", 77, 7, {0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90}, {1, 8, 12, 16, 20, 12, 8}},
	{"LBNL/Klems Quarter", 41, 5, {0, 9, 27, 45, 63, 90}, {1, 8, 12, 12, 8}},
};

const rbf_klems *rbf_klems_basis(bsdfrbf_basis basis)
{
	return basis >= 0 && basis <= 2 ? &basis_list[basis] : NULL;
}

int rbf_klems_ring(const rbf_klems *b, int patch, int *within)
{
	int ring = 0;
	while (ring < b->rings - 1 && patch >= b->count[ring])
		patch -= b->count[ring++];
	*within = patch;
	return ring;
}

static int first_of(const rbf_klems *b, int ring)
{
	int first = 0;
	while (ring > 0)
		first += b->count[--ring];
	return first;
}

int rbf_klems_place(const rbf_klems *b, const float d[3], double *turn)
{
	const double theta = atan2(hypot((double)d[0], (double)d[1]), (double)d[2]) * (180 / RBF_PI);
	int ring = 0;
	while (ring < b->rings - 1 && theta >= b->theta[ring + 1])
		ring++;
	*turn = atan2((double)d[1], (double)d[0]) / (2 * RBF_PI);
	return ring;
}

int rbf_klems_at(const rbf_klems *b, int ring, double turn)
{
	return first_of(b, ring) + (int)floor((turn - floor(turn)) * b->count[ring] + .5) % b->count[ring];
}

int rbf_klems_find(const rbf_klems *b, const float d[3])
{
	double turn;
	const int ring = rbf_klems_place(b, d, &turn);
	return rbf_klems_at(b, ring, turn);
}

/* sin^2 at the limits of a ring */
static void limits(const rbf_klems *b, int ring, double square[2])
{
	for (int n = 0; n < 2; n++) {
		const double s = sin(b->theta[ring + n] * (RBF_PI / 180));
		square[n] = s * s;
	}
}

void rbf_klems_point(const rbf_klems *b, int patch, double u, double v, float d[3])
{
	int within;
	const int ring = rbf_klems_ring(b, patch, &within);
	double square[2];
	limits(b, ring, square);
	const double s2 = square[0] + u * (square[1] - square[0]), phi = 2 * RBF_PI * (within + v - .5) / b->count[ring], s = sqrt(s2);
	d[0] = (float)(s * cos(phi));
	d[1] = (float)(s * sin(phi));
	d[2] = (float)sqrt(fmax(1 - s2, 1e-9));
}

double rbf_klems_omega(const rbf_klems *b, int patch)
{
	int within;
	const int ring = rbf_klems_ring(b, patch, &within);
	double square[2];
	limits(b, ring, square);
	return RBF_PI * (square[1] - square[0]) / b->count[ring];
}

int rbf_klems_mirror(const rbf_klems *b, int patch, unsigned op)
{
	int within;
	const int ring = rbf_klems_ring(b, patch, &within), count = b->count[ring], first = patch - within;
	if (count == 1)
		return patch;
	if (op & 1)
		within = count / 2 - within;
	if (op & 2)
		within = -within;
	return first + (within % count + count) % count;
}

int rbf_klems_turn(const rbf_klems *b, int patch, int quarters)
{
	int within;
	const int ring = rbf_klems_ring(b, patch, &within), count = b->count[ring];
	return count == 1 ? patch : patch - within + (within + quarters * (count / 4)) % count;
}
