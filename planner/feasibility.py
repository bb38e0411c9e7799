"""Impossible missions, proved impossible before any solving, with the binding constraint named."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.obstacles import KeepInZone, label
from missions.reach import shortfall
from missions.schema import Mission
from missions.shapes import Solid, outline, solid
from planner.connectivity.pairs import all_pairs
from planner.errors import UnreachableError

ROUNDING = 1e-9  # [m] where a value may lie on its limit


def check_feasible(mission: Mission) -> None:
    """Raise if no motion can meet the mission's limits.

    Starts and given ends: inside workspace and zones, apart, outside obstacles, within reach. Connection: bounds from
    how far robots can be from their starts at any time (:mod:`missions.reach`).

    Raises:
        UnreachableError: names the constraint, who, the bound and what is required.
    """
    _check_places(mission, "start", fleet.starts(mission))
    _check_ends(mission)
    _check_connection(mission)


def _check_places(mission: Mission, word: str, points: Array) -> None:
    """Points (N, ν), NaN where a robot has none: inside the workspace and its zones, outside obstacles, and apart."""
    names = [robot.name for robot in mission.robots]
    given = np.asarray(np.isfinite(points).all(axis=1))
    lower, upper = np.array(mission.workspace.lower), np.array(mission.workspace.upper)
    for robot in np.flatnonzero(given):
        name, point = names[robot], points[robot]
        outside = float(np.maximum(lower - point, point - upper).max())
        if outside > 0.0:
            raise UnreachableError("workspace", name, -outside, 0.0, "m", f"the {word} lies outside the workspace")
    for constraint, where, clearance in _clearances(mission, points):
        for robot in np.flatnonzero(given & (clearance < -ROUNDING)):
            reason = f"the {word} lies {'outside' if constraint == 'keep-in zone' else 'inside'}"
            place = f"{names[robot]}, {where}"
            raise UnreachableError(constraint, place, float(clearance[robot]), 0.0, "m", reason)
    pairs = all_pairs(len(points))
    x = fleet.in_space(mission, points) * np.array([1.0, 1.0, fleet.vertical_scale(mission)])
    for i, j in pairs[given[pairs].all(axis=1)]:
        distance = float(np.linalg.norm(x[i] - x[j]))
        if distance < mission.limits.separation - ROUNDING:
            reason = f"the {word}s are closer than the robots may ever be"
            where = f"{names[i]}-{names[j]}"
            raise UnreachableError("separation", where, distance, mission.limits.separation, "m", reason)


def _clearances(mission: Mission, points: Array) -> Iterator[tuple[str, str, Array]]:
    """Constraint, where, and each robot's distance (N,) [m] to what it stays out of, or to the edge it stays within."""
    x = np.moveaxis(np.nan_to_num(fleet.in_space(mission, points)), -1, 0)
    for number, obstacle in enumerate(mission.obstacles):
        yield "obstacle clearance", label(number, obstacle), solid(obstacle).distance(x).value
    for number, zone in enumerate(mission.zones):
        bound = np.array([not zone.robots or robot.name in zone.robots for robot in mission.robots])
        depth = Solid(outline(zone)).distance(x).value
        inside = isinstance(zone, KeepInZone)
        name = "keep-in zone" if inside else "keep-out zone"
        yield name, f"zones[{number}]", np.where(bound, -depth if inside else depth, np.inf)


def _check_ends(mission: Mission) -> None:
    """Given ends: places a robot may be, near enough to be reached from start to rest in time."""
    _check_places(mission, "end", fleet.ends(mission))
    way = fleet.ends(mission) - fleet.starts(mission)
    distance = np.nan_to_num(np.linalg.norm(way, axis=1))
    T = mission.horizon.duration
    a, v = fleet.accelerations(mission) * np.sqrt(mission.dimension), fleet.speeds(mission)
    ramp = np.minimum(v / a, T / 2.0)  # from rest to rest; who starts in motion gets there no sooner than at full speed
    moving = np.any(fleet.velocities(mission) != 0.0, axis=1)
    farthest = np.where(moving, v * T, a * ramp * (T - ramp))
    for robot in np.flatnonzero(distance > farthest + ROUNDING):
        reason = f"farther from its start than it can get in {T:g} s"
        name = mission.robots[robot].name
        raise UnreachableError("end point", name, float(farthest[robot]), float(distance[robot]), "m", reason)


def _check_connection(mission: Mission) -> None:
    missed = shortfall(mission)
    if missed is None:
        return
    i, j = (mission.robots[k].name for k in missed.pair)
    where = f"{i}-{j}, {missed.place}"
    raise UnreachableError(missed.constraint, where, missed.bound, missed.required, missed.unit, missed.reason)
