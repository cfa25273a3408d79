/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact mass transport between two sets of lobes. */
#ifndef RBF_TRANSPORT_H
#define RBF_TRANSPORT_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

/* A possible move, source i to target j. */
typedef struct rbf_arc { uint32_t source, target; float cost; } rbf_arc;
/* A move that the optimum makes. */
typedef struct rbf_move { uint32_t source, target; double mass; } rbf_move;

/* Minimises sum(mass * cost) of moving `supply` (n, each >= 0) onto `demand` (m), both scaled to total 1. A pair without
 * an arc, and a pair whose cost is `cap` or more, costs `cap` (what has no partner fades): internally a hub joins
 * them, so only the arcs below cap are in the network, and the plan lists only those.
 * moves: capacity n + m + arcs is enough; *count gets how many, sorted by source then target.
 * dual_u[n], dual_v[m], *gap may be NULL: duals with u_i + v_j <= min(cost_ij, cap), and cost - (u.supply + v.demand).
 * Exact to 1e-9 of cap (integer network simplex); the same result on every machine.
 * Returns 0, or -1 (out of memory), -2 (bad input: a negative or not finite number, or a total of 0). Thread-safe. */
int rbf_transport_solve(size_t n, const double *supply, size_t m, const double *demand, size_t arcs, const rbf_arc *arc,
	double cap, rbf_move *moves, size_t *count, double *cost, double *dual_u, double *dual_v, double *gap);

#ifdef __cplusplus
}
#endif
#endif
