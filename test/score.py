#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""score.py FOLDER ANSWERS: judges float32 answers to FOLDER/query.bin by the truth that lies beside it.

Per held-out incidence, over cells of equal projected solid angle (so that means are integrals over cos dw):
  l1       integral of |answer - truth| cos over the integral of truth cos; mean and 95th percentile
  dhr      relative error of the integral (channel Y); mean and largest
  peak     angle between the two maxima, degrees (channel Y); median and 95th percentile
  logrmse  root mean square of ln(answer/truth) where the truth is above 1 % of its maximum (channel Y)
  zeros    share of answers that are not positive
"""
import os
import sys

import numpy as np


def load(folder):
    """(incident [n, 3], outgoing [n, m, 3], truth [n, m, channels]) of a folder made by a goniometer."""
    query = np.fromfile(os.path.join(folder, 'query.bin'), '<f4').reshape(-1, 6)
    path = os.path.join(folder, 'truth.bin')
    truth = np.fromfile(path, '<f4') if os.path.exists(path) else np.load(os.path.join(folder, 'truth.npy'))
    # The incident vector is constant within a block: the first change gives the block's length.
    changes = np.nonzero((query[1:, :3] != query[:-1, :3]).any(1))[0]
    cells = int(changes[0]) + 1 if len(changes) else len(query)
    query = query.reshape(-1, cells, 6).astype(float)
    return query[:, 0, :3], query[..., 3:], truth.astype(float).reshape(len(query), cells, -1)


def luminance(values):
    return values[..., 1] if values.shape[-1] == 3 else values[..., 0]


def each(outgoing, truth, answers):
    """Arrays with one entry an incidence: l1, dhr, peak; and the flat array of logarithms behind logrmse."""
    answers = np.where(np.isfinite(answers), answers, 1e3)  # an infinity is a gross error, not an absent one
    l1 = np.abs(answers - truth).sum((1, 2)) / truth.sum((1, 2))
    y, t = luminance(answers), luminance(truth)
    dhr = np.abs(y.sum(1) / t.sum(1) - 1)
    row = np.arange(len(t))
    cosine = (outgoing[row, y.argmax(1)] * outgoing[row, t.argmax(1)]).sum(1)
    peak = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    large = t > .01 * t.max(1, keepdims=True)
    return l1, dhr, peak, np.log(np.maximum(y[large], 1e-6) / t[large])


def score(folder, answers):
    """answers: array or file name. Returns a dictionary of figures."""
    _, outgoing, truth = load(folder)
    if isinstance(answers, (str, os.PathLike)):
        answers = np.fromfile(answers, '<f4')
    if answers.size != truth.size:
        raise ValueError(f'{answers.size} answers to {truth.size} questions of {folder}')
    answers = answers.astype(float).reshape(truth.shape)
    l1, dhr, peak, log = each(outgoing, truth, answers)
    return {'l1': l1.mean(), 'l1_p95': np.quantile(l1, .95), 'dhr': dhr.mean(), 'dhr_max': dhr.max(),
            'peak': np.median(peak), 'peak_p95': np.quantile(peak, .95), 'logrmse': np.sqrt(np.mean(log ** 2)),
            'zeros': np.mean(~(answers > 0))}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    print('  '.join(f'{name} {value:.4f}' for name, value in score(*sys.argv[1:]).items()))


if __name__ == '__main__':
    main()
