#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The commands as a user meets them: good and bad input, exit codes, messages, what is left behind.
# BUILD_DIR/bin holds the programs.
set -u
bin=${BUILD_DIR:?}/bin
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0

no() {
	echo "FAILED: $1"
	shift
	[ $# -eq 0 ] || printf '    %s\n' "$@"
	failed=$((failed + 1))
}

# works NAME COMMAND...: exit 0
works() {
	local name=$1 code
	shift
	"$@" >out 2>err
	code=$?
	[ $code -eq 0 ] || no "$name" "exit $code: $*" "$(head -3 err)"
}

# fails NAME PATTERN COMMAND...: exit 1, a message that starts with the program's name and matches, new.rbf not there
fails() {
	local name=$1 pattern=$2 code
	shift 2
	rm -f new.rbf
	"$@" >out 2>err
	code=$?
	[ $code -eq 1 ] || no "$name" "exit $code, not 1: $*" "$(head -3 err)"
	grep -q "^$(basename "$1"): " err || no "$name" "message without the program's name" "$(head -3 err)"
	grep -qE -e "$pattern" err || no "$name" "message does not match '$pattern'" "$(head -3 err)"
	[ ! -e new.rbf ] || no "$name" "left an output file behind"
	for left in *.tmp* .*.tmp* new.rbf*; do
		[ ! -e "$left" ] || no "$name" "left $left behind"
	done
}

# near NAME A B [PART]: equal to 1e-5, or that part, of the larger, plus 1e-7
near() {
	awk -v a="$2" -v b="$3" -v part="${4:-1e-5}" 'BEGIN {d = a - b; if (d < 0) d = -d; m = a > b ? a : b; exit !(d <= part * m + 1e-7)}' || no "$1" "$2 is not $3"
}

# sample THETA FILE [POWER]: a satin reflection at incidence theta, azimuth 0, where phi 0 is up.
# A Gaussian lobe of 12 degrees about the mirror direction, over that power of the cosine (1; reciprocal: 0), over a diffuse floor of 0.15.
sample() {
	awk -v theta="$1" -v power="${3:-1}" 'BEGIN {
		pi = 3.14159265358979; rad = pi / 180
		print "#sample_name \"test satin\""
		print "#format: theta phi BSDF"
		print "#intheta " theta
		print "#inphi 0"
		mx = -sin(theta * rad); mz = cos(theta * rad)
		for (t = 0; t < 88; t += 4) {
			n = int(45 * sin(t * rad)) + 1
			for (i = 0; i < n; i++) {
				p = 360 * i / n
				x = sin(t * rad) * cos(p * rad); z = cos(t * rad)
				f = .15 / pi + .5 * exp(23 * (x * mx + z * mz - 1)) / z ^ power
				printf "%.3f %.3f %.6f\n", t, p, f
			}
		}
	}' >"$2"
}
for theta in 0 20 40 60; do
	sample $theta in$theta.txt
done
good=(in0.txt in20.txt in40.txt in60.txt)

# a query of 40 pairs, half of them with one incident vector
awk 'BEGIN {
	for (i = 0; i < 40; i++) {
		a = i < 20 ? .5 : .02 * i
		print 0, sin(a), cos(a), .4 * sin(i), .4 * cos(2 * i), .6
	}
}' >pairs.txt

# ---------------------------------------------------------------- the plain case
works plain "$bin/mkrbf" -o plain.rbf "${good[@]}"
[ -s plain.rbf ] || no plain "no output file"
[ "$(wc -l <err)" -le 6 ] || no plain "more than six lines on stderr" "$(cat err)"
grep -q "^rf: isotropic" err && grep -q "^    4 incidences to 60.0 degrees, .* samples each; noise" err && grep -q '^    holes: none' err &&
	grep -q '^    [0-9]* lobes each; frames' err && grep -q '^    error of incidences left out' err ||
	no plain "summary without symmetry, incidences, holes, frames or errors" "$(cat err)"
