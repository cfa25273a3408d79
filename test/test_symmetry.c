/* SPDX-License-Identifier: BSD-3-Clause */
/* Symmetry from the azimuths of the incident directions. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "../libbsdfrbf/mesh.h"
#include "plans.h"

static char warned[400];

static void on_warning(void *user, const char *text)
{
	(void)user;
	snprintf(warned, sizeof warned, "%s", text);
}

/* Expected: a symmetry and no text, or 0 and a piece of the message. */
static void choose(const plan *p, char asked, int expected, const char *text)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	rbf_symmetry_choice choice = { .symmetry = RBF_ANISOTROPIC };
	warned[0] = 0;
	bsdfrbf_set_warning(context, on_warning, NULL);
	const bsdfrbf_status status = rbf_symmetry_choose(context, p->count, &p->d[0][0], asked, &choice);
	if (expected) {
		if (status != BSDFRBF_OK)
			fail_msg("refused: %s", bsdfrbf_message(context));
		if (choice.symmetry != (rbf_symmetry)expected)
			fail_msg("%c instead of %c: %s", choice.symmetry, expected, choice.text);
		if (text && !strstr(choice.text, text))
			fail_msg("'%s' instead of '%s'", choice.text, text);
	} else {
		assert_int_equal(status, BSDFRBF_ERR_DATA);
		if (!strstr(bsdfrbf_message(context), text))
			fail_msg("message '%s' lacks '%s'", bsdfrbf_message(context), text);
	}
	bsdfrbf_context_free(context);
}

/* What else the coverage allows, for the data to decide. */
static void allows(const plan *p, char asked, rbf_symmetry symmetry, rbf_symmetry other)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	rbf_symmetry_choice choice;
	assert_int_equal(rbf_symmetry_choose(context, p->count, &p->d[0][0], asked, &choice), BSDFRBF_OK);
	assert_int_equal(choice.symmetry, symmetry);
	assert_int_equal(choice.other, other);
	bsdfrbf_context_free(context);
}

static void test_others(void **state)
{
	(void)state;
	allows(rings(1, 12, 72, 12, 0, 180, 20), 0, RBF_BILATERAL_Y, RBF_UP);
	allows(rings(1, 12, 72, 12, 0, 180, 20), 'B', RBF_BILATERAL_Y, RBF_BILATERAL_Y);
	allows(rings(1, 12, 72, 12, 90, 270, 20), 'B', RBF_BILATERAL_X, RBF_BILATERAL_X);
	allows(rings(1, 15, 75, 15, 0, 345, 15), 'B', RBF_BILATERAL_Y, RBF_BILATERAL_X);
	allows(rings(1, 15, 75, 15, 0, 345, 15), 0, RBF_ANISOTROPIC, RBF_ANISOTROPIC);
	allows(rings(1, 15, 75, 15, 0, 345, 15), 'Q', RBF_QUADRILATERAL, RBF_QUADRILATERAL);
	allows(rings(1, 15, 75, 15, 0, 0, 15), 0, RBF_ISOTROPIC, RBF_ISOTROPIC);
	allows(rings(0, 0, 0, 15, 0, 0, 15), 'B', RBF_BILATERAL_Y, RBF_BILATERAL_Y);
}

