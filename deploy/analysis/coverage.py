"""Ergodicity of what was planned, certified and flown, by the planner's own definition of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deploy.analysis.align import MissionWindow, Motion
from missions.arrays import Array, frozen
from missions.schema import Mission
from planner.certificate.record import Indicators
from planner.indicators import MissionMetric, ergodic_metric, indicators, resample
from planner.plan import Plan
from planner.trajectory.piecewise import PiecewisePolynomial

_POINTS = 150  # of the curves over time


@dataclass(frozen=True)
class Coverage:
    """Indicators of the plan, of the certified bytes and of the flight, and E as it fell.

    Attributes:
        planned: of the solver's samples. certified: of the bytes. flown: None if too little was seen of the flight.
        t: (P,) mission time [s]; planned_over_time, certified_over_time, flown_over_time: (P,) E of everything up to
            then; the flown curve is NaN where a robot was not seen (the gap itself is bridged linearly).
        flown_statistics: (P,) + (n,)*ν, c_k of what was seen of the floor or the object until then; None where robots
            see nothing but where they are.
    """

    planned: Indicators
    certified: Indicators
    flown: Indicators | None
    t: Array
    planned_over_time: Array
    certified_over_time: Array
    flown_over_time: Array
    flown_statistics: Array | None = None


def coverage(
    mission: Mission,
    plan: Plan,
    certified: Indicators,
    references: Mapping[str, PiecewisePolynomial],
    motion: Motion | None,
    window: MissionWindow | None,
) -> Coverage:
    """Compute it; ``references`` are the decoded trajectories by robot, ``motion`` what was flown."""
    metric = ergodic_metric(mission)
    t = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    nu = mission.dimension
    reference = np.stack([references[robot.name].evaluate(t)[:, :nu] for robot in mission.robots], axis=1)
    flown = None
    seen = np.full((mission.steps, *metric.phi_k.shape), np.nan)
    if motion is not None and window is not None:
        bridged = _bridged(*motion.during(window))
        if bridged is not None:
            flown_t, flown_q = bridged
            if window.complete:
                flown = indicators(mission, flown_t, flown_q)
            until = t <= flown_t[-1] + mission.horizon.dt
            q = np.stack(
                [
                    np.stack([np.interp(t[until], flown_t, flown_q[:, i, axis]) for axis in range(nu)], axis=1)
                    for i in range(len(mission.robots))
                ],
                axis=1,
            )
            seen[until] = _running(metric, q)
    every = max(1, mission.steps // _POINTS)
    keep = np.arange(every - 1, mission.steps, every)
    return Coverage(
        planned=indicators(mission, plan.t, plan.q),
        certified=certified,
        flown=flown,
        t=frozen(t[keep]),
        planned_over_time=frozen(_over_time(metric, _running(metric, resample(plan.t, plan.q[..., :nu], t))[keep])),
        certified_over_time=frozen(_over_time(metric, _running(metric, reference)[keep])),
        flown_over_time=frozen(_over_time(metric, seen[keep])),
        flown_statistics=None if mission.footprint is None else frozen(seen[keep]),
    )


def _bridged(t: Array, q: Array) -> tuple[Array, Array] | None:
    """Positions with gaps bridged linearly; None when a robot was seen for less than half of the time."""
    if len(t) < 2 or np.isfinite(q).all(axis=2).mean(axis=0).min() < 0.5:
        return None
    out = np.array(q)
    for i in range(q.shape[1]):
        known = np.isfinite(q[:, i]).all(axis=1)
        for axis in range(3):
            out[:, i, axis] = np.interp(t, t[known], q[known, i, axis])
    return t, out


def _running(metric: MissionMetric, q: Array) -> Array:
    """Statistics of the first 1, 2, .., T steps of q (T, N, ν): (T,) + (n,)*ν."""
    count = np.arange(1.0, len(q) + 1.0).reshape(-1, *(1,) * metric.phi_k.ndim)
    means: Array = metric.statistics_each(q).cumsum(axis=0) / count
    return means


def _over_time(metric: MissionMetric, c_k: Array) -> Array:
    """(P,) E of statistics (P,) + (n,)*ν."""
    E: Array = (metric.basis.Lambda_k * (c_k - metric.phi_k) ** 2).sum(axis=tuple(range(1, c_k.ndim)))
    return E