grep -q $'\r' err && no plain "progress bar without a terminal"
works info "$bin/rbfinfo" -v plain.rbf
for line in "name: test satin" "channels: Y" "symmetry: isotropic" "incidences: 4" "largest theta: 60.00" "in20.txt"; do
	grep -q "$line" out || no info "no line '$line'" "$(cat out)"
done
works query "$bin/rbfquery" plain.rbf <pairs.txt
[ "$(wc -l <out)" -eq 40 ] || no query "40 pairs gave $(wc -l <out) values"
cp out plain.txt
# at a measured incidence, 40 degrees: the peak, and far from it (azimuth 0 is +Y)
"$bin/rbfquery" plain.rbf <<<"0 .642788 .766044 0 -.642788 .766044  0 .642788 .766044 .8 .5 .33" >out
awk 'NR == 1 {exit !($1 > .9 * .7005 && $1 < 1.1 * .7005)}' out || no query "peak $(head -1 out), not .70"
awk 'NR == 2 {exit !($1 > .03 && $1 < .07)}' out || no query "floor $(tail -1 out), not .048"

works quiet "$bin/mkrbf" -q -o quiet.rbf "${good[@]}"
[ ! -s err ] || no quiet "messages in spite of -q" "$(cat err)"
works bar "$bin/mkrbf" -p50 -o bar.rbf "${good[@]}"
grep -q $'\r.*100 %' err || no bar "no progress bar with -p50"
works "no bar" "$bin/mkrbf" -p -o bar.rbf "${good[@]}"
grep -q $'\r' err && no "no bar" "a progress bar with -p"
works threads "$bin/mkrbf" -n 1 -o one.rbf "${good[@]}"
works threads "$bin/mkrbf" -n3 -o three.rbf -- "${good[@]}"
cmp -s one.rbf three.rbf || no threads "-n 1 and -n 3 give different files"

# what a user hears of doubtful measurements
mkdir percent
for file in "${good[@]}"; do
	awk '/^#/ {print; next} {print $1, $2, 100 * $3}' $file >percent/$file
done
works "per cent" "$bin/mkrbf" -o percent.rbf percent/*.txt
grep -q 'exceeds 1 at 4 of 4 .*are the values per cent' err || no "per cent" "$(cat err)"
mkdir noisy
for file in "${good[@]}"; do
	awk '/^#/ {print; next} {print $1, $2, $3 * (NR % 2 ? .7 : 1.3)}' $file >noisy/$file
done
works "noise" "$bin/mkrbf" -o noisy.rbf noisy/*.txt
grep -q 'warning - rf: samples kept back are met with an error of .* finer at the peak' err || no "noise" "$(cat err)"
works "no noise" "$bin/mkrbf" -o quiet.rbf "${good[@]}"
grep -q 'kept back' err && no "no noise" "$(cat err)"
works "one incidence" "$bin/mkrbf" -o single.rbf in0.txt
grep -q 'warning - rf: a single incidence was measured' err && grep -q '^    1 incidence to' err || no "one incidence" "$(cat err)"
works "an incidence of another scale" "$bin/mkrbf" -o odd.rbf in0.txt percent/in20.txt in40.txt in60.txt
grep -q 'theta 20.0 phi 0.0 sends .* or leave it out' err || no "an incidence of another scale" "$(cat err)"

# samples in the plane of incidence alone, at all incidences and at some
mkdir plane
for file in "${good[@]}"; do
	awk '/^#/ {print; next} $2 == 0 || $2 == 180' $file >plane/$file
done
works "one plane" "$bin/mkrbf" -o plane.rbf plane/*.txt
grep -q '^    holes: all but one plane of exitance; guessed beside it' err || no "one plane" "$(cat err)"
works "one plane of some" "$bin/mkrbf" -o plane.rbf in0.txt plane/in20.txt in40.txt in60.txt
grep -q '^    holes: all but one plane of exitance at 1 of 4 incidences;' err || no "one plane of some" "$(cat err)"

# ------------------------------------------------- spellings with the same meaning
same_as_plain() {
	works "$1" "$bin/mkrbf" -q -o other.rbf in0.txt other.txt in40.txt in60.txt
	[ -s err ] && no "$1" "warnings" "$(cat err)"
	"$bin/rbfquery" other.rbf <pairs.txt >other.out 2>/dev/null
	cmp -s other.out plain.txt || no "$1" "other values than the plain file" "$(paste other.out plain.txt | head -3)"
}
sed '200i # a comment between rows' in20.txt >other.txt && same_as_plain "comment between rows"
sed 's/^#/# /' in20.txt >other.txt && same_as_plain "blank after #"
sed 's/^#intheta/#InTheta/; s/^#format/#FORMAT/; s/^#inphi/#INPHI/' in20.txt >other.txt && same_as_plain capitals
sed 's/$/\r/' in20.txt >other.txt && same_as_plain CRLF
sed 's/ /\t/g; s/sample_name\t/sample_name /' in20.txt >other.txt && same_as_plain tabs
sed '300i \\' in20.txt >other.txt && same_as_plain "empty line"
sed 's/^#intheta .*/#incident_angle 20 360/; /^#inphi/d' in20.txt >other.txt && same_as_plain incident_angle
printf '%s' "$(cat in20.txt)" >other.txt && same_as_plain "no newline at the end"

