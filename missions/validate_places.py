"""Checks of where robots start, end, take off and land, and of what each of them may do."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from missions import fleet
from missions.airframes import Airframe
from missions.arrays import Array
from missions.errors import MissionError
from missions.obstacles import KeepInZone, KeepOutZone, label
from missions.schema import Mission, Vector
from missions.shapes import Solid, heights, outline, solid

ErrorAt = Callable[[str, str], MissionError]
SLACK = 1e-9  # [m] rounding allowed where a value may lie on a limit


def check_limits(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    """Check the mission's and every robot's limits against the airframe.

    Raises:
        MissionError: the first thing found wrong.
    """
    limits, name = mission.limits, mission.flight.airframe
    for field, allowed, unit in (
        ("speed", frame.speed_limit, "m/s"),
        ("acceleration", frame.acceleration_limit, "m/s²"),
    ):
        for where, record in (
            ("limits", limits),
            *((_at(i, "limits"), r.limits) for i, r in enumerate(mission.robots)),
        ):
            value = getattr(record, field)
            if value is not None and value > allowed:
                reason = f"got {value:g}; allowed: at most {allowed:g} [{unit}] for airframe {name}"
                raise error(reason, f"{where}.{field}")
    if mission.trajectory.yaw_rate > frame.rate_limit[2]:
        reason = (
            f"got {mission.trajectory.yaw_rate:g}; allowed: at most {frame.rate_limit[2]:g} [rad/s] for airframe {name}"
        )
        raise error(reason, "trajectory.yaw_rate")
    if len(mission.robots) > 1 and limits.separation < 2.0 * frame.radius:
        reason = f"got {limits.separation:g}; allowed: at least {2.0 * frame.radius:g} [m], two bodies of {name}"
        raise error(reason, "limits.separation")
    if limits.vertical_separation is not None and limits.vertical_separation < limits.separation:
        reason = f"got {limits.vertical_separation:g}; allowed: at least the separation of {limits.separation:g} [m]"
        raise error(f"{reason}, for downwash reaches farther down than aside", "limits.vertical_separation")


def check_places(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    """Check starts, ends, altitudes, velocities and pads.

    Raises:
        MissionError: the first thing found wrong.
    """
    for i, robot in enumerate(mission.robots):
        _check_point(mission, i, "start", robot.start, error)
        if robot.altitude is not None and mission.dimension == 3:
            reason = "allowed in 2-D workspaces only; in 3-D the height of a robot is part of the search"
            raise error(f"got {robot.altitude:g}; {reason}", _at(i, "altitude"))
        if robot.velocity is not None:
            _check_velocity(mission, i, robot.velocity, error)
        _check_boundary_conditions(mission, i, error)
    _check_apart(mission, fleet.starts(mission), "start", error)
    for i, robot in enumerate(mission.robots):
        if robot.end is not None and robot.end != "start":
            _check_point(mission, i, "end", robot.end, error)
    _check_ends(mission, error)
    _check_pads(mission, frame, error)


# ---------------------------------------------------------------------------------------------- starts and ends


def _check_point(mission: Mission, i: int, field: str, point: Vector, error: ErrorAt) -> None:
    """A start or end: inside the workspace and its zones, outside obstacles."""
    lower, upper = mission.workspace.lower, mission.workspace.upper
    if len(point) != mission.dimension:
        raise error(f"got {len(point)} numbers; allowed: {mission.dimension}, as the workspace has", _at(i, field))
    for value, low, high in zip(point, lower, upper, strict=True):
        if not low <= value <= high:
            reason = f"got {_show(point)} outside the workspace; allowed: {_show(lower)} to {_show(upper)} [m]"
            raise error(reason, _at(i, field))
    z = point[2] if mission.dimension == 3 else float(fleet.altitudes(mission)[i])
    x = np.array([*point[:2], z])
    for k, obstacle in enumerate(mission.obstacles):
        _check_outside(solid(obstacle), x, label(k, obstacle), point, _at(i, field), error)
    for k, zone in enumerate(mission.zones):
        if zone.robots and mission.robots[i].name not in zone.robots:
            continue
        body = Solid(outline(zone))
        if isinstance(zone, KeepInZone):
            depth = -_distance(body, x)
            if depth < -SLACK:
                reason = f"got {_show(point)}, {-depth:.3g} m outside zones[{k}], where it has to stay"
                raise error(f"{reason}; allowed: inside", _at(i, field))
        else:
            _check_outside(body, x, f"zones[{k}]", point, _at(i, field), error)


def _check_outside(body: Solid, x: Array, what: str, point: Vector, where: str, error: ErrorAt) -> None:
    depth = -_distance(body, x)
    if depth > SLACK:
        raise error(f"got {_show(point)} inside {what}, {depth:.3g} m deep; allowed: outside of it", where)


def _check_boundary_conditions(mission: Mission, i: int, error: ErrorAt) -> None:
    """Given ends are built into the variables of one method, starts in motion into one model of motion."""
    robot = mission.robots[i]
    given = "end" if robot.end is not None else "velocity" if robot.velocity is not None else ""
    if given and mission.dynamics.type != "double_integrator":
        reason = f"given with dynamics of type {mission.dynamics.type}; allowed: with double_integrator"
        raise error(reason, _at(i, given))
    if robot.end is not None and mission.solver.method != "fast":
        raise error(f"given with the method {mission.solver.method}; allowed: with fast", _at(i, "end"))


def _check_velocity(mission: Mission, i: int, velocity: Vector, error: ErrorAt) -> None:
    limit = float(fleet.speeds(mission)[i])
    if len(velocity) != mission.dimension:
        count = len(velocity)
        raise error(f"got {count} numbers; allowed: {mission.dimension}, as the workspace has", _at(i, "velocity"))
    if math.hypot(*velocity) > limit:
        reason = f"got a speed of {math.hypot(*velocity):.3g}; allowed: at most the limit of {limit:g} [m/s]"
        raise error(reason, _at(i, "velocity"))


def _check_apart(mission: Mission, points: Array, field: str, error: ErrorAt) -> None:
    """Points (N, ν), NaN where a robot has none, at least the separation apart, with downwash: robots hover there."""
    least, names = mission.limits.separation, [robot.name for robot in mission.robots]
    x = fleet.in_space(mission, points) * np.array([1.0, 1.0, fleet.transfer_scale(mission)])
    for i, j in itertools.combinations(range(len(names)), 2):
        distance = math.dist(x[i], x[j])
        if distance < least - SLACK:
            counted = ", vertical distance counted as downwash has it" if fleet.at_different_heights(mission) else ""
            reason = f"{field}s of {names[i]} and {names[j]} are {distance:.3g} m apart{counted}"
            raise error(f"{reason}; allowed: at least {least:g} [m]", _at(j, field))


def _check_ends(mission: Mission, error: ErrorAt) -> None:
    """Ends that are given: apart; if robots land there also seen from above, and with nothing below."""
    ends, names = fleet.ends(mission), [robot.name for robot in mission.robots]
    _check_apart(mission, ends, "end", error)
    if mission.flight.return_to == "pads":
        return
    for i, j in itertools.combinations(range(len(names)), 2):
        distance = math.dist(ends[i][:2], ends[j][:2])
        if distance < mission.limits.separation - SLACK:
            reason = f"ends of {names[i]} and {names[j]} are {distance:.3g} m apart seen from above; allowed: at least"
            raise error(f"{reason} {mission.limits.separation:g} [m], for they land straight down", _at(j, "end"))
    for i, end in enumerate(fleet.in_space(mission, ends)):
        if np.isfinite(end).all() and (below := _below(mission, i, end)):
            raise error(f"got {_show(tuple(end))} above {below}; allowed: nothing below, for it lands", _at(i, "end"))


# ---------------------------------------------------------------------------------------------------------- pads


def _check_pads(mission: Mission, frame: Airframe, error: ErrorAt) -> None:
    """Pads: inside the geofence, clear of obstacles, and far enough apart for everybody to take off at once."""
    margin = mission.flight.geofence_margin
    corners = list(zip(mission.workspace.lower, mission.workspace.upper, strict=True))[:2]
    hover = fleet.in_space(mission, fleet.starts(mission))[:, 2]  # straight up to the height of the start
    for i, robot in enumerate(mission.robots):
        pad = robot.pad or robot.start[:2]
        for value, (low, high) in zip(pad, corners, strict=True):
            if not low - margin - SLACK <= value <= high + margin + SLACK:
                reason = f"got {_show(pad)}; allowed: at most geofence_margin = {margin:g} m outside the workspace"
                raise error(reason, _at(i, "pad"))
        if below := _below(mission, i, np.array([*pad, hover[i]])):
            given = f"got {_show(pad)}" if robot.pad else f"under its start {_show(pad)}, the pad is"
            raise error(f"{given} inside {below}, or under it; allowed: a pad clear of it", _at(i, "pad"))
    least = max(mission.limits.separation, 2.0 * frame.radius)
    pads = [robot.pad or robot.start[:2] for robot in mission.robots]
    for (i, a), (j, b) in itertools.combinations(enumerate(pads), 2):
        if math.dist(a, b) < least - SLACK:
            names = f"{mission.robots[i].name} and {mission.robots[j].name}"
            raise error(
                f"pads of {names} are {math.dist(a, b):.3g} m apart; allowed: at least {least:g} [m]", _at(j, "pad")
            )


def _below(mission: Mission, i: int, x: Array) -> str:
    """What is between a robot at x (3,) and the floor; empty if nothing."""
    for k, obstacle in enumerate(mission.obstacles):
        if heights(obstacle)[0] < x[2] and _distance(solid(obstacle).column(), x) < -SLACK:
            return label(k, obstacle)
    for k, zone in enumerate(mission.zones):
        bound = not zone.robots or mission.robots[i].name in zone.robots
        if isinstance(zone, KeepOutZone) and bound and _distance(Solid(outline(zone)), x) < -SLACK:
            return f"zones[{k}]"
    return ""


def _distance(body: Solid, x: Array) -> float:
    return float(body.distance(x[:, None]).value[0])


def _at(index: int, field: str) -> str:
    return f"robots[{index}].{field}"


def _show(point: Vector) -> str:
    return f"({', '.join(f'{value:g}' for value in point)})"
