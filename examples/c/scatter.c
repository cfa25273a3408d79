/* SPDX-License-Identifier: BSD-3-Clause */
/* Where does the light go? Evaluates and samples a recorded BSDF for one incident direction.
 * usage: scatter file.rbf theta phi   (degrees) */
#include <bsdfrbf.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
	if (argc != 4)
		return fputs("usage: scatter file.rbf theta phi\n", stderr), 2;
	bsdfrbf_context *context = bsdfrbf_context_new();
	bsdfrbf_model *model;
	if (!context || bsdfrbf_open(context, argv[1], &model) != BSDFRBF_OK) {
		fprintf(stderr, "%s\n", context ? bsdfrbf_message(context) : "out of memory");
		bsdfrbf_context_free(context);
		return 1;
	}
	const double radian = 3.14159265358979 / 180, theta = atof(argv[2]) * radian, phi = atof(argv[3]) * radian;
	const float in[3] = {(float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)cos(theta)};
	const int y = bsdfrbf_channels(model) == 3; /* luminance: the only channel, or the second of X, Y, Z */

	for (int transmit = 0; transmit < 2; transmit++) {
		enum { SAMPLES = 10000 };
		float dhr[3], diffuse[3], f[3], out[3], mean[3] = {0, 0, 0};
		bsdfrbf_dhr(model, in, transmit, dhr);
		bsdfrbf_lambertian(model, (in[2] < 0) + 2 * transmit, diffuse);
		printf("%s %.5g, of it diffuse %.5g\n", transmit ? "transmittance" : "reflectance", dhr[y], diffuse[y]);
		/* what is not diffuse, by importance: one stratum a sample */
		for (int k = 0; k < SAMPLES && bsdfrbf_sample(model, in, transmit, (k + .5) / SAMPLES, out); k++) {
			for (int axis = 0; axis < 3; axis++)
				mean[axis] += out[axis] / SAMPLES;
			if (k % 2500)
				continue;
			bsdfrbf_eval(model, in, out, f);
			printf("  towards %8.5f %8.5f %8.5f  f %.6g /sr, density %.6g /sr\n", out[0], out[1], out[2], f[y], bsdfrbf_pdf(model, in, out));
		}
		printf("  mean direction %.4f %.4f %.4f\n", mean[0], mean[1], mean[2]);
	}
	bsdfrbf_close(model);
	bsdfrbf_context_free(context);
	return 0;
}
