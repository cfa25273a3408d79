#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The example scenes render: small pictures from few samples, in which what each scene is about is to be seen; and the
daylight example computes."""
import os
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

BUILD, SOURCE = os.environ["BUILD_DIR"], os.environ["SOURCE_DIR"]
if not os.path.exists(os.path.join(BUILD, "radiance", "bin", "rpict")):
    print("skipped: built without Radiance")
    sys.exit(77)


def render(name, folder):
    done = subprocess.run(["bash", os.path.join(SOURCE, "examples", "scenes", "render"), name], capture_output=True, text=True,
                          env={**os.environ, "EXAMPLE_WIDTH": "40", "EXAMPLE_MEASURING": "-every 4 -samples 100 200",
                               "EXAMPLE_OPTIONS": "-ab 1 -ad 32 -as 0 -aa .5 -ss 1", "EXAMPLE_FOLDER": folder})
    assert done.returncode == 0, done.stdout + done.stderr
    path = done.stdout.split()[-1]
    picture = np.asarray(Image.open(path).convert("RGB"), float) / 255
    assert picture.shape == (30, 40, 3), picture.shape
    assert .2 < picture.mean() < .8 and picture.std() > .08, (name, picture.mean(), picture.std())
    return picture


with tempfile.TemporaryDirectory() as work:
    # rows from the top; the ball's highlight, and below it
    picture = render("metal", work).mean(2)
    assert picture[16, 5:9].mean() > picture[18:21, 5:11].mean() + .2, picture[10:24, 2:18].round(2)
    # through the sheet the person close behind it is bluer than what is beside
    picture = render("partition", work)
    blue = picture[..., 2] - picture[..., 0]
    assert blue[20:27, 9:12].mean() > blue[20:27, 16:20].mean() + .1, blue.round(2)
    # the redirecting pane, and the wall below the window
    picture = render("office", work).mean(2)
    assert picture[12:16, 6:18].mean() > picture[20:23, 4:11].mean() + .2, picture.round(2)
    # the two daylight routes agree under an even sky, and bring sun into the room
    done = subprocess.run(["bash", os.path.join(SOURCE, "examples", "daylight", "daylight")], capture_output=True, text=True,
                          env={**os.environ, "EXAMPLE_MEASURING": "-every 3 -samples 200 400", "EXAMPLE_FOLDER": work,
                               "EXAMPLE_SAMPLES": "1000", "EXAMPLE_PATCHES": "1"})
    assert done.returncode == 0, done.stdout + done.stderr
    mean = [float(word) for word in done.stdout.split("mean")[1].split("\n")[0].split()]
    assert len(mean) == 12 and min(mean[0::3]) > 20, done.stdout
    assert abs(mean[11] - 1) < .15 and all(.5 < ratio < 2 for ratio in mean[2::3]), done.stdout
print("the examples render")
