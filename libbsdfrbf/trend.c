/* SPDX-License-Identifier: BSD-3-Clause */
#include "bounds.h"
#include "dhr.h"
#include "trend.h"

#include <stdlib.h>

/* DHR of a component's scattered part at a direction; *total: of all light that leaves a surface lit from the same side. */
static double dhr_at(const bsdfrbf_model *model, int component, const float d[3], double *total)
{
	float own[3], other[3] = {0};
	const rbf_component *c = &model->component[component], *beside = &model->component[component ^ 2];
	const uint32_t y = rbf_luminance(c->channels);
	rbf_component_dhr(c, d, own);
	*total = (double)own[y] + (double)c->lambertian[y];
	if (beside->present) {
		rbf_component_dhr(beside, d, other);
		*total += (double)other[y] + (double)beside->lambertian[y];
	}
	return own[y];
}

/* Outwards at every vertex of a border: the mean of its borders' normals. [vertices][3] */
static float (*outward(const rbf_mesh *mesh))[3]
{
	float (*out)[3] = calloc((size_t)mesh->vertices + 1, sizeof *out);
	for (uint32_t b = 0; b < mesh->borders && out; b++) {
		float weight[2], normal[3];
		rbf_dhr_line(mesh, b, 0, weight, normal);
		for (int k = 0; k < 2; k++)
			for (int n = 0; n < 3; n++)
				out[rbf_bound_vertex(mesh, mesh->border[b][k])][n] += normal[n];
	}
	return out;
}

/* Change of ln DHR per radian outwards at a vertex, from two steps inwards: where it rises or falls ever more steeply, so it does there; but at most
 * half as much again, as noise counts more in it. *room: ln of how much it may still grow there. out is normalised. */
static double slope_at(const bsdfrbf_model *model, int component, const float vertex[3], float out[3], double step, double *room)
{
	double total, change[2], dhr[3];
	const float along = rbf_dot(out, vertex);
	*room = 0;
	for (int n = 0; n < 3; n++)
		out[n] -= along * vertex[n];
	if (!(step > 0) || !(rbf_normalize(out) > 0))
		return 0;
	for (int s = 2; s >= 0; s--) { /* the vertex itself last */
		float inside[3];
		for (int n = 0; n < 3; n++)
			inside[n] = (float)(cos(s * step) * (double)vertex[n] - sin(s * step) * (double)out[n]);
		dhr[s] = dhr_at(model, component, inside, &total);
	}
	*room = total > 0 && total < 1 ? -log(total) : 0;
	if (!(dhr[0] > 0) || !(dhr[1] > 0))
		return 0;
	for (int s = 0; s < 2; s++)
		change[s] = dhr[s + 1] > 0 ? log(dhr[s] / dhr[s + 1]) / step : change[0];
	const double bend = .5 * (change[0] - change[1]), most = .5 * fabs(change[0]);
	return change[0] + fmin(fmax(bend, -most), most);
}

/* How far inside a border the trend is seen from: the last interval of a chain, the mean side of triangles. */
static double step_of(const rbf_mesh *mesh)
{
	const rbf_vertex *last = mesh->vertex + mesh->vertices - 1;
	return mesh->symmetry == RBF_ISOTROPIC && mesh->vertices > 1 ? (double)rbf_angle(last[-1].direction, last->direction) : rbf_mesh_spacing(mesh);
}

static float *trend_of(const bsdfrbf_model *model, int component)
{
	const rbf_component *c = &model->component[component];
	const rbf_mesh *mesh = &c->mesh;
	const uint32_t lines = 4 * c->dhr_steps;
	const double step = step_of(mesh);
	float (*out)[3] = outward(mesh);
	double (*rate)[2] = calloc((size_t)mesh->vertices + 1, sizeof *rate); /* slope, room */
	float *trend = malloc(((size_t)mesh->borders * lines + 1) * sizeof *trend);
	for (uint32_t v = 0; v < mesh->vertices && out && rate; v++)
		if (rbf_dot(out[v], out[v]) > 0)
			rate[v][0] = slope_at(model, component, mesh->vertex[v].direction, out[v], step, &rate[v][1]);
	for (uint32_t i = 0; i < mesh->borders * lines && out && rate && trend; i++) {
		const uint32_t border = i / lines;
		float weight[2], direction[3], mean[3] = {0};
		double slope = 0, room = 0;
		const double horizon = (double)rbf_dhr_line(mesh, border, (float)(i % lines) / (float)c->dhr_steps, weight, direction);
		for (int k = 0; k < 2; k++) {
			const uint32_t v = rbf_bound_vertex(mesh, mesh->border[border][k]);
			slope += (double)weight[k] * rate[v][0];
			room += (double)weight[k] * rate[v][1];
			for (int n = 0; n < 3; n++)
				mean[n] += weight[k] * out[v][n];
		}
		rbf_normalize(mean);
		trend[i] = (float)fmin(.5 * slope * horizon * fmax((double)rbf_dot(direction, mean), 0), room);
	}
	if (!out || !rate) {
		free(trend);
		trend = NULL;
	}
	free(out);
	free(rate);
	return trend;
}

int rbf_trend_set(bsdfrbf_model *model)
{
	float *trend[4] = {0};
	int failed = 0;
	for (int i = 0; i < 4; i++)
		if (model->component[i].present && model->component[i].mesh.borders)
			failed |= !(trend[i] = trend_of(model, i));
	for (int i = 0; i < 4; i++)
		model->component[i].trend = trend[i];
	return failed ? -1 : 0;
}
