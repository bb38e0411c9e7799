"""Plots of a study as small SVG files: every run a dot, one colour a group of runs, a line through its medians."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from html import escape
from pathlib import Path

from planner.study.claims import OVER_A_COLUMN
from planner.study.judge import Row, counted, number
from planner.study.record import Claim, Study

WIDTH, HEIGHT, LEFT, BOTTOM, TOP, RIGHT = 420, 260, 62, 42, 30, 12  # px
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")  # safe for the colour-blind
LOGARITHMIC = {"ergodicity"}


def write_plots(study: Study, rows: Sequence[Row], folder: Path) -> list[Path]:
    """One SVG for every pair of columns (and rows) a trend is about; trends without numbers get none."""
    written: list[Path] = []
    for claim in study.claims:
        if claim.trend not in OVER_A_COLUMN:
            continue
        where = "".join(f"_{value}" for value in claim.where.values())
        path = folder / f"{study.name}_{claim.y}_over_{claim.x.rpartition('.')[2]}{where}.svg"
        picture = plot(study, rows, claim)
        if picture and path not in written:
            path.write_text(picture, encoding="utf-8")
            written.append(path)
    return written


def plot(study: Study, rows: Sequence[Row], claim: Claim) -> str:
    """The dots of one claim, coloured by the first axis it leaves open; empty with fewer than two usable runs."""
    taken = {claim.x, *claim.where}
    axis = next((axis for axis in study.sweep if axis not in taken and len(study.sweep[axis]) > 1), None)
    dots = []
    for row in counted(study, rows):
        x, y = number(row, claim.x), number(row, claim.y)
        asked = all(row[key] == str(value) for key, value in claim.where.items())
        if asked and math.isfinite(x) and math.isfinite(y) and (claim.y not in LOGARITHMIC or y > 0.0):
            dots.append((x, math.log10(y) if claim.y in LOGARITHMIC else y, row[axis] if axis else ""))
    if len(dots) < 2:
        return ""
    keys = sorted({key for _, _, key in dots})
    xs, ys = _Scale([x for x, _, _ in dots], LEFT, WIDTH - RIGHT), _Scale([y for _, y, _ in dots], HEIGHT - BOTTOM, TOP)
    body = [
        f'<circle cx="{xs(x):.1f}" cy="{ys(y):.1f}" r="3.2" fill="{COLOURS[keys.index(key) % len(COLOURS)]}"/>'
        for x, y, key in dots
    ]
    if claim.x in study.sweep:
        body += [_medians([(x, y) for x, y, of in dots if of == key], xs, ys, i) for i, key in enumerate(keys)]
    legend = [
        f'<tspan fill="{COLOURS[i % len(COLOURS)]}"> ● {escape(key)}</tspan>' for i, key in enumerate(keys) if axis
    ]
    if legend:
        name = escape((axis or "").rpartition(".")[2])
        body.append(f'<text x="{WIDTH - RIGHT}" y="16" text-anchor="end">{name}{"".join(legend)}</text>')
    return "\n".join([*_frame(claim, xs, ys), *body, "</svg>", ""])


def _medians(points: Sequence[tuple[float, float]], xs: _Scale, ys: _Scale, colour: int) -> str:
    """A line through the median of every x."""
    middles = {x: statistics.median(y for other, y in points if other == x) for x in sorted({x for x, _ in points})}
    path = "L".join(f"{xs(x):.1f} {ys(y):.1f}" for x, y in middles.items())
    return f'<path d="M{path}" fill="none" stroke="{COLOURS[colour % len(COLOURS)]}" stroke-width="1.5"/>'


class _Scale:
    """Numbers to pixels, with a little room at both ends.

    Args:
        values: what has to fit. first: pixel of the smallest. last: pixel of the largest.
    """

    def __init__(self, values: Sequence[float], first: float, last: float) -> None:
        low, high = min(values), max(values)
        room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
        self.low, self.high, self.first, self.last = low - room, high + room, first, last

    def __call__(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.first + share * (self.last - self.first)

    def ticks(self) -> list[float]:
        """Four round numbers at most, inside the scale."""
        step = 10.0 ** math.floor(math.log10((self.high - self.low) / 2.0))
        step = next(step * k for k in (1.0, 2.0, 5.0, 10.0) if (self.high - self.low) / (step * k) <= 4.5)
        first = math.ceil(self.low / step)
        return [k * step for k in range(first, math.floor(self.high / step) + 1)]


def _frame(claim: Claim, xs: _Scale, ys: _Scale) -> list[str]:
    """Axes, ticks, labels."""
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        f'<text x="{LEFT}" y="16" font-weight="bold">{escape(claim.text)}</text>',
        f'<path d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{WIDTH - RIGHT}" fill="none" stroke="#444444"/>',
        f'<text x="{(LEFT + WIDTH) / 2}" y="{HEIGHT - 8}" text-anchor="middle">{escape(claim.x)}</text>',
        f'<text x="14" y="{HEIGHT / 2}" text-anchor="middle" transform="rotate(-90 14 {HEIGHT / 2})">'
        f"{escape(claim.y)}</text>",
    ]
    for value in xs.ticks():
        out.append(f'<text x="{xs(value):.1f}" y="{HEIGHT - BOTTOM + 15}" text-anchor="middle">{value:g}</text>')
    for value in ys.ticks():
        shown = f"{10**value:.1e}" if claim.y in LOGARITHMIC else f"{value:g}"
        out.append(f'<text x="{LEFT - 5}" y="{ys(value) + 4:.1f}" text-anchor="end">{shown}</text>')
        out.append(f'<path d="M{LEFT} {ys(value):.1f}H{WIDTH - RIGHT}" stroke="#dddddd"/>')
    return out
