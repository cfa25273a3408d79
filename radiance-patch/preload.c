/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * libbsdfrbf_preload.so: recorded interpolants for programs that carry a Radiance of their own, unpatched, such as the
 * extension modules of pyradiance. With LD_PRELOAD its SDloadFile() stands before theirs: it answers for files of ours and
 * passes every other one on.
 *
 * Several modules in one process may each carry a copy of Radiance. The one to talk to is that of the caller: what is
 * allocated for it, freed by it and said in its SDerrorDetail must be its own. Nothing but SDloadFile() is visible.
 */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE		/* dladdr, RTLD_NEXT */
#endif
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "bsdf.h"
#include "bsdf_rbf.h"

#define RBF_DETAIL	256	/* size of SDerrorDetail, bsdf.c */

/* What bsdf_rbf.c expects of the Radiance around it. */
const C_COLOR		c_dfcolor = C_DEFCOLOR;
char			SDerrorDetail[RBF_DETAIL];

/* Functions of the Radiance that called us. */
typedef struct {
	SDError		(*load)(SDData *, const char *);
	SDSpectralDF *	(*new_df)(int);
	void		(*free_df)(SDSpectralDF *);
	void		(*free_bsdf)(SDData *);
	char		*detail;
} RBFcaller;

static __thread RBFcaller	rbf_caller;

SDSpectralDF *
SDnewSpectralDF(int nc)
{
	return (*rbf_caller.new_df)(nc);
}

void
SDfreeSpectralDF(SDSpectralDF *df)
{
	(*rbf_caller.free_df)(df);
}

void
SDfreeBSDF(SDData *sd)
{
	(*rbf_caller.free_bsdf)(sd);
}

double
normalize(FVECT v)
{
	const double	length = sqrt(v[0]*v[0] + v[1]*v[1] + v[2]*v[2]);
	int		i;

	for (i = 0; length > 0 && i < 3; i++)
		v[i] /= length;
	return length;
}

/* A function through the pointer that dlsym() gives (ISO C has no conversion for it). */
static void
rbf_find(void *function, void *handle, const char *name)
{
	void	*found = dlsym(handle, name);

	memcpy(function, &found, sizeof(found));
}

static void
rbf_look_in(RBFcaller *c, void *handle)
{
	rbf_find(&c->load, handle, "SDloadFile");
	rbf_find(&c->new_df, handle, "SDnewSpectralDF");
	rbf_find(&c->free_df, handle, "SDfreeSpectralDF");
	rbf_find(&c->free_bsdf, handle, "SDfreeBSDF");
	c->detail = (char *)dlsym(handle, "SDerrorDetail");
}

__attribute__((visibility("default"))) SDError
SDloadFile(SDData *sd, const char *fname)
{
	RBFcaller	caller;
	Dl_info		info;
	void		*module = NULL;
	SDError		answer;
	int		ours;

	memset(&caller, 0, sizeof(caller));
	if (dladdr(__builtin_return_address(0), &info) && info.dli_fname != NULL)
		module = dlopen(info.dli_fname, RTLD_LAZY|RTLD_NOLOAD);
	if (module != NULL)
		rbf_look_in(&caller, module);
	if (caller.load == NULL || caller.load == &SDloadFile)	/* it does not carry its own */
		rbf_look_in(&caller, RTLD_NEXT);
	if (module != NULL)
		dlclose(module);	/* one reference less; its code runs, so it stays */
	if (caller.load == NULL || caller.load == &SDloadFile)
		return SDEinternal;
	if (sd == NULL || fname == NULL || caller.new_df == NULL || caller.free_df == NULL || caller.free_bsdf == NULL)
		return (*caller.load)(sd, fname);
	rbf_caller = caller;
	(*caller.free_bsdf)(sd);
	SDerrorDetail[0] = '\0';
	ours = SDloadRbf(&answer, sd, &fname);
	if (!ours)
		return (*caller.load)(sd, fname);	/* fname may be the tree that BSDFRBF_FORM asks for */
	if (caller.detail != NULL)
		strcpy(caller.detail, SDerrorDetail);
	return answer;
}
