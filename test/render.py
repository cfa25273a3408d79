# SPDX-License-Identifier: BSD-3-Clause
"""What the tests that render share: programs of ours and of the patched Radiance, scenes, rays, and measurements of sheets."""
import math
import os
import shutil
import subprocess
import sys
import unittest

import numpy as np

BUILD = os.environ.get("BUILD_DIR", os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "build"))
RADIANCE = os.path.join(BUILD, "radiance", "bin")
WORK = os.path.join(BUILD, "test", os.path.splitext(os.path.basename(sys.argv[0]))[0].removeprefix("test_"))  # each test its own

# Radiance's primaries and white, src/common/color.h: x y of red, green, blue, white
PRIMARIES = np.array([[.640, .330], [.290, .600], [.150, .060], [1 / 3, 1 / 3]])


def rgb_to_xyz():
    def xyz(p):
        return np.array([p[0] / p[1], 1, (1 - p[0] - p[1]) / p[1]])
    columns = np.stack([xyz(p) for p in PRIMARIES[:3]], axis=1)
    return columns * np.linalg.solve(columns, xyz(PRIMARIES[3]))


XYZ = rgb_to_xyz()


def run(command, data=b"", fail=False, **environment):
    """Runs a program of ours or of the patched Radiance in WORK and answers its output."""
    folder = RADIANCE if os.path.exists(os.path.join(RADIANCE, command[0])) else os.path.join(BUILD, "bin")
    done = subprocess.run([os.path.join(folder, command[0]), *map(str, command[1:])], input=data, cwd=WORK,
                          capture_output=True, env={**os.environ, "RAYPATH": f".:{BUILD}/radiance/lib", **environment})
    if fail:
        return done.returncode, done.stderr.decode()
    if done.returncode:
        raise AssertionError(f"{command}: {done.returncode}: {done.stderr.decode()[-500:]}")
    return done.stdout


def query(name, *options, vectors):
    """rbfquery: rows of vectors to rows of values."""
    out = np.frombuffer(run(["rbfquery", *options, "-ff", name], np.asarray(vectors, "<f4").tobytes()), "<f4")
    return out.reshape(len(vectors), -1).astype(float)


def vector(theta, phi, side=1):
    theta, phi = math.radians(theta), math.radians(phi)
    return np.array([math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), side * math.cos(theta)])


def scene(name, text):
    with open(os.path.join(WORK, name + ".rad"), "w") as file:
        file.write(text)
    with open(os.path.join(WORK, name + ".oct"), "wb") as file:
        file.write(run(["oconv", name + ".rad"]))
    return name + ".oct"


def trace(octree, rays, *options):
    """rtrace of rays (n x 6) to X, Y, Z (n x 3)."""
    out = run(["rtrace", "-h", "-w", "-ff", *options, octree], np.asarray(rays, "<f4").tobytes())
    return np.frombuffer(out, "<f4").reshape(len(rays), 3) @ XYZ.T


def picture(octree, width, height, *options):
    """rpict to X, Y, Z (height x width x 3), rows from the top."""
    out = run(["rpict", "-x", width, "-y", height, "-pa", "0", *options, octree])
    with open(os.path.join(WORK, octree[:-4] + ".hdr"), "wb") as file:
        file.write(out)
    return np.frombuffer(run(["pvalue", "-h", "-H", "-df"], out), "<f4").reshape(height, width, 3) @ XYZ.T


def mean(values):
    return values.mean(axis=0), values.std(axis=0, ddof=1) / math.sqrt(len(values))


def square(name, modifier, half=50, z=0, up=True):
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)][::1 if up else -1]
    return f"{modifier} polygon {name} 0 0 12 " + " ".join(f"{x * half} {y * half} {z}" for x, y in corners) + "\n"


def bsdf(name, kind="BSDF", up="0 1 0", thick=0):
    return f"void {kind} m {'6 %g' % thick if kind == 'BSDF' else '5'} {name} {up} . 0 0\n"


SPHERE = "void glow g 0 0 4 1 1 1 0\ng bubble env 0 0 4 0 0 0 1000\n"


def sun(direction, radiance=1e4):
    return (f"void light l 0 0 3 {radiance} {radiance} {radiance}\n"
            f"l source sun 0 0 4 {direction[0]} {direction[1]} {direction[2]} .533\n")


SUN = 2 * math.pi * (1 - math.cos(math.radians(.533 / 2)))  # solid angle
FINE = ("-ab", "1", "-aa", "0", "-as", "0", "-lw", "1e-7", "-st", "0", "-dt", "0")