# ------------------------------------------------------------- bad measurements
bad() { # NAME PATTERN: other.txt in place of in20.txt
	fails "$1" "$2" "$bin/mkrbf" -o new.rbf in0.txt other.txt in40.txt in60.txt
}
sed '100s/[^ ]*$/nan/' in20.txt >other.txt && bad NaN 'other.txt:100: '
sed '100s/[^ ]*$/inf/' in20.txt >other.txt && bad infinity 'other.txt:100: '
sed '100s/[.]/,/g' in20.txt >other.txt && bad "decimal comma" 'other.txt:100: '
sed '100s/ [^ ]*$//' in20.txt >other.txt && bad "short row" 'other.txt:100: '
sed '100s/$/ 7/' in20.txt >other.txt && bad "long row" 'other.txt:100: '
: >other.txt && bad "empty file" 'other.txt: .*empty'
grep '^#' in20.txt >other.txt && bad "header only" 'other.txt'
grep -v '^#intheta' in20.txt >other.txt && bad "no incidence" 'other.txt:[0-9]+: .*intheta'
grep -v '^#format' in20.txt >other.txt && bad "no format" 'other.txt:[0-9]+: .*format'
head -c 5000 /dev/urandom >other.txt && bad garbage 'other.txt'
cp plain.rbf other.txt && bad "an .rbf file as measurement" 'other.txt'
rm other.txt && bad "missing file" 'other.txt: .*No such file'
mkdir other.txt && bad directory 'other.txt: ' && rmdir other.txt
awk '/^#/ || NF < 3 {print; next} {print $1, $2, 0}' in20.txt >zero.txt
fails "all zero" 'rf|front reflection' "$bin/mkrbf" -o new.rbf zero.txt

# an older output survives a failure, whole
cp plain.rbf old.rbf
sed '100s/[^ ]*$/nan/' in20.txt >other.txt
"$bin/mkrbf" -o old.rbf other.txt 2>/dev/null && no "old output" "success with a NaN"
cmp -s plain.rbf old.rbf || no "old output" "changed by a failed run"

