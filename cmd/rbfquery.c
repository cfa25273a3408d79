/* SPDX-License-Identifier: BSD-3-Clause */
/* rbfquery: values, DHR or samples of a recorded interpolant; options follow bsdfquery of Radiance. */
#include "common.h"
#include "stream.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 8192 };

typedef struct query {
	const bsdfrbf_model *model;
	int channels;        /* of the model */
	int columns;         /* of the output: 1, or 3 for colour */
	cmd_reader *reader;
	cmd_writer *writer;
	float record[6 * BLOCK], incident[3 * BLOCK], outgoing[3 * BLOCK], value[6 * BLOCK], row[6 * BLOCK];
	int warned[3];
} query;

static int is_zero(const float *v)
{
	return v[0] == 0 && v[1] == 0 && v[2] == 0;
}

static int same(const float *a, const float *b)
{
	return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* One value of the model to what is asked for: Y, or X Y Z. A grey model is equal-energy white, as in Radiance. */
static void to_columns(const query *q, const float *value, float *row)
{
	if (q->columns == 1)
		row[0] = value[q->channels == 3];
	else
		for (int i = 0; i < 3; i++)
			row[i] = value[q->channels == 3 ? i : 0];
}

/* Says once for each component that its answers are 0 because the file does not have it. */
static void warn_if_missing(query *q, const float *incident, const float *outgoing)
{
	static const char *const name[] = {"front reflection", "back reflection", "transmission"};
	const int front = incident[2] > 0, through = front != (outgoing[2] > 0);
	const int kind = through ? 2 : !front;
	if (q->warned[kind])
		return;
	q->warned[kind] = 1;
	if (through ? !bsdfrbf_has(q->model, BSDFRBF_TF) && !bsdfrbf_has(q->model, BSDFRBF_TB)
			: !bsdfrbf_has(q->model, front ? BSDFRBF_RF : BSDFRBF_RB))
		fprintf(stderr, "%s: warning - the file has no %s: its values are 0\n", cmd_name(), name[kind]);
}

/* Values of pairs. Runs with one incident vector go to the function that locates it once. */
static void query_pairs(query *q)
{
	size_t got;
	while ((got = cmd_read(q->reader, q->record, BLOCK)) > 0) {
		size_t count = 0;
		for (size_t i = 0; i < got; i++) {
			const float *pair = q->record + 6 * i;
			if (is_zero(pair) || is_zero(pair + 3))
				continue; /* as bsdfquery: nothing but a flush, and output is flushed anyway */
			memcpy(q->incident + 3 * count, pair, 3 * sizeof *pair);
			memcpy(q->outgoing + 3 * count, pair + 3, 3 * sizeof *pair);
			warn_if_missing(q, pair, pair + 3);
			count++;
		}
		for (size_t i = 0; i < count; ) {
			size_t end = i + 1;
			if (end < count && same(q->incident + 3 * i, q->incident + 3 * end)) {
				while (end < count && same(q->incident + 3 * i, q->incident + 3 * end))
					end++;
				bsdfrbf_eval_exitant(q->model, q->incident + 3 * i, end - i, q->outgoing + 3 * i,
					q->value + (size_t)q->channels * i);
			} else {
				while (end < count && !(end + 1 < count && same(q->incident + 3 * end, q->incident + 3 * (end + 1))))
					end++;
				bsdfrbf_eval_many(q->model, end - i, q->incident + 3 * i, q->outgoing + 3 * i,
					q->value + (size_t)q->channels * i);
			}
			i = end;
		}
		for (size_t i = 0; i < count; i++)
			to_columns(q, q->value + (size_t)q->channels * i, q->row + (size_t)q->columns * i);
		cmd_write(q->writer, q->row, count, (size_t)q->columns);
	}
}

/* Reflectance and transmittance of incident vectors. */
static void query_dhr(query *q)
{
	size_t got;
	while ((got = cmd_read(q->reader, q->record, BLOCK)) > 0) {
		size_t count = 0;
		for (size_t i = 0; i < got; i++) {
			if (is_zero(q->record + 3 * i))
				continue;
			for (int transmit = 0; transmit < 2; transmit++) {
				float value[3] = {0};
				bsdfrbf_dhr(q->model, q->record + 3 * i, transmit, value);
				to_columns(q, value, q->row + (size_t)q->columns * (2 * count + (size_t)transmit));
			}
			count++;
		}
		cmd_write(q->writer, q->row, count, 2 * (size_t)q->columns);
	}
}

/* splitmix64 (Steele, Lea and Flood 2014): the same numbers in every run. */
static double uniform(uint64_t *state)
{
	uint64_t z = *state += 0x9e3779b97f4a7c15u;
	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}

static void lambertian_direction(double u, double v, int front, float d[3])
{
	const double r = sqrt(v), phi = 2 * 3.14159265358979323846 * u;
	d[0] = (float)(r * cos(phi));
	d[1] = (float)(r * sin(phi));
	d[2] = (float)(front ? sqrt(1 - v) : -sqrt(1 - v));
}

/* Draws N directions, stratified, from all that is scattered: the lobes and the Lambertian part of both sides.
 * Zero vectors if nothing is scattered, so that every incident vector has N. */
static void query_samples(query *q, size_t samples)
{
	uint64_t state = 1;
	size_t got;
	const int y = q->channels == 3;
	while ((got = cmd_read(q->reader, q->record, BLOCK)) > 0)
		for (size_t i = 0; i < got; i++) {
			const float *incident = q->record + 3 * i;
			if (is_zero(incident))
				continue;
			const int front = incident[2] > 0;
			double share[4], total = 0; /* lobes and Lambertian part, reflected then transmitted */
			for (int part = 0; part < 4; part++) {
				float all[3] = {0}, lobes[3] = {0};
				bsdfrbf_dhr(q->model, incident, part >> 1, all);
				bsdfrbf_dhr_scatter(q->model, incident, part >> 1, lobes);
				share[part] = fmax(part & 1 ? all[y] - lobes[y] : lobes[y], 0);
				total += share[part];
			}
			size_t filled = 0;
			for (size_t k = 0; k < samples; k++) {
				float *d = q->row + 3 * filled;
				double u = total * ((double)k + uniform(&state)) / (double)samples;
				d[0] = d[1] = d[2] = 0;
				for (int part = 0; part < 4; part++) {
					if (part < 3 && u >= share[part]) {
						u -= share[part];
						continue;
					}
					if (!(share[part] > 0))
						break;
					u = fmin(u / share[part], .999999999);
					if (part & 1)
						lambertian_direction(u, uniform(&state), front != part >> 1, d);
					else
						bsdfrbf_sample(q->model, incident, part >> 1, u, d);
					break;
				}
				if (++filled == BLOCK || k + 1 == samples) {
					cmd_write(q->writer, q->row, filled, 3);
					filled = 0;
				}
			}
		}
}

int main(int argc, char **argv)
{
	const char *word;
	char in = 'a', out = 'a';
	int colour = 0, dhr = 0, at;
	long samples = 0;
	cmd_start(argv[0]);
	for (at = 1; (word = cmd_option(argc, argv, &at, "-")); at++) {
		if (word[1] == 'f') {
			const size_t letters = strspn(word + 2, "afd");
			if (letters < 1 || letters > 2 || word[2 + letters])
				cmd_misuse("option '-f' takes one or two of a, f, d, such as -ff, not '%s'", word);
			in = word[2];
			out = letters > 1 ? word[3] : word[2];
		}
		else if (word[1] == 's')
			samples = cmd_integer("-s", cmd_value(argc, argv, &at), 1, 1000000000);
		else if (!strcmp(word, "-c"))
			colour = 1;
		else if (!strcmp(word, "-d"))
			dhr = 1;
		else if (strcmp(word, "-u"))
			cmd_unknown(word);
	}
	if (argc - at != 1 || (dhr && samples))
		cmd_misuse("%s", dhr && samples ? "-d and -s exclude each other" : "exactly one .rbf file is needed");

	bsdfrbf_context *context = cmd_context();
	bsdfrbf_model *model = cmd_open(context, argv[at]);
	query *q = calloc(1, sizeof *q);
	if (!q)
		cmd_fail("out of memory");
	q->model = model;
	q->channels = bsdfrbf_channels(model);
	q->columns = colour ? 3 : 1;
	q->reader = cmd_reader_new(in, dhr || samples ? 3 : 6);
	q->writer = cmd_writer_new(out);
	if (samples)
		query_samples(q, (size_t)samples);
	else if (dhr)
		query_dhr(q);
	else
		query_pairs(q);
	cmd_reader_free(q->reader);
	cmd_writer_free(q->writer);
	free(q);
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return 0;
}
