#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What has nothing to do with our files renders as before, bit by bit: patched programs against the same sources unpatched.

A room with one thing of nearly every material that Radiance has, among them BSDF and aBSDF with tensor trees and Klems
matrices, seen by rpict and rtrace. (Radiance's own render tests are not in the packaged sources.)"""
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD = os.path.abspath(os.environ["BUILD_DIR"])
PATCHED, UNPATCHED = os.path.join(BUILD, "radiance", "bin"), os.path.join(BUILD, "radiance", "test")
FABRIC = os.path.join(os.environ.get("SHARED_DIR", ""), "data", "xml", "mecho6216_klems_aniso_high.xml")

LIGHTS = """
void light lamp 0 0 3 30 30 25
lamp sphere lamp1 0 0 4 3 2 4.5 .2
void spotlight spot 0 0 7 200 200 200 60 -1 -1 -2
spot ring spot1 0 0 8 4.5 4.5 4.8 -1 -1 -2 0 .1
void light sunlight 0 0 3 9e4 8e4 7e4
sunlight source sun 0 0 4 .3 -.8 .9 .53
void brightfunc skybright 2 2+Dz+.5*Dx . 0 0
skybright glow sky 0 0 4 1 1 1.2 0
sky source skydome 0 0 4 0 0 1 180
void illum pane 0 0 3 2 2 2
"""
MATERIALS = [  # thirty things on a grid, each with the material that precedes it
    "void plastic m 0 0 5 .5 .4 .3 .03 .05", "void metal m 0 0 5 .8 .7 .4 .9 .1", "void trans m 0 0 7 .6 .6 .6 .05 .1 .7 .3",
    "void plastic2 m 4 0 0 1 . 0 6 .4 .5 .6 .1 .05 .2", "void metal2 m 4 0 0 1 . 0 6 .7 .7 .7 .8 .05 .3",
    "void trans2 m 4 0 0 1 . 0 8 .6 .7 .6 .08 .05 .2 .6 .4", "void ashik2 m 4 0 0 1 . 0 8 .2 .2 .2 .4 .4 .4 20 200",
    "void glass m 0 0 3 .9 .95 .9", "void dielectric m 0 0 5 .9 .9 .9 1.5 0", "void mirror m 0 0 3 .9 .9 .9", "void antimatter m 1 void 0 0",
    "void interface m 0 0 8 .9 .9 .9 1.5 .8 .8 1 1.33", "void prism1 m 5 .8 0 0 -1 . 0 0", "void mist m 0 0 7 .05 .05 .05 .5 .5 .5 .4",
    "void texfunc t 4 .1*sin(9*Px) 0 .1*cos(7*Pz) . 0 0\nt plastic m 0 0 5 .5 .5 .5 .05 0",
    "void colorfunc c 4 .5+.4*sin(Px*9) .5 .7 . 0 0\nc plastic m 0 0 5 .5 .5 .5 0 0",
    "void plastic a 0 0 5 .8 .1 .1 0 0\nvoid plastic b 0 0 5 .1 .1 .8 0 0\nvoid mixfunc m 4 a b .5 . 0 0",
    "void BRTDfunc m 10 .1 .1 .1 .2 .2 .2 0 0 0 . 0 9 .3 .3 .3 .2 .2 .2 .1 .1 .1", "void plasfunc m 2 lobe lobe.cal 0 4 .3 .4 .5 .1",
    "void transfunc m 2 lobe lobe.cal 0 6 .5 .5 .5 .1 .5 .2", "void glow m 0 0 4 .2 .1 .1 0",
    "void BSDF m 6 0 tree4.xml 0 0 1 . 0 0", "void BSDF m 6 0 tree3.xml 0 1 0 . 0 0", "void aBSDF m 5 tree3.xml 0 0 1 . 0 0", "void BSDF m 6 0 klems.xml 0 0 1 . 0 0",
    "void aBSDF m 5 klems.xml 0 0 1 . 0 0", "void BSDF m 6 .1 tree4.xml 0 0 1 . 0 9 .1 .1 .1 .1 .1 .1 .05 .05 .05",
    "void BSDF m 6 0 fabric.xml 0 0 1 . 0 0", "void aBSDF m 5 fabric.xml 0 0 1 . 0 0", "void BSDF m 6 -.1 colour3.xml 0 0 1 . 0 0"]
VIEW = "-vp 3 -4.5 2.6 -vd 0 1 -.1 -vu 0 0 1 -vh 62 -vv 50 -x 90 -y 72 -ps 2 -pt .04 -ab 2 -ad 48 -as 16 -aa .2 -ar 32 -lr 6 -ss 2 -ds .2 -dj .6 -st .02 -u-".split()  # -u-: the same random numbers in every run


def run(program, *arguments, folder, stdin=b"", **environment):
    done = subprocess.run([program, *map(str, arguments)], input=stdin, capture_output=True, cwd=folder,
                          env={**os.environ, "RAYPATH": f".:{BUILD}/radiance/lib", **environment})
    if done.returncode:
        raise AssertionError(f"{program} {arguments}: {done.returncode}: {done.stderr.decode()[-800:]}")
    return done.stdout


def thing(n, material):
    """A sphere, a panel or a box, on a grid of five rows in a room of 6 x 6 x 5."""
    x, y, z = .6 + n % 6, 1 + .9 * (n // 6), .5 + .95 * (n // 6)
    name = f"m{n}"
    material = material.replace(" m ", f" {name} ").replace("t plastic", f"t{n} plastic").replace("texfunc t ", f"texfunc t{n} ")
    if "BSDF" in material or n % 3 == 1:
        shape = f"polygon p{n} 0 0 12 {x - .4} {y} {z - .4}  {x + .4} {y} {z - .4}  {x + .4} {y + .2} {z + .4}  {x - .4} {y + .2} {z + .4}"
    else:
        shape = f"sphere p{n} 0 0 4 {x} {y} {z} .38"
    return f"{material}\n{name} {shape}\n"


class Unchanged(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.work)
        cls.pinned = os.path.join(cls.work, "pinned.so")
        run(os.environ.get("CC", "cc"), "-O1", "-shared", "-fPIC", "-o", cls.pinned,
            os.path.join(os.path.dirname(os.path.abspath(__file__)), "peer", "pinned.c"), "-ldl", folder=cls.work)
        ours = os.path.join(BUILD, "bin")
        for name, options, xml in (("redirect", ["-every", "9", "-samples", "100", "200"], "tree4.xml"), ("satin", ["-every", "2", "-samples", "100", "200"], "tree3.xml"), ("film", ["-every", "2", "-samples", "100", "200"], "colour3.xml")):
            folder = os.path.join(cls.work, name)
            run(f"{ours}/goniometer", *options, name, name, folder=cls.work)
            run(f"{ours}/mkrbf", "-q", "-l", 40, "-o", name + ".rbf", *sorted(glob.glob(folder + "/*.txt")), folder=cls.work)
            run(f"{ours}/rbf2ttree", "-g", 4, "-o", xml, name + ".rbf", folder=cls.work)
        run(f"{ours}/rbf2klems", "-o", "klems.xml", "redirect.rbf", folder=cls.work)
        shutil.copy(FABRIC if os.path.exists(FABRIC) else os.path.join(cls.work, "klems.xml"), os.path.join(cls.work, "fabric.xml"))
        for xml in glob.glob(cls.work + "/*.rbf"):
            os.unlink(xml)  # nothing of ours is left
        with open(os.path.join(cls.work, "lobe.cal"), "w") as file:
            file.write("lobe(x, y, z, d) = .2 + .3 * z * z;")
        walls = "".join(f"void plastic wall 0 0 5 .6 .6 .5 0 0\nwall polygon w{n} 0 0 12 {p}\n" for n, p in enumerate(
            ("-1 -5 0 7 -5 0 7 6 0 -1 6 0", "-1 6 0 7 6 0 7 6 5 -1 6 5", "-1 -5 0 -1 6 0 -1 6 5 -1 -5 5")))
        with open(os.path.join(cls.work, "room.rad"), "w") as file:
            file.write(LIGHTS + walls + "".join(map(thing, range(len(MATERIALS)), MATERIALS)))
        with open(os.path.join(cls.work, "room.oct"), "wb") as file:
            file.write(run(f"{PATCHED}/oconv", "room.rad", folder=cls.work))

    def both(self, program, *arguments, stdin=b"", only=None):
        """Output without the header, of the patched (0) and of the unpatched program (1)."""
        out = [run(path, *arguments, folder=self.work, stdin=stdin, LD_PRELOAD=self.pinned) for path in
               (f"{PATCHED}/{program}", f"{UNPATCHED}/unpatched-{program}")[slice(None) if only is None else slice(only, only + 1)]]
        return [data.split(b"\n\n", 1)[1] for data in out]

    def test_pictures(self):
        for more in ([], ["-ab", 0, "-dv-"], ["-i"]):
            patched, unpatched = self.both("rpict", *VIEW, *more, "room.oct")
            self.assertGreater(len(set(patched)), 200)
            self.assertTrue(patched == unpatched, f"rpict {more}: the pictures differ")

    def test_ambient_file(self):
        """The same picture, and the same file of ambient values, which goes on when it is used again."""
        for again in 0, 1:
            patched, unpatched = [self.both("rpict", *VIEW, "-af", name, "room.oct", only=n)[0] for n, name in enumerate(("one.amb", "two.amb"))]
            self.assertTrue(patched == unpatched, "the pictures differ")
            values = [self.content(name) for name in ("one.amb", "two.amb")]
            self.assertGreater(len(values[0]), 5000)
            self.assertTrue(values[0] == values[1], "the ambient files differ")

    def content(self, name):
        with open(os.path.join(self.work, name), "rb") as file:
            return file.read().split(b"\n\n", 1)[1]

    def test_rays(self):
        rays = b"".join(b"3 -4 2.5 %f 1 %f\n" % (x / 20, z / 20) for x in range(-14, 15) for z in range(-10, 10))
        patched, unpatched = self.both("rtrace", "-u-", "-ab", 1, "-ad", 64, "-ovlmsn", "room.oct", stdin=rays)
        self.assertEqual(patched, unpatched)
        for n in range(len(MATERIALS)):
            if "antimatter" not in MATERIALS[n]:
                self.assertIn(b"\tp%d\t" % n, patched, f"{MATERIALS[n]} is not seen")


if __name__ == "__main__":
    if not os.path.exists(f"{UNPATCHED}/unpatched-rpict"):
        print("skipped: Radiance was not built, or from sources that are patched already")
        sys.exit(77)
    unittest.main(verbosity=2)
