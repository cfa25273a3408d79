#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs into a folder; builds the example there with pkg-config and with find_package and compares its answers with
# rbfquery's; patches a Radiance with it and preloads it into pyradiance; takes it all back. Makes the Debian package and runs a
# command out of it.
set -u
build=${BUILD_DIR:?}
source=${SOURCE_DIR:-$(cd "$(dirname "$0")/.." && pwd)}
case $(ldd "$build/lib/libbsdfrbf.so") in *lib?san.so*) echo "skipped: a sanitizer has to be linked first"; exit 77 ;; esac
work=$(mktemp -d) manifest=$build/install_manifest.txt
# what the user installed from this build can still be uninstalled afterwards
[ ! -f "$manifest" ] || mv "$manifest" "$work/manifest"
trap 'rm -f "$manifest"; [ ! -f "$work/manifest" ] || mv "$work/manifest" "$manifest"; rm -rf "$work"' EXIT
failed=0
wrong() { echo "FAILED: $*"; failed=$((failed + 1)); }
must() { "$@" >"$work/log" 2>&1 || { cat "$work/log"; wrong "$*"; exit 1; }; }

prefix="$work/a prefix"
must cmake --install "$build" --prefix "$prefix"
moved=$work/moved # what was installed can be moved
cp -a "$prefix" "$moved"
for name in mkrbf rbf2klems rbf2ttree rbfinfo rbfquery rbfreport; do
	"$prefix/bin/$name" --version >"$work/version" 2>&1 || wrong "$name --version: $(cat "$work/version")"
	[ -s "$prefix/share/man/man1/$name.1" ] || wrong "no manual page of $name"
	[ -s "$prefix/share/bash-completion/completions/$name" ] || wrong "no completion of $name"
done
for name in patch CMakeLists.txt bsdf_rbf.c bsdfrbf.h; do
	[ -s "$prefix/share/bsdfrbf/radiance-patch/$name" ] || wrong "no $name to patch Radiance with"
done
soname=$(objdump -p "$prefix"/lib*/libbsdfrbf.so | awk '$1 == "SONAME" {print $2}')
[[ $soname =~ ^libbsdfrbf\.so\.[0-9]+$ ]] || wrong "SONAME is '$soname'"

