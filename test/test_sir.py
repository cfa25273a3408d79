#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Import of .sir interpolants: those that the stock pabopto2bsdf makes, small ones written here, and damaged ones.
Environment: BUILD_DIR; BSDFQUERY, Radiance's program of that name, as a second witness (the wheel has none)."""
import glob
import math
import os
import resource
import shutil
import struct
import subprocess
import tempfile
import unittest

import numpy as np
import pyradiance

BUILD = os.environ.get('BUILD_DIR', os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'build'))
STOCK = os.path.dirname(pyradiance.__file__)
QUERY = os.environ.get('BSDFQUERY') or shutil.which('bsdfquery') or shutil.which(os.path.join(BUILD, 'bench', 'bsdfquery'))
COMPONENTS = {'rf': (1, 1), 'rb': (-1, -1), 'tf': (1, -1), 'tb': (-1, 1)}
HEAD = '#?RADIANCE\npabopto2bsdf\nNAME={name}\nSYMMETRY=0\nIO_SIDES= {sides[0]} {sides[1]}\nCOLORIMETRY={colour}\nGRIDRES=256\n' \
       'BSDFMIN=0\nFORMAT=BSDF_RBFmesh\n\n'


def run(*command, **more):
    return subprocess.run(command, capture_output=True, **more)


def mkrbf(*arguments, limit=0):
    def bound():
        if limit:
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    return run(os.path.join(BUILD, 'bin', 'mkrbf'), '-q', '-n', '1', *arguments, preexec_fn=bound)


def number(value):
    """Four bytes of mantissa and one of exponent."""
    mantissa, exponent = math.frexp(value)
    return struct.pack('>ib', int(mantissa * 0x7fffffff), exponent if mantissa else 0)


def real(data):
    mantissa, exponent = struct.unpack('>ib', data)
    return (mantissa + math.copysign(.5, mantissa)) / 0x7fffffff * 2. ** exponent if mantissa else 0.


def sir(sides=(1, 1), colour='Unknown', incidences=((0, 0), (30, 0), (60, 0)), lobes=((.5, 49750, 3000, 128, 128), (.3, 49750, 5000, 60, 90))):
    data = (HEAD.format(sides=sides, colour=colour, name='made') + 'Z<').encode()
    for n, (theta, phi) in enumerate(incidences):
        t, p = math.radians(theta), math.radians(phi)
        data += struct.pack('>i', n)
        for v in (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), sides[0] * math.cos(t), .5):
            data += number(v)
        data += struct.pack('>i', len(lobes))
        for peak, *codes in lobes:
            data += number(peak) + struct.pack('>4H', *codes)
    return data + struct.pack('>i', -1)


def parse(data):
    """(sides, grid, colour, [(incident, lobes)])"""
    body = data.index(b'\n\n') + 2
    head = dict(line.split('=', 1) for line in data[:body].decode().split('\n') if '=' in line)
    at, found = body + 2, []
    while struct.unpack_from('>i', data, at)[0] >= 0:
        at += 4
        incident = [real(data[at + 5 * k:at + 5 * k + 5]) for k in range(3)]
        count, = struct.unpack_from('>i', data, at + 20)
        at += 24
        found.append((np.array(incident), np.array([(real(data[k:k + 5]), *struct.unpack_from('>4H', data, k + 5))
                                                    for k in range(at, at + 13 * count, 13)])))
        at += 13 * count
    return [int(x) for x in head['IO_SIDES'].split()], int(head['GRIDRES']), head['COLORIMETRY'], found


def centres(lobes, grid, side):
    a, b = (2 * (lobes[:, k] + .5) / grid - 1 for k in (3, 4))
    wide = abs(a) > abs(b)
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0, 1, radius) * math.pi / 4
    turn = np.where(wide, ratio, math.pi / 2 - ratio)
    spread = radius * np.sqrt(2 - radius ** 2)
    return np.stack([spread * np.cos(turn), spread * np.sin(turn), side * (1 - radius ** 2)], 1)


def dsf(lobes, grid, side, outgoing, colour):
    """As the format's description says, [n, channels]."""
    sigma = (lobes[:, 2] + .5) * math.pi / 65536
    each = lobes[:, 0] * np.exp((outgoing @ centres(lobes, grid, side).T - 1) / sigma ** 2)
    if not colour:
        return each.sum(1)[:, None]
    u, v = (lobes[:, 1].astype(int) & 255) / 410, (lobes[:, 1].astype(int) >> 8) / 410
    x, y = 9 * u / (6 * u - 16 * v + 12), 4 * v / (6 * u - 16 * v + 12)
    return np.stack([each @ (x / y), each.sum(1), each @ ((1 - x - y) / y)], 1)


