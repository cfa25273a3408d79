# SPDX-License-Identifier: BSD-3-Clause
"""A chart of run time against error as SVG: logarithmic axes, a panel a material, a marked line a method."""
import math
from xml.sax.saxutils import escape

COLOURS = ['#b2182b', '#ef8a62', '#2166ac', '#67a9cf', '#555555']
WIDTH, HEIGHT, LEFT, TOP, RIGHT, BOTTOM = 520, 330, 58, 34, 14, 46


def span(values):
    """Ends of a logarithmic axis that holds the values, with some room."""
    low, high = math.log10(min(values)), math.log10(max(values))
    room = max(.08 * (high - low), .08)
    return low - room, high + room


def marks(low, high):
    digits = (1, 2, 5) if high - low > .7 else range(1, 10)
    for decade in range(math.floor(low), math.ceil(high) + 1):
        for digit in digits:
            at = decade + math.log10(digit)
            if low <= at <= high:
                yield at, f'{digit * 10 ** decade:.6g}'


def panel(title, series, x_title, y_title):
    """series: {method: [(x, y, label)]}."""
    points = [p for line in series.values() for p in line]
    (x0, x1), (y0, y1) = span([p[0] for p in points]), span([p[1] for p in points])
    across = lambda x: LEFT + (x - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT)  # noqa: E731
    down = lambda y: HEIGHT - BOTTOM - (y - y0) / (y1 - y0) * (HEIGHT - TOP - BOTTOM)  # noqa: E731
    out = [f'<text x="{WIDTH / 2}" y="20" class="title" text-anchor="middle">{escape(title)}</text>']
    for at, text in marks(x0, x1):
        out.append(f'<path class="grid" d="M{across(at):.1f} {TOP}V{HEIGHT - BOTTOM}"/>'
                   f'<text x="{across(at):.1f}" y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{text}</text>')
    for at, text in marks(y0, y1):
        out.append(f'<path class="grid" d="M{LEFT} {down(at):.1f}H{WIDTH - RIGHT}"/>'
                   f'<text x="{LEFT - 6}" y="{down(at) + 4:.1f}" text-anchor="end">{text}</text>')
    out.append(f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{HEIGHT - TOP - BOTTOM}" class="frame"/>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{escape(x_title)}</text>')
    out.append(f'<text transform="translate(14 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">{escape(y_title)}</text>')
    for n, (method, line) in enumerate(series.items()):
        colour = COLOURS[n % len(COLOURS)]
        places = [(across(math.log10(x)), down(math.log10(y)), label) for x, y, label in line]
        out.append(f'<polyline points="{" ".join(f"{x:.1f},{y:.1f}" for x, y, _ in places)}" fill="none" stroke="{colour}"/>')
        for x, y, label in places:
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"><title>{escape(method)} {escape(label)}</title></circle>'
                       f'<text x="{x + 5:.1f}" y="{y - 5:.1f}" fill="{colour}">{escape(label)}</text>')
    return out


def legend(methods):
    out = []
    for n, method in enumerate(methods):
        colour, y = COLOURS[n % len(COLOURS)], 16 + 17 * n
        out.append(f'<circle cx="{LEFT}" cy="{y - 4}" r="3.5" fill="{colour}"/><text x="{LEFT + 10}" y="{y}">{escape(method)}</text>')
    return out


def chart(path, panels, x_title, y_title):
    """panels: {title: {method: [(x, y, label)]}}; all have the same methods in the same order."""
    methods = list(next(iter(panels.values())))
    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    foot = 17 * len(methods) + 14
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH * columns}" height="{HEIGHT * rows + foot}" '
           'font-family="sans-serif" font-size="11">',
           '<style>.title{font-size:14px}.grid{stroke:#ddd}.frame{fill:none;stroke:#888}</style><rect width="100%" height="100%" fill="white"/>']
    for n, (title, series) in enumerate(panels.items()):
        out += [f'<g transform="translate({n % columns * WIDTH} {n // columns * HEIGHT})">', *panel(title, series, x_title, y_title), '</g>']
    out += [f'<g transform="translate(0 {HEIGHT * rows})">', *legend(methods), '</g></svg>']
    with open(path, 'w') as f:
        f.write('\n'.join(out) + '\n')
