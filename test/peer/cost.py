#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a build costs: processor time and memory against incidences, samples and lobes: build/bench/cost.json, cost.txt.

A material is measured at more and more directions (goniometer -incidences, -samples) and built with one thread. Then these
models are fitted, by relative non-negative least squares, N incidences of S samples and L lobes:
  seconds = d + N (a + b S + c L),  bytes of memory = m + N (n + s S + l L),  bytes of the record if it is not packed = k + N (r + q L)
and extended to 100,000 incidences. There are three edges an incidence.
Last, `mpirun -np 2` is compared with one process, in turn.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.dirname(HERE)]
import measured  # noqa: E402
import stock  # noqa: E402
from measured import BUILD, WORK, binary  # noqa: E402

# incidences, samples, lobes (0: automatic)
FULL = ([(n, 1500, 0) for n in (30, 60, 120, 250, 500, 1000)] + [(60, 500, 0), (60, 5000, 0), (250, 500, 0), (250, 5000, 0), (1000, 5000, 0)]
        + [(120, 1500, lobes) for lobes in (30, 60, 240)])
QUICK = [(30, 500, 0), (60, 500, 0), (60, 1500, 0), (60, 5000, 0), (120, 1500, 0), (250, 1500, 0), (60, 1500, 30), (60, 1500, 240)]
MPI = dict(OMPI_ALLOW_RUN_AS_ROOT='1', OMPI_ALLOW_RUN_AS_ROOT_CONFIRM='1', OMP_NUM_THREADS='1', OMPI_MCA_mpi_yield_when_idle='1',
           OMPI_MCA_rmaps_base_oversubscribe='1')


