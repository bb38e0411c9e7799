"""The rest of a mission as a mission of its own: from where robots are at a step, in whatever motion.

E of the whole is E of the rest for another map. With α the share of the steps that have been flown, c their
statistics and c' those of the rest,

    Σ Λ (α c + (1 − α) c' − φ)² = (1 − α)² Σ Λ (c' − φ')²,    φ' = (φ − α c)/(1 − α),

so what has been seen already is taken off the map, and the search for the rest is a search like any other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.connectivity import Connectivity, PeriodicConnectivity, SubPeriods
from missions.schema import Mission, Robot
from missions.topology import rendezvous_steps, sub_period_times
from planner.dynamics import DoubleIntegrator
from planner.ergodic.metric import ErgodicMetric
from planner.errors import PlannerError
from planner.indicators import ergodic_metric
from planner.margins import Margins, SlowPoint
from planner.problem import Problem, build_problem


def rest_of(mission: Mission, step: int, q: Array) -> Mission:
    """The mission from a step on, robots starting at q (N, ν) [m]; its text is no longer what it says.

    A sub-period that has begun goes on as one of its own: what was missed in its beginning does not count.
    """
    since = step * mission.horizon.dt
    ends, pads = fleet.ends(mission), fleet.pads(mission)
    robots = tuple(_from_here(robot, q[k], ends[k], pads[k]) for k, robot in enumerate(mission.robots))
    return replace(
        mission,
        horizon=replace(mission.horizon, duration=mission.horizon.duration - since),
        robots=robots,
        connectivity=_still_to_come(mission, since),
        source=None,
    )


def rest_problem(
    mission: Mission, step: int, start: Array, flown: Array | None, margins: Margins, modes: int | None = None
) -> tuple[Mission, Problem]:
    """The rest, and how it is searched.

    Args:
        mission: with the map that holds now.
        step: where the rest begins.
        start: (N, ν, 3) position [m], velocity [m/s] and acceleration [m/s²] there.
        flown: (step, N, ν) positions so far, which count; None: they do not.
        margins: how much tighter than the mission the rest is planned.
        modes: of the controls, at most; None: as many as the solver takes.

    Raises:
        PlannerError: dynamics or a metric that this cannot be done for.
    """
    rest = rest_of(mission, step, start[..., 0])
    problem = build_problem(rest, _later(margins, step * mission.horizon.dt), coarse=False, modes=modes)
    dynamics, metric = problem.dynamics, problem.metric
    if not isinstance(dynamics, DoubleIntegrator) or not isinstance(metric, ErgodicMetric):
        raise PlannerError("planning anew: allowed: double-integrator dynamics, without a footprint")
    moving = replace(dynamics, velocity=start[..., 1], acceleration=start[..., 2])
    if flown is not None:
        metric = what_is_left(metric, flown, mission.steps)
    return rest, replace(problem, dynamics=moving, metric=metric)


def what_is_left(metric: ErgodicMetric, flown: Array, steps: int) -> ErgodicMetric:
    """The metric of the rest: less of the map where robots have been.

    Args:
        metric: of the whole.
        flown: (k, N, ν) positions [m] at the first k steps.
        steps: T of the whole.
    """
    if len(flown) == 0:
        return metric
    share = len(flown) / steps
    phi_k: Array = (metric.phi_k - share * metric.statistics(flown)) / (1.0 - share)
    return replace(metric, phi_k=phi_k)


def whole_ergodicity(mission: Mission, q: Array) -> float:
    """E of positions q (T, N, ν) on the mission's map."""
    return ergodic_metric(mission).value(q)


def _from_here(robot: Robot, q: Array, end: Array, pad: Array) -> Robot:
    goal = None if np.isnan(end).any() else tuple(map(float, end))
    x, y = map(float, pad)
    return replace(robot, start=tuple(map(float, q)), end=goal, pad=(x, y))


def _later(margins: Margins, since: float) -> Margins:
    slow = (SlowPoint(point.robot, point.time - since, point.speed) for point in margins.slow)
    return replace(margins, slow=tuple(point for point in slow if point.time > 0.0))


def _still_to_come(mission: Mission, since: float) -> Connectivity:
    policy = mission.connectivity
    if not isinstance(policy, SubPeriods):
        return policy
    inner = sub_period_times(mission)[1:-1]
    boundaries = tuple(t - since for t in inner if t > since + 0.5 * mission.horizon.dt)
    policy = replace(policy, sub_periods=1, boundaries=boundaries)
    if isinstance(policy, PeriodicConnectivity) and isinstance(mission.connectivity, PeriodicConnectivity):
        times = [step * mission.horizon.dt - since for step in rendezvous_steps(mission, mission.connectivity)]
        policy = replace(policy, instants=tuple(t for t in times if t > 0.5 * mission.horizon.dt))
    return policy
