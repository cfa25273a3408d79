# SPDX-License-Identifier: BSD-3-Clause
"""Tables of figures in the repository, whose change shows in review."""
import csv
import os


def text(value):
    if value is None or value == '':
        return ''
    return f'{value:.4g}' if isinstance(value, float) else str(value)


def merge(path, columns, rows, keys=3):
    """Rewrites the table: rows of this run replace those that agree with them in the first `keys` columns."""
    key = lambda row: tuple(str(row[c]) for c in columns[:keys])  # noqa: E731
    table = {}
    if os.path.exists(path):
        with open(path, newline='') as f:
            table = {key(row): row for row in csv.DictReader(f)}
    table.update({key(row): {c: text(row.get(c)) for c in columns} for row in rows})
    with open(path + '.part', 'w', newline='') as f:
        writer = csv.DictWriter(f, columns, extrasaction='ignore', lineterminator='\n')
        writer.writeheader()
        writer.writerows(sorted(table.values(), key=lambda row: [(len(w), w) if w.isdigit() else (0, w) for w in key(row)]))
    os.replace(path + '.part', path)
