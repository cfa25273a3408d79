#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Renders recorded files with the patched Radiance and compares with sums over rbfquery's values.

Colours are compared as CIE X, Y, Z. Limits are four standard errors of the rendering, plus what is said there."""
import math
import os
import shutil
import signal
import time

import numpy as np

from render import (BUILD, FINE, SPHERE, SUN, WORK, XYZ, Case, bsdf, hemisphere, main, mean, measure, measure_grain, picture,
                    query, run, scene, sphere, square, sun, trace, vector)


class Render(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, options, build in (("satin", (), ()), ("film", (), ("-l", "100")), ("redirect", (), ("-l", "60"))):
            run(["goniometer", *options, name, name])
            files = sorted(os.listdir(os.path.join(WORK, name)))
            run(["mkrbf", "-q", *build, "-o", name + ".rbf", *(f"{name}/{f}" for f in files if f.endswith(".txt"))])
        measure_grain("brushed", 1, 0)
        measure_grain("grain", 0, 1)
        measure("sheet", .15, .60, .20, (False, True))

    def test_white_furnace(self):
        self.furnace("satin.rbf")
        self.furnace("film.rbf")
        self.furnace("redirect.rbf")
        self.furnace("redirect.rbf", "aBSDF")  # its straight beam of 1.8 degrees is no view through

    def test_white_furnace_grain(self):
        """Lossless and anisotropic, by reflection and by transmission: what leaves is what the file answers, by quadrature, and
        nearly all, whether found by sampling, from the ambient value, or light by light."""
        incident = [vector(t, p) for t in (0, 30, 60, 75, 85) for p in (0, 50)]
        for name, side in (("brushed.rbf", 1), ("grain.rbf", -1)):
            out = hemisphere(250) * [1, 1, side]
            want = [(query(name, vectors=np.concatenate([np.broadcast_to(v, out.shape), out], axis=1))[:, 0] * abs(out[:, 2])).mean() *
                    2 * math.pi for v in incident]
            self.assertLess(max(abs(w - 1) for w in want), .05)
            rays = [np.concatenate([3 * v, -v]) for v in incident]
            octree = scene("furnace", SPHERE + bsdf(name) + square("s", "m"))
            sampled = trace(octree, np.repeat(rays, 500, axis=0), "-ab", "1", "-lw", "1e-7", "-st", "0", "-ss", ".2")[:, 1].reshape(-1, 500)
            sampled, error = sampled.mean(axis=1), sampled.std(axis=1) / math.sqrt(500)
            ambient = trace(octree, rays, "-ab", "1", "-ad", "64", "-lw", "1e-7", "-st", "1.1", "-ss", "0")[:, 1]
            lights = sphere(10000)
            radiance = 4 * math.pi / len(lights) / SUN
            octree = scene("lights", f"void light l 0 0 3 {radiance} {radiance} {radiance}\n" + bsdf(name) + square("s", "m") +
                           "".join(f"l source s{n} 0 0 4 {x} {y} {z} .533\n" for n, (x, y, z) in enumerate(lights)))
            direct = trace(octree, rays, "-ab", "0", "-dt", "0", "-st", "1.1", "-ss", "0")[:, 1]
            for n, v in enumerate(incident):
                for path, got, noise in (("sampled", sampled, error[n]), ("ambient", ambient, 0), ("direct", direct, 0)):
                    self.agrees(got[n], noise, want[n], .005, f"{name} {path}, theta {math.degrees(math.acos(v[2])):.0f}")

    def test_back(self):
        """A side that was measured, and one that was not and is served by reciprocity."""
        for theta in (0, 60):
            v = vector(theta, 30, -1)
            octree = scene("back", SPHERE + bsdf("sheet.rbf") + square("s", "m"))
            got, error = mean(trace(octree, [np.concatenate([3 * v, -v])] * 200, "-ab", "1", "-ad", "64", "-st", "0"))
            self.agrees(got[1], error[1], query("sheet.rbf", "-d", vectors=[v])[0].sum(), .005, f"sheet from behind, theta {theta}")
        octree = scene("back", SPHERE + bsdf("satin.rbf") + square("s", "m"))
        for theta in (5, 50):
            v = vector(theta, 30, -1)
            got, error = mean(trace(octree, [np.concatenate([3 * v, -v])] * 20, "-ab", "1", "-ad", "64", "-st", "0"))
            want = query("satin.rbf", "-d", vectors=[v])[0].sum()
            self.agrees(got[1], error[1], want, .01, f"satin from behind, theta {theta}")

    def test_proxy_thickness(self):
        """Beside geometry that it stands for (thickness not 0) a view ray passes. Indirect rays meet the BSDF on the side away
        from that geometry: the front if it is positive, the back if negative. On the other side they pass as well."""
        irradiance = {}
        for thick in (0, .1, -.1):
            octree = scene("proxy", SPHERE + bsdf("sheet.rbf", thick=thick) + square("s", "m"))
            for side in (1, -1):
                v = vector(30, 40, side)
                seen = trace(octree, [np.concatenate([3 * v, -v])], "-ab", "1", "-ad", "64", "-st", "0")[0]
                want = query("sheet.rbf", "-d", vectors=[v])[0].sum() if thick == 0 else 1
                self.agrees(seen[1], 0, want, .005, f"view, side {side}, thickness {thick}")
                got, error = mean(trace(octree, [(0, 0, side, 0, 0, -side)] * 30, "-I", "-ab", "2", "-ad", "400", *FINE[2:]))
                irradiance[thick, side] = got[1], error[1]
        for thick, side in ((.1, 1), (.1, -1), (-.1, 1), (-.1, -1)):
            plain, error = irradiance[0, side]
            self.assertGreater(math.pi - plain, .1)  # the BSDF and the sky can be told apart
            want = plain if thick * side > 0 else math.pi
            self.agrees(*irradiance[thick, side], want, .01 + 4 * error / plain, f"irradiance, side {side}, thickness {thick}")

    def test_added_diffuse(self):
        """Nine real arguments add diffuse reflection in front, behind, and diffuse transmission."""
        added = (.1, .1, .1, .25, .25, .25, .05, .05, .05)
        material = bsdf("sheet.rbf").replace("0 0\n", "0 9 " + " ".join(map(str, added)) + "\n")
        octree = scene("added", SPHERE + material + square("s", "m"))
        for side, reflected in ((1, .1), (-1, .25)):
            v = vector(40, 30, side)
            got, error = mean(trace(octree, [np.concatenate([3 * v, -v])] * 300, "-ab", "1", "-ad", "256", "-lw", "1e-7", "-st", "0"))
            want = query("sheet.rbf", "-d", vectors=[v])[0].sum() + reflected + .05
            self.agrees(got[1], error[1], want, .005, f"added diffuse, side {side}")

    def test_processes(self):
        """-n 2 answers as -n 1 does."""
        one = self.furnace("film.rbf", thetas=(45,))
        two = self.furnace("film.rbf", thetas=(45,), processes=2)
        (a, ea), (b, eb) = mean(one), mean(two)
        self.assertTrue(np.all(abs(a - b) <= 4 * np.hypot(ea, 2 ** .5 * np.array(eb)) + 1e-6))

    def test_direct(self):
        """Sun seen by way of the surface, without jitter: f itself, in the axes given by the up vector."""
        z = np.array([0, 0, 1.])
        for name, up in (("redirect.rbf", "0 1 0"), ("redirect.rbf", "1 0 0"), ("redirect.rbf", "1 2 0"), ("film.rbf", "0 1 0")):
            u = np.array([float(c) for c in up.split()])
            x = np.cross(u, z)
            x /= np.linalg.norm(x)
            axes = np.stack([x, np.cross(z, x), z])
            for view, source in ((vector(20, 10), vector(35, 200)), (vector(50, 80), vector(40, 255)),
                                 (vector(60, 300), vector(55, 130))):
                if name == "redirect.rbf":
                    source = source * [1, 1, -1]
                octree = scene("direct", sun(source) + bsdf(name, up=up) + square("s", "m"))
                got = trace(octree, [np.concatenate([3 * view, -view])], "-ab", "0", "-ss", "0")[0]
                v, s = axes @ view, axes @ source
                lambertian = query(name, "-c", vectors=[np.concatenate([v, s])])[0]
                want = lambertian * 1e4 * SUN * abs(source[2])
                self.assertTrue(np.allclose(got, want, rtol=2e-3, atol=1e-6), f"{name} up {up}: {got} instead of {want}")

    def test_swapped(self):
        """Seen from behind, lit from before or behind: sides that were measured, and by reciprocity one that was not."""
        for name in ("redirect.rbf", "sheet.rbf"):
            pairs = [np.concatenate([vector(t, p, -1), vector(30, 200, side)])
                     for t, p, side in ((20, 10, 1), (35, 30, 1), (60, 300, 1), (30, 20, -1), (50, 80, -1))]
            values = query(name, vectors=pairs)[:, 0]
            for pair, f in zip(pairs, values):
                octree = scene("swapped", sun(pair[3:]) + bsdf(name) + square("s", "m"))
                got = trace(octree, [np.concatenate([3 * pair[:3], -pair[:3]])], "-ab", "0", "-ss", "0")[0][1]
                self.agrees(got, 1e-7, f * 1e4 * SUN * abs(pair[5]), .002, f"{name}, view from behind, light on side {pair[5]:.2f}")
            through = [pair for pair in pairs if pair[5] > 0]
            other = query(name, vectors=np.roll(through, 3, axis=1))[:, 0]
            if name == "redirect.rbf":  # measured from before alone
                self.assertTrue(np.allclose(values[:len(other)], other, rtol=1e-4), f"{values} {other}")
                self.assertGreater(max(other), .01)

    def test_transform(self):
        """xform turns the up vector with the surface."""
        view, source = vector(30, 20), vector(40, 190) * [1, 1, -1]
        plain = scene("plain", sun(source) + bsdf("redirect.rbf", up="1 2 0") + square("s", "m"))
        with open(os.path.join(WORK, "turned.rad"), "wb") as file:
            file.write(run(["xform", "-rz", "37", "-rx", "-25", "-ry", "110", "plain.rad"]))
        with open(os.path.join(WORK, "turned.oct"), "wb") as file:
            file.write(run(["oconv", "turned.rad"]))

        def turn(axis, degrees):
            c, s, (i, j) = math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), [(1, 2), (2, 0), (0, 1)][axis]
            m = np.eye(3)
            m[i, i] = m[j, j] = c
            m[i, j], m[j, i] = -s, s
            return m
        m = turn(1, 110) @ turn(0, -25) @ turn(2, 37)
        a = trace(plain, [np.concatenate([3 * view, -view])], "-ab", "0", "-ss", "0")[0]
        b = trace("turned.oct", [np.concatenate([3 * m @ view, -m @ view])], "-ab", "0", "-ss", "0")[0]
        self.assertGreater(a[1], 1e-3)
        self.assertTrue(np.allclose(a, b, rtol=1e-3), f"{a} {b}")

    def test_sun_and_sky(self):
        """Irradiance under a satin panel, lit by sun and a sky that is brighter towards +x."""
        source = vector(40, 0)
        sky = ("void brightfunc b 2 1+Dx . 0 0\nb glow g 0 0 4 1 1 1 0\ng source sky 0 0 4 0 0 1 180\n")
        panel = bsdf("satin.rbf") + square("s", "m", half=2000, z=3, up=False)  # its front looks down
        axes = np.array([[-1., 0, 0], [0, 1, 0], [0, 0, -1]])  # world to panel: x = up cross normal

        def shirley_chiu(n):  # directions of equal projected solid angle
            a, b = np.meshgrid((np.arange(n) + .5) / n * 2 - 1, (np.arange(n) + .5) / n * 2 - 1)
            big = abs(a) > abs(b)
            r = np.where(big, a, b)
            with np.errstate(divide="ignore", invalid="ignore"):
                phi = np.where(big, math.pi / 4 * b / a, math.pi / 2 - math.pi / 4 * a / b)
            d = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r * r)], axis=-1)
            return d.reshape(-1, 3)

        eye = shirley_chiu(300) * [1, 1, -1]  # from the panel down to the floor
        pairs = np.concatenate([eye @ axes.T, np.broadcast_to(source @ axes.T, eye.shape)], axis=1)
        by_sun = query("satin.rbf", vectors=pairs)[:, 0].mean() * math.pi * 1e4 * SUN * source[2]
        # sky: for each of 600 directions of equal projected solid angle, rings around the beam that widen
        r = np.sqrt((np.arange(60) + .5) / 60)
        phi = np.radians(np.arange(10) * 36 + 18)
        eye = np.stack([np.outer(r, np.cos(phi)), np.outer(r, np.sin(phi)), -np.outer(np.sqrt(1 - r * r), np.ones(10))], -1)
        eye = eye.reshape(-1, 3)
        edge = np.concatenate([[0], np.geomspace(.01, math.pi, 48)])
        ring = (edge[1:] + edge[:-1]) / 2
        solid = 2 * math.pi * (np.cos(edge[:-1]) - np.cos(edge[1:])) / 36
        turn = np.radians(np.arange(36) * 10 + 5)
        total = 0
        for some in np.array_split(eye, 10):
            beam = -some
            x = np.cross(beam, [0, 0, 1.])
            x /= np.linalg.norm(x, axis=1)[:, None]
            y = np.cross(beam, x)
            d = (np.cos(ring)[None, :, None, None] * beam[:, None, None] + np.sin(ring)[None, :, None, None] *
                 (np.cos(turn)[None, None, :, None] * x[:, None, None] + np.sin(turn)[None, None, :, None] * y[:, None, None]))
            weight = np.broadcast_to(solid[None, :, None], d.shape[:3])
            eyes = np.broadcast_to(some[:, None, None], d.shape)
            up = d[..., 2] > 1e-3
            d, weight, eyes = d[up], weight[up], eyes[up]
            f = query("satin.rbf", vectors=np.concatenate([eyes @ axes.T, d @ axes.T], axis=1))[:, 0]
            total += (f * d[:, 2] * (1 + d[:, 0]) * weight).sum()
        by_sky = total / len(eye) * math.pi
        for lights, want, what in ((sun(source), by_sun, "sun"), (sky, by_sky, "sky"), (sun(source) + sky, by_sun + by_sky, "both")):
            octree = scene("under", lights + panel)
            floor = np.array([[x, y, 0, 0, 0, 1] for x in (0, .3, 5) for y in (0, 1, 7)], float)
            # the second bounce is the Lambertian part, which gets its light from the sky in that way only
            got, error = mean(trace(octree, floor, "-I", *FINE, "-ab", "2", "-ad", "8192", "-lw", "1e-4"))
            self.agrees(got[1], error[1], want, .005, f"irradiance by {what}")

    def test_ambient_cache(self):
        """A room under a panel, with the ambient cache, with the cache of the run before, and without one."""
        octree = scene("room", "void glow g 0 0 4 2 2 2 0\ng source sky 0 0 4 0 0 1 360\nvoid plastic grey 0 0 5 .5 .5 .5 0 0\n" +
                       square("floor", "grey", half=2) +
                       bsdf("sheet.rbf") + square("s", "m", half=2, z=2, up=False))
        points = [[.4 * x, .4 * y, .001, 0, 0, 1] for x in range(-3, 4) for y in range(-3, 4)]
        views = [[.4 * x, .4 * y, .5, .2, .1, 1] for x in range(-3, 4) for y in range(-3, 4)]
        for what, rays, options in (("floor", points, ["-I", "-st", "0"]), ("panel", views, ["-st", "1.1"])):
            options += ["-ab", "2", "-as", "0", "-lw", "1e-5", "-dt", "0"]
            plain = trace(octree, rays, *options, "-aa", "0", "-ad", "1500")[:, 1]
            file = ["-aa", ".1", "-ad", "1500", "-ar", "64", "-af", what + ".amb"]
            first = trace(octree, rays, *options, *file)[:, 1]
            size = os.path.getsize(os.path.join(WORK, what + ".amb"))
            again = trace(octree, rays, *options, *file)[:, 1]
            self.assertGreater(size, 1000)
            self.assertTrue(np.allclose(first, again, rtol=.1))
            for got, which in ((first, "cache"), (again, "its file")):
                noise = (got - plain).std() / math.sqrt(len(plain))
                self.agrees(got.mean(), noise, plain.mean(), .02, f"{what} with {which}")

    def test_persist(self):
        """A process that waits for more answers as a new one does."""
        octree = scene("persist", SPHERE + bsdf("satin.rbf") + square("s", "m"))
        rays = [[*(3 * vector(t, 20)), *-vector(t, 20)] for t in range(0, 80, 10)]
        options = ["-ab", "1", "-ad", "64", "-st", "1.1", "-ss", "0"]
        want = trace(octree, rays, *options)
        note = os.path.join(WORK, "persist.txt")
        try:
            for _ in range(2):
                self.assertTrue(np.allclose(trace(octree, rays, *options, "-P", "persist.txt"), want, rtol=1e-3))
        finally:
            for _ in range(50):
                with open(note) as file:
                    words = file.read().split()
                if len(words) > 1:
                    os.kill(int(words[1]), signal.SIGTERM)
                    break
                time.sleep(.2)
        self.assertTrue(words[0].endswith("rtrace"))

    def test_search_path(self):
        os.makedirs(os.path.join(WORK, "elsewhere"), exist_ok=True)
        shutil.copy(os.path.join(WORK, "film.rbf"), os.path.join(WORK, "elsewhere", "moved.rbf"))
        octree = scene("path", SPHERE + bsdf("moved.rbf") + square("s", "m"))
        rays = np.array([[0, 0, 3, 0, 0, -1]], "<f4").tobytes()
        code, words = run(["rtrace", "-h", "-w", "-ff", octree], rays, fail=True)
        self.assertNotEqual(code, 0)
        self.assertIn("cannot find BSDF file", words)
        self.assertIn("moved.rbf", words)
        code, words = run(["rtrace", "-h", "-w", "-ff", octree], rays, fail=True,
                          RAYPATH=f".:{WORK}/elsewhere:{BUILD}/radiance/lib")
        self.assertEqual((code, words), (0, ""))

    def test_bad_files(self):
        with open(os.path.join(WORK, "film.rbf"), "rb") as file:
            data = file.read()
        rays = np.array([[0, 0, 3, 0, 0, -1]], "<f4").tobytes()
        for name, content in (("half", data[:len(data) // 2]), ("magic", data[:8]), ("byte", data[:1]), ("empty", b""),
                              ("words", b"<?xml version='1.0'?><a></a>"),
                              ("flipped", data[:3000] + bytes([data[3000] ^ 255]) + data[3001:])):
            with open(os.path.join(WORK, name + ".rbf"), "wb") as file:
                file.write(content)
            octree = scene("bad", SPHERE + bsdf(name + ".rbf") + square("s", "m"))
            code, words = run(["rtrace", "-h", "-w", "-ff", octree], rays, fail=True)
            print("   ", words.strip())
            self.assertEqual(code, 1, name)
            self.assertIn(name, words)

    def test_picture(self):
        octree = scene("picture", SPHERE + bsdf("film.rbf") + square("s", "m", half=1))
        values = picture(octree, 48, 48, "-vp", "0", "-2", "2", "-vd", "0", "1", "-1", "-ab", "1", "-ad", "64", "-st", "0")
        want = query("film.rbf", "-d", vectors=[[0, -1, 1]])[0][0]
        middle = values[20:28, 20:28, 1].mean()
        self.agrees(middle, 0, want, .03, "middle of the picture")

    def test_rcontrib(self):
        octree = scene("contrib", SPHERE + bsdf("satin.rbf") + square("s", "m"))
        v = vector(40, 0)
        rays = np.repeat([np.concatenate([3 * v, -v])], 200, axis=0)
        out = np.frombuffer(run(["rcontrib", "-h", "-ff", "-m", "g", "-ab", "1", "-ad", "64", "-lw", "1e-7", "-st", "0", octree],
                                rays.astype("<f4").tobytes()), "<f4").reshape(-1, 3)
        got, error = mean(out @ XYZ.T)
        self.agrees(got[1], error[1], query("satin.rbf", "-d", vectors=[v])[0].sum(), .005, "rcontrib coefficient")

    def test_photon_map(self):
        """Photons through the panel: about the irradiance that the backward calculation finds."""
        room = ("void plastic grey 0 0 5 .5 .5 .5 0 0\n" + square("floor", "grey", half=4) + bsdf("sheet.rbf") +
                square("s", "m", half=1, z=2, up=False) + "void light lamp 0 0 3 50 50 50\n" + square("lamp", "lamp", half=.5, z=3, up=False))
        octree = scene("photons", room)
        run(["mkpmap", "-fo+", "-apg", "photons.gpm", "40000", "-apD", ".25", octree])
        floor = np.array([[.2 * n - .4, .1, .001, 0, 0, 1] for n in range(5)], float)
        a, _ = mean(trace(octree, floor, "-I", *FINE, "-ad", "16384"))
        b, _ = mean(trace(octree, floor, "-I", "-ab", "-1", "-ap", "photons.gpm", "200"))
        self.agrees(b[1], 0, a[1], .15, "photon map")


if __name__ == "__main__":
    main()
