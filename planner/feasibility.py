"""Impossible missions, proved impossible before any solving, with the binding constraint named."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from missions.schema import Mission, ProbabilisticConnectivity
from planner.connectivity.pairs import all_pairs, sub_period_bounds
from planner.errors import UnreachableError

MOST_TABLE_ENTRIES = 400  # times a side of the table of Γ bounds: thinned beyond, always to the optimistic side


def check_feasible(mission: Mission) -> None:
    """Raise if no motion can meet the mission's limits.

    Starts: inside the workspace, apart, outside obstacles. Connection: P of every pair and sub-period is at most
    n⁻² ΣΣ Γ(max(0, |s_i − s_j| − r(t) − r(s))), r(t) being how far a robot can be from its start at time t.

    Raises:
        UnreachableError: names the constraint, who, the bound and what is required.
    """
    start = np.array([robot.start[: mission.dimension] for robot in mission.robots], dtype=np.float64)
    _check_starts(mission, start)
    if isinstance(mission.connectivity, ProbabilisticConnectivity):
        _check_connection(mission, mission.connectivity, start)


def reach(mission: Mission, t: Array) -> Array:
    """Largest distance [m] from its start a robot can have at times t [s]: full acceleration, then full speed."""
    # The bound is per axis, so the largest acceleration is along a diagonal.
    acceleration = mission.limits.acceleration * np.sqrt(mission.dimension)
    speed = mission.limits.speed
    ramp = speed / acceleration
    distance: Array = np.where(t < ramp, 0.5 * acceleration * t**2, speed * (t - 0.5 * ramp))
    return distance


def _check_starts(mission: Mission, start: Array) -> None:
    names = [robot.name for robot in mission.robots]
    lower, upper = np.array(mission.workspace.lower), np.array(mission.workspace.upper)
    for name, point in zip(names, start, strict=True):
        outside = float(np.maximum(lower - point, point - upper).max())
        if outside > 0.0:
            raise UnreachableError("workspace", name, -outside, 0.0, "m", "the start lies outside the workspace")
        for obstacle in mission.obstacles:
            distance = float(np.linalg.norm(point[:2] - np.array(obstacle.center[:2])))
            if distance < obstacle.radius:
                x, y = obstacle.center[:2]
                where = f"{name}, obstacle at ({x:g}, {y:g})"
                reason = "the start lies inside the obstacle"
                raise UnreachableError("obstacle clearance", where, distance, obstacle.radius, "m", reason)
    for i, j in all_pairs(len(start)):
        distance = float(np.linalg.norm(start[i] - start[j]))
        if distance < mission.limits.separation - 1e-9:
            reason = "the starts are closer than the robots may ever be"
            where = f"{names[i]}-{names[j]}"
            raise UnreachableError("separation", where, distance, mission.limits.separation, "m", reason)


def _check_connection(mission: Mission, policy: ProbabilisticConnectivity, start: Array) -> None:
    names = [robot.name for robot in mission.robots]
    bounds = sub_period_bounds(mission.steps, policy.sub_periods)
    for p, (first, end) in enumerate(bounds):
        t = _optimistic_times(first, end) * mission.horizon.dt
        gap = reach(mission, t)[:, None] + reach(mission, t)[None, :]
        for i, j in all_pairs(len(start)):
            apart = np.maximum(np.linalg.norm(start[i] - start[j]) - gap, 0.0)
            bound = float(np.exp(-(apart**2) / (2.0 * policy.range**2)).mean())
            if bound < policy.threshold:
                raise UnreachableError(
                    "connection",
                    f"{names[i]}-{names[j]}, sub-period {p + 1}",
                    bound,
                    policy.threshold,
                    "",
                    f"they start {np.linalg.norm(start[i] - start[j]):.2f} m apart and cannot come together in time",
                )


def _optimistic_times(first: int, end: int) -> Array:
    """Steps of a sub-period; if there are many, the latest step of each of equal groups stands for the group."""
    steps = end - first
    groups = min(steps, MOST_TABLE_ENTRIES)
    last = np.floor(np.arange(1, groups + 1) * steps / groups + 1e-9) - 1.0
    if groups < steps and steps % groups:
        # Unequal groups would weigh wrongly; the next finer equal grid, rounded up, stays optimistic.
        width = -(-steps // groups)
        last = np.minimum(np.arange(width - 1, steps + width - 1, width), steps - 1).astype(np.float64)
        return np.repeat(first + last, width)[:steps]
    return first + last
