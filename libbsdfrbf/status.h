/* SPDX-License-Identifier: BSD-3-Clause */
/* The context: last error, warnings, progress. */
#ifndef RBF_STATUS_H
#define RBF_STATUS_H
#include "bsdfrbf.h"

/* Records status and message in the context (may be NULL) and returns the status. */
bsdfrbf_status rbf_fail(bsdfrbf_context *context, bsdfrbf_status status, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* The same for want of memory, where no more can be said. */
bsdfrbf_status rbf_out_of_memory(bsdfrbf_context *context);

/* Passes a warning on. */
void rbf_warn(bsdfrbf_context *context, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Reports progress; non-zero: the user wants to stop. */
int rbf_progress(bsdfrbf_context *context, const char *stage, double done);

/* Forwards a failure. */
#define RBF_TRY(expression) do { bsdfrbf_status rbf_try_ = (expression); if (rbf_try_ != BSDFRBF_OK) return rbf_try_; } while (0)
#endif
