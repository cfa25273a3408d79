#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From measurements to a picture: a room whose window panes and metals are measured materials, rendered once with the
# recorded interpolants and once with tensor trees that the stock Radiance tools make of the same measurements.
# Called by ./run demo. Everything goes into build/demo; the slow stock conversions are kept there for the next time.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
build=${BUILD_DIR:-$here/../../build}
out=$build/demo
python=$build/venv/bin/python
stock=$("$python" -c 'import os, sysconfig; print(os.path.join(sysconfig.get_path("platlib"), "pyradiance"))')
# 2^g: resolution of a tensor tree. Anisotropic ones above g 4 take from minutes to hours.
materials=(redirect satin brushed)
declare -A resolution=([redirect]=4 [satin]=6 [brushed]=4)
width=${DEMO_WIDTH:-960} height=$((${DEMO_WIDTH:-960} * 3 / 4))

mkdir -p "$out/stock"
cd "$out"
exec 8>.lock
flock -n 8 || { echo "demo: another one is at work in $out" >&2; exit 1; }
: >times.txt

now() { date +%s%N; }
# timed TEXT COMMAND...: runs the command and keeps its wall time for the table at the end
timed() {
	local text=$1 start
	shift
	start=$(now)
	"$@"
	printf '%8.1f s  %s\n' "$(($(now) - start))e-9" "$text" >>times.txt
}

measure() {
	rm -rf "$1"
	mkdir "$1"
	"$build/bin/goniometer" "$1" "$1"
}

# The peer's route. Kept while the measurements stay the same.
stock_xml() {
	local name=$1 sum
	sum=$(cat "$name"/*.txt | sha256sum)
	if [ -s "stock/$name.xml" ] && [ "$(cat "stock/$name.sum")" = "$sum" ]; then return; fi
	rm -f "stock/$name".*
	RAYPATH=$stock/lib "$stock/bin/pabopto2bsdf" -n 1 "$name"/*.txt >"stock/$name.sir" 2>"stock/$name.log" &&
		RAYPATH=$stock/lib PATH=$stock/bin:$PATH "$stock/bin/bsdf2ttree" -g "${resolution[$name]}" "stock/$name.sir" >"stock/$name.tmp" \
			2>>"stock/$name.log" || { tail -c 2000 "stock/$name.log" >&2; return 1; }
	mv "stock/$name.tmp" "stock/$name.xml"
	echo "$sum" >"stock/$name.sum"
}

# Materials by the names that room.rad uses: $1 is the suffix of the files, after a folder if any.
scene() {
	local pair
	for pair in panel=redirect satin=satin metal=brushed; do
		printf 'void BSDF %s\n6 0 %s 0 0 1 .\n0\n0\n' "${pair%=*}" "${1/NAME/${pair#*=}}"
	done
}

# A small picture first: what it finds of the indirect light is there from the first line of the large one on, which
# spares visible seams.
render() {
	local kind=$1
	local options=(-t 30 -vf "$here/room.vf" -ps 1 -dj 0 -ds .1 -ab 2 -ad 2048 -as 512 -aa .15 -ar 128
		-ss 4 -st .01 -lr 6 -lw 5e-4 -af "$kind.amb")
	rm -f "$kind.amb"
	"$build/radiance/bin/oconv" "$kind.rad" "$here/outside.rad" "$here/room.rad" >"$kind.oct"
	"$build/radiance/bin/rpict" "${options[@]}" -x $((width / 6)) -y $((height / 6)) "$kind.oct" >/dev/null
	"$build/radiance/bin/rpict" "${options[@]}" -x "$width" -y "$height" "$kind.oct" >"$kind.tmp"
	mv "$kind.tmp" "$kind.hdr"
}

echo "== measuring with the virtual goniophotometer"
for name in "${materials[@]}"; do
	timed "measure $name" measure "$name"
done

echo "== building interpolants"
bar=()
[ -t 2 ] || bar=(-p40)
for name in "${materials[@]}"; do
	echo "mkrbf -o $name.rbf $name/*.txt"
	timed "mkrbf $name" "$build/bin/mkrbf" "${bar[@]}" -o "$name.rbf" "$name"/*.txt
done

export RAYPATH=.:$here:$build/radiance/lib
scene NAME.rbf >rbf.rad
scene stock/NAME.xml >xml.rad

echo "== rendering with the interpolants"
timed "rpict, interpolants" render rbf

echo "== the same by way of tensor trees: stock tools, some minutes the first time"
jobs=()
for name in "${materials[@]}"; do
	timed "pabopto2bsdf and bsdf2ttree -g ${resolution[$name]}, $name (0: kept from last time)" stock_xml "$name" &
	jobs+=($!)
done
for job in "${jobs[@]}"; do
	wait "$job" || { echo "demo: a stock conversion failed" >&2; exit 1; }
done
timed "rpict, tensor trees" render xml

"$python" "$here/../hdr2png.py" -s 2 interpolant.png rbf.hdr
"$python" "$here/../hdr2png.py" -s 2 demo.png "rbf.hdr=interpolant (.rbf)" "xml.hdr=tensor tree (.xml)"

echo
cat times.txt
echo "The same measurements, left as interpolants, right as tensor trees: $out/demo.png"
echo "Left half alone: $out/interpolant.png; Radiance pictures: $out/rbf.hdr, $out/xml.hdr"
