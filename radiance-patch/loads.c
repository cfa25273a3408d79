/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * For test_loads.sh: loads and frees a BSDF file again and again, with some use in between, through Radiance's own
 * interface.   loads COUNT FILE
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <math.h>
#include <sys/resource.h>
#include <unistd.h>
#include "bsdf.h"

static long
kilobytes(void)
{
	struct rusage	u;

	getrusage(RUSAGE_SELF, &u);
	return u.ru_maxrss;
}

static int
use(const SDData *sd, int n)
{
	static const double	side[4][2] = {{1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
	FVECT			in, out, v;
	SDValue			value;
	double			psa[2];
	int			i;

	for (i = 0; i < 4; i++) {
		in[0] = .3*sin(n); in[1] = .3*cos(n); in[2] = side[i][0]*.9;
		out[0] = -in[0]; out[1] = -in[1]; out[2] = side[i][1]*.9;
		normalize(in); normalize(out);
		if (SDevalBSDF(&value, in, out, sd) || !(value.cieY >= 0))
			return 0;
		if (SDsizeBSDF(psa, in, out, SDqueryMin+SDqueryMax, sd) || !(psa[0] > 0) || psa[1] < psa[0])
			return 0;
		VCOPY(v, in);
		if (SDsampBSDF(&value, v, (n % 97)/97., SDsampAll, sd))
			return 0;
		if (fabs(value.cieY - SDdirectHemi(in, SDsampAll, sd)) > 1e-5)
			return 0;
	}
	return 1;
}

int
main(int argc, char **argv)
{
	const int	count = argc == 3 ? atoi(argv[1]) : 0;
	const SDData	*cached;
	SDData		sd;
	SDError		ec;
	const int	first = dup(0);
	long		before = 0;
	int		i;

	close(first);
	SDclearBSDF(&sd, "loads");
	for (i = 0; i < count; i++) {
		ec = SDloadFile(&sd, argv[2]);	/* frees the former one itself */
		if (ec) {
			SDreportError(ec, stderr);
			return 1;
		}
		if (!SDisLoaded(&sd) || (i % 50 == 0 && !use(&sd, i))) {
			fprintf(stderr, "load %d is not right\n", i);
			return 1;
		}
		if (i == count/10)
			before = kilobytes();
		if (i % 2)
			SDfreeBSDF(&sd);
		if (i % 10 == 0) {		/* the way of the renderers */
			if ((cached = SDcacheFile(argv[2])) == NULL || SDcacheFile(argv[2]) != cached)
				return 1;
			SDfreeCumulativeCache(cached->tf);
			SDfreeCache(cached);
			SDfreeCache(cached);
		}
	}
	SDfreeBSDF(&sd);
	SDfreeCache(NULL);
	i = dup(0);
	if (i != first) {
		fprintf(stderr, "files were left open\n");
		return 1;
	}
	if (kilobytes() > before + 1024) {
		fprintf(stderr, "memory grew from %ld to %ld kilobytes\n", before, kilobytes());
		return 1;
	}
	printf("%d loads, %ld kilobytes\n", count, kilobytes());
	return count > 0 ? 0 : 2;
}
