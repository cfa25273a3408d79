#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Clear, tinted and hazy glass as aBSDF in the patched Radiance: the view goes straight through, and the sun is counted once."""
import math

import numpy as np

from render import FINE, SUN, Case, bsdf, main, mean, measure, picture, query, scene, square, sun, trace, vector


class Through(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        measure("glass", .01, .80, .08)
        measure("tinted", .01, .80, .08, tint=(.6, .7, .9))
        measure("haze", .02, .70, .08)

    def test_white_furnace_through(self):
        self.furnace("glass.rbf", "BSDF", thetas=(0, 30, 60, 75))
        self.furnace("glass.rbf", "aBSDF", .01, thetas=(0, 30, 60, 75))
        self.furnace("haze.rbf", "aBSDF", .01, thetas=(0, 60))

    def test_sun_through_glass(self):
        """aBSDF: the direct sun comes through once, and the view is crisp."""
        for theta in (0, 30, 60):
            source = vector(theta, 0)
            octree = scene("glass", sun(source) + bsdf("glass.rbf", "aBSDF") + square("s", "m", half=2000, z=3, up=False))
            floor = np.array([[.3 * n, .1, 0, 0, 0, 1] for n in range(4)], float)
            want = query("glass.rbf", "-d", vectors=[source * [-1, 1, 1]])[0][1] * 1e4 * SUN * source[2]
            direct = trace(octree, floor, "-I", "-ab", "0", "-dt", "0")[:, 1].mean()
            self.assertGreater(direct / want, .85)
            self.assertLess(direct / want, 1.)
            got, error = mean(trace(octree, floor, "-I", *FINE, "-ad", "8192"))
            self.agrees(got[1], error[1], want, .015, f"sun through glass at {theta}")
        patch = "void glow g 0 0 4 1 1 1 0\ng source p 0 0 4 0 0 -1 1\n"  # half a degree around the view
        octree = scene("view", patch + bsdf("glass.rbf", "aBSDF") + square("s", "m"))
        seen = trace(octree, [[0, 0, 3, 0, 0, -1]] * 200, "-ab", "0", "-st", "0")[:, 1]
        print(f"    view through: {seen.mean():.4f}")
        self.assertGreater(np.quantile(seen, .02), .70, "the view through does not depend on chance")
        self.assertLess(seen.mean(), .86)

    def test_sun_through_tinted_glass(self):
        for theta in (0, 45):
            source = vector(theta, 0)
            octree = scene("tinted", sun(source) + bsdf("tinted.rbf", "aBSDF") + square("s", "m", half=2000, z=3, up=False))
            floor = np.array([[.3 * n, .1, 0, 0, 0, 1] for n in range(4)], float)
            want = query("tinted.rbf", "-c", "-d", vectors=[source * [-1, 1, 1]])[0][3:] * 1e4 * SUN * source[2]
            direct = trace(octree, floor, "-I", "-ab", "0", "-dt", "0").mean(axis=0)
            got, error = mean(trace(octree, floor, "-I", *FINE, "-ad", "8192"))
            for c, tint in enumerate((.6, .7, .9)):
                self.agrees(got[c], error[c], want[c], .015, f"sun through tinted glass at {theta}, {'XYZ'[c]}")
                self.assertGreater(direct[c] / want[c], .85)
                self.assertLess(direct[c] / want[c], 1.)
                self.assertLess(abs(want[c] / (1e4 * SUN * source[2]) - .8 * tint - .03), .02)

    def test_picture_through_glass(self):
        """rpict: an edge behind the glass stays an edge, and the floor under it gets the sun once."""
        edge = ("void brightfunc e 2 if(Px,1,.001) . 0 0\ne glow far 0 0 4 1 1 1 0\n" + square("back", "far", half=40, z=-3))
        view = ["-vp", "0", "0", "3", "-vd", "0", "0", "-1", "-vu", "0", "1", "0", "-vh", "16", "-vv", "16", "-ps", "1", "-pj", "0",
                "-ab", "0", "-st", "0"]
        for name, tint in (("glass.rbf", (1, 1, 1)), ("tinted.rbf", (.6, .7, .9))):
            bare = picture(scene("bare", edge), 64, 64, *view)
            seen = picture(scene("edge", edge + bsdf(name, "aBSDF") + square("s", "m")), 64, 64, *view)
            dark, bright = seen[:, :31], seen[:, 33:]
            self.assertTrue(np.allclose(bare[:, 33:], 1, rtol=.01))
            print(f"    {name}: bright {bright.mean(axis=(0, 1))}, dark {dark.mean(axis=(0, 1))}")
            for c in range(3):
                self.assertGreater(bright[..., c].min(), .9 * .8 * tint[c])
                # one ray in twenty scatters, and then counts in full
                self.assertLess(np.quantile(bright[..., c], .8), .8 * tint[c] + .03)
                self.assertLess(np.quantile(dark[..., c], .8), .01)
                self.assertLess(abs(bright[..., c].mean() / (.8 * tint[c]) - 1), .03)
                self.assertLess(dark[..., c].mean(), .05)
            floor = "void plastic grey 0 0 5 .5 .5 .5 0 0\n" + square("floor", "grey", half=.2)  # the glass sees little of it
            glass = bsdf(name, "aBSDF") + square("s", "m", half=2000, z=3, up=False)
            source = vector(30, 0)
            look = ["-vp", "0", "0", "1", "-vd", "0", "0", "-1", "-vu", "0", "1", "0", "-vh", "9", "-vv", "9", "-dt", "0"]
            light = [picture(scene("floor", sun(source) + floor + above), 8, 8, *look, "-ab", bounces, "-aa", ".2", "-ad", "8192",
                             "-lw", "1e-7", "-st", "0").mean(axis=(0, 1)) for above, bounces in (("", "0"), (glass, "0"), (glass, "1"))]
            want = query(name, "-c", "-d", vectors=[source * [-1, 1, 1]])[0][3:]
            for c in range(3):
                self.assertLess(abs(light[0][c] / (.5 / math.pi * 1e4 * SUN * source[2]) - 1), .01)
                direct, total = light[1][c] / light[0][c], light[2][c] / light[0][c]
                self.agrees(total, 0, want[c], .025, f"{name}: floor under it, {'XYZ'[c]}, direct {direct:.4f}")
                self.assertLess(abs(direct / (.8 * tint[c]) - 1), .06)


if __name__ == "__main__":
    main()
