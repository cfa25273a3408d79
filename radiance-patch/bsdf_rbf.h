/* SPDX-License-Identifier: BSD-3-Clause */
/* Recorded interpolants (.rbf files of libbsdfrbf) as BSDF data of Radiance. Include bsdf.h first. */
#ifndef BSDF_RBF_H
#define BSDF_RBF_H
#ifdef __cplusplus
extern "C" {
#endif

/* 1 if the file is a recorded interpolant, told by its magic number. */
extern int	SDisRbf(const char *fname);

/* Fills sd, which SDfreeBSDF() has emptied, from such a file. On failure sd is empty again. */
extern SDError	SDloadRbf(SDData *sd, const char *fname);

#ifdef __cplusplus
}
#endif
#endif
