#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Files of version 1 that are kept in golden/ (one for each component, and of later versions) still read, and answer what they answered when they
were written; the damaged ones are refused. --write makes answers.txt anew, for a version that means to change them. Environment: BUILD_DIR."""
import math
import os
import struct
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
GOLDEN = os.path.join(HERE, 'golden')
BIN = os.path.join(os.environ.get('BUILD_DIR', os.path.join(HERE, '..', 'build')), 'bin')
BAD = {'bad-cut.rbf': 'damaged', 'bad-byte.rbf': 'damaged', 'bad-line-ends.rbf': 'damaged', 'bad-empty.rbf': ''}
TOLERANCE = 1e-4  # other vector instructions sum in another order


def direction(theta, phi):
    t, p = math.radians(theta), math.radians(phi)
    return math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)


def query(name, options, vectors):
    done = subprocess.run([os.path.join(BIN, 'rbfquery'), '-ff', *options, os.path.join(GOLDEN, name)],
                          input=b''.join(struct.pack('3f', *v) for v in vectors), capture_output=True)
    assert done.returncode == 0, f'{name}: {done.stderr.decode()}'
    return struct.unpack(f'{len(done.stdout) // 4}f', done.stdout)


def answers(name):
    """f over directions on both sides."""
    front, out = name[1] == 'f', -1 if name[0] == 't' else 1
    vectors = []
    for t in (3, 30, 55, 80):
        for k in range(12):
            i, o = direction(t, 40 * t + 7), direction(7 * k + 2, 31 * k)
            side = 1 if front else -1
            vectors += (i[0], i[1], side * i[2]), (o[0], o[1], side * out * o[2])
    return query(name, [], vectors)


def means(name):
    """Mean outgoing direction: by quadrature over f cos, and of samples, whose tables are made on opening. (The content is made up, and
    no bound holds that a mesh of triangles gives.)"""
    x, y, z = direction(40, 70)
    incident = (x, y, z if name[1] == 'f' else -z)
    grid = [direction(t + .5, p) for t in range(180) for p in range(1, 360, 4)]  # of the sphere
    values = query(name, [], [v for o in grid for v in (incident, o)])
    weights = [f * abs(o[2]) * math.hypot(o[0], o[1]) for f, o in zip(values, grid)]
    drawn = query(name, ['-s', '40000'], [incident])
    count = len(drawn) // 3
    assert count > 30000, f'{name}: {count} samples'
    return [(sum(w * o[k] for w, o in zip(weights, grid)) / sum(weights), sum(drawn[k::3]) / count) for k in range(3)]


def main():
    path = os.path.join(GOLDEN, 'answers.txt')
    good = ('rf.rbf', 'rb.rbf', 'tf.rbf', 'tb.rbf', 'tf-1.1.rbf', 'tf-1.2.rbf', 'tf-1.3.rbf')
    found = {name: answers(name) for name in good}
    if '--write' in sys.argv:
        with open(path, 'w') as f:
            for name in good:
                f.write(' '.join([name] + [f'{v:.7g}' for v in found[name]]) + '\n')
    wrong = []
    with open(path) as f:
        for line in f:
            name, *kept = line.split()
            kept = [float(v) for v in kept]
            if len(kept) != len(found[name]) or not any(kept):
                wrong.append(f'{name}: {len(found[name])} values instead of {len(kept)}, or none but 0')
            for a, b in zip(found[name], kept):
                if not abs(a - b) <= TOLERANCE * max(abs(b), 1e-3 * max(kept)):
                    wrong.append(f'{name}: {a:g} instead of {b:g}')
    for name in good:
        for whole, sampled in means(name):
            if not abs(whole - sampled) < .04:
                wrong.append(f'{name}: samples have a mean of {sampled:.4f} instead of {whole:.4f}')
    for name, words in BAD.items():
        done = subprocess.run([os.path.join(BIN, 'rbfinfo'), os.path.join(GOLDEN, name)], capture_output=True, text=True)
        if done.returncode != 1 or words not in done.stderr or name not in done.stderr:
            wrong.append(f'{name}: exit {done.returncode}, {done.stderr!r}')
    print('\n'.join(wrong[:20]) or f'{len(good)} files answer as before, {len(BAD)} are refused')
    return bool(wrong)


if __name__ == '__main__':
    sys.exit(main())