# ------------------------------------------------------------ what others build with it
export PKG_CONFIG_PATH=
for path in "$moved"/lib*/pkgconfig "$moved"/lib/*/pkgconfig; do PKG_CONFIG_PATH+=$path:; done
version=$(pkg-config --modversion bsdfrbf)
[ "$(cut -d' ' -f2 "$work/version")" = "$version" ] || wrong "pkg-config says $version, a command $(cat "$work/version")"
# shellcheck disable=SC2046
must ${CC:-cc} -std=c11 -pedantic -Wall -Wextra -Werror "$source/examples/c/scatter.c" $(pkg-config --cflags --libs bsdfrbf) -lm -o "$work/by-pkg-config"
must cmake -S "$source/examples/c" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$moved" -DCMAKE_BUILD_TYPE=Release
must cmake --build "$work/consumer"

file=$source/test/golden/tf.rbf
library=$(dirname "$(find "$moved" -name libbsdfrbf.so)")
for program in "$work/by-pkg-config" "$work/consumer/scatter"; do
	LD_LIBRARY_PATH=$library "$program" "$file" 30 40 >"$work/said" || wrong "$program: exit $?"
	grep -q '^  towards' "$work/said" || wrong "$program drew no sample"
	# rows: asked direction, its f as the program has it
	awk -v i="$(awk 'BEGIN {r = atan2(0, -1) / 180; print sin(30*r) * cos(40*r), sin(30*r) * sin(40*r), cos(30*r)}')" \
		'/towards/ {print i, $2, $3, $4}' "$work/said" >"$work/asked"
	"$prefix/bin/rbfquery" "$file" <"$work/asked" >"$work/answers" || wrong "rbfquery: exit $?"
	awk '/towards/ {print $6}' "$work/said" | paste - "$work/answers" |
		awk 'NF < 2 || ($1 - $NF)^2 > (1e-3 * $1)^2 {print; bad = 1} END {exit bad || NR != 4}' || wrong "f differs from rbfquery's"
done
LD_LIBRARY_PATH=$library "$work/consumer/scatter" "$source/test/golden/bad-byte.rbf" 30 40 2>"$work/log"
[ $? = 1 ] && grep -q 'bad-byte.rbf' "$work/log" || wrong "a damaged file: $(cat "$work/log")"

# ------------------------------------------------------------ Radiance
# stock pyradiance with the installed library before it
reads() { # PRELOAD
	LD_PRELOAD=$1 "${PYTHON:-python3}" -c 'import sys; from pyradiance import bsdf
print(bsdf.direct_hemi(bsdf.load_file(sys.argv[1]), 30, 40, bsdf.SAMPLE_ALL))' "$file" 2>&1
}
preload=${library:?}/libbsdfrbf_preload.so
if [ -e "$build/lib/libbsdfrbf_preload.so" ]; then
	"$prefix/bin/rbfquery" -d "$file" <<<".3830222 .3213938 .8660254" >"$work/dhr" # theta 30, phi 40
	reads "$preload" | awk 'NR == FNR {want = $1 + $2; next} ($1 - want)^2 > 1e-8 || want < .01 {bad = 1} END {exit bad || FNR != 1}' "$work/dhr" - ||
		wrong "pyradiance with the installed preload library: $(reads "$preload"), rbfquery: $(cat "$work/dhr")"
fi
# the installed patch, on a tree of its own; it takes the header that is installed beside it
radiance=$(sed -n 's/^RADIANCE_SOURCE_DIR:[A-Z]*=//p' "$build/CMakeCache.txt")
if [ -e "$radiance/src/common/bsdf.c" ]; then
	mkdir -p "$work/ray/src"
	cp -a "$radiance/src/common" "$work/ray/src/"
	must "$moved/share/bsdfrbf/radiance-patch/patch" apply "$work/ray"
	must "$moved/share/bsdfrbf/radiance-patch/patch" check "$work/ray"
	must cmp "$work/ray/src/common/bsdfrbf.h" "$source/libbsdfrbf/bsdfrbf.h"
	# with what it needs to be built
	must cmake -S "$moved/share/bsdfrbf/radiance-patch" -B "$work/radiance" -DRADIANCE_SOURCE_DIR="$radiance" -DCMAKE_PREFIX_PATH="$moved"
	must cmake --build "$work/radiance" --target radiance-preload
fi

# ------------------------------------------------------------ and back
must cmake --build "$build" --target uninstall
find "$prefix" ! -type d -o -name bsdfrbf -o -name radiance-patch | grep . && wrong "left after uninstall"
cmake --build "$build" --target uninstall >"$work/log" 2>&1 && wrong "a second uninstall says nothing"
tr -s '\n ' ' ' <"$work/log" | grep -q 'nothing was installed' || wrong "second uninstall: $(cat "$work/log")"

# ------------------------------------------------------------ Debian package
if command -v dpkg-shlibdeps >/dev/null && command -v file >/dev/null; then
	(cd "$build" && must cpack -G DEB -B "$work/package") || exit 1
	dpkg-deb -x "$work"/package/bsdfrbf_"$version"_*.deb "$work/root" || wrong "no package of version $version"
	dpkg-deb -f "$work"/package/*.deb Depends >"$work/depends"
	grep -q libqhull "$work/depends" || wrong "the package depends on: $(cat "$work/depends")"
	[ ! -e "$preload" ] || [ -n "$(find "$work/root/usr/lib" -name libbsdfrbf_preload.so)" ] || wrong "the package has no preload library"
	[ -x "$work/root/usr/share/bsdfrbf/radiance-patch/patch" ] || wrong "the package has no patch"
	"$work/root/usr/bin/rbfquery" "$file" <"$work/asked" | cmp - "$work/answers" || wrong "rbfquery of the package"
elif [ -e /etc/debian_version ]; then
	wrong "dpkg-dev or file is missing: see .ci/packages.txt"
fi
[ $failed -eq 0 ] && echo "installs, serves pkg-config and CMake, uninstalls; makes a Debian package"
exit $((failed > 0))