# ------------------------------------------------------------------ bad options
fails "no output" '-o' "$bin/mkrbf" "${good[@]}"
fails "no files" 'no measurement' "$bin/mkrbf" -o new.rbf
fails "unknown option" "'-x'.*|Usage" "$bin/mkrbf" -x -o new.rbf "${good[@]}"
fails "unknown long option" "'--frob'" "$bin/mkrbf" --frob
fails threads "'-n'.*0" "$bin/mkrbf" -n 0 -o new.rbf "${good[@]}"
fails symmetry "'-s'.*frob" "$bin/mkrbf" -s frob -o new.rbf "${good[@]}"
fails "symmetry that the data cannot have" 'azimuth' "$bin/mkrbf" -s Quad -o new.rbf "${good[@]}"
fails grazing "'-g'.*95" "$bin/mkrbf" -g 95 -o new.rbf "${good[@]}"
grep -v '^0\.000' in20.txt >other.txt
fails "everything culled" 'grazing' "$bin/mkrbf" -g 90 -o new.rbf in0.txt other.txt
fails lobes "'-l'" "$bin/mkrbf" -l many -o new.rbf "${good[@]}"
fails "value missing" "'-l'" "$bin/mkrbf" -l
fails "option after a file" "'-q'.*first" "$bin/mkrbf" -o new.rbf "${good[@]}" -q
fails "no such directory" 'nowhere' "$bin/mkrbf" -o nowhere/new.rbf "${good[@]}"
fails "output is a directory" 'directory' "$bin/mkrbf" -o . "${good[@]}"
fails "output is an input" 'in20.txt' "$bin/mkrbf" -o in20.txt "${good[@]}"
[ -s in20.txt ] || no "output is an input" "the measurement is gone"
for program in mkrbf rbfquery rbfinfo rbfreport rbf2ttree rbf2klems; do
	works "$program --help" "$bin/$program" --help
	grep -q "^Usage: $program" out || no "$program --help" "no usage on stdout"
	works "$program --version" "$bin/$program" --version
	grep -qE "^$program [0-9]+\.[0-9]+\.[0-9]+$" out || no "$program --version" "$(cat out)"
done

# ---------------------------------------------------------------- -t, -g, -s, -l
works "-t" "$bin/mkrbf" -t -o turned.rbf "${good[@]}"
grep -q '^rb: isotropic' err || no "-t" "a front reflection did not become a back reflection" "$(cat err)"
"$bin/rbfquery" turned.rbf <<<"0 .642788 -.766044 0 -.642788 -.766044" >out
# a lobe that hardly counts may be in one fit and not in the other, as rounding has it
near "-t" "$(cat out)" "$("$bin/rbfquery" plain.rbf <<<"0 .642788 .766044 0 -.642788 .766044")" 1e-3
works "-g" "$bin/mkrbf" -g 10 -o culled.rbf "${good[@]}"
# rows at theta 84: 4 incidences of int(45 sin 84) + 1
grep -q "left out $((4 * 45)) samples" err || no "-g" "$(head -1 err)"
works "-g A" "$bin/mkrbf" -gA -o culled.rbf in20.txt in40.txt in60.txt
grep -q "left out [1-9][0-9]* samples" err || no "-g A" "$(head -1 err)"
works "-s" "$bin/mkrbf" -s ISO -o iso.rbf "${good[@]}"
works "-s A, one azimuth" "$bin/mkrbf" -s A -o sector.rbf "${good[@]}"
grep -q 'warning - nothing was measured at incident azimuths other than' err || no "-s A, one azimuth" "no warning" "$(cat err)"
works "-s A, one azimuth" "$bin/rbfquery" sector.rbf <<<".5 0 .866 -.5 0 .866  .5 0 .866 .5 0 .866"
awk 'NR == 1 {peak = $1} END {exit !(peak > .5 && peak < .9 && $1 > .03 && $1 < .08)}' out || no "-s A, one azimuth" "nothing is carried on to others" "$(cat out)"
works "-s auto" "$bin/mkrbf" -s auto -o auto.rbf "${good[@]}"
cmp -s auto.rbf plain.rbf || no "-s auto" "another file than without"
works "-l" "$bin/mkrbf" -q -l 40 -o few.rbf "${good[@]}"
"$bin/rbfinfo" few.rbf | grep -qE 'lobes: [0-9]+ \(([0-9]|[1-3][0-9]|40)\.' || no "-l" "$("$bin/rbfinfo" few.rbf | grep lobes:)"