static void test_symmetry(void **state)
{
	(void)state;
	choose(rings(0, 0, 80, 8, 0, 0, 1), 0, RBF_ISOTROPIC, "isotropic (azimuth 0 measured)");
	choose(rings(0, 10, 80, 10, 137, 137, 1), 0, RBF_ISOTROPIC, "azimuth 137");
	choose(rings(1, 10, 80, 10, 359.8, 360.3, .5), 0, RBF_ISOTROPIC, NULL);
	choose(rings(1, 10, 80, 10, 0, 90, 15), 0, RBF_QUADRILATERAL, "azimuths 0 to 90");
	choose(rings(1, 10, 80, 10, 270, 360, 15), 0, RBF_QUADRILATERAL, "azimuths 270 to 360");
	choose(rings(1, 10, 80, 10, 97.5, 172.5, 15), 0, RBF_QUADRILATERAL, NULL);
	choose(rings(1, 12, 72, 12, 0, 180, 20), 0, RBF_BILATERAL_Y, "mirror y (azimuths 0 to 180 measured)");
	choose(rings(1, 12, 72, 12, 180, 360, 20), 0, RBF_BILATERAL_Y, NULL);
	choose(rings(1, 12, 72, 12, 90, 270, 20), 0, RBF_BILATERAL_X, "mirror x");
	choose(rings(1, 12, 72, 12, -90, 90, 20), 0, RBF_BILATERAL_X, "azimuths 270 to 90 measured");
	choose(rings(1, 15, 75, 15, 0, 359, 24), 0, RBF_ANISOTROPIC, "azimuths 0 to 360");
	choose(rings(1, 12, 72, 12, 0, 180, 20), 'U', RBF_UP, "asked for");
	choose(rings(1, 12, 72, 12, 45, 225, 20), 'U', RBF_UP, NULL);
	choose(rings(1, 12, 72, 12, 0, 180, 20), 'B', RBF_BILATERAL_Y, NULL);
	choose(rings(1, 15, 75, 15, 0, 359, 15), 'Q', RBF_QUADRILATERAL, NULL);
	choose(rings(1, 15, 75, 15, 0, 359, 15), 'I', RBF_ISOTROPIC, NULL);
	choose(rings(1, 15, 75, 15, 0, 359, 15), 'B', RBF_BILATERAL_Y, NULL);
	/* holes */
	choose(rings(1, 12, 72, 12, 45, 225, 20), 0, 0, "missing 225 to 45");
	choose(rings(1, 12, 72, 12, 45, 225, 20), 0, 0, "-s U");
	choose(rings(1, 10, 80, 10, 0, 270, 15), 0, 0, "missing 270 to 360");
	choose(rings(1, 10, 80, 10, 0, 270, 15), 0, 0, "-s B");
	choose(rings(1, 10, 80, 10, 0, 270, 15), 'B', RBF_BILATERAL_Y, NULL);
	choose(rings(1, 12, 72, 12, 0, 180, 20), 'A', RBF_ANISOTROPIC, "asked for (azimuths 0 to 180 measured)"); /* believed, with a word */
	assert_non_null(strstr(warned, "nothing was measured at incident azimuths 180 to 360,"));
	choose(rings(1, 10, 80, 10, 0, 90, 15), 'A', RBF_ANISOTROPIC, NULL);
	assert_non_null(strstr(warned, "azimuths 90 to 360,"));
	choose(rings(1, 10, 80, 10, 0, 0, 15), 'A', RBF_ANISOTROPIC, NULL);
	assert_non_null(strstr(warned, "other than those in one plane (azimuth 0),"));
	choose(rings(1, 10, 80, 10, 0, 180, 180), 'A', RBF_ANISOTROPIC, NULL);
	assert_non_null(strstr(warned, "other than those in one plane (azimuths 0 and 180),"));
	choose(rings(1, 10, 80, 10, 0, 45, 15), 0, 0, "; -s A carries");
	choose(rings(1, 10, 80, 10, 0, 180, 180), 0, 0, "; -s A carries");
	choose(rings(1, 10, 80, 10, 0, 90, 15), 'U', 0, "missing 90 to 180, 270 to 360");
	choose(rings(1, 10, 80, 10, 0, 90, 15), 'B', 0, "missing 90 to 270");
	choose(rings(1, 10, 80, 10, 0, 45, 15), 0, 0, "missing 45 to 135, 225 to 315");
	choose(rings(1, 10, 80, 10, 0, 0, 15), 'Q', 0, "-s I");
	scratch.count = 0; /* quadrants 1 and 3 */
	for (int p = 0; p <= 90; p += 15) {
		add(&scratch, 30, p);
		add(&scratch, 60, p + 180);
	}
	choose(&scratch, 0, 0, "missing 90 to 180, 270 to 360");
	choose(&scratch, 0, 0, "-s Q");
	choose(rings(1, 10, 80, 10, 0, 180, 180), 0, 0, "missing"); /* one plane, both sides */
	choose(rings(1, 10, 80, 10, 0, 180, 180), 0, 0, "in one plane (azimuths 0 and 180)");
	choose(rings(1, 10, 80, 10, 0, 180, 180), 'B', 0, "in one plane (azimuths 0 and 180)");
	choose(rings(1, 10, 80, 10, 0, 180, 180), 'I', RBF_ISOTROPIC, "asked for (azimuths 0 and 180 measured)");
	choose(rings(1, 10, 80, 10, 0, 180, 180), 0, 0, "-s I");
	choose(rings(1, 10, 80, 10, 0, 90, 90), 0, RBF_QUADRILATERAL, NULL); /* coarse, but it covers */
	assert_true(strstr(warned, "between 0 and 90") != NULL);
	choose(rings(1, 10, 80, 10, 62, 302, 60), 'A', RBF_ANISOTROPIC, NULL);
	assert_true(strstr(warned, "between 302 and 62 degrees") != NULL);
	/* devices err, samples are turned on their mounts: nothing else fits, and what hangs over is an image */
	choose(rings(1, 10, 80, 10, 2, 92, 15), 0, RBF_QUADRILATERAL, "azimuths 2 to 92");
	assert_non_null(strstr(warned, "are off a quadrant between the axes by an arc of up to 2.0 degrees"));
	choose(rings(1, 10, 80, 10, 0, 92, 15), 0, RBF_QUADRILATERAL, NULL);
	assert_string_equal(warned, "");
	choose(rings(1, 12, 72, 12, -3, 177, 20), 0, RBF_BILATERAL_Y, NULL);
	choose(rings(1, 12, 72, 12, 94, 274, 20), 0, RBF_BILATERAL_X, NULL);
	choose(rings(1, 12, 72, 12, -3, 177, 20), 'B', RBF_BILATERAL_Y, NULL);
	assert_string_equal(warned, ""); /* asked for: nothing was guessed */
	choose(rings(0, 10, 80, 10, 138.5, 141.5, 1.5), 0, RBF_ISOTROPIC, NULL);
	assert_non_null(strstr(warned, "are off one azimuth"));
	choose(rings(1, 10, 80, 10, 8, 98, 15), 0, 0, "missing 98 to 262");
	choose(rings(1, 10, 80, 10, -3, 47, 10), 0, 0, "missing 47 to");
	scratch.count = 0; /* near the normal azimuths matter less: an arc of 2.6 degrees */
	for (int p = 0; p <= 90; p += 15)
		for (int t = 5; t <= 75; t += 10)
			add(&scratch, t, t == 5 ? p - 30 : p);
	choose(&scratch, 0, RBF_QUADRILATERAL, NULL);
	/* normal incidence has no azimuth */
	scratch.count = 0;
	add(&scratch, .4, 200);
	choose(&scratch, 0, RBF_ISOTROPIC, "normal incidence only");
	for (int t = 10; t < 80; t += 10)
		add(&scratch, t, 45);
	choose(&scratch, 0, RBF_ISOTROPIC, "azimuth 45");
	rbf_symmetry_choice choice;
	assert_int_equal(rbf_symmetry_choose(NULL, scratch.count, &scratch.d[0][0], 'Z', &choice), BSDFRBF_ERR_ARGUMENT);
}

int main(void)
{
	const struct CMUnitTest tests[] = { cmocka_unit_test(test_symmetry), cmocka_unit_test(test_others) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
