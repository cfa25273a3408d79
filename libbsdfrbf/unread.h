/* SPDX-License-Identifier: BSD-3-Clause */
/* Zeros that an instrument writes where it has not read. */
#ifndef RBF_UNREAD_H
#define RBF_UNREAD_H
#include "faults.h"

/* Sets `read` to a component's incidences without what was not read, as rbf_faults_leave_out() does. Opens an OpenMP region. */
int rbf_unread_leave_out(const rbf_measured *all, int channels, rbf_measured *read, rbf_faults *found);
#endif
