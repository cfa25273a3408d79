# SPDX-License-Identifier: BSD-3-Clause
"""Inputs that measurement software, spreadsheets, operators and bad luck produce, each with the outcome it must have: the result of
the plain files, a result that agrees with the truth, or a refusal that names file, line and remedy. test_inputs.py
runs them on mkrbf.

The sample: a Gaussian lobe of 12 degrees about the mirror direction over a Lambertian floor, isotropic, front reflection
unless a case says otherwise.
"""
import math
import os

KAPPA, FLOOR, PEAK = 23., .15 / math.pi, .5
THETAS = (0, 20, 40, 60)
HEAD = '#sample_name "satin"\n#format: theta phi BSDF\n#intheta {theta:g}\n#inphi {phi:g}\n'


def vector(theta, phi):
    """Mountain angles with #upphi 0: phi 0 is +Y, counter-clockwise from the front."""
    t, p = math.radians(theta), math.radians(phi + 90)
    return math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)


def lobe(axis, out, kappa=KAPPA):
    return math.exp(kappa * (sum(a * b for a, b in zip(axis, out)) - 1))


def bsdf(incident, out):
    """f of the sample, both vectors on one side."""
    mirror = (-incident[0], -incident[1], incident[2])
    return FLOOR + PEAK * lobe(mirror, out) / abs(out[2])


def dhr(theta, f=bsdf, steps=180):
    """By midpoint rule."""
    incident, total = vector(theta, 0), 0.
    for i in range(steps):
        t = (i + .5) * 90 / steps
        for k in range(2 * steps):
            total += f(incident, vector(t, (k + .5) * 180 / steps)) * math.cos(math.radians(t)) * math.sin(math.radians(t))
    return total * math.radians(90 / steps) * math.radians(180 / steps)


def directions(limit=88, step=4):
    for t in range(0, limit, step):
        n = int(45 * math.sin(math.radians(t))) + 1
        for i in range(n):
            yield t, 360 * i / n


def rows(theta, phi=0, f=bsdf, scale=1., limit=88):
    incident = vector(theta, phi)
    return [f'{t:.3f} {p:.3f} {scale * f(incident, vector(t, p)):.6f}' for t, p in directions(limit)]


def measured(theta, phi=0, **options):
    return HEAD.format(theta=theta, phi=phi) + '\n'.join(rows(theta, phi, **options)) + '\n'


def plain():
    return {f'in{t:02}.txt': measured(t) for t in THETAS}


class Case:
    """files: name -> text or bytes. want: 'same' as the plain files give, 'true' (DHR, and f at `pairs`, agree with `truth`),
    'works' (a result that is finite), or 'refused', with `words` (a regular expression) in the message. warns: the same
    for a warning that must be there. pairs: (theta, phi of incidence, theta, phi, f, relative tolerance)."""

    def __init__(self, kind, name, files, want, words='', options=(), warns='', truth=None, pairs=(), order=None, slow=False,
                 transmitted=False):
        self.kind, self.name, self.files, self.want, self.words = kind, name, files, want, words
        self.options, self.warns, self.truth, self.pairs, self.slow = list(options), warns, truth, pairs, slow
        self.order = order or sorted(files)
        self.transmitted = transmitted

    def write(self, folder):
        for name, content in self.files.items():
            path = os.path.join(folder, name)
            if callable(content):
                content(path)
                continue
            with open(path, 'wb') as f:
                f.write(content if isinstance(content, bytes) else content.encode())
        return [os.path.join(folder, name) for name in self.order]


def changed(change, name='in20.txt'):
    """The plain files with one of them changed."""
    files = plain()
    files[name] = change(files[name])
    return files


def line(number, text):
    """Changes one line of a file by a function."""
    def change(content):
        lines = content.split('\n')
        lines[number - 1] = text(lines[number - 1])
        return '\n'.join(lines)
    return change


def head(old, new):
    def change(content):
        assert old in content
        return content.replace(old, new)
    return change


def value(text):
    return line(100, lambda row: ' '.join(row.split()[:2] + [text]))


def of_all(change):
    return {name: change(content) for name, content in plain().items()}


def values(function):
    """Every value of a file through a function."""
    def change(content):
        out = []
        for row in content.split('\n'):
            word = row.split()
            out.append(row if row.startswith('#') or len(word) != 3 else f'{word[0]} {word[1]} {function(float(word[2])):.6f}')
        return '\n'.join(out)
    return change


