#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""rbf2ttree and rbf2klems: structure of what they write, energy, and that the stock reader of Radiance (pyradiance, if it is
installed) finds each component on its side with the values that rbfquery gives."""
import math
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
import unittest

BIN = os.path.join(os.environ["BUILD_DIR"], "bin")
try:
    import pyradiance.bsdf as reader
except ImportError:
    reader = None
NEEDS_READER = unittest.skipIf(reader is None, "no pyradiance: values are not checked with the stock reader")
RINGS = [(0, 5, 1), (5, 15, 8), (15, 25, 16), (25, 35, 20), (35, 45, 24), (45, 55, 24), (55, 65, 24), (65, 75, 16), (75, 90, 12)]
OMEGA = [math.pi * (math.sin(math.radians(b)) ** 2 - math.sin(math.radians(a)) ** 2) / n for a, b, n in RINGS for _ in range(n)]
# name, incident front, outgoing front, the fixed exit of its lobe (x, y), WINDOW's name
COMPONENTS = [("rf", 1, 1, (.5, .1), "Reflection Back"), ("rb", 0, 0, (-.2, .5), "Reflection Front"),
              ("tf", 1, 0, (.1, -.55), "Transmission Back"), ("tb", 0, 1, (-.5, -.3), "Transmission Front")]
KAPPA = 14


def disk(x, y):
    """Shirley and Chiu's map of the unit square."""
    a, b = 2 * x - 1, 2 * y - 1
    r, phi = (a, math.pi / 4 * b / a) if abs(a) > abs(b) else (b, math.pi / 2 - math.pi / 4 * a / b)
    return r * math.cos(phi), r * math.sin(phi)


def through(x, y):
    """Direction behind, half a turn from what the tree's cells say."""
    return -x, -y, -math.sqrt(1 - x * x - y * y)


def run(program, *arguments, stdin=None):
    done = subprocess.run([os.path.join(BIN, program), *map(str, arguments)], input=stdin, capture_output=True)
    if done.returncode:
        raise AssertionError(f"{program} failed: {done.stderr.decode()}")
    return done.stdout


def vector(theta, phi):
    s, c = math.sin(math.radians(theta)), math.cos(math.radians(theta))
    return s * math.cos(math.radians(phi)), s * math.sin(math.radians(phi)), c


def values(model, pairs):
    """f of pairs of vectors by rbfquery."""
    out = run("rbfquery", "-ff", model, stdin=b"".join(struct.pack("6f", *a, *b) for a, b in pairs))
    return struct.unpack(f"{len(out) // 4}f", out)


def dhr(model, vectors):
    out = run("rbfquery", "-ff", "-d", model, stdin=b"".join(struct.pack("3f", *v) for v in vectors))
    numbers = struct.unpack(f"{len(out) // 4}f", out)
    return list(zip(numbers[::2], numbers[1::2]))


def angles(v):
    return math.degrees(math.acos(max(-1, min(1, v[2])))), math.degrees(math.atan2(v[1], v[0]))


loaded = {}


def load(path):
    """Kept until the end: the reader does not survive that some are freed."""
    if path not in loaded:
        loaded[path] = reader.load_file(path)
    return loaded[path]


def read(data, a, b):
    """Luminance of f(a, b) by the stock reader."""
    v = reader.query(data, *angles(a), *angles(b))
    return float(v[0] if len(v) == 1 else v[1])


def hemi(data, v, transmit):
    return reader.direct_hemi(data, *angles(v), reader.SAMPLE_ALL & ~(reader.SAMPLE_R if transmit else reader.SAMPLE_T))


def blocks(xml):
    """(wavelength, direction, numbers as text) of each data block."""
    pattern = (r"<Wavelength unit=\"Integral\">(.*?)</Wavelength>.*?<WavelengthDataDirection>(.*?)</WavelengthDataDirection>"
               r".*?<ScatteringData>(.*?)</ScatteringData>")
    return re.findall(pattern, xml, re.S)


def matrix(text):
    numbers = [float(x) for x in re.split(r"[,\s]+", text.strip().rstrip(","))]
    assert len(numbers) == 145 * 145
    return [numbers[145 * o:145 * (o + 1)] for o in range(145)]


def patch(index):
    """Middle of a patch: theta, phi."""
    for a, b, n in RINGS:
        if index < n:
            return (a + b) / 2 if n > 1 else 0, 360 * index / n
        index -= n
    raise IndexError


