/* SPDX-License-Identifier: BSD-3-Clause */
#define RBF_KERNEL_NAME rbf_kernel_generic
#include "kernel_template.h"