def plan(azimuths, thetas=(30, 60), **options):
    files = {f'i{t:02}_{p:+04}.txt': measured(t, p, **options) for t in thetas for p in azimuths}
    files['i00.txt'] = measured(0, **options)
    return files


def shuffled(content):
    """Rows in another order, the same each time."""
    lines = content.strip().split('\n')
    top, rest = [x for x in lines if x.startswith('#')], [x for x in lines if not x.startswith('#')]
    return '\n'.join(top + sorted(rest, key=lambda x: hash_of(x))) + '\n'


def hash_of(text):
    h = 2166136261
    for c in text.encode():
        h = (h ^ c) * 16777619 & 0xffffffff
    return h


def with_rows(content, row_of):
    """With row_of(word) in place of every row of the table."""
    return '\n'.join(row if row.startswith('#') else row_of(row.split()) for row in content.strip().split('\n')) + '\n'


def swapped(content):
    return with_rows(content, lambda word: f'{word[1]} {word[0]} {word[2]}').replace('theta phi BSDF', 'phi theta BSDF')


def dsf(content):
    return with_rows(content, lambda word: f'{word[0]} {word[1]} {float(word[2]) * math.cos(math.radians(float(word[0]))):.9f}') \
        .replace('BSDF', 'DSF')


def turned_azimuths(content, turn):
    return with_rows(content, lambda word: f'{word[0]} {float(word[1]) + turn:.3f} {word[2]}')


def behind(content):
    """The same from the back."""
    lines = with_rows(content, lambda word: f'{180 - float(word[0]):.3f} {word[1]} {float(word[2]) * .5:.6f}').split('\n')
    return '\n'.join(f'#intheta {180 - float(row.split()[1]):g}' if row.startswith('#intheta') else row for row in lines)


def through(theta):
    """Reflection and, a third as strong, straight transmission in one file."""
    out = measured(theta)
    for t, p in directions():
        out += f'{180 - t:.3f} {p:.3f} {bsdf(vector(theta, 0), vector(t, p)) / 3:.6f}\n'
    return out


def second_peak(incident, out):
    """A weak retro-reflection beside the main peak."""
    return .02 + .6 * lobe((-incident[0], -incident[1], incident[2]), out, 40) + .184 * lobe(incident, out, 60)


def narrow(incident, out):
    """0.3 degrees wide: between the samples, which are 4 degrees apart, but for the one that meets it."""
    return FLOOR + 300 * lobe((-incident[0], -incident[1], incident[2]), out, 36000)


def spike(content):
    """A wrong value at an exitance beyond 85 degrees."""
    return content + '86.5 111 400\n'


def near_grazing(incident, out):
    """A floor that rises towards the horizon."""
    return FLOOR / (abs(out[2]) + .05)


def many_rows(count):
    """A file of this many rows, written on the way."""
    def write(path):
        incident = vector(20, 0)
        with open(path, 'w') as f:
            f.write(HEAD.format(theta=20, phi=0))
            side = int(math.sqrt(count))
            for i in range(side):
                t = 88. * i / side
                f.write(''.join(f'{t:.4f} {360. * k / side:.4f} {bsdf(incident, vector(t, 360. * k / side)):.5f}\n' for k in range(side)))
    return write


def many_files(count):
    """Incidences all over the hemisphere, ten samples each."""
    files = {}
    for i in range(count):
        z, p = 1 - (i + .5) / count * .9, math.degrees(2.399963 * i) % 360
        theta = math.degrees(math.acos(z))
        files[f'm{i:05}.txt'] = HEAD.format(theta=round(theta, 3), phi=round(p, 3)) + '\n'.join(rows(theta, p)[::29]) + '\n'
    return files