def measure(folder, name, incidences, directions, value, front_in=1, front_out=1):
    """Mountain files, azimuth 0 to the right (#upphi 90)."""
    files = []
    for theta, phi in incidences:
        path = os.path.join(folder, f"{name}_{theta}_{phi}.dat")
        with open(path, "w") as out:
            out.write("#sample_name four sides\n#format theta phi BSDF\n#colorimetry CIE-Y\n#upphi 90\n"
                      f"#intheta {theta if front_in else 180 - theta}\n#inphi {phi}\n")
            for d in directions(theta, phi):
                t = d[0] if front_out else 180 - d[0]
                out.write(f"{t:.4f} {d[1]:.4f} {value(vector(theta, phi), vector(*d)):.7f}\n")
        files.append(path)
    return files


def spread(count, limit=84):
    """Directions (theta, phi) evenly over the hemisphere, in projected solid angle."""
    top = math.sin(math.radians(limit)) ** 2
    return [(math.degrees(math.asin(math.sqrt(top * (n + .5) / count))), 222.4922 * n % 360) for n in range(count)]


def four_sides(folder, count=500):
    """One fixed off-axis lobe a component, with a different one for each, over 17 incidences."""
    incidences = [(0, 0)] + [(t, p) for t in (35, 70) for p in range(0, 360, 45)]
    files = []
    for name, front_in, front_out, (x, y), _ in COMPONENTS:
        exit_ = (x, y, math.sqrt(1 - x * x - y * y))

        def value(i, o, exit_=exit_):
            tilt = 1 + .5 * i[0] - .3 * i[1]  # the incident side is to be told from its mirror images
            return .02 + .3 * tilt * math.exp(KAPPA * (sum(a * b for a, b in zip(o, exit_)) - 1))
        files += measure(folder, name, incidences, lambda t, p: spread(count), value, front_in, front_out)
    return files


def narrow(folder):
    """Transmission with a beam of .6 degrees (full width at half maximum)."""
    kappa = 1 / math.radians(.6 / 2.3548) ** 2

    def value(i, o):
        return .01 + .5 * kappa / (2 * math.pi) * math.exp(kappa * (-i[0] * o[0] - i[1] * o[1] + i[2] * o[2] - 1)) / o[2]

    def directions(theta, phi):
        fine = [(theta + .15 * a, phi + 180 + .15 * b / max(math.sin(math.radians(theta)), .1))
                for a in range(-8, 9) for b in range(-8, 9)]
        if theta == 0:
            fine = [(.15 * n, 30 * k) for n in range(1, 9) for k in range(12)] + [(0, 0)]
        return spread(400) + fine
    return measure(folder, "narrow", [(t, 0) for t in (0, 15, 30, 45, 60)], directions, value, 1, 0)


