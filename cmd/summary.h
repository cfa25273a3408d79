/* SPDX-License-Identifier: BSD-3-Clause */
/* What mkrbf says at the end: what was found in the measurements, and what came of them. */
#ifndef CMD_SUMMARY_H
#define CMD_SUMMARY_H
#include "bsdfrbf.h"

/* "rf", "rb", "tf", "tb". */
extern const char *const summary_name[4];

/* Five lines a component on stderr: symmetry, incidences and noise, holes, lobes and frames, errors. */
void summary_print(const bsdfrbf_model *model, const bsdfrbf_data *data);

/* Warnings where the result cannot be good, and what would help. */
void summary_warn(const bsdfrbf_model *model);

/* Gains of a component's scans, as bsdfrbf_data_gains(): how many are not 1. *gain: to be freed, or NULL if none is. */
int summary_gains(const bsdfrbf_model *model, const bsdfrbf_data *data, int component, float **gain);

/* Warnings about such scans. */
void summary_warn_gains(const bsdfrbf_model *model, const bsdfrbf_data *data);
#endif