def directions(side, count=1500):
    k = np.arange(count)
    z = 1 - (k + .5) / count * .9
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(2.399963 * k), s * np.sin(2.399963 * k), side * z], 1)


def answers(record, incident, outgoing, channels=1):
    """f, [n, channels]: Y, or X, Y, Z."""
    pairs = np.concatenate([np.broadcast_to(incident, outgoing.shape), outgoing], 1).astype('<f4')
    done = run(os.path.join(BUILD, 'bin', 'rbfquery'), '-c', '-ff', record, input=pairs.tobytes())
    found = np.frombuffer(done.stdout, '<f4').reshape(len(outgoing), 3)
    return found if channels == 3 else found[:, 1:2]


class Import(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.path('out.rbf')

    def path(self, name, data=None):
        path = os.path.join(self.folder, name)
        if data is not None:
            with open(path, 'wb') as file:
                file.write(data)
        return path

    def agrees(self, data, tolerance):
        """The record holds the lobes: DSF at each incidence within `tolerance` of L1."""
        sides, grid, colour, found = parse(data)
        outgoing = directions(sides[1])
        for incident, lobes in found:
            want = dsf(lobes, grid, sides[1], outgoing, colour == 'CIE-XYZ')
            got = answers(self.out, incident, outgoing, want.shape[1]) * abs(outgoing[:, 2:])
            self.assertLess(abs(got - want).sum(), tolerance * want.sum(), f'at {incident}')

    def stock(self, material, *options):
        folder, name = self.path(material), self.path(material + '.sir')
        done = run(os.path.join(BUILD, 'bin', 'goniometer'), '-held', '1', *options, material, folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(os.path.join(STOCK, 'bin', 'pabopto2bsdf'), '-n', '1', *sorted(glob.glob(folder + '/[0-9]*.txt')),
                   env=dict(os.environ, RAYPATH=os.path.join(STOCK, 'lib')))
        data = done.stdout
        self.assertEqual(done.returncode, 0, done.stderr)
        self.path(material + '.sir', data)
        done = mkrbf('-o', self.out, name)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.agrees(data, 1e-3)
        if QUERY:
            self.witnessed(name, data)

    def witnessed(self, name, data):
        """bsdfquery divides DSF by .02 + .98 cos, and raises f to BSDFMIN. The mesh of stock misses an incidence now and then."""
        sides, _, _, found = parse(data)
        outgoing, errors = directions(sides[1]), []
        for incident, _ in found:
            pairs = np.concatenate([np.broadcast_to(incident, outgoing.shape), outgoing], 1)
            text = '\n'.join(' '.join(f'{x:.9g}' for x in row) for row in pairs)
            want = np.array([float(line.split()[0]) for line in run(QUERY, name, input=text.encode()).stdout.decode().splitlines()])
            want *= .02 + .98 * abs(outgoing[:, 2])
            got = answers(self.out, incident, outgoing)[:, 0] * abs(outgoing[:, 2])
            errors.append(abs(got - want).sum() / want.sum())
        self.assertLess(np.median(errors), .005)

    def test_stock_isotropic(self):
        self.stock('satin', '-grid', '20', '-every', '4')

    def test_stock_colour(self):
        self.stock('film', '-xyz', '-grid', '16', '-every', '4')

    def test_stock_anisotropic(self):
        self.stock('brushed', '-grid', '20', '-every', '6', '-samples', '900', '0')

    def test_four_sides(self):
        """Four files, one record; each component answers with its own lobes. Reversed, front and back change places."""
        names, data = [], {}
        for k, (component, sides) in enumerate(COMPONENTS.items()):
            data[component] = sir(sides, lobes=((.2 + .1 * k, 49750, 4000, 140, 128 + k), (.3, 49750, 6000, 60, 90)))
            names.append(self.path(component + '.sir', data[component]))
        done = mkrbf('-o', self.out, *names)
        self.assertEqual(done.returncode, 0, done.stderr)
        for each in data.values():
            self.agrees(each, 1e-3)
        done = mkrbf('-t', '-o', self.out, names[0], names[2])
        self.assertEqual(done.returncode, 0, done.stderr)
        outgoing = directions(1)
        want = dsf(parse(data['rf'])[3][0][1], 256, 1, outgoing, False)
        turned = outgoing * [-1, 1, -1]
        got = answers(self.out, np.array([0, 0, -1]), turned) * abs(turned[:, 2:])
        self.assertLess(abs(got - want).sum(), 1e-3 * want.sum())

    def test_azimuths_of_an_isotropic_file(self):
        """Turned to one meridian, as measurements are."""
        lobes = ((.5, 49750, 3000, 200, 128),)
        data = sir(incidences=((0, 0), (40, 35)), lobes=lobes)
        name = self.path('a.sir', data)
        self.assertEqual(mkrbf('-o', self.out, name).returncode, 0)
        outgoing = directions(1)
        want = dsf(parse(data)[3][1][1], 256, 1, outgoing, False)
        t, p = math.radians(40), math.radians(35)
        got = answers(self.out, np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)]), outgoing) * outgoing[:, 2:]
        self.assertLess(abs(got - want).sum(), 1e-3 * want.sum())

    def refused(self, words, *names):
        done = mkrbf('-o', self.out, *names, limit=1 << 30)
        said = done.stderr.decode(errors='replace')
        self.assertEqual(done.returncode, 1, said)
        self.assertRegex(said, words)
        self.assertFalse(os.path.exists(self.out))

    def test_damage(self):
        good = sir()
        body = good.index(b'\n\n') + 2
        for length in [*range(body, len(good), 7), body - 1, body - 20, 12]:
            self.refused(r'bad\.sir.*(byte \d+, .*cut off|cut off)', self.path('bad.sir', good[:length]))
        lobes_at, lobe_at, huge = body + 2 + 4 + 20, body + 2 + 4 + 24, struct.pack('>i', 0x7fffffff)
        for at, new, words in ((lobes_at, huge, 'number of lobes'), (lobes_at, b'\0\0\0\0', 'number of lobes'), (lobes_at, b'\xff' * 4, 'number of lobes'),
                               (lobes_at, struct.pack('>i', 20000), 'cut off|damaged'), (body + 6, b'\x7f\xff\xff\xff\x7f', 'unit vector'),
                               (body + 16, number(-1.), 'other side'), (lobe_at, number(-.5), 'negative'),
                               (lobe_at, b'\x7f\xff\xff\xff\x7f', 'beyond 1e12'), (lobe_at + 9, b'\1\0', 'outside the grid'), (body, b'XX', 'magic')):
            self.refused(r'bad\.sir: (byte \d+: .*|ends at byte \d+.*)?(' + words + ')', self.path('bad.sir', good[:at] + new + good[at + len(new):]))
        self.refused('no incident direction', self.path('bad.sir', sir(incidences=())))
        for old, new, words in ((b'IO_SIDES= 1 1', b'IO_SIDES= 2 1', r'bad\.sir:5: IO_SIDES'), (b'GRIDRES=256', b'GRIDRES=-1', r'bad\.sir:7: GRIDRES'),
                                (b'GRIDRES=256\n', b'', 'lacks GRIDRES'), (b'Unknown', b'CIE-uv', r'bad\.sir:6: COLORIMETRY'), (b'BSDF_RBFmesh', b'32-bit_rle_rgbe', 'picture')):
            self.refused(words, self.path('bad.sir', good.replace(old, new)))
        self.refused('colour of a lobe', self.path('bad.sir', sir(colour='CIE-XYZ', lobes=((.5, 10, 3000, 128, 128),))))

    def test_what_cannot_be_joined(self):
        a, b = self.path('a.sir', sir()), self.path('b.sir', sir())
        text = self.path('c.txt', b'#format: theta phi DSF\n#incident_angle 30 0\n' + b''.join(b'%d %d 1\n' % (10 * t, p) for t in range(8) for p in (0, 90, 180, 270)))
        self.refused(r'b\.sir: front reflection.*already', a, b)
        self.refused(r'c\.txt: front reflection.*already', a, text)
        self.refused(r'a\.sir: front reflection.*already', text, a)
        self.refused(r'a\.sir.*separately', self.path('d.sir', sir((-1, -1), 'CIE-XYZ')), a)
        self.refused('omit the limit', '-g', '5', a)
        done = mkrbf('-l', '50', '-o', self.out, a)
        self.assertIn('does not count', done.stderr.decode())
        self.assertEqual(done.returncode, 0)


if __name__ == '__main__':
    unittest.main()