def cases():
    c = []

    def add(*arguments, **options):
        c.append(Case(*arguments, **options))

    base = plain()
    # ------------------------------------------------------------- separators
    kind = 'separators'
    add(kind, 'tabs', changed(lambda x: x.replace(' ', '\t').replace('name\t', 'name ')), 'same')
    add(kind, 'blanks in front, between and behind', changed(lambda x: x.replace(' ', '   ').replace('\n', '  \n  ').rstrip(' ')), 'same')
    add(kind, 'CR LF', changed(lambda x: x.replace('\n', '\r\n')), 'same')
    add(kind, 'CR alone', changed(lambda x: x.replace('\n', '\r')), 'same')
    add(kind, 'no end of the last line', changed(lambda x: x.rstrip('\n')), 'same')
    add(kind, 'empty lines', changed(lambda x: x.replace('\n', '\n\n')), 'same')
    add(kind, 'comment between rows', changed(line(200, lambda row: row + '\n# a comment\n#')), 'same')
    add(kind, 'comment behind a value', changed(line(200, lambda row: row + '  # good')), 'same')
    add(kind, 'CSV', changed(lambda x: '\n'.join(r if r.startswith('#') else r.replace(' ', ',') for r in x.split('\n'))), 'refused',
        r'in20.txt:5: .*decimal point.*blanks')
    add(kind, 'semicolons', changed(line(50, lambda row: row.replace(' ', ';'))), 'refused', r'in20.txt:50: .*blanks')
    add(kind, 'decimal commas', changed(line(50, lambda row: row.replace('.', ','))), 'refused', r'in20.txt:50: .*decimal point')
    add(kind, 'decimal comma in #intheta', changed(head('#intheta 20', '#intheta 20,5')), 'refused', r'in20.txt:3: .*decimal point')
    add(kind, 'Fortran exponents', changed(lambda x: x.replace('0 0.047746', '0 4.7746D-2')), 'same')
    add(kind, 'a column short', changed(line(50, lambda row: row.rsplit(' ', 1)[0])), 'refused', r'in20.txt:50: 2 columns instead of 3')
    add(kind, 'a column too many', changed(line(50, lambda row: row + ' 1')), 'refused', r'in20.txt:50: 4 columns instead of 3')
    add(kind, 'a row cut in its number', changed(lambda x: x[:len(x) - 40].rsplit(' ', 1)[0]), 'refused', r'in20.txt:\d+: \d columns instead of 3')
    # ---------------------------------------------------------- header
    kind = 'header'
    add(kind, 'blank after #', of_all(lambda x: x.replace('#', '# ')), 'same')
    add(kind, 'capitals', of_all(lambda x: x.replace('#intheta', '#InTheta').replace('#format', '#FORMAT')), 'same')
    add(kind, 'colons and equals signs', of_all(lambda x: x.replace('#intheta ', '#intheta: ').replace('#inphi ', '#inphi = ')), 'same')
    add(kind, 'no colon', of_all(lambda x: x.replace('#format:', '#format')), 'same')
    add(kind, '#incident_angle', of_all(lambda x: x.replace('#intheta', '#incident_angle').replace('\n#inphi', '')), 'same')
    add(kind, 'tabs', of_all(lambda x: x.replace('#intheta ', '#intheta\t').replace('#inphi ', '#inphi\t\t')), 'same')
    add(kind, 'unknown entries', of_all(lambda x: '#device: pgII\n#date 2024-02-30\n#lamp "xenon"\n' + x), 'same')
    for entry in 'intheta', 'inphi', 'format':
        add(kind, f'no #{entry}', changed(lambda x, e=entry: '\n'.join(r for r in x.split('\n') if not r.startswith('#' + e))), 'refused',
            rf'in20.txt:4: .*lacks.*#{entry}')
    add(kind, 'unknown format', changed(head('phi BSDF', 'phi luminance')), 'refused', r'in20.txt:2: unknown #format.*DSF')
    add(kind, 'two incidences in a file', changed(lambda x: x + '#intheta 45\n10 0 1\n'), 'refused', r'in20.txt:\d+: .*differs from the one in line 3.*split')
    add(kind, 'header behind the first row', changed(lambda x: x + '#upphi 90\n10 0 1\n'), 'refused', r'in20.txt:\d+: .*before the rows')
    add(kind, 'fewer rows than announced', changed(lambda x: '#datapoints_in_file: 9999\n' + x), 'works', warns=r'in20.txt:1: .*complete\?')
    add(kind, 'titles of columns', changed(lambda x: x.replace('#inphi 0\n', '#inphi 0\ntheta phi value\n')), 'refused', r"in20.txt:5: the line begins with 'theta'")
    add(kind, 'columns swapped', changed(line(9, lambda row: '271 10 1')), 'refused', r"in20.txt:9: theta is '271'.*swapped")
    add(kind, 'unknown colours', changed(lambda x: '#colorimetry: RGB\n' + x), 'refused', r'in20.txt:1: .*CIE-XYZ')
    add(kind, 'colour in one file alone', changed(lambda x: '#colorimetry: CIE-XYZ\n' + '\n'.join(
        r if r.startswith('#') or not r else r + ' 1 1' for r in x.split('\n'))), 'refused', r'separately')
    add(kind, 'three values without #colorimetry', changed(line(9, lambda row: row + ' 1 1')), 'refused', r'in20.txt:9: .*#colorimetry: CIE-XYZ')
    # ------------------------------------------------------------ units
    kind = 'units'
    add(kind, 'degrees in so many words', changed(head('#intheta 20', '#intheta 20 deg')), 'same')
    add(kind, 'radians in so many words', changed(head('#intheta 20', '#intheta .349 rad')), 'refused', r"in20.txt:3: 'rad'.*degrees")
    add(kind, 'radians unsaid', changed(lambda x: '\n'.join(r if r.startswith('#') or not r else ' '.join(
        f'{math.radians(float(v)):.5f}' for v in r.split()[:2]) + ' ' + r.split()[2] for r in x.split('\n')).replace('#intheta 20', '#intheta .349')),
        'works', warns=r'in20.txt: .*radians')
    add(kind, 'DSF for BSDF', of_all(dsf), 'true')
    add(kind, 'negative azimuths', changed(lambda x: turned_azimuths(x, -360)), 'same')
    add(kind, 'azimuths above 360', changed(lambda x: turned_azimuths(x, 360)), 'same')
    add(kind, 'azimuth 4000', changed(line(50, lambda r: r.split()[0] + ' 4000 1')), 'refused', r"in20.txt:50: phi is '4000'")
    add(kind, 'negative theta', changed(line(50, lambda r: f'-{r.split()[0]} {float(r.split()[1]) - 180} {r.split()[2]}')), 'same')
    add(kind, 'theta above 180', changed(line(50, lambda r: '181 0 1')), 'refused', r'in20.txt:50: theta')
    add(kind, 'another up', of_all(lambda x: '#upphi 90\n' + turned_azimuths(x, 90).replace('#inphi 0', '#inphi 90')), 'same')
    # ----------------------------------------------------------------- sides
    kind = 'sides'
    add(kind, 'one file from the back among front files', changed(behind, 'in40.txt'), 'true', warns=r'back reflection \(rb\): a single incidence.*theta 140')
    add(kind, 'both sides in each file', {f'in{t:02}.txt': through(t) for t in THETAS}, 'true')
    add(kind, 'all four components', dict({f'in{t:02}.txt': through(t) for t in THETAS}, **{f'back{t:02}.txt': behind(measured(t)) for t in THETAS}), 'true')
    add(kind, 'incidence in the plane of the surface', changed(head('#intheta 20', '#intheta 90')), 'refused', r'in20.txt:3: .*plane')
    add(kind, 'all samples on the horizon', changed(lambda x: '\n'.join(r if r.startswith('#') or not r else '90 ' + r.split(' ', 1)[1] for r in x.split('\n'))),
        'refused', r'in20.txt: .*horizon')
    add(kind, 'BRDF that is transmission', of_all(lambda x: x.replace('BSDF', 'BTDF')), 'works', warns=r'#format says BTDF')
    # ------------------------------------------------------------ duplicates
    kind = 'duplicates'
    add(kind, 'a file twice', base, 'true', order=sorted(base) + ['in20.txt'])
    add(kind, 'an incidence in two halves', dict({k: v for k, v in base.items() if k != 'in20.txt'},
        a=HEAD.format(theta=20, phi=0) + '\n'.join(rows(20)[::2]), b=HEAD.format(theta=20, phi=0) + '\n'.join(rows(20)[1::2])), 'true')
    add(kind, 'each row twice', of_all(lambda x: '\n'.join(r if r.startswith('#') else r + '\n' + r for r in x.strip().split('\n'))), 'true')
    add(kind, '40 and 40.2 degrees', dict(base, **{'near.txt': measured(40.2)}), 'true')
    add(kind, '40 and 40.005 degrees', dict(base, **{'near.txt': measured(40.005)}), 'true')
    add(kind, '0.4 degrees, at any azimuth', dict({k: v for k, v in base.items() if k != 'in00.txt'}, **{'near.txt': measured(.4, 77)}), 'true')
    add(kind, '0 and 0.4 degrees', dict(base, **{'near.txt': measured(.4, 210)}), 'true')
    # -------------------------------------------------------------- coverage
    kind = 'coverage'
    add(kind, 'one incidence', {'in20.txt': base['in20.txt']}, 'works')
    add(kind, 'two incidences, 0 and 30 degrees', {'a.txt': measured(0), 'b.txt': measured(30)}, 'works',
        pairs=[(50, 0, 50, 180, bsdf(vector(50, 0), vector(50, 180)), .3)])
    add(kind, 'azimuths 0 and 90 alone', plan((0, 90)), 'true')
    add(kind, 'a quarter', plan((0, 30, 60, 90)), 'true')
    add(kind, 'half', plan((-90, -45, 0, 45, 90)), 'true')
    add(kind, 'the whole circle', plan(range(0, 360, 60)), 'true')
    add(kind, 'quarters 1 and 3', plan((0, 30, 60, 90, 180, 210, 240, 270)), 'refused', r'missing 0 to 90, 180 to 270;')
    add(kind, 'azimuths from 0 to 270 by 45', plan((0, 45, 90, 135, 180, 225, 270)), 'true')
    add(kind, 'azimuths from 0 to 240', plan(range(0, 241, 30)), 'refused', r'missing 330 to 90;')
    add(kind, 'symmetry asked for that the plan cannot have', base, 'refused', r'azimuth', options=['-s', 'Quad'])
    add(kind, 'a hole in the samples', of_all(lambda x: '\n'.join(r for r in x.strip().split('\n') if r.startswith('#') or not (
        abs(float(r.split()[0]) - 20) < 7 and float(r.split()[1]) < 40))), 'true')
    # ---------------------------------------------------------------- values
    kind = 'values'
    for text in 'nan', '-NaN', 'inf', '-Infinity', '1.#QNAN', '1e400':
        add(kind, text, changed(value(text)), 'refused', r'in20.txt:100: .*not a finite number.*delete the row')
    add(kind, '1e30', changed(value('1e30')), 'refused', r'in20.txt:100: .*1e12')
    add(kind, '0x1p3', changed(value('0x1p3')), 'refused', r'in20.txt:100: ')
    add(kind, '1.2.3', changed(value('1.2.3')), 'refused', r'in20.txt:100: ')
    add(kind, 'empty quotes', changed(value('""')), 'refused', r'in20.txt:100: ')
    add(kind, 'all zero', of_all(values(lambda v: 0)), 'refused', r'front reflection.*above zero')
    add(kind, 'all negative', of_all(values(lambda v: -v)), 'refused', r'front reflection.*above zero.*sign')
    add(kind, 'one incidence all zero', changed(values(lambda v: 0)), 'works', warns=r'no value is above zero at 1 of 4')
    add(kind, 'some negative', of_all(values(lambda v: v if v > .05 or hash_of(str(v)) % 3 else -.001)), 'works')
    add(kind, 'tiny', of_all(values(lambda v: v * 1e-4)), 'works')
    add(kind, 'a spike beyond 85 degrees', changed(spike), 'true', truth=None)
    add(kind, 'a floor that rises towards the horizon', {f'in{t:02}.txt': measured(t, f=near_grazing, limit=89) for t in THETAS}, 'true', truth=near_grazing)
    add(kind, 'a weak second peak', {f'in{t:02}.txt': measured(t, f=second_peak) for t in THETAS}, 'true', truth=second_peak,
        pairs=[(40, 0, 40, 0, second_peak(vector(40, 0), vector(40, 0)), .12)])
    add(kind, 'a peak narrower than the grid', {f'in{t:02}.txt': measured(t, f=narrow) for t in THETAS}, 'works')
    # ----------------------------------------------------------------- order
    kind = 'order'
    add(kind, 'rows in another order', of_all(shuffled), 'true')
    add(kind, 'files in another order', base, 'true', order=sorted(base, reverse=True))
    add(kind, 'azimuth in the first column', of_all(swapped), 'same')
    # ------------------------------------------------------------------ size
    kind = 'size'
    add(kind, 'no file', {}, 'refused', r'no measurement files')
    add(kind, 'an empty file', changed(lambda x: ''), 'refused', r'in20.txt: .*empty')
    add(kind, 'a header alone', changed(lambda x: x[:x.index('\n0.000') + 1]), 'refused', r'in20.txt: .*only a header')
    add(kind, 'one sample', changed(lambda x: HEAD.format(theta=20, phi=0) + '10 0 .3\n'), 'works', warns='only 1 samples|fewer than 10 samples')
    add(kind, '250,000 rows', dict(base, **{'in20.txt': many_rows(250000)}), 'true')
    add(kind, '10,000,000 rows', dict(base, **{'in20.txt': many_rows(10000000)}), 'true', slow=True)
    add(kind, '300 files', many_files(300), 'works', options=['-l', '8'], slow=True)
    add(kind, '5,000 files', many_files(5000), 'works', options=['-l', '4'], slow=True)
    # ------------------------------------------------------------- encodings
    kind = 'encodings'
    add(kind, 'byte order mark', changed(lambda x: '\ufeff' + x), 'same')
    add(kind, 'UTF-8 name', of_all(lambda x: x.replace('satin', 'Müller 光')), 'same')
    add(kind, 'Latin-1 name', {k: v.replace('satin', 'Müller').encode('latin-1') for k, v in base.items()}, 'same')
    add(kind, 'UTF-16', {k: v.encode('utf-16') if k == 'in20.txt' else v for k, v in base.items()}, 'refused', r'in20.txt: .*UTF-16.*UTF-8')
    add(kind, 'UTF-16 without mark', {k: v.encode('utf-16-le') if k == 'in20.txt' else v for k, v in base.items()}, 'refused', r'in20.txt: .*binary')
    add(kind, 'NUL byte', changed(line(100, lambda r: r + '\0')), 'refused', r'in20.txt.*(NUL|binary)')
    add(kind, 'Ctrl-Z at the end', changed(lambda x: x + '\x1a'), 'refused', r"in20.txt:\d+: ")
    add(kind, 'no-break spaces', changed(line(50, lambda r: r.replace(' ', '\u00a0'))), 'refused', r'in20.txt:50: ')
    add(kind, 'typographic minus', changed(line(50, lambda r: '10 0 \u22120.01')), 'refused', r'in20.txt:50: ')
    # ---------------------------------------------------------------- length
    kind = 'length'
    add(kind, 'a name of 2 MB', changed(head('satin', 'x' * 2000000), 'in00.txt'), 'same')
    add(kind, 'a comment of 10 MB', changed(lambda x: '#' + 'y' * 10000000 + '\n' + x), 'same')
    add(kind, 'a line of 20 MB', changed(lambda x: '#' + 'y' * 20000000 + '\n' + x), 'refused', r'in20.txt:1: line longer')
    add(kind, 'a number of 100,000 digits', changed(value('0.' + '0' * 100000 + '1')), 'works')
    add(kind, 'a file name of 250 characters', {('n' * 246 + k[2:] if k != 'in00.txt' else k): v for k, v in base.items()}, 'same')
    add(kind, 'format letters in the file name', {k.replace('in', '%s%n%d '): v for k, v in base.items()}, 'same')
    add(kind, 'format letters in the sample name', of_all(head('satin', '%s%n%1000000d')), 'same')
    add(kind, 'line feed in the file name', {k.replace('in', 'i\nn'): v for k, v in base.items()}, 'same')
    # --------------------------------------------------------------- foreign
    kind = 'foreign'
    for name, content, words in (('Radiance .sir', b'#?RADIANCE\nSYMMETRY=0\nFORMAT=BSDF_RBFmesh\n\n\0\1', r'\.sir'),
                                 ('Radiance XML', '<?xml version="1.0"?>\n<WindowElement>', 'XML'),
                                 ('XML with an entity', '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>', 'XML'),
                                 ('spreadsheet', b'PK\3\4' + bytes(100), 'spreadsheet'), ('gzip', b'\x1f\x8b\x08' + bytes(100), 'compressed'),
                                 ('PNG', b'\x89PNG\r\n\x1a\n' + bytes(100), 'binary'), ('random bytes', os.urandom(5000), ''),
                                 ('JSON', '{"theta": [1, 2]}\n', 'Mountain'), ('prose', 'Dear colleague,\nhere are the data.\n', 'Mountain')):
        add(kind, name, changed(lambda x, v=content: v), 'refused', r'in20.txt.*' + words)
    add(kind, 'folder', dict(base, **{'in20.txt': os.mkdir}), 'refused', r'in20.txt: ')
    add(kind, 'broken link', dict(base, **{'in20.txt': lambda path: os.symlink('nowhere', path)}), 'refused', r'in20.txt: .*No such file')
    add(kind, 'no such file', {k: v for k, v in base.items() if k != 'in20.txt'}, 'refused', r'in20.txt: .*No such file', order=sorted(base))
    return c
