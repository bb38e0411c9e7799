"""How well each robot followed its certified trajectory: error, and how far behind it flew."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow, Motion
from missions.arrays import Array, frozen
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.timeline import Timeline

_LAGS = np.arange(-0.2, 1.2001, 0.02)  # s, lags that are tried
_FINE = 0.02  # s, steps at which a trajectory is as good as straight: 0.05 mm at 1 m/s²
_LAG_SAMPLES = 1500  # positions compared; a long flight is thinned, not cut
_LEAST_MOTION = 0.02  # m of standard deviation below which an axis says nothing about lag


@dataclass(frozen=True)
class Tracking:
    """One robot against its certified trajectory.

    Attributes:
        robot: name.
        t: (S,) mission time [s]. error: (S,) distance to the trajectory [m], NaN where the robot was not seen.
        deviation: (S, 3) from the trajectory to the robot [m]. reference: (S, 3) the trajectory at these times [m].
        mean, p95, largest: of the error [m]; NaN without data. largest_at: mission time of the largest [s].
        lag: per axis x, y, z: how far behind the robot flew [s]; NaN for an axis that hardly moved.
        residual: mean error that is left when the mean lag is taken out [m].
        seen: share of the mission it was seen.
    """

    robot: str
    t: Array
    error: Array
    deviation: Array
    reference: Array
    mean: float
    p95: float
    largest: float
    largest_at: float
    lag: tuple[float, float, float]
    residual: float
    seen: float

    @property
    def mean_lag(self) -> float:
        """Mean over the axes that moved [s]; NaN if none did."""
        known = [lag for lag in self.lag if not math.isnan(lag)]
        return sum(known) / len(known) if known else math.nan


def track(
    robot: str,
    number: int,
    motion: Motion,
    window: MissionWindow,
    reference: PiecewisePolynomial,
    timeline: Timeline,
) -> Tracking:
    """Compare a robot's flown positions with where its certified trajectory was at the same time.

    Args:
        robot: its name.
        number: its column in ``motion``.
        motion: where everybody was.
        window: when the search was flown.
        reference: its trajectory as decoded from the bytes.
        timeline: where in it the robot should have been, by flight clock: legs begin when they begin.
    """
    t, q = motion.during(window)
    q, s = q[:, number], timeline.at_each(window.start + t)
    r = reference.evaluate(s)[:, :3]
    deviation = q - r
    error = np.linalg.norm(deviation, axis=1)
    known = np.isfinite(error)
    curves = frozen(t), frozen(error), frozen(deviation), frozen(r)
    if known.sum() < 2:
        nan = math.nan
        return Tracking(robot, *curves, nan, nan, nan, nan, (nan, nan, nan), nan, 0.0)
    lag = lags(s[known], q[known], reference)
    finite = [value for value in lag if not math.isnan(value)]
    shift = sum(finite) / len(finite) if finite else 0.0
    late = np.linalg.norm(q[known] - reference.evaluate(s[known] - shift)[:, :3], axis=1)
    worst = int(np.nanargmax(error))
    return Tracking(
        robot,
        *curves,
        mean=float(error[known].mean()),
        p95=float(np.percentile(error[known], 95)),
        largest=float(error[worst]),
        largest_at=float(t[worst]),
        lag=lag,
        residual=float(late.mean()),
        seen=float(known.mean()),
    )


def lags(t: Array, q: Array, reference: PiecewisePolynomial) -> tuple[float, float, float]:
    """Per axis, the shift of the reference that correlates best with what was flown (Pearson), to a parabola's top."""
    every = math.ceil(len(t) / _LAG_SAMPLES)
    t, flown = t[::every], q[::every] - q[::every].mean(axis=0)
    grid = np.arange(t[0] - _LAGS[-1], t[-1] - _LAGS[0] + 2.0 * _FINE, _FINE)
    path = reference.evaluate(grid)[:, :3]
    spread, correlation = np.empty((len(_LAGS), 3)), np.empty((len(_LAGS), 3))
    for row, lag in enumerate(_LAGS):
        shifted = np.stack([np.interp(t - lag, grid, path[:, axis]) for axis in range(3)], axis=1)
        shifted = shifted - shifted.mean(axis=0)
        spread[row] = np.sqrt((shifted**2).mean(axis=0))
        correlation[row] = (shifted * flown).mean(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation /= spread * np.sqrt((flown**2).mean(axis=0))
    still = spread.min(axis=0) < _LEAST_MOTION
    x, y, z = (math.nan if still[axis] else _peak(correlation[:, axis]) for axis in range(3))
    return x, y, z


def _peak(correlation: Array) -> float:
    best = int(np.argmax(correlation))
    if best in (0, len(_LAGS) - 1):
        return math.nan  # at the edge of what was tried: no peak
    before, top, after = correlation[best - 1 : best + 2]
    curvature = before - 2.0 * top + after
    offset = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
    return float(_LAGS[best] + offset * (_LAGS[1] - _LAGS[0]))
