"""Branch and bound along one curve: pieces are halved as long as something smaller may be found in them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import MOST_OPEN, ROUNDS, Minimum, halves

# Of pieces (B, 3, n+1): values (B, 2) at their two ends, and what nothing along each of them is below (B,).
Look: TypeAlias = Callable[[Array], tuple[Array, Array]]


def smallest(points: Array, start: Array, end: Array, look: Look, resolution: float) -> Minimum:
    """Smallest value along a curve, with proof; one group.

    Args:
        points: (B, 3, n+1) Bernstein coefficients of the curve's pieces [m].
        start: (B,) times of the pieces' beginnings [s].
        end: (B,) and ends [s].
        look: says what is at the ends of pieces, and bounds what is between.
        resolution: largest gap between bound and attained.
    """
    best, when, proven = np.inf, 0.0, np.inf
    left, right = halves(points.shape[-1] - 1)
    for _ in range(ROUNDS):
        values, low = look(points)
        piece, side = np.unravel_index(int(values.argmin()), values.shape)
        if values[piece, side] < best:
            best, when = float(values[piece, side]), float((start, end)[side][piece])
        open_ = low < best - resolution
        proven = min(proven, float(low[~open_].min(initial=np.inf)))
        points, start, end, low = points[open_], start[open_], end[open_], low[open_]
        if len(points) == 0:
            break
        if len(points) > MOST_OPEN:  # the bound stays a bound, only wider than the resolution
            proven = min(proven, float(low.min()))
            break
        middle = (start + end) / 2
        points = np.concatenate([points @ left.T, points @ right.T])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        low = np.concatenate([low, low])
    else:
        proven = min(proven, float(low.min()))
    return Minimum(np.array([min(proven, best)]), np.array([best]), np.array([when]))
