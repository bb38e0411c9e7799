"""The paper's claims against the rows of a study's table."""

from __future__ import annotations

import itertools
import math
import statistics
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from planner.study.claims import BETWEEN_GROUPS
from planner.study.record import Claim, Study

Row = Mapping[str, str]
CLEAR = 0.3  # |τ| from which a trend is one
NEAR = 2.0  # a ratio within this factor of the paper's agrees with it


@dataclass(frozen=True)
class Verdict:
    """What came of a claim.

    Attributes:
        found: ``agrees``, ``agrees in direction only``, ``the opposite``, ``no clear trend``, ``no clear difference``
            or ``too few runs``.
        figures: the numbers behind it, in words; empty with too few runs.
    """

    found: str
    figures: str = ""

    def __str__(self) -> str:
        return f"**{self.found}** ({self.figures})" if self.figures else self.found


def judge(claim: Claim, study: Study, rows: Sequence[Row]) -> Verdict:
    """Hold a claim against the rows that count (see :func:`counted`)."""
    used = [
        row
        for row in counted(study, rows)
        if all(row[axis] == str(label) for axis, label in claim.where.items()) and math.isfinite(number(row, claim.y))
    ]
    return _ratio(claim, study, used) if claim.trend in BETWEEN_GROUPS else _trend(claim, used)


def counted(study: Study, rows: Sequence[Row]) -> list[Row]:
    """Rows of feasible plans; of the reference's runs all, as in the paper."""
    return [row for row in rows if row["feasible"] == "True" or study.stage == "reference"]


def number(row: Row, column: str) -> float:
    """A cell as a number; NaN where there is none."""
    try:
        return float(row.get(column) or "nan")
    except ValueError:
        return math.nan


def _trend(claim: Claim, rows: Sequence[Row]) -> Verdict:
    strata: dict[tuple[str, ...], list[tuple[float, float]]] = defaultdict(list)
    for row in rows:
        point = number(row, claim.x), number(row, claim.y)
        if math.isfinite(point[0]):
            strata[tuple(row[axis] for axis in claim.within)].append(point)
    tau = kendall(*strata.values())
    if math.isnan(tau):
        return Verdict("too few runs")
    signed = tau if claim.trend == "rises" else -tau
    found = "agrees" if signed >= CLEAR else "the opposite" if signed <= -CLEAR else "no clear trend"
    return Verdict(found, f"τ = {tau:+.2f}, n = {sum(map(len, strata.values()))}")


def kendall(*strata: Sequence[tuple[float, float]]) -> float:
    """Kendall's τ_b of (x, y) pairs, compared within strata only; NaN if either never varies."""
    concordant = x_tied = y_tied = total = 0
    for (x, y), (a, b) in itertools.chain.from_iterable(itertools.combinations(points, 2) for points in strata):
        total += 1
        x_tied += x == a
        y_tied += y == b
        concordant += (x - a) * (y - b) > 0
        concordant -= (x - a) * (y - b) < 0
    scale = math.sqrt((total - x_tied) * (total - y_tied))
    return concordant / scale if scale else math.nan


def _ratio(claim: Claim, study: Study, rows: Sequence[Row]) -> Verdict:
    """Every run of one group over every run of the other at the same point of the axes that are left."""
    left = [axis for axis in study.sweep if axis not in {*claim.of, *claim.to}]
    groups: list[dict[tuple[str, ...], list[float]]] = []
    for labels in (claim.of, claim.to):
        group: dict[tuple[str, ...], list[float]] = defaultdict(list)
        for row in rows:
            if all(row[axis] == str(label) for axis, label in labels.items()):
                group[tuple(row[axis] for axis in left)].append(number(row, claim.y))
        groups.append(group)
    above, below = groups
    ratios = [a / b for point in above for a in above[point] for b in below.get(point, ()) if b > 0.0]
    if not ratios:
        return Verdict("too few runs")
    low, middle, high = quartiles(ratios)
    if low <= 1.0 <= high:
        found = "no clear difference"
    elif (high < 1.0) != (claim.trend == "below"):
        found = "the opposite"
    elif claim.paper is not None and not 1.0 / NEAR <= middle / claim.paper <= NEAR:
        found = "agrees in direction only"
    else:
        found = "agrees"
    runs = [sum(map(len, group.values())) for group in groups]
    figures = f"ratio {middle:.2g}, middle half {low:.2g} to {high:.2g}, n = {runs[0]} and {runs[1]}"
    return Verdict(found, figures + (f"; paper {claim.paper:g}" if claim.paper is not None else ""))


def quartiles(values: Sequence[float]) -> tuple[float, float, float]:
    """Lower quartile, median, upper quartile."""
    if len(values) == 1:
        return values[0], values[0], values[0]
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return low, middle, high
