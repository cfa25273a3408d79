#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs our tools and the stock Radiance tools on the same measurements in one go; rewrites test/results.csv.

Measurements come from the project's goniometer and, for materials named bench-*, from ../shared/bench/gonio.py.
Errors are those of score.py. Ratios compare with the peer in the same run and are above 1 where we are better:
build time and evaluations a second of one random pair; render ratio is our time over the peer's, so below 1 is better.
The peer's interpolant (.sir) and tensor tree take minutes, so they are kept in build/bench/cache under a check sum of
the data; their times are then scaled by a calibration loop and marked "kept". The tree is asked at more directions than the
others: at the centres of its own cells alone its error would come out too small.
"""
import argparse
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.dirname(HERE)]
import score as scoring  # noqa: E402
import stock  # noqa: E402
from measured import BUILD, ROOT, VARIANTS, WORK, binary, chosen, materials, measure, measurements  # noqa: E402
from picture import picture  # noqa: E402
from table import merge  # noqa: E402

COLUMNS = ('material variant seed l1 l1_p95 dhr dhr_max peak peak_p95 logrmse beam predicted_l1 lobes bytes '
           'build_s build_cpu_s build_ratio build_cpu_ratio eval_ratio render_ratio peer sir_l1 sir_l1_p95 sir_dhr sir_logrmse sir_bytes '
           'sir_build_s sir_build_cpu_s tree_depth tree_l1 tree_build_s eval_ns tree_eval_ns').split()


def beam_error(folder, evaluate, channels):
    """Median relative error at the maxima that the goniometer declares; '' if it declares none."""
    path = os.path.join(folder, 'beams.bin')
    pairs = np.fromfile(path, '<f4').reshape(-1, 6) if os.path.exists(path) else np.empty((0, 6))
    if not len(pairs):
        return ''
    answers = np.empty((len(pairs), channels), '<f4')
    evaluate(pairs, answers)
    truth = np.fromfile(os.path.join(folder, 'beams_truth.bin'), '<f4').reshape(len(pairs), -1)
    return float(np.median(np.abs(scoring.luminance(answers) / scoring.luminance(truth) - 1)))


class Comparison:
    def __init__(self, options):
        self.options = options
        os.makedirs(WORK, exist_ok=True)
        self.stock = stock.Stock(WORK, options.force)
        self.loops = stock.Loops(WORK, os.path.join(BUILD, 'lib', 'libbsdfrbf.so'))
        if not self.stock.query and options.peers != 'none':
            print('accuracy: no bsdfquery (a full Radiance has it; set BSDFQUERY): errors of .sir files are left empty')

    def ours(self, row, folder, files):
        record = os.path.join(folder, 'ours.rbf')
        command = [binary('mkrbf'), '-n', '2', '-q', '-o', record, *files]
        row['build_s'], row['build_cpu_s'] = stock.median_run(command, limit=self.options.patience)
        row['bytes'] = os.path.getsize(record)
        model, one, many = self.loops.rbf(record)
        info, channels = self.loops.info(model), self.loops.ours.bsdfrbf_channels(model)
        row['lobes'], row['predicted_l1'] = info.lobes // max(info.incidences, 1), info.expected_error
        answers = os.path.join(folder, 'ours.bin')
        stock.run([binary('rbfquery'), '-ff', *(['-c'] if channels == 3 else []), record],
                  stdin=os.path.join(folder, 'query.bin'), stdout=answers)
        row.update(scoring.score(folder, answers))
        row['beam'] = beam_error(folder, one, channels)
        pairs = np.random.default_rng(1).permutation(np.fromfile(os.path.join(folder, 'query.bin'), '<f4').reshape(-1, 6))
        pairs = np.ascontiguousarray(pairs[:60000])
        row['eval_ns'] = 1e9 * stock.seconds_a_pair(one, pairs, channels)
        return record, pairs, channels

    def peers(self, row, folder, files, record, pairs, channels, symmetry, side, finer):
        """finer(cells): the folder with questions on a grid of at least that many cells a side."""
        key = stock.checksum(files)
        if self.options.peers == 'kept' and not self.stock.has(key, 'interpolant.sir'):
            return
        made = self.stock.interpolant(key, files, 2)
        if not made:
            row['peer'] = 'failed'
            return
        sir, row['sir_build_s'], row['sir_build_cpu_s'], fresh = made
        row['peer'], row['sir_bytes'] = 'same run' if fresh else 'kept', os.path.getsize(sir)
        if fresh:  # waiting on a busy machine cannot be scaled, work can
            row['build_ratio'] = row['sir_build_s'] / row['build_s']
        row['build_cpu_ratio'] = row['sir_build_cpu_s'] / row['build_cpu_s']
        answers = self.stock.query_sir(sir, folder, channels)
        if answers:
            row.update({'sir_' + k: v for k, v in scoring.score(folder, answers).items() if 'sir_' + k in COLUMNS})
        depth = self.options.depth[symmetry == 'isotropic']
        if not depth or self.options.peers == 'kept' and not self.stock.has(key, f'tree{depth}.xml'):
            return
        made = self.stock.tree(key, sir, depth)
        if not made:
            return
        xml, row['tree_build_s'], _, _ = made
        row['tree_depth'] = depth
        evaluate = self.loops.tree(xml)
        row['tree_eval_ns'] = 1e9 * stock.seconds_a_pair(evaluate, pairs, 1)
        row['eval_ratio'] = row['tree_eval_ns'] / row['eval_ns']
        if channels == 1:
            row['tree_l1'] = stock.tree_error(evaluate, finer(2 << depth))['l1']
        if self.options.render and os.path.exists(os.path.join(BUILD, 'radiance', 'bin', 'rpict')):
            ours, theirs = stock.interleaved([picture(BUILD, folder, file, side == 'T', 200) for file in (record, xml)])
            row['render_ratio'] = float(ours[1] / theirs[1])

    def compare(self, name, variant, seed):
        symmetry, side, theta = self.options.known[name]
        held, grid = self.options.questions
        folder = measure(name, theta, variant, seed, held, grid)
        files = measurements(folder)
        row = {'material': name, 'variant': variant, 'seed': seed}
        try:
            record, pairs, channels = self.ours(row, folder, files)
            if self.options.peers != 'none':
                self.peers(row, folder, files, record, pairs, channels, symmetry, side,
                           lambda cells: measure(name, theta, variant, seed, held, max(grid, cells)))
        except stock.Failed as error:
            print(f'accuracy: {name} {variant} {seed}: {error}', file=sys.stderr)
        return row


SHOWN = [('l1', 'L1'), ('l1_p95', 'p95'), ('dhr', 'DHR'), ('peak_p95', 'peak95'), ('logrmse', 'logrms'), ('beam', 'beam'),
         ('predicted_l1', 'pred'), ('lobes', 'lobes'), ('build_s', 'build s'), ('sir_l1', 'sir L1'), ('tree_l1', 'tree L1'),
         ('build_ratio', 'build x'), ('build_cpu_ratio', 'cpu x'), ('eval_ratio', 'eval x'), ('render_ratio', 'render'), ('peer', 'peer')]


def show(row):
    cells = []
    for column, _ in SHOWN:
        value = row.get(column)
        cells.append(f'{value:8.3g}' if isinstance(value, float) else f'{"-" if value in (None, "") else value:>8}')
    print(f'{row["material"]:15}{row["variant"]:8}{row["seed"]:4}' + ''.join(cells), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('-m', '--materials', help='names, separated by commas; "bench" and "own" name groups (default: all)')
    parser.add_argument('-s', '--seeds', default='7,11,23', help='default %(default)s')
    parser.add_argument('-v', '--variants', default='full', help='of %s, or all (default full)' % ', '.join(VARIANTS))
    parser.add_argument('-p', '--peers', choices=('all', 'kept', 'none'), default='all',
                        help='kept: only where their results are at hand; none: ours alone')
    parser.add_argument('-f', '--force', action='store_true', help='run the slow peers again')
    parser.add_argument('-q', '--quick', action='store_true', help='first seed, fewer questions, shallow trees, no pictures')
    parser.add_argument('-d', '--depth', default='5,6', help='tensor tree depths: anisotropic, isotropic; 0: none (default 5,6)')
    parser.add_argument('-o', '--output', default=os.path.join(ROOT, 'test', 'results.csv'))
    options = parser.parse_args()
    options.known = materials()
    options.render, options.questions, options.patience = not options.quick, (40, 64), 3
    options.depth = [int(d) for d in options.depth.split(',')]
    seeds = [int(s) for s in options.seeds.split(',')]
    if options.quick:
        seeds, options.depth, options.questions, options.patience = seeds[:1], [3, 5], (16, 48), 0
    names = chosen(parser, options.materials, options.known) if options.materials else list(options.known)
    variants = list(VARIANTS) if options.variants == 'all' else options.variants.split(',')
    for word in variants:
        if word not in VARIANTS:
            parser.error(f'{word}: not one of {", ".join(VARIANTS)}')
    comparison = Comparison(options)
    print(f'{"material":15}{"variant":8}seed' + ''.join(f'{title:>8}' for _, title in SHOWN))
    rows, lost = [], 0
    for name in names:
        for variant in variants:
            for seed in seeds:
                row = comparison.compare(name, variant, seed)
                show(row)
                lost += 'l1' not in row
                rows.append(row)
                merge(options.output, COLUMNS, [r for r in rows if 'l1' in r])
    print(f'written: {options.output}')
    if lost:
        sys.exit(f'accuracy: {lost} of {len(rows)} rows have no result of ours')


if __name__ == '__main__':
    main()
