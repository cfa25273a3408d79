#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs into a folder; builds the example there with pkg-config and with find_package and compares its answers with
# rbfquery's; takes it all back. Makes the Debian package and runs a command out of it.
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

# ------------------------------------------------------------ and back
must cmake --build "$build" --target uninstall
find "$prefix" ! -type d -o -name bsdfrbf | grep . && wrong "left after uninstall"
cmake --build "$build" --target uninstall >"$work/log" 2>&1 && wrong "a second uninstall says nothing"
tr -s '\n ' ' ' <"$work/log" | grep -q 'nothing was installed' || wrong "second uninstall: $(cat "$work/log")"

# ------------------------------------------------------------ Debian package
if command -v dpkg-shlibdeps >/dev/null && command -v file >/dev/null; then
	(cd "$build" && must cpack -G DEB -B "$work/package") || exit 1
	dpkg-deb -x "$work"/package/bsdfrbf_"$version"_*.deb "$work/root" || wrong "no package of version $version"
	dpkg-deb -f "$work"/package/*.deb Depends >"$work/depends"
	grep -q libqhull "$work/depends" || wrong "the package depends on: $(cat "$work/depends")"
	"$work/root/usr/bin/rbfquery" "$file" <"$work/asked" | cmp - "$work/answers" || wrong "rbfquery of the package"
elif [ -e /etc/debian_version ]; then
	wrong "dpkg-dev or file is missing: see .ci/packages.txt"
fi
[ $failed -eq 0 ] && echo "installs, serves pkg-config and CMake, uninstalls; makes a Debian package"
exit $((failed > 0))
