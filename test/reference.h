/* SPDX-License-Identifier: BSD-3-Clause */
/* What rbf_site_dsf() computes, in double precision, lobe by lobe with libm's exp, without culling. */
#ifndef TEST_REFERENCE_H
#define TEST_REFERENCE_H

/* DSF without the Lambertian part at a folded exitant direction. site: const rbf_site *, see reference.c. */
void reference_dsf(const void *site, const float exitant[3], double value[3]);
#endif
