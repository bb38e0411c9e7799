"""All robots on one time grid: between two of its times every robot is one polynomial."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.trajectory.bezier import to_points_matrix
from planner.trajectory.piecewise import PiecewisePolynomial

_SAME_TIME = 1e-9  # [s]; joints that differ by float32 noise of summed durations stay apart, float64 noise does not
_ROUNDING = 1e-12  # relative error of gaps between boxes


@dataclass(frozen=True)
class Segments:
    """Positions of all robots as Bernstein coefficients on common intervals.

    Attributes:
        times: (K+1,) [s].
        points: (N, K, 3, 8) coefficients of x, y, z [m]; after its end a robot holds its last point.
    """

    times: Array
    points: Array

    def scaled(self, scale: Array) -> Segments:
        """The same with axes (3,) stretched."""
        return Segments(self.times, self.points * scale[:, None])

    @functools.cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Lower and upper corners (N, K, 3) of boxes that hold every robot during every interval."""
        return self.points.min(axis=-1), self.points.max(axis=-1)

    def box_gaps(self, robot: int) -> Array:
        """(N−1−robot, K) distances [m] that a robot and every later one at least keep during every interval."""
        low, high = self.boxes
        others = slice(robot + 1, None)
        gap = np.maximum(np.maximum(low[others] - high[robot], low[robot] - high[others]), 0.0)
        return np.asarray(np.sqrt(np.einsum("jkd,jkd->jk", gap, gap)) * (1.0 - _ROUNDING))


def common_segments(trajectories: Sequence[PiecewisePolynomial], breaks: Array) -> Segments:
    """Cut all trajectories at all their joints and at further times [s]."""
    times = np.unique(np.concatenate([*(t.knots() for t in trajectories), breaks]))
    times = times[np.concatenate([[True], np.diff(times) > _SAME_TIME])]
    return Segments(times, np.stack([_restricted(t, times) for t in trajectories]))


def _restricted(trajectory: PiecewisePolynomial, times: Array) -> Array:
    """(K, 3, 8) coefficients of one trajectory on the intervals between ``times``."""
    knots = trajectory.knots()
    middle = (times[1:] + times[:-1]) / 2
    piece = np.clip(np.searchsorted(knots, middle, side="right") - 1, 0, trajectory.pieces - 1)
    h = trajectory.durations[piece]
    begin = np.clip((times[:-1] - knots[piece]) / h, 0.0, 1.0)
    width = np.clip((times[1:] - knots[piece]) / h, 0.0, 1.0) - begin  # 0 after the end: the last point
    powers = trajectory.coefficients[piece, :3] * (h[:, None] ** np.arange(8))[:, None]  # in u = t/h
    shifted = np.einsum("mkj,maj->mak", _shift(begin), powers)
    restricted: Array = (shifted * (width[:, None] ** np.arange(8))[:, None]) @ to_points_matrix(7).T
    return restricted


def _shift(u: Array) -> Array:
    """(M, 8, 8) Taylor shifts: coefficients about u from coefficients about 0."""
    out = np.zeros((len(u), 8, 8))
    for k in range(8):
        for j in range(k, 8):
            out[:, k, j] = math.comb(j, k) * u ** (j - k)
    return out
