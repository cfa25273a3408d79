# SPDX-License-Identifier: BSD-3-Clause
# Completion for bash (zsh: after `autoload bashcompinit && bashcompinit`). Options are those that --help lists, which
# are those of the manual page.
_bsdfrbf() {
	local program=$1 word=$2 before=$3 options
	COMPREPLY=()
	case ${program##*/}:$before in
	mkrbf:-s) COMPREPLY=($(compgen -W "auto isotropic quadrilateral bilateral up anisotropic" -- "$word")) ;;
	rbf2klems:-b) COMPREPLY=($(compgen -W "full half quarter" -- "$word")) ;;
	rbf2klems:-c | rbf2ttree:-c) COMPREPLY=($(compgen -W "rf rb tf tb rf,rb tf,tb rf,rb,tf,tb" -- "$word")) ;;
	rbf2klems:-s | rbf2ttree:-s) COMPREPLY=($(compgen -W "n= m= t= w= h=" -- "$word")); compopt -o nospace 2>/dev/null ;;
	rbf2klems:-solar) COMPREPLY=($(compgen -W visible -- "$word") $(compgen -f -X '!*.rbf' -- "$word")) ;;
	mkrbf:-o) COMPREPLY=($(compgen -f -X '!*.rbf' -- "$word") $(compgen -d -- "$word")) ;;
	rbf2klems:-o | rbf2ttree:-o) COMPREPLY=($(compgen -f -X '!*.xml' -- "$word") $(compgen -d -- "$word")) ;;
	*:-[negltf]) ;; # numbers and formats
	*)
		case $word in
		[-+]*)
			options=$("$program" --help 2>/dev/null | sed -n 's/^  \([-+][^ ]*\).*/\1/p; s/^  [-+][^ ]*, \(-[^ ]*\).*/\1/p' | tr -d ,)
			COMPREPLY=($(compgen -W "$options" -- "$word"))
			;;
		*)
			# measurements have any name; everything else reads .rbf files
			case ${program##*/} in
			mkrbf | rbfreport) COMPREPLY=($(compgen -f -- "$word")) ;;
			*) COMPREPLY=($(compgen -f -X '!*.rbf' -- "$word") $(compgen -d -- "$word")) ;;
			esac
			;;
		esac
		;;
	esac
}
complete -o filenames -F _bsdfrbf mkrbf rbf2klems rbf2ttree rbfinfo rbfquery rbfreport
