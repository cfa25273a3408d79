# SPDX-License-Identifier: BSD-3-Clause
"""Times one picture rendered with a recorded file against the same with a tensor tree: patched rpict, same scene."""
import os

from stock import run

# The sample stands upright in the plane x = 0, its front towards the camera at +x, beside a sphere of it if it reflects.
SCENE = """void BSDF sample
6 0 {file} 0 0 1 .
0
0

sample polygon panel
0
0
12  0 -1 0  0 1 0  0 1 2  0 -1 2
{sphere}
void plastic floor_paint
0
0
5 .4 .4 .4 0 0
floor_paint polygon floor
0
0
12  -4 -4 -.01  4 -4 -.01  4 4 -.01  -4 4 -.01
void light sun_light
0
0
3 2e5 2e5 2e5
sun_light source sun
0
0
4 {side} .5 .8 2
void glow sky_glow
0
0
4 30 30 30 0
sky_glow source sky
0
0
4 0 0 1 360
"""
SPHERE = """
sample sphere ball
0
0
4 .6 1.2 .5 .45
"""


def picture(build, folder, record, transmits, size, samples=16):
    """A function that renders `record`, a .rbf or .xml file, once, and returns (wall, cpu) seconds of rpict."""
    binaries = os.path.join(build, 'radiance', 'bin')
    env = dict(os.environ, PATH=binaries + ':' + os.environ.get('PATH', ''), RAYPATH=':'.join(('.', folder, os.path.join(build, 'radiance', 'lib'))))
    stem = os.path.join(folder, 'render_' + record.rsplit('.', 1)[1])
    with open(stem + '.rad', 'w') as f:
        f.write(SCENE.format(file=record, side=-1 if transmits else 1, sphere='' if transmits else SPHERE))
    run([os.path.join(binaries, 'oconv'), stem + '.rad'], stdout=stem + '.oct', env=env)
    view = '-vp 4 .5 1.2 -vd -1 -.1 -.05 -vu 0 0 1 -vh 40 -vv 40'.split()
    command = [os.path.join(binaries, 'rpict'), '-x', str(size), '-y', str(size), '-ps', '1', '-ab', '0', '-ss', str(samples)]
    return lambda: run(command + view + [stem + '.oct'], stdout=stem + '.hdr', env=env)
