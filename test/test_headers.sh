#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# bsdfrbf.h compiles alone; stages include no header of a later one; the library shows only its own names.
set -u
SOURCE=${SOURCE_DIR:-$(cd "$(dirname "$0")/.." && pwd)} BUILD=${BUILD_DIR:-$SOURCE/build}
LIB=$SOURCE/libbsdfrbf
WORK=$(mktemp -d) || exit 1
trap 'rm -rf "$WORK"' EXIT
failures=0
wrong() { echo "$*"; failures=$((failures + 1)); }

# ------------------------------------------------------------ the public header
echo '#include "bsdfrbf.h"
int main(void) { return bsdfrbf_version() == 0; }' > "$WORK/alone.c"
cp "$WORK/alone.c" "$WORK/alone.cpp"
${CC:-cc} -std=c11 -pedantic -Wall -Wextra -Werror -I "$LIB" -c "$WORK/alone.c" -o "$WORK/alone.o" || wrong "bsdfrbf.h does not compile alone as C11"
if command -v "${CXX:-c++}" > /dev/null; then
	"${CXX:-c++}" -std=c++17 -pedantic -Wall -Wextra -Werror -I "$LIB" -c "$WORK/alone.cpp" -o "$WORK/alone.o" ||
		wrong "bsdfrbf.h does not compile alone as C++17"
fi

# ------------------------------------------------------------ names
# A header that has the name of another, or of one of the system's, hides it from whoever includes it.
ls "$SOURCE"/libbsdfrbf/*.h "$SOURCE"/cmd/*.h "$SOURCE"/test/*.h "$SOURCE"/test/*/*.h 2> /dev/null | sed 's/.*\///' | sort > "$WORK/names"
for name in $(uniq -d "$WORK/names"); do wrong "$name: two headers of that name"; done
while read -r name; do
	echo "#include <$name>" | ${CC:-cc} -std=c11 -E -x c - > /dev/null 2>&1 && wrong "$name: the system has a header of that name"
done < "$WORK/names"

# ------------------------------------------------------------ the arrows
# All project headers that a file includes, directly or not.
closure() {
	local seen=" " queue="$1" file name
	while [ -n "$queue" ]; do
		file=${queue%% *}
		queue=${queue#"$file"}
		queue=${queue# }
		for name in $(sed -n 's/^[[:space:]]*#[[:space:]]*include[[:space:]]*"\([^"]*\)".*/\1/p' "$LIB/$file" 2> /dev/null); do
			case "$seen" in *" $name "*) continue ;; esac
			seen="$seen$name "
			queue="$queue${queue:+ }$name"
		done
	done
	echo "$seen"
}

# never FILES... -- HEADERS...
never() {
	local files=() file header all
	while [ "$1" != -- ]; do files+=("$1"); shift; done
	shift
	for file in "${files[@]}"; do
		[ -e "$LIB/$file" ] || { wrong "$file: named here, but gone"; continue; }
		all=$(closure "$file")
		for header in "$@"; do
			case "$all" in *" $header "*) wrong "$file includes $header, a stage that it must not know" ;; esac
		done
	done
}

EVALUATION="site.c evaluate.c carry.c dhr.c sample.c integrate.c query.c incidence.c kernel.c kernel_template.h map.h reciprocal.c mesh_locate.c model.c record_read.c"
never $EVALUATION -- measure.h gather.h read.h text.h fit.h nonnegative.h neighbours.h label.h choose.h advect.h assemble.h transport.h \
	division.h resample.h tree.h xml_write.h
never read.c read_mountain.c read_zemax.c read_sir.c measure.c measure_adjust.c text.c -- fit.h lobes.h mesh_build.h label.h choose.h advect.h assemble.h \
	transport.h evaluate.h sample.h record.h model.h resample.h
never fit.c unread.c nonnegative.c equations.c neighbours.c arrange.c lobes.c trials.c lobe_count.c -- mesh_build.h label.h choose.h advect.h assemble.h transport.h evaluate.h sample.h record.h resample.h
never mesh.c mesh_hull.c mesh_diagonals.c mesh_grid.c symmetry.c -- measure.h fit.h lobes.h label.h choose.h advect.h assemble.h transport.h evaluate.h sample.h record.h
never transport.c -- measure.h fit.h label.h choose.h advect.h assemble.h evaluate.h sample.h record.h
never label.c settle.c advect.c -- choose.h assemble.h evaluate.h sample.h record.h resample.h

# No OpenMP where renderers call: libgomp does not survive a fork.
for file in $EVALUATION; do
	grep -qE '#[[:space:]]*pragma[[:space:]]+omp|<omp\.h>' "$LIB/$file" && wrong "$file: OpenMP on a path that renderers call"
done
# The library neither prints nor exits.
for file in "$LIB"/*.c; do
	grep -nE '(^|[^a-z_])(printf|puts|perror|exit|abort|setlocale|signal)[[:space:]]*\(|fprintf[[:space:]]*\([[:space:]]*std' "$file" |
		grep -v '^\([0-9]*\):[[:space:]]*\(/\*\|\*\)' > "$WORK/found" && wrong "$(basename "$file"): $(head -1 "$WORK/found")"
done
# One public header, and every file says its licence.
for file in "$LIB"/*.[ch]; do
	head -1 "$file" | grep -q 'SPDX-License-Identifier: BSD-3-Clause' || wrong "$(basename "$file"): no licence on the first line"
	[ "$(wc -l < "$file")" -le 540 ] || wrong "$(basename "$file"): longer than 540 lines"
done

# ------------------------------------------------------------ symbols
SHARED=$BUILD/lib/libbsdfrbf.so
if [ -e "$SHARED" ] && command -v nm > /dev/null; then
	nm -D --defined-only "$SHARED" | awk '{print $NF}' | sed 's/@.*//' > "$WORK/symbols"
	[ -s "$WORK/symbols" ] || wrong "$SHARED shows nothing"
	grep -v '^bsdfrbf_' "$WORK/symbols" | grep -vE '^(_init|_fini|__bss_start|_edata|_end)$' > "$WORK/foreign" && wrong "$SHARED shows $(tr '\n' ' ' < "$WORK/foreign")"
	sed -n 's/^BSDFRBF_API.*[ *]\(bsdfrbf_[a-z_]*\)(.*/\1/p' "$LIB/bsdfrbf.h" | sort -u > "$WORK/declared"
	sort -u "$WORK/symbols" | grep '^bsdfrbf_' | diff "$WORK/declared" - > "$WORK/difference" || wrong "declared (<) and defined (>) functions differ: $(grep '^[<>]' "$WORK/difference" | tr '\n' ' ')"
else
	wrong "$SHARED is not there"
fi

[ $failures = 0 ] && echo "headers, arrows and symbols as they should be"
exit $((failures > 0))
