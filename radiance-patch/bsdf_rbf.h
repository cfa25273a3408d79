/* SPDX-License-Identifier: BSD-3-Clause */
/* Recorded interpolants (.rbf files of libbsdfrbf) as BSDF data of Radiance. Include bsdf.h first. */
#ifndef BSDF_RBF_H
#define BSDF_RBF_H
#ifdef __cplusplus
extern "C" {
#endif

/* For SDloadFile(), once it has emptied sd. 1: the file was a recorded interpolant, or XML with one, and *ec is the answer
 * (on failure sd is empty again). 0: *fname is to be parsed as XML; it is the same, or the tree that BSDFRBF_FORM asks for. */
extern int	SDloadRbf(SDError *ec, SDData *sd, const char **fname);

#ifdef __cplusplus
}
#endif
#endif
