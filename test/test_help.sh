#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# --help and the manual pages: every option that a page has is in --help, and every one that --help names is known to the
# command; the pages are in order; completion offers the options.
set -u
bin=${BUILD_DIR:?}/bin pages=$BUILD_DIR/share/man/man1
source=${SOURCE_DIR:-$(cd "$(dirname "$0")/.." && pwd)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
wrong() { echo "FAILED: $*"; failed=$((failed + 1)); }

for program in "$bin"/rbf* "$bin"/mkrbf; do
	name=${program##*/} page=$pages/${program##*/}.1
	[ -s "$page" ] || { wrong "$name has no manual page"; continue; }
	"$program" --help >"$work/help" 2>"$work/err" || wrong "$name --help: exit $?"
	[ -s "$work/err" ] && wrong "$name --help writes on stderr"
	[ "$(head -1 "$work/help" | cut -c1-$((8 + ${#name})))" = "Usage: $name " ] || wrong "$name --help: $(head -1 "$work/help")"
	awk 'NR > 1 && length > 132 || length > 160 {exit 1}' "$work/help" || wrong "$name --help: a line is too long"
	# tags of the page, as they stand in its source: the line behind .TP
	awk '/^\.SH/ {on = /OPTIONS/} on && /^\.TP/ {getline; print}' "$page" | sed 's/\\-/-/g' | grep -oE '(^|[ "])[-+]-?[a-z]+' | tr -d ' "' >"$work/tags"
	[ -s "$work/tags" ] || wrong "$name: no options in the manual page"
	while read -r option; do
		grep -qE -e "^  (.*[ ,])?${option//+/[+]}" "$work/help" || wrong "$name --help lacks $option"
		# an option that the command does not know is a mistake that names it; without a file the others are another one
		"$program" "$option" </dev/null 2>&1 | grep -q 'unknown option' && wrong "$name does not know $option"
		synopsis=$(awk '/^\.SH SYNOPSIS/ {on = 1; next} /^\.SH/ {on = 0} on' "$page" | sed 's/\\-/-/g')
		case $option in
		--*) ;;
		*) grep -qF -e "$option" <<<"$synopsis" || case $name:$option in
			rbf2klems:-[fhq]) ;;
			*) wrong "$name: $option is not in the synopsis" ;;
			esac ;;
		esac
	done <"$work/tags"
	for section in NAME SYNOPSIS DESCRIPTION OPTIONS '"EXIT STATUS"' EXAMPLES '"SEE ALSO"'; do
		grep -q "^\.SH $section" "$page" || wrong "$name: no section $section"
	done
	grep -q '@' "$page" && wrong "$name: a placeholder is left in the page"
	if command -v man >/dev/null; then
		LC_ALL=C.UTF-8 MANROFFSEQ='' man --warnings -l "$page" 2>&1 >/dev/null | grep . && wrong "$name: man warns"
	fi
done

# completion: options, values, files
cd "$work" || exit 1
touch film.rbf film.txt
offers() { # PROGRAM WORD PREVIOUS WANTED UNWANTED
	local got
	got=$(bash -c '. "$1"; _bsdfrbf "$2" "$3" "$4"; echo "${COMPREPLY[*]}"' - "$source/doc/completion/bsdfrbf.bash" "$bin/$1" "$2" "$3")
	case " $got " in *" $4 "*) ;; *) wrong "completion of $1 $3 $2: '$got' has no $4" ;; esac
	[ -z "$5" ] || case " $got " in *" $5 "*) wrong "completion of $1 $3 $2: '$got' has $5" ;; esac
}
offers mkrbf - mkrbf -o --frob
offers mkrbf iso -s isotropic up
offers rbf2ttree + rbf2ttree +a -g
offers rbfquery fi rbfquery film.rbf film.txt
offers mkrbf fi mkrbf film.txt ''
[ $failed -eq 0 ] && echo "help, manual pages and completion agree"
exit $((failed > 0))
