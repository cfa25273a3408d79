#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Other programs read what rbf2ttree and rbf2klems write: pyradiance, checkBSDF, rmtxop, dctimestep,
pyWinCalc, honeybee-radiance. A three-phase run gives the daylight of the interpolant itself."""
import math
import os
import random
import re
import subprocess
import tempfile
import unittest

from test_resample import (COMPONENTS, OMEGA, blocks, dhr, disk, four_sides, load, matrix, measure, patch, read, reader, run,
                           spread, vector)

PATCHED = os.path.join(os.environ["BUILD_DIR"], "radiance", "bin")
STOCK = os.path.join(os.path.dirname(reader.__file__), "bin") if reader else ""
NEEDS_STOCK = unittest.skipUnless(reader, "no pyradiance")
try:
    import pywincalc
except ImportError:
    pywincalc = None
try:
    from honeybee_radiance.modifier.material.bsdf import BSDF
except ImportError:
    BSDF = None

KINDS = {  # name: (model, program and options, what checkBSDF calls it)
    "tree3.xml": ("iso", ["rbf2ttree", "-g", "5"], "Isotropic_Tensor_Tree"),
    "colour3.xml": ("colour", ["rbf2ttree", "-g", "4"], "Isotropic_Tensor_Tree"),
    "tree4.xml": ("sides", ["rbf2ttree", "-g", "4"], "Anisotropic_Tensor_Tree"),
    "reciprocal4.xml": ("sides", ["rbf2ttree", "-g", "3", "+a"], "Anisotropic_Tensor_Tree"),
    "culled4.xml": ("sides", ["rbf2ttree", "-g", "4", "-t", "95"], "Anisotropic_Tensor_Tree"),
    # 77 patches, as Radiance's reader divides it; checkBSDF expects 73
    "half.xml": ("sides", ["rbf2klems", "-b", "half", "-c", "rb,tf"], "Unknown_Matrix"),
    "quarter.xml": ("sides", ["rbf2klems", "-b", "quarter", "-c", "rf,tb"], "Klems_Quarter"),
    "full.xml": ("iso", ["rbf2klems"], "Klems_Full"),
    "colour.xml": ("colour", ["rbf2klems"], "Klems_Full"),
    "window.xml": ("sides", ["rbf2klems", "-w", "-solar", "visible", "-s", "t=.003", "-s", "n=four sides"], "Klems_Full"),
    "embed.xml": ("iso", ["rbf2ttree", "-g", "4", "-embed"], "Isotropic_Tensor_Tree")}


def tool(folder, name, *arguments, stdin=None):
    path = f"{STOCK}:{os.environ['PATH']}"
    done = subprocess.run([os.path.join(folder, name), *map(str, arguments)], input=stdin, capture_output=True,
                          env=dict(os.environ, PATH=path, RAYPATH=".:" + os.path.join(os.path.dirname(STOCK), "lib")))
    if done.returncode:
        raise AssertionError(f"{name} {arguments} failed: {done.stderr.decode()}")
    return done.stdout


def numbers(text):
    """Rows of a Radiance matrix in ASCII, the first of the three colours."""
    return [[float(x) for x in line.split()[::3]] for line in text.decode().split("\n\n", 1)[1].splitlines() if line.strip()]


class Readers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        folder = cls.place.name
        path = {n: os.path.join(folder, n + ".rbf") for n in ("iso", "colour", "sides")}
        run("mkrbf", "-q", "-l", 25, "-o", path["sides"], *four_sides(folder, 300))

        def lobe(i, o):
            return .05 + .5 * math.exp(20 * (i[2] * o[2] - i[0] * o[0] - i[1] * o[1] - 1))
        run("mkrbf", "-q", "-l", 40, "-o", path["iso"],
            *measure(folder, "iso", [(t, 0) for t in (0, 25, 50, 75)], lambda t, p: spread(400), lobe, 1, 0))
        files = []
        for theta in 0, 25, 50:
            files.append(os.path.join(folder, f"colour{theta}.dat"))
            with open(files[-1], "w") as out:
                out.write(f"#format theta phi BSDF\n#colorimetry CIE-XYZ\n#upphi 90\n#intheta {theta}\n#inphi 0\n")
                for d in spread(400):
                    y = lobe(vector(theta, 0), vector(*d))
                    out.write("%.4f %.4f %.6f %.6f %.6f\n" % (*d, 1.2 * y, y, .4 * y + .01))
        run("mkrbf", "-q", "-l", 40, "-o", path["colour"], *files)
        cls.model, cls.xml = path, {}
        for name, (model, command, _) in KINDS.items():
            cls.xml[name] = os.path.join(folder, name)
            run(*command, "-o", cls.xml[name], path[model])

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    @NEEDS_STOCK
    def test_load(self):
        """Every kind loads, and checkBSDF finds what it is, with no more light out than in."""
        for name, (model, _, kind) in KINDS.items():
            self.assertIsNotNone(load(self.xml[name]), name)
            said = tool(STOCK, "checkBSDF", self.xml[name]).decode()
            self.assertIn(f"Type: {kind}\n", said)
            self.assertIn(f"Color: {int(model == 'colour')}\n", said)
            totals = [float(x) for x in re.findall(r"\t\s*([\d.]+)%", said)]
            self.assertEqual(len(totals), 4, said)
            self.assertTrue(10 < max(totals) <= 100, said)

    @NEEDS_STOCK
    def test_hemispheres(self):
        """DHR of the interpolant within 1 % at a hundred incidences: middles of cells, whose value a tree has."""
        pick = random.Random(5)
        for name, size in ("tree4.xml", 16), ("tree3.xml", 32):
            data, model = load(self.xml[name]), self.model[KINDS[name][0]]
            transmitted = name == "tree3.xml"
            vectors = []
            while len(vectors) < 100:
                if size == 32:
                    s, phi = 1 - 2 * (pick.randrange(16) + .5) / 32, 2 * math.pi * pick.random()
                    x, y = s * math.cos(phi), s * math.sin(phi)
                else:
                    x, y = disk((pick.randrange(16) + .5) / 16, (pick.randrange(16) + .5) / 16)
                if math.hypot(x, y) < .9:
                    vectors.append((x, y, math.sqrt(1 - x * x - y * y) * (1 if transmitted else pick.choice((-1, 1)))))
            for v, ours in zip(vectors, dhr(model, vectors)):
                theta, phi = math.degrees(math.acos(v[2])), math.degrees(math.atan2(v[1], v[0]))
                for transmit in (1,) if transmitted else (0, 1):
                    hemi = reader.direct_hemi(data, theta, phi,
                                              reader.SAMPLE_ALL & ~(reader.SAMPLE_R if transmit else reader.SAMPLE_T))
                    self.assertLess(abs(hemi / ours[transmit] - 1), .01, (name, v, transmit))

    def lobes(self, name, value):
        """The exit of each component is where it is largest: none is mirrored or on the wrong side."""
        grid = [disk((x + .5) / 32, (y + .5) / 32) for x in range(32) for y in range(32)]
        command = KINDS[name][1]
        for component, front_in, front_out, exit_, _ in COMPONENTS:
            if "-c" in command and component not in command[-1]:
                continue
            incident = vector(20, 35)
            incident = (incident[0], incident[1], incident[2] if front_in else -incident[2])
            pairs = [(incident, (x, y, math.sqrt(1 - x * x - y * y) * (1 if front_out else -1))) for x, y in grid]
            f = value(pairs)
            top = [grid[n] for n in range(len(f)) if f[n] > .8 * max(f)]
            middle = [sum(p[k] for p in top) / len(top) for k in (0, 1)]
            self.assertLess(math.dist(middle, exit_), .15, (name, component))

    @NEEDS_STOCK
    def test_lobes(self):
        for name in "tree4.xml", "half.xml", "quarter.xml", "window.xml":
            self.lobes(name, lambda pairs, name=name: [read(load(self.xml[name]), a, b) for a, b in pairs])

    @NEEDS_STOCK
    def test_matrix_tools(self):
        """rmtxop and dctimestep take a matrix's transmission from the back, each patch times its projected solid angle."""
        with open(self.xml["window.xml"]) as f:
            expected = matrix(blocks(f.read())[3][2])
        found = numbers(tool(STOCK, "rmtxop", "-fa", self.xml["window.xml"]))
        for o in range(0, 145, 6):
            for i in range(0, 145, 6):
                self.assertAlmostEqual(found[o][i], expected[o][i] * OMEGA[i], delta=1e-4 + 1e-3 * found[o][i])

    def folder(self, name, text):
        path = os.path.join(self.place.name, name)
        with open(path, "w") as out:
            out.write(text)
        return path

    @unittest.skipUnless(reader and os.path.exists(os.path.join(PATCHED, "rtrace")), "no pyradiance or no patched Radiance")
    def test_three_phase(self):
        """View matrix, daylight matrix and Klems matrix by stock tools, against the patched rtrace with the interpolant."""
        pane = "polygon w\n0\n0\n12 -.5 0 1  .5 0 1  .5 0 2  -.5 0 2\n"
        source = "{0} source {0}s\n0\n0\n4 0 0 {1} 180\n"
        receiver = "#@rfluxmtx h=u u=Y\nvoid glow {0}\n0\n0\n4 1 1 1 0\n" + source
        window = self.folder("win.rad", "#@rfluxmtx h=kf u=Z\nvoid glow win\n0\n0\n4 1 1 1 0\nwin " + pane)
        sky = self.folder("sky.rad", receiver.format("ground", -1) + receiver.format("sky", 1))
        far = self.folder("far.rad", "void plastic black\n0\n0\n5 0 0 0 0 0\nblack sphere far\n0\n0\n4 0 0 -900 .1\n")
        light = self.folder("light.txt", "#?RADIANCE\nNROWS=2\nNCOLS=1\nNCOMP=3\nFORMAT=ascii\n\n.3 .3 .3\n1 1 1\n")
        direct = self.folder("direct.rad", f"void BSDF pane\n6 0 {self.model['iso']} 0 0 1 .\n0\n0\npane " + pane + "".join(
            f"void glow {n}\n0\n0\n4 {v} {v} {v} 0\n" + source.format(n, z) for n, v, z in (("ground", .3, -1), ("sky", 1, 1))))
        pick = random.Random(2)
        for eye in (-.4, -1.5, .6), (.6, -1.2, 2.4):  # what shines through is mostly sky, mostly ground
            rays = [(*eye, pick.random() - .5 - eye[0], -eye[1], 1 + pick.random() - eye[2]) for _ in range(1000)]
            text = "".join(" ".join(map(str, r)) + "\n" for r in rays).encode()
            view = self.folder("view.mtx", "")
            with open(view, "wb") as out:
                out.write(tool(STOCK, "rfluxmtx", "-V-", "-ab", 0, "-w", "-faa", "-y", len(rays), "-", window, far, stdin=text))
            daylight = self.folder("daylight.mtx", "")
            with open(daylight, "wb") as out:
                out.write(tool(STOCK, "rfluxmtx", "-ab", 1, "-c", 400, window, sky, far))
            phases = numbers(tool(STOCK, "dctimestep", view, self.xml["full.xml"], daylight, light))
            octree = self.folder("direct.oct", "")
            with open(octree, "wb") as out:
                out.write(tool(PATCHED, "oconv", direct))
            traced = tool(PATCHED, "rtrace", "-h", "-ab", 1, "-aa", 0, "-ad", 64, "-lw", 1e-6, "-st", 0, "-ss", 16, "-w", octree, stdin=text)
            mean = [sum(float(line.split()[0]) for line in traced.decode().splitlines()) / len(rays), sum(map(sum, phases)) / len(rays)]
            self.assertLess(abs(mean[1] / mean[0] - 1), .02, eye)

    @unittest.skipUnless(pywincalc, "no pywincalc")
    def test_pywincalc(self):
        """WINDOW's engine finds our reflectance and transmittance on both sides; its front is our back."""
        product = pywincalc.parse_bsdf_xml_file(self.xml["window.xml"])
        self.assertEqual((product.thickness, product.product_name), (.003, "four sides"))
        self.assertEqual(product.measurements.solar.transmittance_back.data, product.measurements.visible.transmittance_back.data)
        system = pywincalc.GlazingSystem(solid_layers=[product],
                                         bsdf_hemisphere=pywincalc.BSDFHemisphere.create(pywincalc.BSDFBasisType.FULL))
        theta, phi = patch(30)
        results = system.optical_method_results("PHOTOPIC", theta, phi).system_results  # takes 5 s
        for found, z in (results.back, 1), (results.front, -1):
            # the mean over the patch; incident vectors have its x and y negated
            points = [vector(theta + t, phi + 180 + p) for t in (-2.9, 2.9) for p in (-5, 5)]
            ours = dhr(self.model["sides"], [(x, y, z * c) for x, y, c in points])
            for k, theirs in enumerate((found.reflectance.direct_hemispherical, found.transmittance.direct_hemispherical)):
                self.assertLess(abs(theirs / sum(d[k] for d in ours) * 4 - 1), .005, (z, k))

    @unittest.skipUnless(BSDF, "no honeybee-radiance")
    def test_honeybee(self):
        for name, basis in ("tree3.xml", "TensorTree"), ("tree4.xml", "TensorTree"), ("window.xml", "Klems Full"), \
                ("half.xml", "Klems Half"), ("quarter.xml", "Klems Quarter"), ("embed.xml", "TensorTree"):
            self.assertEqual(BSDF(self.xml[name]).angle_basis, basis, name)


if __name__ == "__main__":
    unittest.main()
