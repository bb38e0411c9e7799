"""How close robots come to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import minimise, root, square_sum
from planner.certificate.segments import common_segments
from planner.connectivity.pairs import all_pairs
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


@dataclass(frozen=True)
class Approaches:
    """Closest approach of every pair in every period of time.

    Attributes:
        pairs: robot indices i < j.
        bound: (pairs, periods) [m]; they are never closer.
        attained: (pairs, periods) [m]; they do come this close, at most 0.1 mm more.
        time: (pairs, periods) [s], when.
    """

    pairs: tuple[tuple[int, int], ...]
    bound: Array
    attained: Array
    time: Array


def closest_approaches(
    trajectories: Sequence[PiecewisePolynomial], periods: Array, scale: Array | None = None
) -> Approaches:
    """Closest approaches in continuous time.

    Args:
        trajectories: all robots'.
        periods: (P+1,) boundaries of the periods [s]; what is before or after counts to the first or last.
        scale: (3,) by how much distance counts along each axis; None: fully.
    """
    segments = common_segments(trajectories, periods)
    positions = segments.points if scale is None else segments.points * scale[:, None]
    robots, count = len(positions), len(periods) - 1
    start, end = segments.times[:-1], segments.times[1:]
    period = np.clip(np.searchsorted(periods, (start + end) / 2) - 1, 0, count - 1)
    rows = []
    for i in range(robots - 1):  # one robot against all later ones: memory stays linear in robots
        relative = positions[i + 1 :] - positions[i]  # (J, K, 3, 8)
        others = len(relative)
        group = (np.arange(others)[:, None] * count + period).ravel()
        points = square_sum(relative).reshape(-1, 15)
        smallest = minimise(
            points, np.tile(start, others), np.tile(end, others), group, others * count, RESOLUTION, root
        )
        rows.append(np.stack([smallest.bound, smallest.attained, smallest.time]).reshape(3, others, count))
    pairs = tuple((int(i), int(j)) for i, j in all_pairs(robots))
    bound, attained, time = np.concatenate(rows, axis=1) if rows else np.zeros((3, 0, count))
    return Approaches(pairs, bound, attained, time)
