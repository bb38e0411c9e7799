"""The hyper-volume: how much of the box below a reference point a set of vectors dominates. Exact.

Two objectives are swept, three are sliced along the last into sets of two, more are summed by exclusive volumes: what a
point dominates by itself is its box less what the points after it, moved into that box, dominate there (WFG: While,
Bradstreet and Barone 2012).
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.pareto.dominance import non_dominated


def hypervolume(points: Array, reference: Array | None = None) -> float:
    """Volume of the union of the boxes between each of ``points`` (n, m) and ``reference`` (m,), by default (1, …, 1).

    Points that are beyond the reference in any objective count nothing.
    """
    return _volume(_gains(points, reference))


def exclusive(point: Array, points: Array, reference: Array | None = None) -> float:
    """Hyper-volume that ``point`` (m,) adds to ``points`` (n, m)."""
    own = _gains(point[None], reference)
    if len(own) == 0:
        return 0.0
    return float(own.prod()) - _volume(np.minimum(_gains(points, reference), own[0]))


def _gains(points: Array, reference: Array | None) -> Array:
    """(k, m) by how much the points that count are below the reference."""
    points = np.asarray(points, dtype=np.float64)
    below = (1.0 if reference is None else reference) - points
    return below[(below > 0.0).all(axis=1)]


def _volume(gains: Array) -> float:
    """Volume of the union of the boxes [0, gain]."""
    gains = gains[non_dominated(-gains)]
    if len(gains) == 0:
        return 0.0
    objectives = gains.shape[1]
    if objectives == 1:
        return float(gains.max())
    if objectives == 2:
        return _area(gains)
    gains = gains[np.argsort(-gains[:, -1], kind="stable")]
    if objectives == 3:
        depths = gains[:, 2] - np.append(gains[1:, 2], 0.0)
        return sum(_area(gains[: i + 1, :2]) * float(depth) for i, depth in enumerate(depths) if depth > 0.0)
    return sum(
        float(gain.prod()) - _volume(np.minimum(gains[i + 1 :], gain))  # the others' share of this box
        for i, gain in enumerate(gains)
    )


def _area(gains: Array) -> float:
    """The same in two objectives; points that others dominate do no harm."""
    gains = gains[np.argsort(-gains[:, 0], kind="stable")]
    highest = np.maximum.accumulate(gains[:, 1])
    rise = np.diff(highest, prepend=0.0)
    return float(rise @ gains[:, 0])
