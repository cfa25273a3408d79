/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Loops for timing that Python could not time: one call a pair of directions, through function pointers into the two
 * libraries. test/bench compiles this when it runs. pairs: incident xyz, outgoing xyz, as in query.bin.
 */

/* SDevalBSDF() of Radiance's bsdf.h: value, incident, outgoing, data; a value starts with its luminance. */
typedef int radiance_eval(void *value, const double incident[3], const double outgoing[3], const void *data);

int loop_radiance(radiance_eval *eval, const void *data, long count, const float *pairs, float *answers)
{
	union { double luminance; char room[1024]; } value;
	for (long n = 0; n < count; n++, pairs += 6) {
		const double incident[3] = {pairs[0], pairs[1], pairs[2]}, outgoing[3] = {pairs[3], pairs[4], pairs[5]};
		const int status = eval(&value, incident, outgoing, data);
		if (status)
			return status;
		answers[n] = (float)value.luminance;
	}
	return 0;
}

/* bsdfrbf_eval() */
typedef void rbf_eval(const void *model, const float incident[3], const float outgoing[3], float *value);

void loop_rbf(rbf_eval *eval, const void *model, int channels, long count, const float *pairs, float *answers)
{
	for (long n = 0; n < count; n++, pairs += 6, answers += channels)
		eval(model, pairs, pairs + 3, answers);
}
