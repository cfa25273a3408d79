#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One file for everybody: XML that carries an interpolant, or points to one. Stock Radiance programs read the tree or matrix,
the patched Radiance evaluates the interpolant, and falls back where it is missing or changed. And trees on demand (BSDFRBF_FORM)."""
import glob
import os
import shutil
import subprocess
import sys
import unittest

import numpy as np
import pyradiance

BUILD = os.environ.get("BUILD_DIR", os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "build"))
RADIANCE = os.path.join(BUILD, "radiance", "bin")
WORK = os.path.join(BUILD, "test", "carrier")
STOCK = os.path.join(os.path.dirname(pyradiance.__file__), "bin")
NEEDS_RADIANCE = unittest.skipUnless(os.path.exists(os.path.join(RADIANCE, "rtrace")), "Radiance was not built")


def run(program, *arguments, stdin=b"", **environment):
    folder = next(f for f in (os.path.join(BUILD, "bin"), RADIANCE, STOCK) if os.path.exists(os.path.join(f, program)))
    environment = {**os.environ, "RAYPATH": f".:{BUILD}/radiance/lib", **environment}
    done = subprocess.run([os.path.join(folder, program), *map(str, arguments)], input=stdin, cwd=WORK, capture_output=True, env=environment)
    if done.returncode:
        raise AssertionError(f"{program} {arguments}: {done.stderr.decode()[-600:]}")
    return done


def command(name, **environment):
    """rtrace of a square under a small sun, and the rays that look at it."""
    with open(os.path.join(WORK, "one.rad"), "w") as file:
        file.write("void light l 0 0 3 1e5 1e5 1e5\nl source sun 0 0 4 .45 .1 .88 .2\n"
                   f"void BSDF m 6 0 {name} 0 1 0 . 0 0\nm polygon p 0 0 12 -1 -1 0 1 -1 0 1 1 0 -1 1 0\n")
    with open(os.path.join(WORK, "one.oct"), "wb") as file:
        file.write(run("oconv", "one.rad").stdout)
    rays = [[0, 0, 0, -x, -y, .8] for x in (-.5, -.45, -.3, 0, .2) for y in (-.2, -.1, 0, .3)]
    return ["rtrace", "-h", "-fff", "-w", "-ab", 0, "-dj", 0, "-ds", 0, "-ss", 0, "one.oct"], np.array([[-3 * r for r in ray[3:]] + ray[3:] for ray in rays], "<f4").tobytes()


def see(name, **environment):
    """Values, and what was said on standard error."""
    arguments, rays = command(name)
    done = run(*arguments, stdin=rays, **environment)
    return np.frombuffer(done.stdout, "<f4")[::3], done.stderr.decode()


def stock(name):
    """Values that the stock reader sees."""
    data = pyradiance.bsdf.load_file(os.path.join(WORK, name))
    return np.array([sum(pyradiance.bsdf.query(data, *angles(x, y), *angles(.45, .1, True))) for x in (-.4, 0, .3) for y in (-.2, .1)])


def angles(x, y, behind=False):
    theta = np.degrees(np.arcsin(np.hypot(x, y)))
    return 180 - theta if behind else theta, np.degrees(np.arctan2(y, x))


def edit(name, change):
    path = os.path.join(WORK, name)
    with open(path, "rb") as file:
        data = change(file.read())
    os.unlink(path)
    with open(path, "wb") as file:
        file.write(data)


class Carrier(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        os.makedirs(WORK)
        os.makedirs(os.path.join(WORK, "away"))
        run("goniometer", "translucent", "in")
        files = sorted(glob.glob(os.path.join(WORK, "in", "*.txt")))
        run("mkrbf", "-q", "-l", 60, "-o", "a-b.rbf", *files)
        run("mkrbf", "-q", "-l", 40, "-o", "other.rbf", *files)
        for name, program, options in (("tree.xml", "rbf2ttree", ["-g", 4]), ("klems.xml", "rbf2klems", ["-b", "quarter"])):
            run(program, *options, "-o", name, "a-b.rbf")
            run(program, *options, "-embed", "-o", "embed-" + name, "a-b.rbf")
            run(program, *options, "-link", "-o", "link-" + name, "a-b.rbf")
            run(program, *options, "-link", "-o", "away/link-" + name, "a-b.rbf")

    def test_our_programs(self):
        """They take the XML as they take the record."""
        pairs = b"0 .6 .8 0 -.6 .8\n.3 .1 .9487 -.2 .1 .97\n"
        want = run("rbfquery", "a-b.rbf", stdin=pairs).stdout
        for name in ("embed-tree.xml", "link-klems.xml", "away/link-tree.xml"):
            self.assertEqual(run("rbfquery", name, stdin=pairs).stdout, want, name)
        self.assertIn(b"translucent", run("rbfinfo", "embed-klems.xml").stdout)
        run("rbf2klems", "-b", "quarter", "-embed", "-o", "again.xml", "embed-klems.xml")
        with open(os.path.join(WORK, "again.xml")) as again, open(os.path.join(WORK, "embed-klems.xml")) as first:
            self.assertTrue(again.read().split("-->", 1)[1] == first.read().split("-->", 1)[1])

    def test_stock_reader(self):
        for name in ("tree.xml", "klems.xml"):
            want = stock(name)
            self.assertGreater(want.min(), 0)
            for kind in ("embed-", "link-"):
                np.testing.assert_array_equal(stock(kind + name), want)

    def test_stock_matrix_programs(self):
        """dctimestep and rmtxop read the matrix."""
        want = run("rmtxop", "-fa", "klems.xml").stdout.split(b"\n\n", 1)[1]
        self.assertGreater(len(want.split()), 41 * 41)
        for name, rows, columns in (("view", 1, 41), ("daylight", 41, 2), ("sky", 2, 1)):
            with open(os.path.join(WORK, name + ".mtx"), "w") as file:
                file.write(f"#?RADIANCE\nNROWS={rows}\nNCOLS={columns}\nNCOMP=3\nFORMAT=ascii\n\n"
                           + "".join(f"{1 + i % 3} {1 + i % 5} 2\n" for i in range(rows * columns)))

        def daylight(matrix):
            return [float(x) for x in run("dctimestep", "-h", "view.mtx", matrix, "daylight.mtx", "sky.mtx").stdout.split()[-3:]]
        self.assertGreater(min(daylight("klems.xml")), 0)
        for kind in ("embed-", "link-"):
            self.assertEqual(run("rmtxop", "-fa", kind + "klems.xml").stdout.split(b"\n\n", 1)[1], want)
            self.assertEqual(daylight(kind + "klems.xml"), daylight("klems.xml"))

    @NEEDS_RADIANCE
    def test_patched_radiance(self):
        want = see("a-b.rbf")[0]
        for name in ("tree.xml", "klems.xml"):
            plain = see(name)[0]
            self.assertGreater(np.abs(plain - want).max(), .01 * want.max())
            for kind in ("embed-", "link-", "away/link-"):
                values, said = see(kind + name)
                np.testing.assert_array_equal(values, want, kind + name)
                self.assertEqual(said, "")

    @NEEDS_RADIANCE
    def test_falls_back(self):
        plain = see("klems.xml")[0]

        def falls_back(name, word):
            values, said = see(name)
            np.testing.assert_array_equal(values, plain)
            self.assertIn("warning - BSDF", said)
            self.assertIn(word, said)
        os.makedirs(os.path.join(WORK, "moved"), exist_ok=True)
        shutil.copy(os.path.join(WORK, "link-klems.xml"), os.path.join(WORK, "moved/x.xml"))
        falls_back("moved/x.xml", "moved/a-b.rbf")
        shutil.copy(os.path.join(WORK, "other.rbf"), os.path.join(WORK, "moved/a-b.rbf"))
        falls_back("moved/x.xml", "is not what the XML was made with")
        shutil.copy(os.path.join(WORK, "a-b.rbf"), os.path.join(WORK, "moved/a-b.rbf"))
        np.testing.assert_array_equal(see("moved/x.xml")[0], see("a-b.rbf")[0])
        for n, change in enumerate((lambda data: data[:-4000] + b"Z" * 50 + data[-3950:], lambda data: data[:-4000] + data[-3900:],
                                    lambda data: data[:-4000] + b"!" + data[-3999:], lambda data: data.replace(b"bsdfrbf record", b"another")
                                    )):
            shutil.copy(os.path.join(WORK, "embed-klems.xml"), os.path.join(WORK, f"broken{n}.xml"))
            edit(f"broken{n}.xml", change)
            falls_back(f"broken{n}.xml", "damaged")
        edit("broken0.xml", lambda data: data.replace(b"bytes=", b"bytes=x"))
        values, said = see("broken0.xml")  # what cannot be read as a mark is a comment
        np.testing.assert_array_equal(values, plain)
        self.assertEqual(said, "")
        shutil.copy(os.path.join(WORK, "embed-klems.xml"), os.path.join(WORK, "dos.xml"))
        edit("dos.xml", lambda data: data.replace(b"\n", b"\r\n"))  # as mail and version control may do
        np.testing.assert_array_equal(see("dos.xml")[0], see("a-b.rbf")[0])

    def test_refusals(self):
        for arguments, word in ((("rbf2ttree", "-embed", "-link", "a-b.rbf"), "not both"), (("rbf2ttree", "-link", "embed-tree.xml"), "'-link'"),
                                (("rbfinfo", "tree.xml"), "nor XML that carries one")):
            with self.assertRaises(AssertionError) as caught:
                run(*arguments)
            self.assertIn(word, str(caught.exception))

    @NEEDS_RADIANCE
    def test_tree_on_demand(self):
        cache = os.path.join(WORK, "cache")
        want = see("tree.xml")[0]
        for name in ("a-b.rbf", "embed-klems.xml"):
            values, said = see(name, BSDFRBF_FORM="ttree:4", XDG_CACHE_HOME=cache)
            np.testing.assert_array_equal(values, want)
            self.assertEqual(said, "")
        kept = os.listdir(os.path.join(cache, "bsdfrbf"))
        self.assertEqual(len(kept), 1)
        path = os.path.join(cache, "bsdfrbf", kept[0])
        before = os.stat(path)
        see("a-b.rbf", BSDFRBF_FORM="ttree:4", XDG_CACHE_HOME=cache)
        self.assertEqual((os.stat(path).st_ino, os.stat(path).st_mtime_ns), (before.st_ino, before.st_mtime_ns))
        np.testing.assert_array_equal(see("a-b.rbf", BSDFRBF_FORM="direct", XDG_CACHE_HOME=cache)[0], see("a-b.rbf")[0])
        see("other.rbf", BSDFRBF_FORM="ttree", XDG_CACHE_HOME=cache)
        self.assertEqual(len(os.listdir(os.path.join(cache, "bsdfrbf"))), 2)
        # no folder: in memory
        with open(os.path.join(WORK, "file"), "w"):
            pass
        np.testing.assert_array_equal(see("a-b.rbf", BSDFRBF_FORM="ttree:4", XDG_CACHE_HOME=os.path.join(WORK, "file"))[0], want)
        with self.assertRaises(AssertionError) as caught:
            see("a-b.rbf", BSDFRBF_FORM="tree", XDG_CACHE_HOME=cache)
        self.assertIn("BSDFRBF_FORM", str(caught.exception))

    @NEEDS_RADIANCE
    def test_two_at_once(self):
        """Processes that start together share one tree, and none sees half of it; rtrace -n forks before it loads."""
        cache = os.path.join(WORK, "together")
        want = see("tree.xml")[0]
        arguments, rays = command("a-b.rbf")
        environment = {**os.environ, "RAYPATH": f".:{BUILD}/radiance/lib", "BSDFRBF_FORM": "ttree:4", "XDG_CACHE_HOME": cache}
        started = [subprocess.Popen([os.path.join(RADIANCE, "rtrace"), *map(str, arguments[1:-1]), "-n", "2", arguments[-1]], cwd=WORK, env=environment,
                                    stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(3)]
        for process in started:
            process.stdin.write(rays)
            process.stdin.close()
        for process in started:
            np.testing.assert_array_equal(np.frombuffer(process.stdout.read(), "<f4")[::3], want)
            process.stdout.close()
            self.assertEqual(process.wait(), 0)
        self.assertEqual(len(os.listdir(os.path.join(cache, "bsdfrbf"))), 1)


if __name__ == "__main__":
    unittest.main()
