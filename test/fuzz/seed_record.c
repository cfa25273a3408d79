/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes small .rbf files for the fuzzer to start from, with and without the optional sections: seed_record FOLDER. */
#include "../synthetic.h"
#include "moves.h"
#include "bsdfrbf.h"

#include <stdio.h>

/* Made such that it is packed. */
static int pack(rbf_component *c)
{
	for (uint32_t i = 0; i < c->blocks * RBF_LANES; i++) {
		rbf_block *b = (rbf_block *)&c->block[i / RBF_LANES];
		const uint32_t lane = i % RBF_LANES;
		float d[3] = {b->x[lane], b->y[lane], b->z[lane]};
		rbf_normalize(d);
		b->x[lane] = d[0];
		b->y[lane] = d[1];
		b->z[lane] = d[2];
		b->k[lane] = 5 + 90 * b->k[lane];
	}
	free((void *)c->cull);
	c->cull = calloc((size_t)rbf_cull_words(c->blocks) + 1, sizeof *c->cull);
	for (uint32_t i = 0; i < c->residual * 6 * c->mesh.elements; i++) { /* one edge a base, towards wherever */
		uint32_t *at = (uint32_t *)&c->shift_of[i];
		const uint32_t base = c->mesh.vertex[c->mesh.element[i / 6].v[i % 6 / 2]].base;
		*at = *at == RBF_NO_SHIFT ? *at : base * (c->shifts / c->mesh.bases);
	}
	if (c->residual && rbf_moves_round(c))
		return 1;
	rbf_pack_round(c);
	rbf_pack_round_dhr(c);
	return !c->cull;
}

int main(int argc, char **argv)
{
	static const synthetic want[] = {{1, RBF_BILATERAL_Y, 2, 3, 1, 2, 5, 1, 1, 1, 2, 0}, {3, RBF_ISOTROPIC, 3, 3, 2, 2, 70, 2, 1, 2, 4, 1},
		{3, RBF_QUADRILATERAL, 3, 6, 4, 3, 90, 4, 1, 1, 4, 1}, {1, RBF_ANISOTROPIC, 1, 1, 0, 1, 30, 1, 0, 1, 2, 0},
		{1, RBF_BILATERAL_X, 1, 3, 1, 3, 8, 1, 0, 1, 2, 1}, {1, RBF_ISOTROPIC, 2, 3, 1, 2, 9, 2, 0, 2, 2, 2}};
	for (int n = 0; argc == 2 && n < (int)(sizeof want / sizeof *want); n++) {
		char path[4096];
		bsdfrbf_model *model = rbf_model_new();
		model->channels = want[n].channels;
		synthetic_component(&want[n], (uint64_t)n + 1, model->component + (n + 3) % 4);
		if (n % 2 && pack(model->component + (n + 3) % 4))
			return 1;
		if (n < 2)
			bsdfrbf_set_text(NULL, model, "name", "seed");
		snprintf(path, sizeof path, "%s/seed%d.rbf", argv[1], n);
		const bsdfrbf_status status = bsdfrbf_save(NULL, model, path);
		bsdfrbf_close(model);
		if (status != BSDFRBF_OK)
			return 1;
	}
	return argc != 2;
}
