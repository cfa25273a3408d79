/* SPDX-License-Identifier: BSD-3-Clause */
/* Were samples taken along lines, far apart for the distance of samples along them? */
#ifndef RBF_SCAN_LINES_H
#define RBF_SCAN_LINES_H
#include "measure.h"

/* Sets *lines to whether that is so of more than a few samples at any incidence. Returns 0, or -1 when out of memory. */
int rbf_scan_lines(const rbf_measured *measured, int *lines);

#define RBF_SCAN_FLAT .05 /* sine: samples in a plane are 3 degrees off it at most */

/* Whether all samples are of a scan in one plane through the origin, by 3 degrees, or, by 1 degree, in one up to 5 degrees beside it, as with an instrument or
 * a sample out of line; unit normal of the plane through the origin that is nearest to them. A few peaks and nothing between
 * them are no scan. */
int rbf_scan_plane(const rbf_incidence *incidence, double normal[3]);
#endif