def measure(name, sigma, transmitted, reflected, backs=(False,), tint=None):
    """A sheet with a straight beam, a mirrored beam (sigma in radians) and 3 % scattered to each side, at incidences 0 to 80.
    tint: X, Y, Z by which the straight beam is multiplied."""
    os.makedirs(os.path.join(WORK, name))
    near = [(math.degrees(r * sigma), a) for r in (0, .4, .8, 1.2, 1.6, 2, 2.5, 3, 4, 5, 7) for a in range(0, 360, 30)]
    for theta in range(0, 81, 10):
        beam = vector(theta, 180)
        across, along = np.array([0., 1, 0]), np.array([beam[2], 0, -beam[0]])
        rows = [(t, p) for t in range(2, 89, 6) for p in range(0, 360, 15)]
        for r, a in near:
            d = beam + math.tan(math.radians(min(r, 80))) * (math.cos(math.radians(a)) * along + math.sin(math.radians(a)) * across)
            d /= np.linalg.norm(d)
            if d[2] > .02:
                rows.append((math.degrees(math.acos(d[2])), math.degrees(math.atan2(d[1], d[0]))))
        for back in backs:
            for through, share in ((True, transmitted), (False, reflected)):
                with open(os.path.join(WORK, name, f"{theta}{'fb'[back]}{'rt'[through]}.txt"), "w") as file:
                    file.write(f"#intheta {180 - theta if back else theta}\n#inphi 0\n#upphi 0\n#format: theta phi DSF\n" +
                               ("#colorimetry: CIE-XYZ\n" if tint else ""))
                    for t, p in rows:
                        d = vector(t, p)
                        peak = share * math.exp((d @ beam - 1) / sigma**2) / (2 * math.pi * sigma**2)
                        dsf = (peak * part + .03 * d[2] / math.pi for part in (tint and (tint if through else (1, 1, 1)) or (1,)))
                        file.write(f"{180 - t if back != through else t:.4f} {p:.4f} {' '.join(f'{value:.6g}' for value in dsf)}\n")
    run(["mkrbf", "-q", "-s", "I", "-o", name + ".rbf", *(f"{name}/{f}" for f in sorted(os.listdir(os.path.join(WORK, name))))])


def hemisphere(n):
    """n x n directions of the upper hemisphere, each in the middle of a solid angle 2 pi / n^2."""
    z, phi = (a.ravel() for a in np.meshgrid((np.arange(n) + .5) / n, (np.arange(n) + .5) * 2 * math.pi / n))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def sphere(n):
    """n directions of the whole sphere, each in a solid angle 4 pi / n: a spiral."""
    z, phi = 1 - (np.arange(n) + .5) * 2 / n, np.arange(n) * math.pi * (3 - math.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def grain(incident, outgoing, wide=.35, narrow=.12):
    """f of a beam about the mirrored direction, wide along x and narrow along y; not scaled."""
    d = outgoing + incident * [1, 1, -1]
    turned = np.maximum(outgoing @ (incident * [-1, -1, 1]), 1e-9)
    return np.exp(-.5 * ((d[:, 0] / wide)**2 + (d[:, 1] / narrow)**2 + (d[:, 2] / wide)**2) / turned)


def measure_grain(name, reflected, transmitted, thetas=(0, 15, 30, 45, 60, 72, 81, 87), backs=(False,)):
    """A sheet with a grain along y that reflects and transmits just these shares at every incidence of one quadrant."""
    os.makedirs(os.path.join(WORK, name))
    full = hemisphere(300)
    theta, phi = (a.ravel() for a in np.meshgrid([1.5, *range(4, 88, 4), 89], range(0, 360, 10)))
    rows = np.stack([np.sin(np.radians(theta)) * np.cos(np.radians(phi)), np.sin(np.radians(theta)) * np.sin(np.radians(phi)),
                     np.cos(np.radians(theta))], axis=-1)
    for t in thetas:
        for p in (0, 22.5, 45, 67.5, 90) if t else (0,):
            v = vector(t, p)
            dsf = grain(v, rows) * rows[:, 2] / ((grain(v, full) * full[:, 2]).mean() * 2 * math.pi)
            for back in backs:
                for through, share in ((True, transmitted), (False, reflected)):
                    if share:
                        side = np.where(back != through, 180 - theta, theta)
                        with open(os.path.join(WORK, name, f"{t}_{p}{'fb'[back]}{'rt'[through]}.txt"), "w") as file:
                            file.write(f"#intheta {180 - t if back else t}\n#inphi {p}\n#upphi 0\n#format: theta phi DSF\n")
                            np.savetxt(file, np.stack([side, phi, share * dsf], axis=-1), "%.6g")
    run(["mkrbf", "-q", "-s", "Q", "-o", name + ".rbf", *(f"{name}/{f}" for f in sorted(os.listdir(os.path.join(WORK, name))))])


class Case(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        os.makedirs(WORK)

    def agrees(self, got, error, want, share, what):
        limit = 4 * error + share * abs(want)
        print(f"    {what}: {got:.5f} +- {error:.5f}, expected {want:.5f}")
        self.assertLessEqual(abs(got - want), limit, what)

    def furnace(self, name, kind="BSDF", share=.005, processes=1, count=600, thetas=(0, 30, 60, 75, 85)):
        octree = scene("furnace", SPHERE + bsdf(name, kind) + square("s", "m"))
        incident = [vector(t, p) for t in thetas for p in (0, 40)]
        rays = np.repeat([np.concatenate([3 * v, -v]) for v in incident], count, axis=0)
        values = trace(octree, rays, "-ab", "1", "-ad", "64", "-lw", "1e-7", "-st", "0", "-n", processes)
        dhr = query(name, "-c", "-d", vectors=incident).reshape(-1, 2, 3).sum(axis=1)
        for n, want in enumerate(dhr):
            got, error = mean(values[n * count:(n + 1) * count])
            error = np.multiply(error, processes ** .5)  # they all start with the same random numbers
            for c in range(3):
                self.agrees(got[c], error[c], want[c], share, f"{name} {kind} {'XYZ'[c]}, theta {thetas[n // 2]}")
        return values



def main():
    if not os.path.exists(os.path.join(RADIANCE, "rtrace")):
        print("SKIP: Radiance was not built")
        sys.exit(0)
    unittest.main(verbosity=2)
