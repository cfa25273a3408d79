/* SPDX-License-Identifier: BSD-3-Clause */
/* Was a peak measured more coarsely than it is wide? Its light is a guess then, and DHR with it. */
#ifndef RBF_COARSE_PEAK_H
#define RBF_COARSE_PEAK_H
#include "measure.h"

/* Light (DSF times solid angle, luminance) that stands on the highest sample alone, of a lobe as narrow as the samples allow, at the incidence nearest to a
 * direction, if all samples around it are far lower; else 0; -1 when out of memory. all_azimuths: only the polar angle counts. *apart: degrees between samples
 * there. */
float rbf_coarse_peak(const rbf_measured *measured, int channels, const float direction[3], int all_azimuths, float *apart);
#endif
