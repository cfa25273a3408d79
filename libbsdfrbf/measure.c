/* SPDX-License-Identifier: BSD-3-Clause */
#include "gather.h"
#include "overlap.h"
#include "scan_lines.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180)
#define FEW_SAMPLES 10

bsdfrbf_data *bsdfrbf_data_new(bsdfrbf_context *context)
{
	bsdfrbf_data *data = calloc(1, sizeof *data);
	if (!data)
		rbf_out_of_memory(context);
	return data;
}

void rbf_measured_free(rbf_measured *measured)
{
	for (size_t i = 0; i < measured->count; i++) {
		free(measured->incidence[i].outgoing);
		free(measured->incidence[i].dsf);
		free(measured->incidence[i].lobe);
	}
	free(measured->incidence);
	memset(measured, 0, sizeof *measured);
}

void bsdfrbf_data_free(bsdfrbf_data *data)
{
	if (!data)
		return;
	for (int c = 0; c < 4; c++)
		rbf_measured_free(&data->component[c]);
	free(data->name);
	free(data->source);
	free(data);
}

const char *rbf_component_name(int component)
{
	static const char *const name[4] = {"front reflection (rf)", "back reflection (rb)",
		"front transmission (tf)", "back transmission (tb)"};
	return component >= 0 && component < 4 ? name[component] : "?";
}

/* ---------------------------------------------------------------- gather */

void rbf_direction_from_angles(double theta, double phi, double direction[3])
{
	/* whole quarter turns exactly, so that directions in a mirror plane lie in it */
	const double turn = fmod(phi, 360) / 90;
	double c = cos(phi * DEGREE), s = sin(phi * DEGREE);
	if (turn == floor(turn)) {
		c = round(c) + 0.0; /* no negative zero */
		s = round(s) + 0.0;
	}
	const double sine = theta == 180 ? 0 : sin(theta * DEGREE);
	direction[0] = sine * c;
	direction[1] = sine * s;
	direction[2] = cos(theta * DEGREE);
}

int rbf_gather_start(rbf_gather *gather, const double incident[3], int channels)
{
	memset(gather, 0, sizeof *gather);
	gather->channels = channels;
	gather->back = incident[2] < 0;
	memcpy(gather->direction, incident, sizeof gather->direction);
	gather->direction[2] = fabs(incident[2]);
	if (hypot(incident[0], incident[1]) < sin(RBF_SAME_INCIDENCE_DEG * DEGREE)) {
		gather->direction[0] = gather->direction[1] = 0; /* normal: its azimuth means nothing */
		gather->direction[2] = 1;
	}
	return gather->direction[2] >= RBF_HORIZON_Z;
}

static int batch_grow(rbf_batch *batch, size_t capacity, int channels)
{
	if (capacity > SIZE_MAX / (3 * sizeof(double)))
		return 0;
	double *outgoing = realloc(batch->outgoing, capacity * 3 * sizeof(double));
	if (outgoing)
		batch->outgoing = outgoing;
	float *dsf = realloc(batch->dsf, capacity * (size_t)channels * sizeof(float));
	if (dsf)
		batch->dsf = dsf;
	if (!outgoing || !dsf)
		return 0;
	batch->capacity = capacity;
	return 1;
}

int rbf_gather_add(rbf_gather *gather, const double outgoing[3], const double *values, bsdfrbf_quantity quantity)
{
	const double z = fabs(outgoing[2]);
	if (!(z >= RBF_HORIZON_Z))
		return 1;
	rbf_batch *batch = &gather->side[gather->back != (outgoing[2] < 0)];
	if (batch->count == batch->capacity &&
			!batch_grow(batch, batch->capacity ? 2 * batch->capacity : 1024, gather->channels))
		return 0;
	double *o = batch->outgoing + 3 * batch->count;
	o[0] = outgoing[0];
	o[1] = outgoing[1];
	o[2] = z;
	float *dsf = batch->dsf + (size_t)gather->channels * batch->count;
	for (int c = 0; c < gather->channels; c++)
		dsf[c] = (float)(quantity == BSDFRBF_QUANTITY_BSDF ? values[c] * z : values[c]);
	batch->count++;
	return 1;
}

