#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every path as a ratio to its peer, which is measured in turn with it: build/bench/speed.json, speed.txt and speed.svg.

  build, bytes       stock pabopto2bsdf; its interpolants are kept (build/bench/cache), their times scaled to the machine's pace now
  pair, sample, ..   a tensor tree (g5, isotropic g6) through Radiance's own library; the tree is made from our record, so its
                     error is that of its resolution alone: less than that of a tree of the stock tools
  .sir pair          bsdfquery, if there is one (set BSDFQUERY)
  transport          LEMON's network simplex on the full bipartite graph, on edges of the mesh as they come up while building
  exponentials       libm and libmvec
  picture            patched rpict, the same scene with the record and with the tree
Times are processor time, medians of rounds in turn; what is timed is kept on one core. A ratio is the peer's figure over ours: above
1 we are better. The chart shows a random pair's time against the error between measured incidences: points are numbers of
lobes (-l of mkrbf; "auto": as found from the data) and depths of trees.
"""
import argparse
import ctypes
import json
import os
import subprocess
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.dirname(HERE)]
import measured  # noqa: E402
import programs  # noqa: E402
import score as scoring  # noqa: E402
import stock  # noqa: E402
from chart import chart  # noqa: E402
from measured import BUILD, WORK, binary  # noqa: E402
from picture import picture  # noqa: E402

LOBES = ((20, 40, 80, 160, 320), (40, 160))  # settings of -l: full, quick
# What a ratio is to be at least, for anisotropic and for isotropic materials; None: no goal.
GOALS = {'build': (40, 8), 'bytes': (2, 2), 'pair': (1 / 1.5, None), 'L1': (10, None), 'pairs in one call': (1 / 1.2, None),
         'exitants at one incidence': (1, None), 'sample at one incidence': (3, None), 'sample at scattered incidences': (12, None),
         '.sir pair': (40, 40), 'transport': (3, 3), 'picture': (1 / 1.2, 1 / 1.2)}
# What a figure of ours is to be at most.
LIMITS = {'DHR': 50, 'DHR error to 80 degrees': .5, 'transport cost': 1e-6, 'open and one pair of 1 GB': 1, 'resident of 1 GB': 1000}


class Table:
    def __init__(self):
        self.rows = []
        print(f'{"material":16}{"":32}{"ours":>11}{"peer":>11} {"unit":6}{"ratio":>8}{"goal":>7}      peer', flush=True)

    def add(self, material, what, ours, peer, unit, name, isotropic=False):
        row = {'material': material, 'what': what, 'ours': float(ours), 'peer': None if peer is None else float(peer), 'unit': unit,
               'peer_name': name, 'ratio': None, 'goal': None, 'limit': LIMITS.get(what), 'met': None}
        if peer is not None:
            row['ratio'] = row['peer'] / row['ours']
            row['goal'] = GOALS.get(what, (None, None))[isotropic]
            if row['goal']:
                row['met'] = row['ratio'] >= row['goal']
        if row['limit']:
            row['met'] = row['ours'] <= row['limit']
        self.rows.append(row)
        print(self.line(row), flush=True)

    @staticmethod
    def line(row):
        cell = lambda value, width, mark='': f'{"" if value is None else mark + format(value, ".3g"):>{width}}'  # noqa: E731
        goal = cell(row['goal'], 7) if row['goal'] else cell(row['limit'], 7, '<')
        met = {None: '', True: 'met', False: 'MISSED'}[row['met']]
        return (f'{row["material"]:16}{row["what"]:32}{cell(row["ours"], 11)}{cell(row["peer"], 11)} {row["unit"]:6}'
                f'{cell(row["ratio"], 8)}{goal} {met:7}{row["peer_name"]}')


def times(record, tree, count=''):
    """{question: (ours, theirs)}, nanoseconds."""
    return {w[0]: (float(w[1]), float(w[2])) for w in programs.lines('timing', record, tree, *([count] if count else []))}


def sir_seconds(tools, sir, folder):
    """Seconds of a random pair at a new incidence, by bsdfquery."""
    pairs = np.fromfile(os.path.join(folder, 'query.bin'), '<f4').reshape(40, -1, 6)
    pairs = pairs[np.arange(40), np.random.default_rng(1).integers(pairs.shape[1], size=40)]
    path = os.path.join(folder, 'few.bin')

    def cost(count):
        pairs[:count].tofile(path)
        return stock.run([tools.query, '-ff', sir], stdin=path, env=tools.env)[1]
    few, many = stock.interleaved([lambda: cost(1), lambda: cost(40)])
    return float(many - few) / 39


def dhr_error(loops, model, transmit, count, limit):
    """Largest error against quadrature, per cent: midpoints of a 1024 x 1024 grid of equal solid angle, as f rises to the horizon where
    f cos does not end there, and cells of equal projected solid angle miss up to 2.5 %."""
    rng = np.random.default_rng(3)
    cells = 1024
    z, phi = np.meshgrid(*[(np.arange(cells) + .5) / cells * end for end in (1, 2 * np.pi)])
    r = np.sqrt(1 - z * z)
    out = np.stack([r * np.cos(phi), r * np.sin(phi), -z if transmit else z], -1).reshape(-1, 3).astype('<f4')
    worst, values, answer = 0, np.empty(len(out), '<f4'), np.empty(1, '<f4')
    for _ in range(count):
        theta, phi = np.arccos(1 - rng.random() * (1 - np.cos(np.radians(limit)))), 2 * np.pi * rng.random()
        incident = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], '<f4')
        loops.ours.bsdfrbf_eval_exitant(model, stock.address(incident), ctypes.c_size_t(len(out)), stock.address(out), stock.address(values))
        loops.ours.bsdfrbf_dhr(model, stock.address(incident), int(transmit), stock.address(answer))
        worst = max(worst, abs(float(answer[0]) / (2 * np.pi * (values * z.ravel()).mean(dtype=float)) - 1))
    return 100 * worst


class Bench:
    def __init__(self, options):
        self.options, self.table, self.panels = options, Table(), {}
        self.tools = stock.Stock(WORK, False)
        self.loops = stock.Loops(WORK, os.path.join(BUILD, 'lib', 'libbsdfrbf.so'))

    def material(self, name, symmetry, side, theta):
        quick, isotropic = self.options.quick, symmetry == 'isotropic'
        add = lambda *row: self.table.add(name, *row, isotropic)  # noqa: E731
        folder = measured.measure(name, theta, 'full', 7, 40, 64)
        fine = measured.measure(name, theta, 'full', 7, 40, 128)
        files, record = measured.measurements(folder), os.path.join(folder, 'speed.rbf')
        build = lambda lobes, path: stock.run([binary('mkrbf'), '-n', '2', '-q', *(['-l', str(lobes)] if lobes else []), '-o', path, *files])  # noqa: E731
        cpu = float(stock.interleaved([lambda: build(None, record)], 1 if quick else 3)[0][1])
        key = stock.checksum(files)
        sir = None
        if isotropic or not quick or self.tools.has(key, 'interpolant.sir'):
            sir = self.tools.interpolant(key, files, 2)
        if sir:
            add('build', cpu, sir[2], 's', 'pabopto2bsdf -n 2' + ('' if sir[3] else ', kept'))
            add('bytes', os.path.getsize(record), os.path.getsize(sir[0]), '', '.sir')
        chosen = 6 if isotropic else 5
        depths = {g: os.path.join(folder, f'tree{g}.xml') for g in ((4, 5, 6) if quick and not isotropic else (4, 5, 6, 7))}
        for g, tree in depths.items():
            stock.run([binary('rbf2ttree'), '-n', '2', '-g', str(g), '-o', tree, record])
        lobes = {None: record}
        info = self.loops.info(self.loops.rbf(record)[0])
        for setting in LOBES[quick]:
            if abs(setting / (info.lobes / max(info.incidences, 1)) - 1) > .1:
                lobes[setting] = os.path.join(folder, f'speed{setting}.rbf')
                build(setting, lobes[setting])
        with stock.on_one_core(self.options.core):
            self.questions(add, fine, record, depths[chosen], f'tensor tree g{chosen}', side == 'T')
            if sir and self.tools.query:
                self.interpolant(add, folder, fine, record, sir[0])
            if os.path.exists(os.path.join(BUILD, 'radiance', 'bin', 'rpict')):
                size = 200 if quick else 400
                ours, theirs = stock.interleaved([picture(BUILD, folder, f, side == 'T', size) for f in (record, depths[chosen])])
                add('picture', ours[1], theirs[1], 's', f'rpict {size} x {size}, tree g{chosen}')
            self.points(name, fine, lobes, depths)
            self.exponentials(add, record)
            self.transport(add, files)

    def error(self, record, folder):
        _, _, many = self.loops.rbf(record)
        return stock.tree_error(many, folder)['l1']

    def questions(self, add, fine, record, tree, peer, transmit):
        for what, (ours, theirs) in times(record, tree).items():
            add(what, ours, theirs, 'ns', peer)
        add('L1', self.error(record, fine), stock.tree_error(self.loops.tree(tree), fine)['l1'], '', peer)
        model = self.loops.rbf(record)[0]
        add('DHR error to 80 degrees', dhr_error(self.loops, model, transmit, 15 if self.options.quick else 60, 80), None, '%', 'quadrature')

    def interpolant(self, add, folder, fine, record, sir):
        _, one, _ = self.loops.rbf(record)
        pairs = np.random.default_rng(1).permutation(np.fromfile(os.path.join(folder, 'query.bin'), '<f4').reshape(-1, 6))
        pairs = np.ascontiguousarray(pairs[:20000])
        add('.sir pair', 1e9 * stock.seconds_a_pair(one, pairs, 1), 1e9 * sir_seconds(self.tools, sir, folder), 'ns', 'bsdfquery, new incidence')
        answers = self.tools.query_sir(sir, folder, 1)
        add('L1, .sir', self.error(record, fine), scoring.score(folder, answers)['l1'], '', 'bsdfquery')

    def points(self, name, fine, lobes, depths):
        """For the chart. Settings are timed in turn, like peers."""
        kinds = ['interpolant, -l', 'the same, pairs in one call', 'tensor tree of it, g']
        line = {kind: [] for kind in kinds}
        took = stock.interleaved([lambda path=path: list(times(path, depths[4], 2).values()) for path in lobes.values()])
        for (setting, path), ((pair, _), (at_once, _)) in zip(lobes.items(), took):
            error = self.error(path, fine)
            line[kinds[0]].append((pair, error, str(setting or 'auto')))
            line[kinds[1]].append((at_once, error, ''))
        took = stock.interleaved([lambda tree=tree: times(lobes[None], tree, 1)['pair'] for tree in depths.values()])
        for (g, tree), (_, pair) in zip(depths.items(), took):
            questions = measured.measure(name, self.options.known[name][2], 'full', 7, 40, max(128, 2 << g))
            line[kinds[2]].append((pair, stock.tree_error(self.loops.tree(tree), questions)['l1'], f'g{g}'))
        for kind in kinds[:2]:
            line[kind].sort(key=lambda point: point[1])
        self.panels[name] = line

    def exponentials(self, add, record):
        took = {w[0]: float(w[1]) for w in programs.lines('kernel', record)}
        add('lobe', took['kernel lobe'], took['libm exp'], 'ns', 'one exponential of libm')
        add('lobe', took['kernel lobe'], took['libmvec exp'], 'ns', 'one exponential of libmvec')
        add('pair, of exponentials alone', took['pair'], took['lobes of a pair'] * took['libmvec exp'], 'ns',
            f'{took["lobes of a pair"]:.0f} of libmvec')

    def transport(self, add, files):
        every = 1 + len(files) // (2 if self.options.quick else 6)
        try:
            rows = np.array(programs.lines('transport', every, *files), float)
        except stock.Failed as error:
            print(f'speed: no LEMON (liblemon-dev)? {str(error)[:200]}', file=sys.stderr)
            return
        if not len(rows):
            return
        add('transport', 1e3 * np.median(rows[:, 5]), 1e3 * np.median(rows[:, 6]), 'ms', f'LEMON, full graph, median of {len(rows)} edges')
        add('transport, all', 1e3 * rows[:, 5].sum(), 1e3 * rows[:, 6].sum(), 'ms', 'LEMON, full graph, total of the same')
        add('transport cost', np.max(np.abs(rows[:, 3] / rows[:, 4] - 1)), None, '', "largest difference from LEMON's optimum, relative")

    def large_file(self):
        """By the test that makes a record of 1 GB."""
        said = subprocess.run([os.path.join(BUILD, 'test', 'test_record_large')], capture_output=True, text=True)
        for line in (said.stdout + said.stderr).splitlines():
            words = line.replace(',', '').split()
            if 'GB:' in words:
                self.table.add('1 GB', 'open and one pair of 1 GB', float(words[words.index('query') + 1]) / 1000, None, 'ms', line)
                self.table.add('1 GB', 'resident of 1 GB', float(words[-3]), None, 'kB', '')

    def write(self):
        stem = os.path.join(WORK, 'speed')
        with open(stem + '.json', 'w') as f:
            json.dump({'machine': stock.machine(), 'quick': self.options.quick, 'rows': self.table.rows, 'points': self.panels}, f, indent=1)
        with open(stem + '.txt', 'w') as f:
            f.write('\n'.join(map(Table.line, self.table.rows)) + '\n')
        chart(stem + '.svg', self.panels, 'a random pair, ns', 'L1 between measured incidences')
        print(f'written: {stem}.json, .txt, .svg')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('-m', '--materials', help='names, separated by commas; "bench" and "own" name groups (default: bench, or what is like it)')
    parser.add_argument('-q', '--quick', action='store_true', help='two materials, fewer settings, slow peers only where they are kept')
    parser.add_argument('-c', '--core', type=int, help='core to keep to (default: the last one)')
    options = parser.parse_args()
    options.known = measured.materials()
    bench = [n for n in options.known if n.startswith('bench-')] or ['satin', 'brushed', 'sawtooth', 'redirect']
    names = measured.chosen(parser, options.materials, options.known) if options.materials else bench[:2] if options.quick else bench
    cores = sorted(os.sched_getaffinity(0))
    os.environ.update(OMP_WAIT_POLICY='passive')
    options.core = options.core if options.core in cores else cores[-1]
    bench = Bench(options)
    for name in names:
        try:
            bench.material(name, *options.known[name])
        except stock.Failed as error:
            print(f'speed: {name}: {error}', file=sys.stderr)
    bench.large_file()
    bench.write()


if __name__ == '__main__':
    main()
