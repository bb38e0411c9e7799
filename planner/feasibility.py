"""Impossible missions, proved impossible before any solving, with the binding constraint named."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from missions.reach import shortfall
from missions.schema import Mission
from planner.connectivity.pairs import all_pairs
from planner.errors import UnreachableError


def check_feasible(mission: Mission) -> None:
    """Raise if no motion can meet the mission's limits.

    Starts: inside the workspace, apart, outside obstacles. Connection: bounds from how far robots can be from their
    starts at any time (:mod:`missions.reach`).

    Raises:
        UnreachableError: names the constraint, who, the bound and what is required.
    """
    start = np.array([robot.start[: mission.dimension] for robot in mission.robots], dtype=np.float64)
    _check_starts(mission, start)
    _check_connection(mission)


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


def _check_connection(mission: Mission) -> None:
    missed = shortfall(mission)
    if missed is None:
        return
    i, j = (mission.robots[k].name for k in missed.pair)
    where = f"{i}-{j}, {missed.place}"
    raise UnreachableError(missed.constraint, where, missed.bound, missed.required, missed.unit, missed.reason)