void rbf_gather_free(rbf_gather *gather)
{
	for (int side = 0; side < 2; side++) {
		free(gather->side[side].outgoing);
		free(gather->side[side].dsf);
	}
	memset(gather, 0, sizeof *gather);
}

/* ------------------------------------------------------------------ join */

/* What a gather has on one side, and where it goes. */
typedef struct item {
	int component;
	const double *direction;
	rbf_batch *batch;
	size_t target;     /* index of the incidence within its component, after joining */
	int opens;         /* it is the first of a new incidence */
} item;

static int same_incidence(const double a[3], const double b[3])
{
	const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	const double chord = RBF_SAME_INCIDENCE_DEG * DEGREE;
	return x * x + y * y + z * z < chord * chord;
}

static void find_targets(const bsdfrbf_data *data, item *items, size_t count, size_t fresh[4])
{
	for (size_t i = 0; i < count; i++) {
		item *it = &items[i];
		const rbf_measured *measured = &data->component[it->component];
		it->target = measured->count;
		for (size_t k = 0; k < measured->count && it->target == measured->count; k++)
			if (same_incidence(measured->incidence[k].direction, it->direction))
				it->target = k;
		if (it->target < measured->count)
			continue;
		it->opens = 1;
		for (size_t k = 0; k < i && it->opens; k++)
			if (items[k].opens && items[k].component == it->component &&
					same_incidence(items[k].direction, it->direction)) {
				it->target = items[k].target;
				it->opens = 0;
			}
		if (it->opens)
			it->target = measured->count + fresh[it->component]++;
	}
}

/* Makes room for everything without changing what a reader of `data` sees. */
static int reserve(bsdfrbf_data *data, item *items, size_t count, const size_t fresh[4])
{
	for (int c = 0; c < 4; c++) {
		rbf_measured *measured = &data->component[c];
		if (!fresh[c])
			continue;
		rbf_incidence *grown = realloc(measured->incidence, (measured->count + fresh[c]) * sizeof *grown);
		if (!grown)
			return 0;
		measured->incidence = grown;
	}
	for (size_t i = 0; i < count; i++) {
		item *it = &items[i];
		rbf_measured *measured = &data->component[it->component];
		size_t more = it->batch->count;
		for (size_t k = 0; k < count; k++)
			if (k != i && items[k].component == it->component && items[k].target == it->target) {
				if (!it->opens && k < i)
					more = 0; /* the first one makes room for all */
				else if (more)
					more += items[k].batch->count;
			}
		if (it->opens) {
			/* the first batch becomes the incidence itself; its own arrays grow */
			if (!batch_grow(it->batch, more, data->channels))
				return 0;
		} else if (more && it->target < measured->count) {
			rbf_incidence *incidence = &measured->incidence[it->target];
			rbf_batch batch = {incidence->count, 0, incidence->outgoing, incidence->dsf};
			const int grown = batch_grow(&batch, incidence->count + more, data->channels);
			incidence->outgoing = batch.outgoing;
			incidence->dsf = batch.dsf;
			if (!grown)
				return 0;
		}
	}
	return 1;
}

static void commit(bsdfrbf_data *data, item *items, size_t count, const size_t fresh[4], int from_file)
{
	for (size_t i = 0; i < count; i++) {
		item *it = &items[i];
		rbf_incidence *incidence = &data->component[it->component].incidence[it->target];
		if (it->opens) {
			memset(incidence, 0, sizeof *incidence);
			memcpy(incidence->direction, it->direction, sizeof incidence->direction);
			incidence->count = it->batch->count;
			incidence->outgoing = it->batch->outgoing;
			incidence->dsf = it->batch->dsf;
			incidence->file = from_file ? data->files + 1 : 0;
			memset(it->batch, 0, sizeof *it->batch);
			continue;
		}
		const size_t channels = (size_t)data->channels;
		memcpy(incidence->outgoing + 3 * incidence->count, it->batch->outgoing, it->batch->count * 3 * sizeof(double));
		memcpy(incidence->dsf + channels * incidence->count, it->batch->dsf, it->batch->count * channels * sizeof(float));
		incidence->count += it->batch->count;
	}
	for (int c = 0; c < 4; c++)
		data->component[c].count += fresh[c];
}

