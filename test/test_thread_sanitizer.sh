#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# test_threads under the thread sanitizer, in a build of its own: no race in what renderers call, in the reader and in the
# builder's own code. OpenMP gets one thread, since the sanitizer does not know the locks of libgomp.
set -u
build=${BUILD_DIR:?} source=${SOURCE_DIR:-$(cd "$(dirname "$0")/.." && pwd)}
own=$build/thread-sanitizer
{ cmake -S "$source" -B "$own" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG="-O1 -g" -DBSDFRBF_THREAD_SANITIZE=ON \
	-DBSDFRBF_RADIANCE=OFF && cmake --build "$own" --target test_threads; } >"$own.log" 2>&1 ||
	{ tail -20 "$own.log"; exit 1; }
export OMP_NUM_THREADS=1 TSAN_OPTIONS="exitcode=66 halt_on_error=1"
# Older sanitizers stop where the kernel puts libraries at addresses they do not know.
run=("$own/test/test_threads")
race() { RACE=1 "${run[@]}" >"$own.txt" 2>&1; }
race
if grep -q 'unexpected memory mapping' "$own.txt"; then
	run=(setarch -R "${run[@]}")
	race
fi
grep -qE 'unexpected memory mapping|personality' "$own.txt" && { echo "skipped: the sanitizer does not run here"; exit 77; }
grep -q 'WARNING: ThreadSanitizer: data race' "$own.txt" || { cat "$own.txt"; echo "FAILED: a race was not noticed"; exit 1; }
"${run[@]}"
