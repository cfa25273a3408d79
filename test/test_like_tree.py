#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A recorded file in a Radiance scene behaves as a tensor tree of the same data does (rbf2ttree, read by Radiance's own code),
whatever else the scene says: thickness, up vectors, transforms, real arguments, patterns, mkillum. Limits are four standard
errors of the rendering, plus what a tree's cells take away."""
import math
import os

import numpy as np

from render import (FINE, RADIANCE, SPHERE, WORK, Case, hemisphere, main, mean, measure, measure_grain, query, run, scene, square,
                    trace, vector)

# bright where x is small: what a sheet with a grain shows of it depends on how it is turned
SKY = "void brightfunc b 2 .2+exp(-12*Dx*Dx) . 0 0\nb glow g 0 0 4 1 1 1 0\ng source sky 0 0 4 0 0 1 360\n"
VIEWS = (vector(20, 30), vector(55, 110), vector(40, 0, -1), vector(10, 200, -1))
ADDED = (.1, .12, .14, .25, .2, .15, .05, .06, .07)


def panel(form, name, up="0 1 0", thick=0, transform="", modifier="void", added=()):
    words = f"{thick} {name}.{form} {up} . {transform}".split()
    return f"{modifier} BSDF m {len(words)} {' '.join(words)} 0 {len(added)} {' '.join(map(str, added))}\n" + square("s", "m")


