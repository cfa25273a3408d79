#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the cases of inputs.py on mkrbf; --slow those as well that take minutes; --stock PROGRAM on Radiance's pabopto2bsdf
instead, and counts what becomes of them. Environment: BUILD_DIR."""
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
STOCK_SECONDS = 60  # then it is stopped


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


def judge(case, record, plain, same=lambda found, plain: found == plain):
    """What is wrong with the result, or ''."""
    found = answers(record)
    if not all(v >= 0 and math.isfinite(v) for v in found):
        return 'values that are negative or not finite'
    if case.want == 'same' and not same(found, plain):
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


def stock_result(program, case, folder):
    """(exit code or None, the interpolant that came of it as a file of ours or None)."""
    files, sir, record = case.write(folder), os.path.join(folder, 'out.sir'), os.path.join(folder, 'out.rbf')
    options = [o for o in case.options if o in ('-t', '-s', '-g') or not o.startswith('-')] if '-l' not in case.options else []
    try:
        with open(sir, 'wb') as f:
            code = subprocess.run([program, *options, *files], stdout=f, stderr=subprocess.DEVNULL, timeout=STOCK_SECONDS).returncode
    except subprocess.TimeoutExpired:
        return None, None
    made = not code and not subprocess.run([os.path.join(BIN, 'mkrbf'), '-q', '-n', '1', '-o', record, sir], capture_output=True).returncode
    return code, record if made else None


def stock(program, cases):
    """What becomes of the cases: a dictionary of counts."""
    def even(found, plain):
        return all(abs(a - b) <= .02 * abs(b) + 1e-4 for a, b in zip(found, plain))

    def one(case):
        folder = tempfile.mkdtemp()
        try:
            code, record = stock_result(program, case, folder)
            if code is None:
                return 'stopped after a minute'
            if code < 0:
                return 'crashed'
            if code:
                return 'refused, rightly' if case.want == 'refused' else 'refused, though good'
            if case.want == 'refused':
                return 'taken without a word, though bad'
            return 'taken, with wrong values' if not record or judge(case, record, plain, even) else 'taken, rightly'
        finally:
            shutil.rmtree(folder)
    folder = tempfile.mkdtemp()
    plain = answers(stock_result(program, inputs.Case('', '', inputs.plain(), 'true'), folder)[1])
    shutil.rmtree(folder)
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(one, cases))
    return {what: found.count(what) for what in sorted(set(found))}


def plain_answers():
    folder = tempfile.mkdtemp()
    try:
        files = inputs.Case('', '', inputs.plain(), 'true').write(folder)
        subprocess.run([os.path.join(BIN, 'mkrbf'), '-q', '-l', '60', '-n', '1', '-o', folder + '/out.rbf', *files], check=True)
        return answers(folder + '/out.rbf')
    finally:
        shutil.rmtree(folder)


def main():
    chosen = [c for c in inputs.cases() if '--slow' in sys.argv or not c.slow]
    if '--stock' in sys.argv:
        found = stock(sys.argv[sys.argv.index('--stock') + 1], chosen)
        print('stock: ' + ', '.join(f'{count} {what}' for what, count in found.items()))
        return False
    plain = plain_answers()
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda c: run(c, plain), chosen))
    wrong = [(c, w) for c, (_, w) in zip(chosen, results) if w]
    for case, words in wrong:
        print(f'FAILED {case.kind}: {case.name}: {words}')
    print(f'{len(chosen)} inputs, {len(wrong)} wrong')
    return bool(wrong)


if __name__ == '__main__':
    sys.exit(main())
