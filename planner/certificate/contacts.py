"""When robots are within range, proven: intervals of time from Bernstein bounds, never too long."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.certificate.bernstein import halves, square_sum
from planner.certificate.segments import Segments
from planner.connectivity.forwarding import Contact

RESOLUTION = 1e-4  # [s] by how much an interval may be too short at either end
_ROUNDING = 1e-13  # relative error of coefficients, well above that of 40 halvings


def contacts_within(segments: Segments, distance: float) -> tuple[Contact, ...]:
    """Every interval during which two robots are provably no farther apart than ``distance`` [m].

    Between two of a pair's intervals it may be within range for moments shorter than the resolution.

    Args:
        segments: all robots on one time grid.
        distance: communication range [m].

    Returns:
        Contacts of all pairs i < j, ordered by pair and time; a pair's contacts do not touch.
    """
    found: list[Contact] = []
    for i in range(len(segments.points) - 1):  # one robot against all later ones: memory stays linear in robots
        pair, piece = np.nonzero(segments.box_gaps(i) <= distance)
        relative = segments.points[i + 1 + pair, piece] - segments.points[i, piece]  # (B, 3, 8)
        excess = square_sum(relative) - distance**2
        pair, begin, end = _negative(excess, pair, segments.times[piece], segments.times[piece + 1], distance**2)
        for j in np.unique(pair):
            mine = pair == j
            found += [Contact(i, i + 1 + int(j), *span) for span in _merged(begin[mine], end[mine])]
    return tuple(found)


def time_in_contact(contacts: Sequence[Contact], begin: float, end: float) -> tuple[float, float]:
    """Longest single and total time [s] of one pair's contacts between two instants."""
    parts = [max(min(c.end, end) - max(c.begin, begin), 0.0) for c in contacts]
    return max(parts, default=0.0), sum(parts)


def _negative(
    points: Array, row: NDArray[np.intp], start: Array, end: Array, scale: float
) -> tuple[NDArray[np.intp], Array, Array]:
    """Row, beginning and end of intervals on which polynomials (B, n+1) on intervals (B,) are negative."""
    found = [(row[:0], start[:0], end[:0])]
    while len(points):
        slack = _ROUNDING * (np.abs(points).max(axis=1) + scale)
        inside = points.max(axis=1) <= -slack
        found.append((row[inside], start[inside], end[inside]))
        open_ = ~inside & (points.min(axis=1) < -slack) & (end - start > RESOLUTION)
        points, row, start, end = points[open_], row[open_], start[open_], end[open_]
        middle = (start + end) / 2.0
        points = np.concatenate([points @ half.T for half in halves(points.shape[1] - 1)])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        row = np.concatenate([row, row])
    rows, begins, ends = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return rows, begins, ends


def _merged(begin: Array, end: Array) -> list[tuple[float, float]]:
    """Intervals that share an end, joined."""
    order = np.argsort(begin)
    begin, end = begin[order], end[order]
    if len(begin) == 0:
        return []
    first = np.concatenate([[True], begin[1:] > end[:-1]])
    last = np.concatenate([first[1:], [True]])
    return [(float(a), float(b)) for a, b in zip(begin[first], end[last], strict=True)]