class Resample(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.sides, cls.narrow, cls.lone = (os.path.join(cls.folder.name, n) for n in ("sides.rbf", "narrow.rbf", "lone.rbf"))
        files = four_sides(cls.folder.name)
        run("mkrbf", "-q", "-l", 60, "-o", cls.sides, *files)
        run("mkrbf", "-q", "-l", 60, "-o", cls.lone, *[f for f in files if os.path.basename(f).startswith("tf")])
        run("mkrbf", "-q", "-o", cls.narrow, *narrow(cls.folder.name))
        cls.tree, cls.klems, cls.narrow_tree = (os.path.join(cls.folder.name, n) for n in ("tree.xml", "klems.xml", "narrow.xml"))
        run("rbf2ttree", "-g", 5, "-n", 2, "-o", cls.tree, cls.sides)
        run("rbf2ttree", "-g", 7, "-o", cls.narrow_tree, cls.narrow)
        run("rbf2klems", "-o", cls.klems, cls.sides)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def text(self, path):
        with open(path) as f:
            return f.read()

    def pairs(self, front_in, front_out, count=250):
        pick = random.Random(7)
        for _ in range(count):
            a, b = (vector(math.degrees(math.asin(math.sqrt(pick.random() * .8))), 360 * pick.random()) for _ in range(2))
            yield (a[0], a[1], a[2] if front_in else -a[2]), (b[0], b[1], b[2] if front_out else -b[2])

    def agree(self, path, limit):
        data = load(path)
        for name, front_in, front_out, _, _ in COMPONENTS:
            pairs = list(self.pairs(front_in, front_out))
            ours = values(self.sides, pairs)
            theirs = [read(data, a, b) for a, b in pairs]
            error = sum(abs(x - y) for x, y in zip(ours, theirs)) / sum(ours)
            self.assertLess(error, limit, name)

    @NEEDS_READER
    def test_tree_values(self):
        self.agree(self.tree, .12)

    @NEEDS_READER
    def test_klems_values(self):
        self.agree(self.klems, .35)

    @NEEDS_READER
    def test_energy(self):
        # at the middle of incident cells and patches: what an incidence shares with its cell is not looked at
        cells = [disk((x + .5) / 32, (y + .5) / 32) for x, y in ((15, 16), (20, 18), (9, 13), (6, 22), (25, 3), (12, 28))]
        middles = [vector(*patch(i))[:2] for i in (0, 4, 20, 50, 75, 100)]
        for path, points, limit in ((self.tree, cells, .01), (self.klems, middles, .02)):
            data = load(path)
            for z in 1, -1:
                vectors = [(x, y, z * math.sqrt(1 - x * x - y * y)) for x, y in points]
                for v, ours in zip(vectors, dhr(self.sides, vectors)):
                    for transmit in 0, 1:
                        self.assertLess(abs(hemi(data, v, transmit) / ours[transmit] - 1), limit, (path, v))

    def test_tree_structure(self):
        xml = self.text(self.tree)
        self.assertIn("<IncidentDataStructure>TensorTree4</IncidentDataStructure>", xml)
        self.assertEqual([b[1] for b in blocks(xml)], [c[4] for c in COMPONENTS])
        self.assertIn("TensorTree3", self.text(self.narrow_tree))
        self.assertEqual(len(blocks(run("rbf2ttree", "-g", 3, "-c", "tb,rf", self.sides).decode())), 2)
        self.assertEqual(run("rbf2ttree", "-g", 4, "-n", 1, self.sides).split(b"-->")[1],
                         run("rbf2ttree", "-g", 4, "-n", 3, self.sides).split(b"-->")[1])

    def test_cull(self):
        culled = run("rbf2ttree", "-g", 4, "-t", 90, self.sides).decode()
        for leaves, all_ in re.findall(r"(\d+) leaves of (\d+)", culled):
            self.assertLessEqual(int(leaves), .1 * int(all_))

    @NEEDS_READER
    def test_narrow_peak(self):
        data = load(self.narrow_tree)
        sine = 1 - 2 * 40.5 / 128  # the middle of an incident cell
        a = (sine, 0, math.sqrt(1 - sine * sine))
        column = round(128 * (.5 + .5 * sine))
        ours = theirs = 0
        for x in range(column - 8, column + 8):
            for y in range(56, 72):
                theirs += read(data, a, through(*disk((x + .5) / 128, (y + .5) / 128)))
                fine = [(a, through(*disk((x + (i + .5) / 8) / 128, (y + (j + .5) / 8) / 128))) for i in range(8) for j in range(8)]
                ours += sum(values(self.narrow, fine)) / 64 if abs(y - 64) < 4 else values(self.narrow, fine[:1])[0]
        ours, theirs = ours * math.pi / 128 ** 2, theirs * math.pi / 128 ** 2
        self.assertGreater(ours, .4)
        self.assertLess(abs(theirs / ours - 1), .01)

    @NEEDS_READER
    def test_colour(self):
        def value(channel):
            def f(i, o):
                return (.05, .05, .055)[channel] + (.39, .3, .09)[channel] * math.exp(20 * (i[2] * o[2] - i[0] * o[0] - i[1] * o[1] - 1))
            return f
        files = []
        for theta in 0, 25, 50:
            path = os.path.join(self.folder.name, f"colour{theta}.dat")
            files.append(path)
            with open(path, "w") as out:
                out.write(f"#format theta phi BSDF\n#colorimetry CIE-XYZ\n#upphi 90\n#intheta {theta}\n#inphi 0\n")
                for d in spread(400):
                    out.write("%.4f %.4f %.6f %.6f %.6f\n" % (*d, *(value(c)(vector(theta, 0), vector(*d)) for c in range(3))))
        rbf = os.path.join(self.folder.name, "colour.rbf")
        run("mkrbf", "-q", "-o", rbf, *files)
        for program, limit in ("rbf2ttree", .02), ("rbf2klems", .05):  # a patch mixes the beam with what is around it
            xml = rbf + program + ".xml"
            run(program, "-o", xml, rbf)
            for a, b in ((30, 0), (30, 180)), ((20, 0), (5, 180)), ((45, 10), (20, 100)):
                theirs = reader.query(load(xml), *a, *b)
                ours = [float(x) for x in run("rbfquery", "-c", rbf, stdin=" ".join(map(str, vector(*a) + vector(*b))).encode()).split()]
                for x, y in zip(theirs, ours):
                    self.assertLess(abs(x / sum(theirs) - y / sum(ours)), limit, (program, a, b))

    def test_klems_energy(self):
        """Columns add up to the mean DHR of the patch: here, over a fan of directions of it."""
        for (name, front_in, front_out, _, direction), block in zip(COMPONENTS, blocks(self.text(self.klems))):
            self.assertEqual(block[:2], ("Visible", direction))
            m = matrix(block[2])
            for i in 0, 5, 30, 70, 110:
                theta, phi = patch(i)
                total = sum(m[o][i] * OMEGA[o] for o in range(145))
                fan = [vector(theta + dt, phi + 180 + dp) for dt in (-2.5, 2.5) for dp in (-3, 3)]
                if not front_in:
                    fan = [(x, y, -z) for x, y, z in fan]
                mean = sum(d[front_in != front_out] for d in dhr(self.sides, fan)) / 4
                self.assertLess(abs(total / mean - 1), .01, (name, i))

    def test_klems_isotropic(self):
        """Entries are means of f over both patches, with a lobe that leaves to one side of the plane of incidence."""
        side = math.radians(220)

        def value(i, o):
            c, s = math.cos(side), math.sin(side)
            return .01 + .5 * math.exp(120 * ((c * i[0] - s * i[1]) * o[0] + (s * i[0] + c * i[1]) * o[1] + i[2] * o[2] - 1))
        path = os.path.join(self.folder.name, "turned.rbf")
        run("mkrbf", "-q", "-l", 60, "-o", path,
            *measure(self.folder.name, "turned", [(t, 0) for t in (0, 20, 40, 60, 80)], lambda t, p: spread(500), value))
        m = matrix(blocks(run("rbf2klems", path).decode())[0][2])
        count, golden = 6000, 1.1673039782614187  # x^5 = x + 1: an even sequence in four dimensions
        even = [[k * golden ** -d % 1 for d in (1, 2, 3, 4)] for k in range(count)]

        def within(index, turn, u, v):
            for low, high, n in RINGS:
                if index < n:
                    a, b = (math.sin(math.radians(x)) ** 2 for x in (low, high))
                    return vector(math.degrees(math.asin(math.sqrt(a + u * (b - a)))), 360 * (index + v - .5) / n + turn)
                index -= n
        for i in 0, 3, 37, 60, 90:
            most = max(m[o][i] for o in range(145))
            near = [o for o in range(145) if m[o][i] > .25 * most]
            for o in near[::max(1, len(near) // 3)]:
                mean = sum(values(path, [(within(i, 180, *n[:2]), within(o, 0, *n[2:])) for n in even])) / count
                self.assertLess(abs(m[o][i] / mean - 1), .02, (i, o))

    def test_klems_reciprocal(self):
        """WINDOW's transmission that was not measured is the other one read backwards."""
        path = os.path.join(self.folder.name, "window.xml")
        run("rbf2klems", "-w", "-solar", "visible", "-s", "t=.003", "-s", "n=<pane>", "-o", path, self.lone)
        xml = self.text(path)
        found = blocks(xml)
        self.assertEqual([b[0] for b in found], 4 * ["Visible"] + 4 * ["Solar"])
        self.assertEqual(sorted(b[1] for b in found[:4]), sorted(c[4] for c in COMPONENTS))
        self.assertIn("<Thickness unit=\"Meter\">0.003</Thickness>", xml)
        self.assertIn("<Name>&lt;pane&gt;</Name>", xml)
        self.assertIn("<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis>", xml)
        sides = {b[1]: matrix(b[2]) for b in found[:4]}
        self.assertEqual(max(map(max, sides["Reflection Front"])), 0)
        front, back = sides["Transmission Back"], sides["Transmission Front"]

        def opposite(index):
            first = 0
            for _, _, n in RINGS:
                if index < first + n:
                    return index if n == 1 else first + (index - first + n // 2) % n
                first += n
        for o in range(0, 145, 7):
            for i in range(0, 145, 11):
                self.assertAlmostEqual(back[o][i], front[opposite(i)][opposite(o)], delta=1e-5)

    def test_refusals(self):
        def message(*arguments):
            done = subprocess.run([os.path.join(BIN, arguments[0]), *arguments[1:]], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1, arguments)
            return done.stderr
        self.assertIn("thickness", message("rbf2klems", "-w", self.lone))
        self.assertIn("full", message("rbf2klems", "-w", "-s", "t=.1", "-b", "half", self.lone))
        self.assertIn("none of the components", message("rbf2ttree", "-c", "rf", self.lone))
        self.assertIn("'-c'", message("rbf2ttree", "-c", "xy", self.lone))
        self.assertIn("'-g'", message("rbf2ttree", "-g", "12", self.lone))
        self.assertIn("exactly one", message("rbf2ttree"))
        self.assertIn("No such file", message("rbf2klems", "missing.rbf"))


if __name__ == "__main__":
    unittest.main()