# ------------------------------------------------------ colour, several components
mkdir colour back
for file in "${good[@]}"; do
	awk '/^#intheta/ {print "#colorimetry: CIE-XYZ"} /^#/ {print; next} {print $1, $2, .5 * $3, $3, 2 * $3}' $file >colour/$file
	awk '/^#intheta/ {print $1, 180 - $2; next} /^#/ {print; next} {print 180 - $1, $2, .5 * $3}' $file >back/$file
done
works colour "$bin/mkrbf" -q -o colour.rbf colour/*.txt
"$bin/rbfquery" -c colour.rbf <pairs.txt | awk 'function off(a, b) {return a > 1.03 * b || b > 1.03 * a}
	NF != 3 || off($1, .5 * $2) || off($3, 2 * $2) {bad = 1} END {exit bad || NR != 40}' || no colour "X : Y : Z is not 1 : 2 : 4"
"$bin/rbfquery" colour.rbf <pairs.txt | paste - plain.txt | awk '$1 > 1.03 * $2 || $2 > 1.03 * $1 {exit 1}' ||
	no colour "Y is not that of the grey files"
"$bin/rbfinfo" colour.rbf | grep -q 'channels: X Y Z' || no colour "rbfinfo says nothing of it"
fails "grey and colour" 'colour|CIE|channel' "$bin/mkrbf" -o new.rbf in0.txt colour/in20.txt
works "two components" "$bin/mkrbf" -o both.rbf "${good[@]}" back/*.txt
grep -q '^rf: ' err && grep -q '^rb: ' err || no "two components" "$(cat err)"
"$bin/rbfquery" both.rbf <pairs.txt | cmp -s - plain.txt || no "two components" "rf is not as without the others"
awk '{print $1, $2, -$3, $4, $5, -$6}' pairs.txt | "$bin/rbfquery" both.rbf | paste - plain.txt |
	awk '2 * $1 > 1.03 * $2 || $2 > 1.03 * 2 * $1 {exit 1}' || no "two components" "rb is not half of rf"

# ---------------------------------------------------------------- reciprocity
mkdir uneven through
for file in "${good[@]}"; do # two calibrations that differ by 20 %
	awk -v by="$(case $file in in0.txt | in40.txt) echo 1.2 ;; *) echo 1 ;; esac)" '/^#/ {print; next} {print $1, $2, by * $3}' $file >uneven/$file
	awk '/^#/ {print; next} {print 180 - $1, $2, $3}' $file >through/$file
done
works "-r" "$bin/mkrbf" -r -o reciprocal.rbf uneven/*.txt
awk '/f\(b, a\)/ {found = 1; better = $10 + 0 < .7 * $12} END {exit !(found && better)}' err || no "-r" "$(cat err)"
"$bin/rbfinfo" reciprocal.rbf | grep -q '^command: mkrbf -r' || no "-r" "is not recorded"
works "-r, one side" "$bin/mkrbf" -r -o reciprocal.rbf through/*.txt
grep -q 'tf: only one side' err || no "-r, one side" "$(cat err)"
works "without -r" "$bin/mkrbf" -q -o plain_through.rbf through/*.txt
for file in reciprocal plain_through; do "$bin/rbfquery" -c $file.rbf <<<"0 .3 .954 0 -.35 -.937"; done | sort -u | wc -l | grep -qx 1 || no "-r, one side" "another result than without"

# ---------------------------------------------------------------------- gains
mkdir even gains
for theta in 0 12 24 36 48 60 70; do
	sample $theta even/in$theta.txt 0
	awk -v by="$(case $theta in 24) echo 1.15 ;; *) echo 1 ;; esac)" '/^#/ {print; next} {print $1, $2, by * $3}' even/in$theta.txt >gains/in$theta.txt
done
works "no gains" "$bin/mkrbf" -q -o even.rbf even/*.txt
grep -q 'by reciprocity' err && no "no gains" "$(cat err)"
works "no gains, -r" "$bin/mkrbf" -r -o even_r.rbf even/*.txt
grep -q 'divided by gains' err && no "no gains, -r" "$(cat err)"
works gains "$bin/mkrbf" -q -o gains.rbf gains/*.txt
grep -Eq 'rf: by reciprocity .* at 1 of 7 incidences: theta 24.0 phi 90.0 by 1\.1[345]; .*-r' err || no gains "$(cat err)"
works "gains, -r" "$bin/mkrbf" -r -o gains_r.rbf gains/*.txt
grep -Eq 'rf: 1 of 7 scans divided by gains .* 1.000 to 1\.1[345]' err || no "gains, -r" "$(cat err)"
for file in even gains_r; do "$bin/rbfquery" $file.rbf <<<"0 .4067 .9135  0 -.4067 .9135"; done | xargs | {
	read -r right divided
	near "gains, -r" "$right" "$divided" .02
}
mkdir drift
for theta in 0 12 24 36 48 60 70; do
	awk -v by="$((80 + theta * theta % 43))" '/^#/ {print; next} {print $1, $2, by / 100 * $3}' even/in$theta.txt >drift/in$theta.txt
done
works "many gains" "$bin/mkrbf" -q -o drift.rbf drift/*.txt
grep -Eq 'rf: f\(a, b\) and f\(b, a\) are not the same .* no few scans are to blame: factors of 0\..* to 1\..*-r' err || no "many gains" "$(cat err)"
grep -q 'the whole scan is off' err && no "many gains" "$(cat err)"

cp gains/in24.txt even/twice.txt
works "measured twice" "$bin/mkrbf" -q -o twice.rbf even/in*.txt even/twice.txt
grep -q 'theta 24.0 phi 90.0 is measured twice: even/twice.txt has 1.15 times the values of even/in24.txt' err || no "measured twice" "$(cat err)"

# ------------------------------------------------------------------- rbfquery
python=${PYTHON:-python3}
"$python" - <<'END' || no formats "cannot write binary queries"
import struct
pairs = [float(x) for x in open("pairs.txt").read().split()]
open("pairs.f", "wb").write(struct.pack("=%df" % len(pairs), *pairs))
open("pairs.d", "wb").write(struct.pack("=%dd" % len(pairs), *pairs))
END
"$bin/rbfquery" -ffa plain.rbf <pairs.f >float.txt
cmp -s float.txt plain.txt || no -ffa "other values than ASCII"
"$bin/rbfquery" -fda plain.rbf <pairs.d >double.txt
cmp -s double.txt plain.txt || no -fda "other values than ASCII"
[ "$("$bin/rbfquery" -ff plain.rbf <pairs.f | wc -c)" -eq 160 ] || no -ff "not 160 bytes"
[ "$("$bin/rbfquery" -fd plain.rbf <pairs.d | wc -c)" -eq 320 ] || no -fd "not 320 bytes"
"$bin/rbfquery" -c plain.rbf <pairs.txt | awk 'NF != 3 || $1 != $2 || $2 != $3 {exit 1}' || no -c "a grey model is not X = Y = Z"
"$bin/rbfquery" plain.rbf <<<"0 0 0 0 0 1  0 0 1 0 0 1  0 0 1 0 0 0" >out
[ "$(wc -l <out)" -eq 1 ] || no "zero vectors" "$(wc -l <out) values, not 1"
"$bin/rbfquery" plain.rbf <<<"0 0 5 0 0 .1" | cmp -s - out || no "vectors of any length" "another value than for unit vectors"
: | "$bin/rbfquery" plain.rbf >out || no "no input" "exit $?"
[ ! -s out ] || no "no input" "output"
while read -r pair; do
	"$bin/rbfquery" plain.rbf <<<"$pair"
done <pairs.txt >single.txt
paste single.txt plain.txt | while read -r a b; do
	near "one by one" "$a" "$b"
done
works "a component that is missing" "$bin/rbfquery" plain.rbf <<<"0 0 1 0 0 -1"
grep -q '^0\.000000e+00$' out || no "a component that is missing" "$(cat out)"
grep -q 'warning - .*transmission' err || no "a component that is missing" "no warning"
fails "half a pair" 'record 2' "$bin/rbfquery" plain.rbf <<<"0 0 1 0 0 1 0 0"
fails "no number" "record 1.*'frob'" "$bin/rbfquery" plain.rbf <<<"0 0 1 frob 0 1"
fails "not finite" "record 1.*finite" "$bin/rbfquery" plain.rbf <<<"0 0 1 nan 0 1"
fails "binary as text" "record 1" "$bin/rbfquery" plain.rbf <pairs.f
fails "two files" 'exactly one' "$bin/rbfquery" plain.rbf plain.rbf
fails "-d and -s" '-d and -s' "$bin/rbfquery" -d -s 3 plain.rbf
fails "format" "'-fx'" "$bin/rbfquery" -fx plain.rbf

# DHR against the values' own integral at normal incidence, by rows of theta (isotropic)
works -d "$bin/rbfquery" -d plain.rbf <<<"0 0 1  0 .5 .866"
[ "$(awk 'NF == 2 && $1 > .1 && $1 < 1 && $2 == 0' out | wc -l)" -eq 2 ] || no -d "$(cat out)"
dhr=$(head -1 out | cut -d' ' -f1)
awk 'BEGIN {for (i = 0; i < 900; i++) {t = (i + .5) * 3.14159265358979 / 1800; print 0, 0, 1, sin(t), 0, cos(t)}}' |
	"$bin/rbfquery" plain.rbf |
	awk -v dhr="$dhr" '{t = (NR - .5) * 3.14159265358979 / 1800
		sum += $1 * cos(t) * sin(t) * 2 * 3.14159265358979 * 3.14159265358979 / 1800}
		END {exit !(sum > .99 * dhr && sum < 1.01 * dhr)}' || no -d "DHR $dhr is not the integral of the values"
works -s "$bin/rbfquery" -s 100 plain.rbf <<<"0 .5 .866"
[ "$(awk 'NF == 3 && $3 > 0 {l = $1*$1 + $2*$2 + $3*$3; if (l > .9999 && l < 1.0001) n++} END {print n}' out)" = 100 ] ||
	no -s "not 100 unit vectors in front" "$(head -3 out)"

# ------------------------------------------------------------- damaged .rbf files
size=$(wc -c <plain.rbf)
for bytes in 0 3 8 63 64 200 $((size / 2)) $((size - 1)); do
	head -c "$bytes" plain.rbf >cut.rbf
	fails "cut at $bytes" 'cut.rbf: ' "$bin/rbfquery" cut.rbf <pairs.txt
	fails "cut at $bytes" 'cut.rbf: ' "$bin/rbfinfo" cut.rbf
done
fails "missing .rbf" 'none.rbf: .*No such file' "$bin/rbfquery" none.rbf <pairs.txt
fails "text as .rbf" 'in20.txt: ' "$bin/rbfinfo" in20.txt
fails "directory as .rbf" '\.: ' "$bin/rbfinfo" .

# --------------------------------------------------------------------- signals
mkfifo slow.txt
"$bin/mkrbf" -o new.rbf in0.txt slow.txt 2>err &
pid=$!
sleep .3
kill -TERM $pid
wait $pid
code=$?
[ $code -eq 143 ] || no signal "exit $code after SIGTERM, not 143"
[ ! -e new.rbf ] || no signal "an output file is left"

[ $failed -eq 0 ] && echo "all passed" || echo "$failed failed"
exit $((failed > 0))
