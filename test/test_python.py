#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Python module, installed with pip from the sources: its answers are rbfquery's, samples weigh what DHR tells, what is
built is what mkrbf builds, and every refusal is an exception with the library's message."""
import ctypes
import glob
import os
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings

BUILD, SOURCE = os.environ["BUILD_DIR"], os.environ["SOURCE_DIR"]
BIN = os.path.join(BUILD, "bin")
SITE = os.path.join(BUILD, "python", "site")
installed = subprocess.run(
    [sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--no-index", "--no-deps", "--no-build-isolation",
     "--upgrade", "--target", SITE, "--config-settings", "build-dir=" + os.path.join(BUILD, "python", "build"), SOURCE],
    capture_output=True, text=True)
if installed.returncode:
    sys.exit(installed.stdout + installed.stderr)
sys.path.insert(0, SITE)
os.environ.pop("BSDFRBF_LIBRARY", None)

import numpy as np  # noqa: E402

import bsdfrbf  # noqa: E402


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, **options).stdout


def directions(count, seed, sign=1):
    """Evenly spread over one hemisphere, float32."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(.05, 1, count), rng.uniform(0, 2 * np.pi, count)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(phi), s * np.sin(phi), sign * z], -1).astype(np.float32)


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.files, cls.path, cls.model = {}, {}, {}
        for name, options in (("satin", ()), ("film", ("-xyz",))):
            folder = os.path.join(cls.folder.name, name)
            os.mkdir(folder)
            run(os.path.join(BIN, "goniometer"), "-samples", "500", "700", *options, name, folder)
            cls.files[name] = sorted(glob.glob(folder + "/*.txt"))
            cls.path[name] = folder + ".rbf"
            run(os.path.join(BIN, "mkrbf"), "-q", "-o", cls.path[name], *cls.files[name])
            cls.model[name] = bsdfrbf.open(cls.path[name])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def query(self, name, rows, *options):
        said = run(os.path.join(BIN, "rbfquery"), "-ff", *options, self.path[name], input=np.ascontiguousarray(rows).tobytes())
        return np.frombuffer(said, np.float32)

    def test_installed(self):
        self.assertTrue(bsdfrbf.__file__.startswith(SITE), bsdfrbf.__file__)
        self.assertEqual("rbfquery " + bsdfrbf.__version__, run(os.path.join(BIN, "rbfquery"), "--version").decode().split("\n")[0])
        self.assertEqual((self.model["satin"].components, self.model["satin"].channels, self.model["satin"].name), (("tf",), 1, "satin"))
        self.assertEqual((self.model["film"].components, self.model["film"].channels), (("rf",), 3))
        info = self.model["satin"].info("tf")
        self.assertEqual((info["incidences"], info["theta_max_deg"]), (11, 80))
        self.assertAlmostEqual(sum(info["frames"].values()), 1, 3)

    def test_layout(self):
        """What the library fills in is what the module takes it for, to the byte."""
        from bsdfrbf import _library
        room = (ctypes.c_ubyte * 4096)(*[0xA5] * 4096)
        _library.c.get_component_info(self.model["satin"]._pointer, bsdfrbf._component("tf"), ctypes.cast(room, ctypes.POINTER(_library.ComponentInfo)))
        self.assertEqual(len(bytes(room).rstrip(b"\xa5")), ctypes.sizeof(_library.ComponentInfo))

    def test_values(self):
        for name, sign, options in (("satin", -1, ()), ("film", 1, ("-c",))):
            model = self.model[name]
            i, o = directions(500, 1), directions(500, 2, sign)
            want = self.query(name, np.hstack([i, o]), *options).reshape(500, -1)
            self.assertGreater(want.min(), 0)
            np.testing.assert_allclose(model.eval(i, o), want, 1e-5)
            # broadcasting, one incidence, other types and orders, other lengths
            grid = model.eval(i[:4, None], o[None, :7])
            self.assertEqual(grid.shape, (4, 7, model.channels))
            np.testing.assert_array_equal(grid, model.eval(np.repeat(i[:4], 7, 0), np.tile(o[:7], (4, 1))).reshape(grid.shape))
            np.testing.assert_allclose(model.eval(i[3], o), model.eval(i[3:4].repeat(500, 0), o), 1e-5)
            np.testing.assert_allclose(model.eval(list(map(float, 3 * i[0])), np.asfortranarray(o[:5].astype(float))), model.eval(i[0], o[:5]), 1e-4)
            self.assertEqual(model.eval(i[0], o[0]).shape, (model.channels,))
            self.assertEqual(model.eval(i[:0], o[:0]).shape, (0, model.channels))
            self.assertEqual(model.eval(i[0], -o[0])[0], 0)  # the other side, which was not measured

    def test_dhr(self):
        for name, options, sign in (("satin", (), 1), ("film", ("-c",), 1), ("satin", (), -1)):
            model, i = self.model[name], directions(20, 3, sign)
            n = model.channels
            want = self.query(name, i, "-d", *options).reshape(20, 2, n)
            np.testing.assert_allclose(model.dhr(i), want[:, 0], 1e-5)
            np.testing.assert_allclose(model.dhr(i.reshape(4, 5, 3), transmit=True), want[:, 1].reshape(4, 5, n), 1e-5)
        self.assertGreater(want[:, 1].min(), .3)  # by reciprocity

    def test_samples(self):
        u = (np.arange(4000) + .5) / 4000
        for name, component, y in (("satin", "tf", 0), ("film", "rf", 1)):
            model = self.model[name]
            transmit = component == "tf"
            for i in directions(3, 4):
                o = model.sample(i, u, transmit)
                self.assertEqual((o.shape, o.dtype), ((4000, 3), np.float32))
                np.testing.assert_allclose(np.linalg.norm(o, axis=1), 1, 1e-4)
                self.assertEqual(set(np.sign(o[:, 2])), {-1. if transmit else 1.})
                diffuse = model.lambertian(component)
                weight = (model.eval(i, o) - diffuse / np.pi) * abs(o[:, 2:]) / model.pdf(i, o)[:, None]
                np.testing.assert_allclose(weight.mean(0) + diffuse, model.dhr(i, transmit), 1e-2)
                # importance: the luminance of every sample weighs the same
                np.testing.assert_allclose(weight[:, y], model.dhr(i, transmit)[y] - diffuse[y], .02)
                # distributed by their density: a moment by samples and by quadrature over the hemisphere
                z, phi = np.meshgrid((np.arange(200) + .5) / 200, (np.arange(400) + .5) * np.pi / 200)
                s = np.sqrt(1 - z * z)
                grid = np.stack([s * np.cos(phi), s * np.sin(phi), -z if transmit else z], -1)
                moment = (model.pdf(i, grid)[..., None] * grid).mean((0, 1)) * 2 * np.pi
                np.testing.assert_allclose(o.mean(0), moment, atol=.01)

    def test_build(self):
        stages = []
        model = bsdfrbf.build(self.files["satin"], progress=lambda stage, done: stages.append((stage, done)))
        self.assertTrue(stages and all(0 <= done <= 1 for _, done in stages))
        i, o = directions(50, 5), directions(50, 6, -1)
        np.testing.assert_array_equal(model.eval(i, o), self.model["satin"].eval(i, o))
        path = os.path.join(self.folder.name, "again.rbf")
        bsdfrbf.build(bsdfrbf.Data(self.files["satin"]), "isotropic", name="again").save(path)
        self.assertEqual(bsdfrbf.open(path).name, "again")

    def test_arrays(self):
        read, data = bsdfrbf.Data(self.files["satin"]), bsdfrbf.Data()
        self.assertEqual((data.channels, read.channels, read.incidences("tf"), read.incidences("rf")), (0, 1, 11, 0))
        for k in range(read.incidences("tf")):
            direction, outgoing, dsf = read.samples("tf", k)
            self.assertEqual((direction.shape, outgoing.shape[1], dsf.shape), ((3,), 3, (len(outgoing), 1)))
            data.add(direction, outgoing * [1, 1, -1], dsf, "dsf")
        self.assertEqual(data.incidences("tf"), 11)
        i, o = directions(50, 7), directions(50, 8, -1)
        np.testing.assert_allclose(bsdfrbf.build(data, "isotropic").eval(i, o), bsdfrbf.build(read, "isotropic").eval(i, o), 1e-2)

    def refused(self, status, text, call, *arguments):
        with self.assertRaises(bsdfrbf.Error) as caught:
            call(*arguments)
        self.assertEqual(caught.exception.status, status)
        self.assertIn(text, str(caught.exception))

    def test_refusals(self):
        golden, model = os.path.join(SOURCE, "test", "golden"), self.model["satin"]
        self.refused("io", "nowhere.rbf", bsdfrbf.open, "nowhere.rbf")
        self.refused("format", "bad-byte.rbf", bsdfrbf.open, os.path.join(golden, "bad-byte.rbf"))
        self.refused("io", "/nowhere", model.save, "/nowhere/x.rbf")
        self.refused("data", "", bsdfrbf.build, bsdfrbf.Data())
        wrong = os.path.join(self.folder.name, "wrong.txt")
        with open(wrong, "w") as file:
            file.write("#format: theta phi BTDF\n#intheta 0\n#inphi 0\n170 0 nonsense\n")
        self.refused("syntax", "wrong.txt:4", bsdfrbf.build, [wrong])
        self.refused("cancelled", "", lambda: bsdfrbf.build(self.files["satin"], progress=lambda stage, done: True))
        self.refused("data", "", bsdfrbf.Data().add, [0, 0, 1], [[0, 0, 1]], [np.nan])
        with self.assertRaises(KeyboardInterrupt):
            def stop(stage, done):
                raise KeyboardInterrupt
            bsdfrbf.build(self.files["satin"], progress=stop)
        for call, arguments in ((model.eval, ([0, 1], [0, 0, 1])), (model.eval, (directions(3, 1), directions(4, 1))),
                                (model.sample, (1., .5)), (model.lambertian, ("tx",)), (model.info, ("rf",)),
                                (bsdfrbf.Data().add, ([0, 0, 1], [[0, 0, 1]], [1, 2])), (bsdfrbf.build, ([], "round"))):
            with self.assertRaises(ValueError):
                call(*arguments)
        with self.assertRaises(IndexError):
            bsdfrbf.Data().samples("rf", 0)

    def test_warnings(self):
        """What the library warns of comes as a warning of the line that called."""
        short = os.path.join(self.folder.name, "short.txt")
        with open(self.files["satin"][0]) as whole, open(short, "w") as file:
            file.write("#datapoints_in_file: 9000\n" + whole.read())
        for call in (lambda: bsdfrbf.Data().read(short), lambda: bsdfrbf.Data([short])):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                call()
            self.assertEqual([w.filename for w in caught], [__file__])
            self.assertIn("short.txt", str(caught[0].message))
            self.assertIn("datapoints_in_file", str(caught[0].message))

    def test_threads(self):
        """While the library works, another thread runs."""
        i, o = directions(200000, 9), directions(200000, 10, -1)
        want = self.model["satin"].eval(i, o)
        answers, counted, done = [], 0, threading.Event()

        def work():
            for _ in range(3):
                answers.append(self.model["satin"].eval(i, o))
            done.set()

        thread = threading.Thread(target=work)
        thread.start()
        while not done.is_set():
            counted += 1
            time.sleep(1e-3)
        thread.join()
        self.assertGreater(counted, 20)
        for answer in answers:
            np.testing.assert_array_equal(answer, want)


unittest.main()
