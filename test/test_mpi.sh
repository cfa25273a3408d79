#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# mkrbf on several processes: the same bytes as on one, and failures that end them all with one message.
set -u
bin=${BUILD_DIR:?}/bin
command -v mpirun >/dev/null && ldd "$bin/mkrbf" | grep -q libmpi || { echo "SKIP: mkrbf was built without MPI, or there is no mpirun"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMP_NUM_THREADS=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1
export ASAN_OPTIONS=detect_leaks=0${ASAN_OPTIONS:+:$ASAN_OPTIONS} # MPI's own

no() {
	echo "FAILED: $1"
	[ ! -e err ] || head -5 err
	failed=$((failed + 1))
}

# several NAME CODE MPIRUN_ARGUMENTS...: exit code, no hang
several() {
	local name=$1 code=$2 got
	shift 2
	timeout 120 mpirun -quiet "$@" >out 2>err
	got=$?
	[ $got -eq "$code" ] || no "$name: exit $got, not $code"
}

# told NAME PATTERN: exactly one line of mkrbf's, which matches
told() {
	[ "$(grep -c '^mkrbf: ' err)" -eq 1 ] || no "$1: not one message"
	grep -q "^mkrbf: .*$2" err || no "$1: message does not match '$2'"
}

"$bin/goniometer" -every 3 -samples 250 150 film film || exit 1
files=(film/*.txt)
"$bin/mkrbf" -q -o alone.rbf "${files[@]}" || exit 1
for count in 1 2 4; do
	several "$count processes" 0 -np $count "$bin/mkrbf" -q -o "team$count.rbf" "${files[@]}"
	[ ! -s err ] || no "$count processes: messages in spite of -q"
	cmp -s alone.rbf "team$count.rbf" || no "$count processes: other bytes than one"
done

several summary 0 -np 2 "$bin/mkrbf" -l 20 -o short.rbf "${files[@]}"
[ "$(grep -c '^tf\|^rf' err)" -eq 1 ] || no "summary: not one line for the component"
several help 0 -np 3 "$bin/mkrbf" --help
[ "$(grep -c '^Usage: ' out)" -eq 1 ] || no "help: not once"

rm -f new.rbf
several "a missing file" 1 -np 3 "$bin/mkrbf" -o new.rbf "${files[0]}" missing.txt
told "a missing file" "missing.txt"
several "a bad option" 1 -np 2 "$bin/mkrbf" -o new.rbf -z "${files[@]}"
told "a bad option" "unknown option '-z'"
sed '20s/.*/x y z/' "${files[0]}" >bad.txt
several "a bad line" 1 -np 2 "$bin/mkrbf" -o new.rbf bad.txt
told "a bad line" "bad.txt:20"
# one process alone sees an error: the others are waiting for it
several "an error at the first" 1 -np 1 "$bin/mkrbf" -o new.rbf missing.txt : -np 2 "$bin/mkrbf" -o new.rbf "${files[@]}"
told "an error at the first" "missing.txt"
several "an error at the last" 1 -np 2 "$bin/mkrbf" -o new.rbf "${files[@]}" : -np 1 "$bin/mkrbf" -o new.rbf missing.txt
told "an error at the last" "missing.txt"
# only the first writes, once all is built: here to what is not a file
if [ -w /dev/full ]; then
	several "no room" 1 -np 1 "$bin/mkrbf" -l 20 -o /dev/full "${files[@]}" : -np 1 "$bin/mkrbf" -l 20 -o new.rbf "${files[@]}"
	told "no room" "/dev/full"
fi
[ ! -e new.rbf ] || no "left an output file behind"

[ $failed -eq 0 ] && echo "as one process, and one message"
exit $((failed > 0))
