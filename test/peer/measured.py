# SPDX-License-Identifier: BSD-3-Clause
"""Measurements that the parts of test/bench work on: from the project's goniometer and, for materials named bench-*, from
../shared/bench/gonio.py. Each is made once, into build/bench/data."""
import os
import shutil
import subprocess
import sys

import numpy as np

from stock import run

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BUILD = os.environ.get('BUILD_DIR', os.path.join(ROOT, 'build'))
SHARED = os.environ.get('SHARED_DIR', os.path.join(ROOT, '..', 'shared'))
WORK = os.path.join(BUILD, 'bench')
BENCH = {'bench-satin': ('isotropic', 'T', 80), 'bench-brushed': ('quadrilateral', 'R', 80),
         'bench-sawtooth': ('bilateral', 'R', 72), 'bench-lcp': ('anisotropic', 'T', 75)}
# How the measurement departs from the default: options of either goniometer, without their dashes; `spoil` is done here
# for the one that has no such option.
VARIANTS = {'full': [], 'half': ['every', '2'], 'noisy': ['noise', '.08'], 'hole': ['hole', '8'], 'cut': ['maxout', '75'],
            'outliers': ['spoil', '.01'], 'outside': None}


def binary(name):
    return os.path.join(BUILD, 'bin', name)


def materials():
    """name: (symmetry, 'R' or 'T', largest polar angle of incidence)"""
    known = {}
    if os.path.exists(os.path.join(SHARED, 'bench', 'gonio.py')):
        known.update(BENCH)
    listing = subprocess.run([binary('goniometer'), '-list'], check=True, capture_output=True, text=True).stdout
    for line in listing.splitlines():
        name, symmetry, side, _, theta = line.split()[:5]
        known[name] = (symmetry, side, float(theta))
    return known


def chosen(parser, text, known):
    """Names of materials from an option's words, of which "bench" and "own" are groups."""
    groups = {'bench': [n for n in known if n.startswith('bench-')], 'own': [n for n in known if not n.startswith('bench-')]}
    names = [n for word in text.split(',') for n in groups.get(word, [word])]
    for name in names:
        if name not in known:
            parser.error(f'{name}: not one of {", ".join(known)}')
    return names


def spoil(files, share, seed):
    """As the goniometer's -spoil: values of a share of the rows become 0 or ten times as large."""
    draw = np.random.default_rng(seed)
    for name in files:
        lines = open(name).read().splitlines()
        for k, line in enumerate(lines):
            if not line.startswith('#') and draw.random() < share:
                words = line.split()
                factor = 0. if draw.random() < .5 else 10.
                lines[k] = ' '.join(words[:2] + [f'{factor * float(w):.6g}' for w in words[2:]])
        with open(name, 'w') as f:
            f.write('\n'.join(lines) + '\n')


def measurements(folder):
    return sorted(os.path.join(folder, f) for f in os.listdir(folder) if f.endswith('.dat') or f.endswith('.txt') and f[0].isdigit())


def measure(name, theta, variant, seed, held, grid):
    """Folder with the measurement, made if it is not there."""
    if name == 'narrow':
        held, grid = min(held, 12), max(grid, 256)  # its peak falls between coarser cells
    folder = os.path.join(WORK, 'data', f'{name}-{variant}-{seed}-{held}x{grid}')
    done, bench = os.path.join(folder, '.done'), name.startswith('bench-')
    maker = os.path.join(SHARED, 'bench', 'gonio.py') if bench else binary('goniometer')
    if os.path.exists(done) and os.path.getmtime(done) > os.path.getmtime(maker):
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    options = ['theta', str(theta), str(theta + 5)] if variant == 'outside' else list(VARIANTS[variant])
    spoilt = float(options[1]) if bench and options[:1] == ['spoil'] else 0
    options = ([] if spoilt else options) + ['seed', str(seed), 'held', str(held), 'grid', str(grid)]
    words = [('--' if bench else '-') + o if o.isalpha() else o for o in options]
    run([sys.executable, maker, name[6:], folder, *words] if bench else [maker, *words, name, folder])
    if spoilt:
        spoil(measurements(folder), spoilt, seed)
    open(done, 'w').close()
    return folder
