#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The sun on a panel of each bench material, behind it or before it, and the irradiance of a floor before its front.

Truth is quadrature over the panel of the formula in ../shared/bench/gonio.py. Beside it: the same quadrature with rbfquery's
values, that with radiances that the patched rtrace finds with the .rbf file, and with a tensor tree of the same file.
Columns: error of the mean over the floor, and of the worst of its points relative to that mean, in per cent.
"""
import argparse
import os
import subprocess
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import measured  # noqa: E402
import stock  # noqa: E402

sys.path.insert(0, os.path.join(measured.SHARED, 'bench'))
import gonio  # noqa: E402

RADIANCE, WORK = os.path.join(measured.BUILD, 'radiance'), os.path.join(measured.WORK, 'sun')
SUNS = ((0, 0), (20, 35), (38, 290), (52, 155), (65, 250))  # theta, phi, degrees
SOLID = 2 * np.pi * (1 - np.cos(np.radians(.533 / 2)))
HALF, HEIGHT, CELLS = 2., 2., 120  # half side of the panel, distance of the floor, cells along a side of the panel
SCENE = """void light l 0 0 3 1e4 1e4 1e4
l source sun 0 0 4 {0} {1} {2} .533
void BSDF m 6 0 {3} 0 1 0 . 0 0
m polygon panel 0 0 12 -{4} -{4} 0 {4} -{4} 0 {4} {4} 0 -{4} {4} 0
"""


def rtrace(sun, name, rays):
    """Radiance along each ray that hits the panel."""
    with open(os.path.join(WORK, 'sun.rad'), 'w') as f:
        f.write(SCENE.format(*sun, name, HALF))
    env = dict(os.environ, RAYPATH=f'{WORK}:{RADIANCE}/lib')
    with open(os.path.join(WORK, 'sun.oct'), 'wb') as f:
        subprocess.run([RADIANCE + '/bin/oconv', WORK + '/sun.rad'], stdout=f, check=True, env=env)
    done = subprocess.run([RADIANCE + '/bin/rtrace', '-h', '-w', '-fff', '-ab', '0', '-dj', '0', '-ss', '0', '-dt', '0', WORK + '/sun.oct'],
                          input=rays.astype('<f4').tobytes(), stdout=subprocess.PIPE, check=True, env=env)
    return np.frombuffer(done.stdout, '<f4').reshape(-1, 3)[:, 1].astype(float)


def judge(name, depth):
    symmetry, side, theta = measured.BENCH[name]
    folder = measured.measure(name, theta, 'full', 7, 40, 64)
    record, tree = os.path.join(WORK, name + '.rbf'), os.path.join(WORK, f'{name}{depth}.xml')
    files = [os.path.join(folder, f) for f in sorted(os.listdir(folder)) if f.endswith('.dat')]
    stock.run([measured.binary('mkrbf'), '-q', '-o', record, *files])
    wall, _ = stock.run([measured.binary('rbf2ttree'), '-g', str(depth), '-o', tree, record])
    at = (np.arange(CELLS) + .5) / CELLS * 2 * HALF - HALF
    panel = np.stack(np.meshgrid(at, at, [0.]), -1).reshape(-1, 3)
    floor = np.stack(np.meshgrid([-1.5, -.5, .5, 1.5], [-1.5, -.5, .5, 1.5], [HEIGHT]), -1).reshape(-1, 3)
    out = (floor[:, None] - panel).reshape(-1, 3)
    distance = np.linalg.norm(out, axis=1)
    out /= distance[:, None]
    rays = np.concatenate([np.repeat(floor, len(panel), 0), -out], 1)
    weight = (out[:, 2]**2 / distance**2).reshape(len(floor), -1) * (2 * HALF / CELLS)**2
    truth = gonio.MATS[name[6:]]().f
    print(f'{name}, tree 2^{depth} in {wall:.0f} s')
    for angles in SUNS:
        sun = gonio.sph(*np.array(angles, float)) * [1, 1, 1 if side == 'R' else -1]
        scale = 1e4 * SOLID * abs(sun[2]) * weight
        suns = np.broadcast_to(sun, out.shape)  # f(view, sun), as a renderer asks; reciprocity makes it the light's way
        want = (truth(out, suns).reshape(weight.shape) * scale).sum(1)
        pairs = np.concatenate([out, suns], 1).astype('<f4').tobytes()
        values = subprocess.run([measured.binary('rbfquery'), '-ff', record], input=pairs, stdout=subprocess.PIPE, check=True).stdout
        found = {'quadrature': (np.frombuffer(values, '<f4').reshape(weight.shape) * scale).sum(1)}
        for label, path in (('rtrace', record), ('tree', tree)):
            found[label] = (rtrace(sun, os.path.basename(path), rays).reshape(weight.shape) * weight).sum(1)
        print(f'  sun {angles[0]:2} {angles[1]:3}   floor {want.mean():8.4f}   ' + '   '.join(
            f'{label} {100 * (e.mean() / want.mean() - 1):+6.2f} {100 * np.abs(e - want).max() / want.mean():6.2f}'
            for label, e in found.items()), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('-d', '--depth', default=6, type=int, help='of the tensor tree (default %(default)s)')
    parser.add_argument('materials', nargs='*', default=list(measured.BENCH), help='default: all of the bench')
    options = parser.parse_args()
    os.makedirs(WORK, exist_ok=True)
    for name in options.materials:
        judge(name, options.depth)


if __name__ == '__main__':
    main()