def lay_out(material, incidences, samples):
    """Folder with the measurement, and its files."""
    folder = os.path.join(WORK, 'data', f'cost-{material}-{incidences}x{samples}')
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    stock.run([binary('goniometer'), '-incidences', str(incidences), '-samples', str(samples // 2), str(samples - samples // 2), '-held', '0',
               material, folder])
    return folder, measured.measurements(folder)


def cost(material, incidences, samples, lobes):
    folder, files = lay_out(material, incidences, samples)
    record = os.path.join(folder, 'cost.rbf')
    try:
        done = subprocess.run([sys.executable, os.path.join(HERE, 'stages.py'), os.path.join(BUILD, 'lib', 'libbsdfrbf.so'), str(lobes), record,
                               *files], capture_output=True, text=True)
        if done.returncode:
            raise stock.Failed(done.stderr.strip()[-300:])
        row = json.loads(done.stdout)
        info = subprocess.run([binary('rbfinfo'), record], capture_output=True, text=True, check=True).stdout
        count = next(line for line in info.splitlines() if line.strip().startswith('lobes:')).split()[1]
        row.update(incidences=incidences, samples=samples, lobes=int(count) / incidences, total=sum(row['seconds'].values()))
    finally:
        shutil.rmtree(folder)
    return row


def fit(rows, features, value):
    """Coefficients >= 0 that minimise the sum of squared relative residuals, and the largest of these."""
    a = np.array([features(r) for r in rows], float) / np.array([[value(r)] for r in rows], float)
    active = list(range(a.shape[1]))
    while active:  # few columns: drop the most negative one until none is
        x = np.linalg.lstsq(a[:, active], np.ones(len(rows)), rcond=None)[0]
        if (x >= 0).all():
            break
        del active[int(np.argmin(x * np.abs(a[:, active]).mean(0)))]
    full = np.zeros(a.shape[1])
    full[active] = x
    return full, float(np.abs(a @ full - 1).max())


MODELS = {
    'seconds': ('dabc', lambda r: [1, *(r['incidences'] * f for f in (1, r['samples'], r['lobes']))], lambda r: r['total']),
    'memory': ('mnsl', lambda r: [1, *(r['incidences'] * f for f in (1, r['samples'], r['lobes']))], lambda r: r['memory']),
    'record': ('krq', lambda r: [1, *(r['incidences'] * f for f in (1, r['lobes']))], lambda r: r['plain']),
}


def ranks(material, incidences, samples, rounds):
    """Wall and processor seconds of one process and of two ranks, one thread each; None if there is no MPI."""
    linked = subprocess.run(['ldd', binary('mkrbf')], capture_output=True, text=True).stdout
    if not shutil.which('mpirun') or 'libmpi' not in linked:
        return None
    folder, files = lay_out(material, incidences, samples)
    build = [binary('mkrbf'), '-n', '1', '-q', '-o', os.path.join(folder, 'cost.rbf'), *files]
    env = dict(os.environ, **MPI)
    try:
        return [list(t) for t in stock.interleaved([lambda: stock.run(build, env=env), lambda: stock.run(['mpirun', '-np', '2', *build], env=env)],
                                                   rounds)]
    finally:
        shutil.rmtree(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('-m', '--material', default='redirect', help='one of the goniometer (default %(default)s)')
    parser.add_argument('-q', '--quick', action='store_true', help='at most 250 incidences')
    options = parser.parse_args()
    if options.material not in measured.materials() or options.material.startswith('bench-'):
        parser.error(f'{options.material}: not a material of the goniometer')
    os.makedirs(WORK, exist_ok=True)
    os.environ['OMP_WAIT_POLICY'] = 'passive'
    said, rows = [], []

    def say(line):
        said.append(line)
        print(line, flush=True)

    stages = ['lobes', 'frames', 'learned frames', 'residual transport', 'tables']
    say(f'{"incidences":>10}{"samples":>9}{"lobes":>7}{"CPU s":>9}{"ms/edge":>9}{"memory MB":>11}{"record MB":>11}'
        + ''.join(f'{stage:>20}' for stage in stages) + ' (s)')
    for setting in QUICK if options.quick else FULL:
        row = cost(options.material, *setting)
        rows.append(row)
        say(f'{row["incidences"]:10}{row["samples"]:9}{row["lobes"]:7.0f}{row["total"]:9.2f}{1e3 * row["total"] / row["incidences"] / 3:9.1f}'
            f'{1e-6 * row["memory"]:11.1f}{1e-6 * row["bytes"]:11.2f}' + ''.join(f'{row["seconds"].get(stage, 0):20.2f}' for stage in stages))
    facts = {'machine': stock.machine(), 'material': options.material, 'rows': rows, 'models': {}, 'extended': []}
    for name, (letters, features, value) in MODELS.items():
        x, worst = fit(rows, features, value)
        facts['models'][name] = dict(zip(letters, x), largest_error=worst)
        say(f'{name}: ' + ', '.join(f'{letter} = {c:.3g}' for letter, c in zip(letters, x)) + f'; largest error {100 * worst:.0f} %')
    lobes = statistics.median(r['lobes'] for r in rows)
    for incidences in (1000, 10000, 100000):
        point = {'incidences': incidences, 'samples': 5000, 'lobes': lobes}
        for name, (letters, features, _) in MODELS.items():
            point[name] = float(np.dot(features(point), [facts['models'][name][letter] for letter in letters]))
        facts['extended'].append(point)
        say(f'{incidences} incidences of 5000 samples, {lobes:.0f} lobes: {point["seconds"] / 60:.1f} minutes of one core, '
            f'{1e-6 * point["memory"]:.0f} MB, a record of {1e-6 * point["record"]:.0f} MB, unless it is packed')
    pair = ranks(options.material, 120 if options.quick else 250, 1500, 1 if options.quick else 3)
    if pair:
        facts['ranks'] = {'one': pair[0], 'two': pair[1]}
        say(f'mpirun -np 2: {pair[1][0]:.1f} s by the clock, {pair[1][1] / 2:.1f} s of processor time each; one process '
            f'{pair[0][0]:.1f} s, {pair[0][1]:.1f} s')
    else:
        say('mpirun -np 2: mkrbf was built without MPI, or there is no mpirun')
    stem = os.path.join(WORK, 'cost')
    with open(stem + '.json', 'w') as f:
        json.dump(facts, f, indent=1)
    with open(stem + '.txt', 'w') as f:
        f.write('\n'.join(said) + '\n')
    print(f'written: {stem}.json, .txt')


if __name__ == '__main__':
    main()
