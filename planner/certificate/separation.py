"""How close robots come to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    if scale is not None:
        segments = segments.scaled(scale)
    positions, times = segments.points, segments.times
    robots, count = len(positions), len(periods) - 1
    period = np.clip(np.searchsorted(periods, (times[:-1] + times[1:]) / 2) - 1, 0, count - 1)
    rows = []
    for i in range(robots - 1):  # one robot against all later ones: memory stays linear in robots
        near = segments.box_gaps(i) <= _distance_taken(positions, i, period, count)[:, period]
        other, piece = np.nonzero(near)
        points = square_sum(positions[i + 1 + other, piece] - positions[i, piece])
        group, groups = other * count + period[piece], len(near) * count
        smallest = minimise(points, times[piece], times[piece + 1], group, groups, RESOLUTION, root)
        rows.append(np.stack([smallest.bound, smallest.attained, smallest.time]).reshape(3, -1, count))
    pairs = tuple((int(i), int(j)) for i, j in all_pairs(robots))
    bound, attained, time = np.concatenate(rows, axis=1) if rows else np.zeros((3, 0, count))
    return Approaches(pairs, bound, attained, time)


def _distance_taken(positions: Array, robot: int, period: NDArray[np.intp], count: int) -> Array:
    """(J, count) a distance that a robot and every later one take in every period: the smallest at its joints."""
    ends = positions[..., [0, -1]]  # (N, K, 3, 2)
    difference = ends[robot + 1 :] - ends[robot]
    distance = np.sqrt(np.einsum("jkdi,jkdi->jki", difference, difference)).min(axis=2)
    return np.stack([distance[:, period == p].min(axis=1, initial=np.inf) for p in range(count)], axis=1)
