#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# SDloadFile and SDfreeBSDF of the patched Radiance, thousands of times: no leak of memory or files, no memory error,
# and all of it is well defined for every combination of components. Under valgrind 30 of a record with all four components;
# LOADS_VALGRIND=10000 does as many, of such records with few lobes, with one component and with all four: 25 minutes of a quiet core.
set -euo pipefail
loads=$BUILD_DIR/radiance/test/loads
work=$BUILD_DIR/test/loads
[ -x "$loads" ] || { echo "skipped: Radiance was not built"; exit 77; }
mkdir -p "$work"
cd "$work"
rm -rf ./*

# small measurements of both sides: one beam and a diffuse part; phi 180 more is the mirror direction
write() { # NAME, sign of z for incidence, sign for exit, CIE-Y or CIE-XYZ
	local theta
	for theta in 0 30 60; do
		awk -v t=$theta -v in_back="$2" -v out_back="$3" -v colour="$4" 'BEGIN {
			pi = atan2(0, -1); print "#format: theta phi BSDF"; print "#colorimetry: " colour
			print "#intheta " (in_back ? 180 - t : t); print "#inphi 0"
			for (o = 1; o < 90; o += 4) for (p = 0; p < 360; p += 10) {
				c = sin(t*pi/180)*sin(o*pi/180)*cos((p-180)*pi/180) + cos(t*pi/180)*cos(o*pi/180)
				y = .05 + 3*exp(40*(c - 1))
				printf "%g %g %g", (out_back ? 180 - o : o), p, (colour == "CIE-XYZ" ? 1.1 : 1)*y
				if (colour == "CIE-XYZ") printf " %g %g", y, .5*y
				print ""
			}
		}' >"$1-$theta.txt"
	done
}
write rf 0 0 CIE-Y; write rb 1 1 CIE-Y; write tf 0 1 CIE-Y; write tb 1 0 CIE-Y; write xyz 0 1 CIE-XYZ

for set in rf rb tf tb "rf tf" "rf rb tf tb" xyz; do
	files=()
	for part in $set; do files+=("$part"-*.txt); done
	"$BUILD_DIR/bin/mkrbf" -q -s I -l 40 -o "${set// /}.rbf" "${files[@]}" >/dev/null
	count=200
	[ "$set" != "rf rb tf tb" ] || count=10000
	echo -n "$set: "
	"$loads" $count "${set// /}.rbf"
done
if command -v valgrind >/dev/null; then
	watched() { # COUNT FILE
		echo -n "under valgrind, $2: "
		valgrind -q --freelist-vol=200000 --leak-check=full --errors-for-leak-kinds=definite,indirect,possible --error-exitcode=9 "$loads" "$@"
	}
	watched 30 rfrbtftb.rbf
	if [ -n "${LOADS_VALGRIND:-}" ]; then
		"$BUILD_DIR/bin/mkrbf" -q -s I -l 1 -o one.rbf rf-*.txt
		"$BUILD_DIR/bin/mkrbf" -q -s I -l 1 -o four.rbf rf-*.txt rb-*.txt tf-*.txt tb-*.txt
		watched "$LOADS_VALGRIND" one.rbf
		watched "$LOADS_VALGRIND" four.rbf
	fi
else
	echo "no valgrind here"
fi

head -c 3000 rfrbtftb.rbf >truncated.rbf
if "$loads" 1 truncated.rbf 2>message; then echo "FAIL: a truncated file was loaded"; exit 1; fi
grep -q "truncated.rbf" message || { echo "FAIL: no word about the file: $(cat message)"; exit 1; }
echo PASS