/* "list\npath", or NULL when out of memory. */
static char *with_line(const char *list, const char *path)
{
	const size_t before = list ? strlen(list) + 1 : 0, length = strlen(path);
	char *joined = malloc(before + length + 1);
	if (!joined)
		return NULL;
	if (list) {
		memcpy(joined, list, before - 1);
		joined[before - 1] = '\n';
	}
	memcpy(joined + before, path, length + 1);
	for (char *c = joined + before; *c; c++)
		if (*c == '\n')
			*c = '?';
	return joined;
}

static bsdfrbf_status refuse_channels(bsdfrbf_context *context, const bsdfrbf_data *data, int channels, const char *path)
{
	static const char *const what[2] = {"one value (CIE Y)", "three values (CIE X, Y, Z)"};
	const char *first = data->source ? data->source : "those added before";
	size_t length = strcspn(first, "\n");
	const size_t own = path ? strlen(path) : 0;
	first += length > 300 ? length - 300 : 0; /* of long paths the end tells more */
	length = length > 300 ? 300 : length;
	return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: %s a sample, but %s in %.*s: "
		"fit files with and without colour separately", path ? path + (own > 300 ? own - 300 : 0) : "these samples",
		what[channels == 3], what[data->channels == 3], (int)length, first);
}

static bsdfrbf_status refuse_second(bsdfrbf_context *context, int component, const char *path)
{
	const size_t length = path ? strlen(path) : 0;
	return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: %s is there already, and one of the two is a finished interpolant (.sir), which "
		"nothing can be joined to: give one .sir file, or else measurements, for each component",
		path ? path + (length > 300 ? length - 300 : 0) : "these samples", rbf_component_name(component));
}

bsdfrbf_status rbf_data_join(bsdfrbf_context *context, bsdfrbf_data *data, size_t count, rbf_gather *gathers,
	const char *path, const char *name)
{
	const int channels = count ? gathers[0].channels : data->channels, channels_before = data->channels;
	if (data->channels && channels != data->channels)
		return refuse_channels(context, data, channels, path);
	for (size_t g = 0; g < count; g++)
		for (int side = 0; side < 2; side++) {
			const int component = (side ? BSDFRBF_TF : BSDFRBF_RF) + gathers[g].back;
			if (gathers[g].side[side].count && data->component[component].ready)
				return refuse_second(context, component, path);
		}

	size_t fresh[4] = {0}, used = 0;
	item *items = calloc(2 * count + 1, sizeof *items);
	char *source = path ? with_line(data->source, path) : NULL;
	char *label = name && !data->name ? with_line(NULL, name) : NULL;
	int done = items && (!path || source) && (!name || data->name || label);
	if (done) {
		for (size_t g = 0; g < count; g++)
			for (int side = 0; side < 2; side++)
				if (gathers[g].side[side].count) {
					items[used].component = (side ? BSDFRBF_TF : BSDFRBF_RF) + gathers[g].back;
					items[used].direction = gathers[g].direction;
					items[used++].batch = &gathers[g].side[side];
				}
		data->channels = channels;
		find_targets(data, items, used, fresh);
		done = reserve(data, items, used, fresh);
	}
	if (!done) {
		data->channels = channels_before;
		free(items);
		free(source);
		free(label);
		return rbf_out_of_memory(context);
	}
	for (size_t i = 0; i < used; i++)
		if (items[i].target < data->component[items[i].component].count)
			rbf_overlap_warn(context, data, items[i].component, items[i].target, items[i].batch, path);
	commit(data, items, used, fresh, path != NULL);
	free(items);
	if (source) {
		free(data->source);
		data->source = source;
		data->files++;
	}
	if (label)
		data->name = label;
	return BSDFRBF_OK;
}

