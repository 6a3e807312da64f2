"""Draws the differences of a Markdown table with their intervals: one row per difference, as a forest plot.

Input: the text of a table, the heading of the column with cells such as `+0.060 [+0.039, +0.080]`, and the headings of the columns that
name a row. Output: the text of an SVG file. Rows whose cell has no interval are left out. Nothing is computed here.
"""

import html
import re

CELL = re.compile(r"([+-−]?\d+\.\d+) \[([+-−]?\d+\.\d+), ([+-−]?\d+\.\d+)\]")
WIDTH, MARGIN, ROW, HEAD, FOOT = 820, 10, 24, 34, 44
# The width of a letter of a name, and that of the numbers at the right.
LETTER, NUMBERS = 7.3, 190
STYLE = """text { font: 13px system-ui, sans-serif; fill: #5a6672; font-variant-numeric: tabular-nums; }
.caption { font-weight: 600; } .name, .label { fill: #1b2127; } .mid { text-anchor: middle; } .end { text-anchor: end; }
.grid { stroke: #dde2e8; } .zero { stroke: #1b2127; stroke-dasharray: 4 3; }
.bar { stroke-width: 2.2; stroke-linecap: round; } .dot { stroke: #fff; stroke-width: 1.5; }
.sure .bar { stroke: #0072b2; } .sure .dot { fill: #0072b2; } .unsure .bar { stroke: #7d8894; } .unsure .dot { fill: #7d8894; }"""


def tables(text):
    """Yields the tables of a Markdown text. Each is a list of rows, and the first row has the headings."""
    for paragraph in text.split("\n\n"):
        lines = [line for line in paragraph.strip().splitlines() if line.startswith("|")]
        if len(lines) > 2:
            rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines]
            yield [rows[0], *rows[2:]]


def rows_of(table, column, names):
    """Returns the rows of a table that have an interval: a name, and the mean with the two ends of its interval."""
    head = table[0]
    value, labels = head.index(column), [head.index(name) for name in names]
    rows = []
    for row in table[1:]:
        found = CELL.search(row[value])
        if found:
            name = " · ".join(row[label].replace("`", "") for label in labels)
            rows.append((name.removeprefix("Δ "), *(float(part.replace("−", "-")) for part in found.groups())))
    return rows


def step_of(span):
    """Returns a round distance of about six ticks."""
    power = 10.0 ** int(f"{span / 6:e}".split("e")[1])
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= span / 6)


def shown(number):
    """Returns a number with its sign and three decimals, as in the tables."""
    return f"{number:+.3f}"


def forest(table, column, names, caption):
    """Returns the SVG text of the differences in a column."""
    rows = rows_of(table, column, names)
    if not rows:
        raise SystemExit(f"the column {column!r} has no interval")
    low, high = min(0, *(row[2] for row in rows)), max(0, *(row[3] for row in rows))
    step = step_of(high - low)
    first, last = int(low // step), int(-(-high // step))
    left = MARGIN + LETTER * max(len(row[0]) for row in rows) + 12
    right = WIDTH - NUMBERS
    place = lambda value: left + (value - first * step) / ((last - first) * step) * (right - left)
    bottom = HEAD + ROW * len(rows)

    size = f'width="{WIDTH}" height="{bottom + FOOT}"'
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {bottom + FOOT}" {size}>']
    svg += [f"<style>\n{STYLE}\n</style>", f'<rect {size} fill="#fff"/>']
    svg.append(f'<text class="caption" x="{MARGIN}" y="22">{html.escape(caption)}</text>')
    for tick in range(first, last + 1):
        x, kind = place(tick * step), "zero" if tick == 0 else "grid"
        svg.append(f'<path class="{kind}" d="M{x:.1f} {HEAD}V{bottom}"/>')
        svg.append(f'<text class="mid" x="{x:.1f}" y="{bottom + 16}">{tick * step:.2f}</text>')
    for number, (name, mean, lower, upper) in enumerate(rows):
        y = HEAD + ROW * (number + 0.5)
        svg.append(f'<g class="{"sure" if lower > 0 or upper < 0 else "unsure"}">')
        svg.append(f'<text class="name end" x="{left - 12:.1f}" y="{y + 4:.1f}">{html.escape(name)}</text>')
        svg.append(f'<path class="bar" d="M{place(lower):.1f} {y:.1f}H{place(upper):.1f}"/>')
        svg.append(f'<circle class="dot" cx="{place(mean):.1f}" cy="{y:.1f}" r="5"/>')
        svg.append(f'<text x="{right + 10}" y="{y + 4:.1f}">{shown(mean)} [{shown(lower)}, {shown(upper)}]</text></g>')
    svg.append(f'<text class="mid label" x="{(left + right) / 2:.1f}" y="{bottom + 36}">difference of the mean mIoU</text>')
    return "\n".join([*svg, "</svg>\n"])