class LikeTree(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        measure("sheet", .15, .60, .20, (False, True))
        measure_grain("grain", .3, .6, (0, 20, 40, 60, 75))
        for name in ("sheet", "grain"):
            run(["rbf2ttree", "-o", name + ".xml", name + ".rbf"])

    def seen(self, text, views, *options, count=2000):
        """Mean and standard error of what each view ray towards the origin finds, Y."""
        rays = np.repeat([np.concatenate([3 * v, -v]) for v in views], count, axis=0)
        values = trace(scene("seen", text), rays, "-ab", "1", "-ad", "64", "-lw", "1e-7", "-st", "0", *options)[:, 1].reshape(-1, count)
        return values.mean(axis=1), values.std(axis=1, ddof=1) / math.sqrt(count)

    def alike(self, what, sky=SKY, views=VIEWS, turn=None, **material):
        for name, share in (("sheet", .02), ("grain", .07)):  # its tree has wide cells of incidence
            values = {}
            for form in ("rbf", "xml"):
                text = panel(form, name, **material)
                if turn:
                    with open(os.path.join(WORK, "panel.rad"), "w") as file:
                        file.write(text)
                    text = run(["xform", *turn, "panel.rad"]).decode()
                values[form] = self.seen(sky + text, views)
            for n in range(len(views)):
                (ours, error), (theirs, other) = ((v[n] for v in values[form]) for form in ("rbf", "xml"))
                self.agrees(ours, math.hypot(error, other), theirs, share, f"{name}, {what}, view {n}")
        return values["rbf"][0]

    def test_sides_and_axes(self):
        plain = self.alike("plain")
        across = self.alike("up along x", up="1 0 0")
        self.assertGreater(abs(across - plain).max(), .05)  # the sheet with a grain shows how it is turned
        between = self.alike("up between", up="1 2 0")
        # and by quadrature of rbfquery's values
        around = np.concatenate([hemisphere(250), hemisphere(250) * [1, 1, -1]])
        sky = abs(around[:, 2]) * (.2 + np.exp(-12 * around[:, 0]**2)) * 2 * math.pi / 250**2
        for (x, y), got, what in (((0, 1), plain, "plain"), ((1, 0), across, "across"), ((1, 2), between, "between")):
            axes = np.array([[y, -x, 0], [x, y, 0], [0, 0, math.hypot(x, y)]]) / math.hypot(x, y)
            for n, v in enumerate(VIEWS):
                f = query("grain.rbf", vectors=np.concatenate([np.broadcast_to(axes @ v, around.shape), around @ axes.T], axis=1))[:, 0]
                self.agrees(got[n], .007, f @ sky, .01, f"quadrature, {what}, view {n}")
        self.alike("up turned by a transform", transform="-rz 35")
        self.alike("xform", turn=("-rz", "40", "-ry", "15"))
        self.alike("mirrored", turn=("-mx", "-rz", "30"))

    def test_added_and_pattern(self):
        self.alike("added diffuse", added=ADDED)
        self.alike("front alone", added=ADDED[:3])
        pattern = "void brightfunc p 2 .3 . 0 0\n"
        self.alike("pattern", sky=SKY + pattern, modifier="p", added=ADDED)
        # what is not diffuse keeps its reflection, and all else is multiplied
        got, error = self.seen(SPHERE + pattern + panel("rbf", "grain", modifier="p", added=[.2] * 3 + [.1] * 3 + [.05] * 3), VIEWS[:2])
        for n, (reflected, transmitted) in enumerate(query("grain.rbf", "-d", vectors=VIEWS[:2])):
            self.agrees(got[n], error[n], reflected + .3 * (transmitted + .2 + .05), .005, f"pattern of .3, view {n}")

    def test_thickness(self):
        """Irradiance beside the panel, which indirect rays meet on the side away from the geometry that it stands for. (With
        thickness, negative in 5.4 and either in 6.x, Radiance starts the rays of its diffuse transmission on the near side, so that
        they meet the panel again: 6 % less, here, with a tree as with the file.)"""
        for thick, side in ((0, 1), (.1, 1), (-.1, 1), (0, -1), (.1, -1), (-.1, -1)):
            found = []
            for form in ("rbf", "xml"):
                octree = scene("thick", SPHERE + panel(form, "sheet", thick=thick, added=[0] * 6 + [.3] * 3))
                rays = [(.1 * n, 0, side, 0, 0, -side) for n in range(12)]
                found.append([v[1] for v in mean(trace(octree, rays, "-I", "-ab", "2", "-ad", "600", *FINE[2:]))])
            (ours, error), (theirs, other) = found
            self.agrees(ours, math.hypot(error, other), theirs, .003, f"thickness {thick}, side {side}")
    def test_mkillum(self):
        """The panel as a secondary light source."""
        if not os.path.exists(os.path.join(RADIANCE, "mkillum")):
            self.skipTest("these sources of Radiance have no mkillum")
        room = ("void brightfunc b 2 1+Dx . 0 0\nb glow g 0 0 4 1 1 1 0\ng source sky 0 0 4 0 0 1 180\n"
                "void plastic black 0 0 5 0 0 0 0 0\nblack ring shade 0 0 8 0 0 2 0 0 -1 1.2 100\n")
        floor = [[x, y, z, 0, 0, 1] for x, y, z in ((0, 0, 0), (.5, .5, 0), (.8, -.8, .3), (-1, .5, 0))]
        seen = {}
        for form in ("rbf", "xml"):
            pane = f"void BSDF m 6 0 sheet.{form} 0 1 0 . 0 0\nm ring pane 0 0 8 0 0 2 0 0 -1 0 1.2\n"
            octree = scene("pane", room + pane)
            seen[form] = trace(octree, floor, "-I", "-ab", "2", "-ad", "8192", "-lw", "1e-6", "-aa", "0", "-as", "0", "-st", "0")[:, 1]
            for processes in ("1", "2"):
                illum = run(["mkillum", "-n", processes, "-ab", "1", "-st", "0", "-lw", "1e-7", octree],
                            b"#@mkillum d=300 s=200\n" + pane.encode()).decode()
                seen[form, processes] = trace(scene("illum", room + illum), floor, "-I", "-ab", "0", "-dt", "0", "-ds", ".05")[:, 1]
        for n in range(len(floor)):
            for processes in ("1", "2"):
                self.agrees(seen["rbf", processes][n], 0, seen["xml", processes][n], .01, f"mkillum -n {processes}, point {n}")
                self.agrees(seen["rbf", processes][n], 0, seen["rbf"][n], .06, f"mkillum -n {processes} beside none, point {n}")


if __name__ == "__main__":
    main()