bsdfrbf_status rbf_data_join_ready(bsdfrbf_context *context, bsdfrbf_data *data, int component, int channels,
	rbf_measured *ready, const char *path, const char *name)
{
	if (data->channels && channels != data->channels)
		return refuse_channels(context, data, channels, path);
	if (data->component[component].count)
		return refuse_second(context, component, path);
	/* joining no samples records the file */
	RBF_TRY(rbf_data_join(context, data, 0, NULL, path, name));
	data->channels = channels;
	free(data->component[component].incidence);
	data->component[component] = *ready;
	memset(ready, 0, sizeof *ready);
	return BSDFRBF_OK;
}

/* ------------------------------------------------------------------- API */

static int to_unit(const double in[3], double out[3])
{
	const double largest = fmax(fabs(in[0]), fmax(fabs(in[1]), fabs(in[2])));
	if (!isfinite(in[0]) || !isfinite(in[1]) || !isfinite(in[2]) || !(largest > 0))
		return 0;
	for (int i = 0; i < 3; i++)
		out[i] = in[i] / largest;
	const double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
	for (int i = 0; i < 3; i++)
		out[i] /= length;
	return 1;
}

bsdfrbf_status bsdfrbf_data_add(bsdfrbf_context *context, bsdfrbf_data *data, const double incident[3], size_t count,
	const double *outgoing, const double *values, int channels, bsdfrbf_quantity quantity)
{
	double unit[3];
	rbf_gather gather;

	if (!data || !incident || !outgoing || !values || !count)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_add: no data, directions or values");
	if (channels != 1 && channels != 3)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_add: %d channels: must be 1 or 3", channels);
	if (quantity != BSDFRBF_QUANTITY_BSDF && quantity != BSDFRBF_QUANTITY_DSF)
		return rbf_fail(context, BSDFRBF_ERR_ARGUMENT, "bsdfrbf_data_add: unknown quantity %d", (int)quantity);
	if (!to_unit(incident, unit))
		return rbf_fail(context, BSDFRBF_ERR_DATA, "incident direction is zero or not finite");
	if (!rbf_gather_start(&gather, unit, channels))
		return rbf_fail(context, BSDFRBF_ERR_DATA, "incident direction lies in the plane of the surface");

	bsdfrbf_status status = BSDFRBF_OK;
	for (size_t i = 0; i < count && !status; i++) {
		const double *value = values + (size_t)channels * i;
		if (!to_unit(outgoing + 3 * i, unit))
			status = rbf_fail(context, BSDFRBF_ERR_DATA, "outgoing direction %zu is zero or not finite", i);
		for (int c = 0; c < channels && !status; c++)
			if (!(fabs(value[c]) <= RBF_VALUE_MAX))
				status = rbf_fail(context, BSDFRBF_ERR_DATA, "value of sample %zu is not finite or beyond 1e12 per sr", i);
		if (!status && !rbf_gather_add(&gather, unit, value, quantity))
			status = rbf_out_of_memory(context);
	}
	if (!status)
		status = rbf_data_join(context, data, 1, &gather, NULL, NULL);
	rbf_gather_free(&gather);
	return status;
}

/* ----------------------------------------------------------------- check */

static void describe(const rbf_incidence *incidence, int component, char text[80])
{
	const double *d = incidence->direction;
	const int back = component == BSDFRBF_RB || component == BSDFRBF_TB;
	const double theta = atan2(hypot(d[0], d[1]), back ? -d[2] : d[2]) / DEGREE;
	const double phi = atan2(d[1], d[0]) / DEGREE;
	/* tenths by hand: the host's locale must not put a comma into a message */
	const long t = lround(theta * 10), p = lround((phi < 0 ? phi + 360 : phi) * 10);
	snprintf(text, 80, "theta %ld.%ld phi %ld.%ld", t / 10, t % 10, p / 10, p % 10);
}

