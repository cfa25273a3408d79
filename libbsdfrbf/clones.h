/* SPDX-License-Identifier: BSD-3-Clause */
/* RBF_CLONES before a function: compiled also for AVX2 and FMA, and for AVX-512, chosen when the library is loaded. Only for loops that call nothing but
 * what is inlined: GCC 12 gets values wrong where a clone calls a plain static function. */
#ifndef RBF_CLONES_H
#define RBF_CLONES_H

/* The loader chooses before the thread sanitizer is ready. Where everything is compiled for AVX2 or more (-march=native), GCC 12 breaks
 * down over clones for less. */
#if defined(__x86_64__) && !defined(__AVX2__) && defined(__GNUC__) && !defined(__clang__) && defined(__linux__) && !defined(__SANITIZE_THREAD__)
#define RBF_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define RBF_CLONES
#endif
#endif
