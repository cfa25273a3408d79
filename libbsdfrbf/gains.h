/* SPDX-License-Identifier: BSD-3-Clause */
/* Gains of scans, from what pairs of them differ by. */
#ifndef RBF_GAINS_H
#define RBF_GAINS_H
#include <stdint.h>

/* Two scans, and ln of what the first one's value is over the second one's where they measure the same. */
typedef struct rbf_pair {
	uint32_t a, b;
	double difference, weight;
} rbf_pair;

/* told[scans]: ln of each scan's gain. Of those that pairs join, that of most is 0, or, where many stand out, their mean is. 0 as well is what
 * does not stand out from what pairs contradict each other by, or is less than least[scans] and few stand out. light[scans]: what each
 * counts in such a mean. Returns how many are not 0, or -1 when out of memory. */
int rbf_gains_solve(uint32_t scans, const float light[], const float least[], uint32_t pairs, const rbf_pair pair[], double told[]);
#endif
