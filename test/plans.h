/* SPDX-License-Identifier: BSD-3-Clause */
/* Scan plans of incident directions, for tests. To be included after cmocka.h, once a program. */
#ifndef TEST_PLANS_H
#define TEST_PLANS_H
#include "../libbsdfrbf/vector.h"

#define DEGREE (RBF_PI / 180)
#define MAX_PLAN 6000

typedef struct plan {
	size_t count;
	double d[MAX_PLAN][3];
} plan;

static plan scratch;

static void polar(double theta_deg, double phi_deg, double d[3])
{
	const double t = theta_deg * DEGREE, p = phi_deg * DEGREE;
	d[0] = sin(t) * cos(p);
	d[1] = sin(t) * sin(p);
	d[2] = cos(t);
}

static void add(plan *p, double theta_deg, double phi_deg)
{
	assert_true(p->count < MAX_PLAN);
	polar(theta_deg, phi_deg, p->d[p->count++]);
}

/* Rings at theta from, from + step, ... to, azimuths likewise; with the pole if asked. */
static plan *rings(int pole, double from, double to, double step, double phi_from, double phi_to, double phi_step)
{
	scratch.count = 0;
	if (pole)
		add(&scratch, 0, 0);
	for (double t = from; t <= to + 1e-9; t += step)
		for (double p = phi_from; p <= phi_to + 1e-9; p += phi_step)
			add(&scratch, t, p);
	return &scratch;
}
#endif
