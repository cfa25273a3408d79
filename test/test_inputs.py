#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the cases of inputs.py on mkrbf; --slow those as well that take minutes. Environment: BUILD_DIR."""
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import inputs  # noqa: E402

BIN = os.path.join(os.environ.get('BUILD_DIR', os.path.join(HERE, '..', 'build')), 'bin')
QUERY_THETAS = (5, 20, 33, 50, 60)
DHR_TOLERANCE, VALUE_TOLERANCE = .05, .25


def query(record, *options, floats):
    done = subprocess.run([os.path.join(BIN, 'rbfquery'), '-ff', *options, record], input=struct.pack(f'{len(floats)}f', *floats), capture_output=True)
    if done.returncode:
        raise AssertionError('rbfquery: ' + done.stderr.decode())
    return struct.unpack(f'{len(done.stdout) // 4}f', done.stdout)


def answers(record):
    """f over a set of pairs of directions: what makes two files the same."""
    floats = []
    for t in QUERY_THETAS:
        for k in range(12):
            floats += inputs.vector(t, 0) + inputs.vector(7 * k + 2, 31 * k)
            floats += inputs.vector(t, 0) + inputs.vector(min(t + k / 2, 89), 180)
    return query(record, floats=floats)


def judge(case, record, plain):
    """What is wrong with the result, or ''."""
    found = answers(record)
    if not all(v >= 0 and math.isfinite(v) for v in found):
        return 'values that are negative or not finite'
    if case.want == 'same' and found != plain:
        return f'other values than of the plain files, by up to {max(abs(a - b) for a, b in zip(found, plain)):g}'
    for t0, p0, t1, p1, f, tolerance in case.pairs:
        got = query(record, floats=inputs.vector(t0, p0) + inputs.vector(t1, p1))[0]
        if not abs(got - f) <= tolerance * f:
            return f'f is {got:.4g} instead of {f:.4g} at {t0} degrees'
    if case.want == 'true':
        truth = case.truth or inputs.bsdf
        for t in (20, 40, 50):
            got, want = query(record, '-d', floats=inputs.vector(t, 0))[0], truth_dhr(truth, t)
            if not abs(got - want) <= DHR_TOLERANCE * want:
                return f'DHR is {got:.4f} instead of {want:.4f} at {t} degrees'
    return ''


def truth_dhr(truth, theta, memory={}):
    if (truth, theta) not in memory:
        memory[truth, theta] = inputs.dhr(theta, truth, 120)
    return memory[truth, theta]


def run(case, plain=None):
    """(outcome in words, what is wrong or '')."""
    folder = tempfile.mkdtemp()
    try:
        files, record = case.write(folder), os.path.join(folder, 'out.rbf')
        options = case.options or ['-l', '60']
        done = subprocess.run([os.path.join(BIN, 'mkrbf'), *options, '-n', '1', '-o', record, '--', *files], capture_output=True)
        said = done.stderr.decode(errors='replace')
        left = [name for name in os.listdir(folder) if name not in case.files and name != 'out.rbf']
        if left:
            return 'left files', f'left {left}'
        if done.returncode not in (0, 1):
            return f'exit {done.returncode}', f'exit {done.returncode}: {said[-300:]}'
        if case.want == 'refused':
            if done.returncode == 0:
                return 'accepted', 'accepted'
            if os.path.exists(record):
                return 'refused', 'left an output file'
            if not re.search(case.words, said, re.S):
                return 'refused', f'message lacks {case.words!r}: {said[:300]}'
            return 'refused', ''
        if done.returncode:
            return 'refused', f'refused: {said[:300]}'
        if not re.search(case.warns, said):
            return 'accepted', f'no warning {case.warns!r}: {said[:600]}'
        return 'accepted', judge(case, record, plain)
    finally:
        shutil.rmtree(folder)


def plain_answers():
    folder = tempfile.mkdtemp()
    try:
        files = inputs.Case('', '', inputs.plain(), 'true').write(folder)
        subprocess.run([os.path.join(BIN, 'mkrbf'), '-q', '-l', '60', '-n', '1', '-o', folder + '/out.rbf', *files], check=True)
        return answers(folder + '/out.rbf')
    finally:
        shutil.rmtree(folder)


def main():
    plain = plain_answers()
    chosen = [c for c in inputs.cases() if '--slow' in sys.argv or not c.slow]
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda c: run(c, plain), chosen))
    wrong = [(c, w) for c, (_, w) in zip(chosen, results) if w]
    for case, words in wrong:
        print(f'FAILED {case.kind}: {case.name}: {words}')
    print(f'{len(chosen)} inputs, {len(wrong)} wrong')
    return bool(wrong)


if __name__ == '__main__':
    sys.exit(main())
