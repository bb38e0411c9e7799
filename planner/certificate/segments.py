"""All robots on one time grid: between two of its times every robot is one polynomial."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.trajectory.bezier import to_points_matrix
from planner.trajectory.piecewise import PiecewisePolynomial

_SAME_TIME = 1e-9  # [s]; joints that differ by float32 noise of summed durations stay apart, float64 noise does not


@dataclass(frozen=True)
class Segments:
    """Positions of all robots as Bernstein coefficients on common intervals.

    Attributes:
        times: (K+1,) [s].
        points: (N, K, 3, 8) coefficients of x, y, z [m]; after its end a robot holds its last point.
    """

    times: Array
    points: Array


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
