#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What disturbed measurements do to the error between incidences; rewrites test/robustness.csv.

  half      every other incidence is missing       hole      no samples within 8 degrees of the source
  noisy     noise of 8 % in place of 2 %           cut       no samples beyond 75 degrees from the normal
  outliers  1 % of the values are 0 or tenfold     outside   questions up to 5 degrees beyond the last incidence
Columns: mean L1 of score.py with the undisturbed and with the disturbed data, how much it rose, L1 and rise of stock
pabopto2bsdf with the same data, and ours as a share of its. Its interpolants are kept in build/bench/cache under a check sum of
the data: an anisotropic one takes minutes, and a cell is empty where none was made (-p kept). They are evaluated by bsdfquery,
which not every Radiance has (set BSDFQUERY).
"""
import argparse
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.dirname(HERE)]
import measured  # noqa: E402
import score as scoring  # noqa: E402
import stock  # noqa: E402
from table import merge  # noqa: E402

OWN = ['film', 'retro', 'slats', 'translucent', 'white']
COLUMNS = 'material disturbance seed l1_clean l1 rise sir_l1_clean sir_l1 sir_rise share'.split()


def ours(folder, channels, threads):
    record, answers = os.path.join(folder, 'ours.rbf'), os.path.join(folder, 'ours.bin')
    stock.run([measured.binary('mkrbf'), '-n', str(threads), '-q', '-o', record, *measured.measurements(folder)])
    stock.run([measured.binary('rbfquery'), '-ff', *(['-c'] if channels == 3 else []), record],
              stdin=os.path.join(folder, 'query.bin'), stdout=answers)
    return scoring.score(folder, answers)['l1']


def theirs(tools, folder, channels, threads, kept):
    """L1; "failed"; or None if it is not known."""
    files = measured.measurements(folder)
    key = stock.checksum(files)
    if kept and not tools.has(key, 'interpolant.sir'):
        return None
    made = tools.interpolant(key, files, threads)
    if not made:
        return 'failed'
    answers = tools.query_sir(made[0], folder, channels)
    return scoring.score(folder, answers)['l1'] if answers else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('-m', '--materials', help=f'names, separated by commas; "bench" and "own" name groups (default bench,{",".join(OWN)})')
    parser.add_argument('-v', '--disturbances', default=','.join(list(measured.VARIANTS)[1:]), help='default %(default)s')
    parser.add_argument('-s', '--seed', type=int, default=7, help='default %(default)s')
    parser.add_argument('-p', '--peers', choices=('all', 'kept'), default='all', help='kept: only where their results are at hand')
    parser.add_argument('-n', '--threads', type=int, default=2, help='of both builders (default %(default)s)')
    parser.add_argument('-o', '--output', default=os.path.join(measured.ROOT, 'test', 'robustness.csv'))
    options = parser.parse_args()
    known = measured.materials()
    names = measured.chosen(parser, options.materials or ','.join(['bench'] * ('bench-satin' in known) + OWN), known)
    disturbances = options.disturbances.split(',')
    for word in disturbances:
        if word not in measured.VARIANTS:
            parser.error(f'{word}: not one of {", ".join(measured.VARIANTS)}')
    tools = stock.Stock(measured.WORK, False)
    if not tools.query:
        print('robustness: no bsdfquery (a full Radiance has it; set BSDFQUERY): errors of .sir files are left empty')
    print(''.join(f'{c:>13}' for c in COLUMNS))
    rows = []
    for name in names:
        clean = None
        for variant in ['full', *disturbances]:
            folder = measured.measure(name, known[name][2], variant, options.seed, 40, 64)
            channels = 3 if name == 'film' else 1
            pair = ours(folder, channels, options.threads), theirs(tools, folder, channels, options.threads, options.peers == 'kept')
            if variant == 'full':
                clean = pair
                continue
            row = {'material': name, 'disturbance': variant, 'seed': options.seed, 'l1_clean': clean[0], 'l1': pair[0],
                   'rise': pair[0] - clean[0], 'sir_l1_clean': clean[1], 'sir_l1': pair[1]}
            if isinstance(pair[1], float):
                row['share'] = pair[0] / pair[1]
                row['sir_rise'] = pair[1] - clean[1] if isinstance(clean[1], float) else None
            rows.append(row)
            print(''.join(f'{v:13.4f}' if isinstance(v, float) else f'{"-" if v is None else v:>13}' for v in map(row.get, COLUMNS)), flush=True)
            merge(options.output, COLUMNS, rows)
    print(f'written: {options.output}')


if __name__ == '__main__':
    main()
