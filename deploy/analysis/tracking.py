"""How well each robot followed its certified trajectory: error, and how far behind it flew."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow, Motion
from missions.arrays import Array, frozen
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.timeline import Timeline

_STEP, _BACK, _AHEAD = 0.02, 60, 10  # s, and how many of them a robot may be behind and ahead
_NEAR = 0.25  # s between samples beyond which nothing is known in between
_LAG_SAMPLES, _LEAST_SAMPLES = 1500, 20  # positions compared; a long flight is thinned, not cut
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
    """Per axis, the shift of the reference that correlates best with what was flown (Pearson), to a parabola's top.

    Args:
        t: (S,) times in the trajectory [s], increasing.
        q: (S, 3) positions then [m].
        reference: the trajectory.
    """
    n = int((t[-1] - t[0]) / _STEP) + 1
    grid = t[0] + _STEP * np.arange(n)
    later = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    seen = np.flatnonzero(t[later] - t[later - 1] <= _NEAR)
    seen = seen[:: max(1, math.ceil(len(seen) / _LAG_SAMPLES))]
    if len(seen) < _LEAST_SAMPLES:
        return math.nan, math.nan, math.nan
    flown = np.stack([np.interp(grid[seen], t, q[:, axis]) for axis in range(3)], axis=1)
    flown -= flown.mean(axis=0)
    path = reference.evaluate(t[0] + _STEP * np.arange(-_BACK, n + _AHEAD))[:, :3]
    # The trajectory as late as every lag that is tried, the least first: (lags, 3, samples).
    shifted = np.lib.stride_tricks.sliding_window_view(path, n, axis=0)[::-1][:, :, seen]
    variance = np.maximum((shifted**2).mean(axis=2) - shifted.mean(axis=2) ** 2, 0.0)
    spread = np.sqrt(variance)
    correlation = np.einsum("lak,ka->la", shifted, flown) / len(seen)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation /= spread * np.sqrt((flown**2).mean(axis=0))
    still = spread.min(axis=0) < _LEAST_MOTION
    x, y, z = (math.nan if still[axis] else _peak(correlation[:, axis]) for axis in range(3))
    return x, y, z


def _peak(correlation: Array) -> float:
    best = int(np.argmax(correlation))
    if best in (0, len(correlation) - 1):
        return math.nan  # at the edge of what was tried: no peak
    before, top, after = correlation[best - 1 : best + 2]
    curvature = before - 2.0 * top + after
    offset = 0.5 * (before - after) / curvature if curvature < 0.0 else 0.0
    return float(_STEP * (best - _AHEAD + offset))
