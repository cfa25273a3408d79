#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""test/bench still measures what it says: its programs on a small measurement, its tables, chart and models. Nothing here looks at speed."""
import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, 'peer'), HERE]
import chart  # noqa: E402
import cost  # noqa: E402
import measured  # noqa: E402
import programs  # noqa: E402
import stock  # noqa: E402
import table  # noqa: E402

failed = 0


def check(name, right):
    global failed
    if not right:
        failed += 1
        print('FAILED:', name)


def run_programs(work):
    os.makedirs(measured.WORK, exist_ok=True)
    stock.run([measured.binary('goniometer'), '-samples', '250', '150', '-held', '3', '-grid', '16', 'retro', work])
    files, record, tree = measured.measurements(work), os.path.join(work, 'a.rbf'), os.path.join(work, 'a.xml')
    stock.run([measured.binary('mkrbf'), '-q', '-l', '30', '-o', record, *files])
    stock.run([measured.binary('rbf2ttree'), '-g', '4', '-o', tree, record])
    if os.path.exists(programs.RADIANCE + '/archive/libradiance-common.a'):
        rows = programs.lines('timing', record, tree)
        check('timing: ten questions', len(rows) == 10 and all(float(w) > 0 for row in rows for w in row[1:]))
    rows = dict(programs.lines('kernel', record))
    check('kernel: lobes are counted', 8 <= float(rows['lobes of a pair']) <= 200)
    check('kernel: exponentials are not left out', .05 < float(rows['libmvec exp']) < float(rows['libm exp']))
    if os.path.exists('/usr/include/lemon/network_simplex.h'):
        rows = np.array(programs.lines('transport', 5, *files), float)
        check('transport: problems are met', len(rows) > 0)
        check('transport: the same cost', np.allclose(rows[:, 3], rows[:, 4], rtol=1e-6))
    loops = stock.Loops(measured.WORK, os.path.join(measured.BUILD, 'lib', 'libbsdfrbf.so'))
    check('error of a record', stock.tree_error(loops.rbf(record)[2], work)['l1'] < .5)
    out = json_of(subprocess.run([sys.executable, os.path.join(HERE, 'peer', 'stages.py'), os.path.join(measured.BUILD, 'lib', 'libbsdfrbf.so'),
                                  '30', os.path.join(work, 'b.rbf'), *files], capture_output=True, text=True))
    check('stages: time and memory', out['seconds']['lobes'] > 0 and 1e5 < out['memory'] < 1e9)
    check('stages: the record of mkrbf', out['bytes'] > 0 and abs(out['bytes'] - os.path.getsize(record)) < 4096)


def json_of(done):
    if done.returncode:
        print(done.stderr)
    return json.loads(done.stdout)


def spoilt(work):
    path = os.path.join(work, 'one.txt')
    with open(path, 'w') as f:
        f.write('#head\n' + '10 20 1.5\n' * 4000)
    measured.spoil([path], .01, 7)
    rows = open(path).read().splitlines()
    values = [float(row.split()[2]) for row in rows[1:]]
    check('spoil: the head stays', rows[0] == '#head' and len(values) == 4000)
    check('spoil: about one in a hundred', 20 < sum(v != 1.5 for v in values) < 65 and set(values) == {0., 1.5, 15.})


def tables(work):
    path, columns = os.path.join(work, 't.csv'), ['m', 'v', 's', 'x', 'y']
    table.merge(path, columns, [{'m': 'b', 'v': 'full', 's': 11, 'x': 1.23456, 'y': None}, {'m': 'b', 'v': 'full', 's': 7, 'x': 2.}])
    table.merge(path, columns, [{'m': 'b', 'v': 'full', 's': 7, 'x': 3.}, {'m': 'a', 'v': 'full', 's': 7, 'x': 4.}])
    check('table', open(path).read() == 'm,v,s,x,y\na,full,7,4,\nb,full,7,3,\nb,full,11,1.235,\n')


def charts(work):
    path = os.path.join(work, 'c.svg')
    chart.chart(path, {'a & b': {'ours': [(100., .01, '20'), (300., .005, '80')], 'tree': [(200., .5, 'g4')]}}, 'ns', 'L1 <mean>')
    root = xml.etree.ElementTree.parse(path).getroot()
    circles = [e for e in root.iter() if e.tag.endswith('circle')]
    check('chart: three points and two of the legend', len(circles) == 5)


def models():
    _, features, _ = cost.MODELS['seconds']
    truth = np.array([5, .01, 2e-6, 0])
    rows = [{'incidences': n, 'samples': s, 'lobes': l} for n in (30, 100, 1000) for s in (500, 5000) for l in (50, 150)]
    for row in rows:
        row['total'] = float(np.dot(features(row), truth))
    found, worst = cost.fit(rows, features, lambda r: r['total'])
    check('model: its coefficients are found', np.allclose(found, truth, rtol=1e-6, atol=1e-9) and worst < 1e-6)
    for row in rows:
        row['total'] -= 1e-6 * row['incidences'] * row['lobes']
    found, _ = cost.fit(rows, features, lambda r: r['total'])
    check('model: none is negative', (found >= 0).all())


with tempfile.TemporaryDirectory() as folder:
    spoilt(folder)
    tables(folder)
    charts(folder)
    models()
    run_programs(os.path.join(folder, 'data'))
print('as it says' if not failed else f'{failed} failed')
sys.exit(failed > 0)