bsdfrbf_status rbf_data_check(bsdfrbf_context *context, const bsdfrbf_data *data)
{
	const int y = data->channels == 3;
	size_t incidences = 0;
	for (int c = 0; c < 4; c++) {
		const rbf_measured *measured = &data->component[c];
		size_t dark = 0, few = 0, flat = 0;
		char first_dark[80] = "", first_few[80] = "", first_flat[80] = "";
		for (size_t i = 0; i < measured->count; i++) {
			const rbf_incidence *incidence = &measured->incidence[i];
			double normal[3];
			int light = 0;
			for (size_t k = 0; k < incidence->count && !light; k++)
				light = incidence->dsf[(size_t)data->channels * k + (size_t)y] > 0;
			for (size_t k = 0; k < incidence->lobes && !light; k++)
				light = incidence->lobe[k].dsf[y] > 0;
			if (!light && !dark++)
				describe(incidence, c, first_dark);
			if (!measured->ready && incidence->count < FEW_SAMPLES && !few++)
				describe(incidence, c, first_few);
			else if (!measured->ready && incidence->count >= FEW_SAMPLES && rbf_scan_plane(incidence, normal) && !flat++)
				describe(incidence, c, first_flat);
		}
		if (measured->count && dark == measured->count)
			return rbf_fail(context, BSDFRBF_ERR_DATA, "%s: no value is above zero at any of the %zu incidences: "
				"check the column that holds the values, and its sign", rbf_component_name(c), measured->count);
		if (dark)
			rbf_warn(context, "%s: no value is above zero at %zu of %zu incidences, the first at %s (degrees)",
				rbf_component_name(c), dark, measured->count, first_dark);
		if (few)
			rbf_warn(context, "%s: fewer than %d samples at %zu of %zu incidences, the first at %s (degrees): "
				"the fit will be poor there", rbf_component_name(c), FEW_SAMPLES, few, measured->count, first_few);
		if (flat)
			rbf_warn(context, "%s: all samples are in one plane at %zu of %zu incidences, the first at %s (degrees): what lies beside it "
				"is guessed if the material is isotropic, or planes at other azimuths tell, else dark, and so is DHR; measure other planes", rbf_component_name(c), flat, measured->count, first_flat);
		/* theta beyond 90 by a slip of the operator puts one file of many on the other side */
		const size_t other = data->component[c ^ 1].count;
		if (measured->count == 1 && other >= 3) {
			char where[80];
			describe(measured->incidence, c, where);
			rbf_warn(context, "%s: a single incidence, at %s (degrees), beside %zu of %s: is its side right?",
				rbf_component_name(c), where, other, rbf_component_name(c ^ 1));
		}
		incidences += measured->count;
	}
	if (!incidences)
		return rbf_fail(context, BSDFRBF_ERR_DATA, "no measurements: give at least one file");
	return BSDFRBF_OK;
}

int rbf_incidence_reserve(rbf_incidence *incidence, size_t channels, size_t count)
{
	double *outgoing = realloc(incidence->outgoing, (count + 1) * 3 * sizeof *outgoing);
	if (!outgoing)
		return -1;
	incidence->outgoing = outgoing;
	float *dsf = realloc(incidence->dsf, (count * channels + 1) * sizeof *dsf);
	if (!dsf)
		return -1;
	incidence->dsf = dsf;
	return 0;
}

int rbf_incidence_append(rbf_incidence *to, const rbf_incidence *other, size_t channels)
{
	const size_t count = to->count + other->count;
	if (rbf_incidence_reserve(to, channels, count))
		return -1;
	if (other->count) {
		memcpy(to->outgoing + 3 * to->count, other->outgoing, 3 * other->count * sizeof *to->outgoing);
		memcpy(to->dsf + channels * to->count, other->dsf, channels * other->count * sizeof *to->dsf);
	}
	to->count = count;
	return 0;
}
