// SPDX-License-Identifier: BSD-3-Clause
//
// transport EVERY FILES...: builds the interpolant of measurement files and puts every EVERY-th transport problem that comes up
// to LEMON's network simplex as well, on the full bipartite graph. Prints for each: sources, targets, arcs below the cap, our
// cost and LEMON's (radian squared; masses are scaled to 1), our and LEMON's seconds (medians of three, taken in turn; LEMON's
// without the time to make its graph). test/bench compiles this with --wrap=rbf_transport_solve, by which the problems are met.
#include "bsdfrbf.h"
#include "transport.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numeric>
#include <vector>

#include <lemon/network_simplex.h>
#include <lemon/smart_graph.h>

extern "C" int __real_rbf_transport_solve(size_t n, const double *supply, size_t m, const double *demand, size_t arcs, const rbf_arc *arc,
	double cap, rbf_move *moves, size_t *count, double *cost, double *dual_u, double *dual_v, double *gap);

static double now()
{
	timespec t;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
	return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// Whole numbers in proportion to mass that add up to 2^40 exactly.
static std::vector<long long> units(const double *mass, size_t n)
{
	const long long all = 1ll << 40;
	const double total = std::accumulate(mass, mass + n, 0.);
	std::vector<long long> u(n);
	for (size_t i = 0; i < n; i++)
		u[i] = std::llround(mass[i] / total * double(all));
	*std::max_element(u.begin(), u.end()) += all - std::accumulate(u.begin(), u.end(), 0ll);
	return u;
}

struct solution { double cost, seconds; };

static solution lemon_solve(size_t n, const double *supply, size_t m, const double *demand, size_t arcs, const rbf_arc *arc, double cap)
{
	using lemon::SmartDigraph;
	const double cost_units = double(1 << 30);
	SmartDigraph graph;
	graph.reserveNode(int(n + m));
	graph.reserveArc(int(n * m));
	std::vector<SmartDigraph::Node> node(n + m);
	for (auto &one : node)
		one = graph.addNode();
	std::vector<double> cost(n * m, cap);
	for (size_t a = 0; a < arcs; a++)
		cost[arc[a].source * m + arc[a].target] = std::min(double(arc[a].cost), cap);
	SmartDigraph::ArcMap<long long> price(graph);
	SmartDigraph::NodeMap<long long> mass(graph);
	std::vector<SmartDigraph::Arc> all(n * m);
	for (size_t i = 0; i < n; i++)
		for (size_t j = 0; j < m; j++) {
			all[i * m + j] = graph.addArc(node[i], node[n + j]);
			price[all[i * m + j]] = std::llround(cost[i * m + j] / cap * cost_units);
		}
	const auto from = units(supply, n), to = units(demand, m);
	for (size_t i = 0; i < n; i++)
		mass[node[i]] = from[i];
	for (size_t j = 0; j < m; j++)
		mass[node[n + j]] = -to[j];
	const double start = now();
	lemon::NetworkSimplex<SmartDigraph, long long> simplex(graph);
	simplex.costMap(price).supplyMap(mass);
	if (simplex.run() != simplex.OPTIMAL) {
		std::fprintf(stderr, "transport: LEMON finds no optimum\n");
		std::exit(1);
	}
	const double seconds = now() - start;
	double sum = 0;
	for (size_t a = 0; a < n * m; a++)
		sum += double(simplex.flow(all[a])) * cost[a];
	return {sum / double(1ll << 40), seconds};
}

static int every = 1, met;

extern "C" int __wrap_rbf_transport_solve(size_t n, const double *supply, size_t m, const double *demand, size_t arcs, const rbf_arc *arc,
	double cap, rbf_move *moves, size_t *count, double *cost, double *dual_u, double *dual_v, double *gap)
{
	int status = 0;
	double ours[3], theirs[3];
	const bool asked = met++ % every == 0;
	solution peer = {0, 0};
	for (int r = 0; r < (asked ? 3 : 1); r++) {
		const double start = now();
		status = __real_rbf_transport_solve(n, supply, m, demand, arcs, arc, cap, moves, count, cost, dual_u, dual_v, gap);
		ours[r] = now() - start;
		if (!asked || status)
			return status;
		peer = lemon_solve(n, supply, m, demand, arcs, arc, cap);
		theirs[r] = peer.seconds;
	}
	std::sort(ours, ours + 3);
	std::sort(theirs, theirs + 3);
	std::printf("%zu\t%zu\t%zu\t%.12g\t%.12g\t%.6g\t%.6g\n", n, m, arcs, *cost, peer.cost, ours[1], theirs[1]);
	return status;
}

int main(int argc, char **argv)
{
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_data *data = bsdfrbf_data_new(context);
	bsdfrbf_build_options options;
	bsdfrbf_model *model = nullptr;
	bsdfrbf_status status = BSDFRBF_OK;
	bsdfrbf_build_defaults(&options);
	options.threads = 1;
	every = argc > 1 ? std::max(std::atoi(argv[1]), 1) : 1;
	for (int k = 2; k < argc && !status; k++)
		status = bsdfrbf_data_read(context, data, argv[k]);
	if (!status)
		status = bsdfrbf_build(context, data, &options, &model);
	if (status)
		std::fprintf(stderr, "transport: %s\n", bsdfrbf_message(context));
	bsdfrbf_close(model);
	bsdfrbf_data_free(data);
	bsdfrbf_context_free(context);
	return status != BSDFRBF_OK;
}
