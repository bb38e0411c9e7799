"""Where robots are: apart, in their places, clear of what is in the way; on the way to the search and after it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.obstacles import KeepOutZone, Obstacle
from missions.schema import Mission
from planner.certificate import obstacles, workspace
from planner.certificate import transitions as ways
from planner.certificate.checks import DISTANCE_TOLERANCE, check, room, worst
from planner.certificate.record import Check
from planner.certificate.separation import Approaches, closest_approaches
from planner.trajectory.piecewise import PiecewisePolynomial


def separation(mission: Mission, flown: Sequence[PiecewisePolynomial], approaches: Approaches) -> list[Check]:
    """The pair that comes closest; where downwash counts, vertical distances are shortened to the ellipsoid's."""
    if not approaches.pairs:
        return []
    scale = fleet.vertical_scale(mission)
    if scale != 1.0:
        whole = np.array([0.0, mission.horizon.duration])
        approaches = closest_approaches(flown, whole, np.array([1.0, 1.0, scale]))
    pair, period = np.unravel_index(np.argmin(approaches.bound), approaches.bound.shape)
    names = [robot.name for robot in mission.robots]
    where = ways.names_of(approaches.pairs[pair], names)
    value, time = approaches.bound[pair, period], float(approaches.time[pair, period])
    return [room("separation", value, where, time, mission.limits.separation)]


def of_robot(mission: Mission, robot: int, flown: PiecewisePolynomial) -> list[Check]:
    """Obstacles, zones, workspace, altitude, start and end of one robot."""
    name, checks = mission.robots[robot].name, []
    for kind, label, thing in _in_the_way(mission, name):
        gap = obstacles.clearance(flown, thing)
        checks.append(room(kind, float(gap.bound[0]), f"{name}, {label}", float(gap.time[0])))
    for number, zone in enumerate(mission.zones):
        if not isinstance(zone, KeepOutZone) and (not zone.robots or name in zone.robots):
            gap = obstacles.inside_zone(flown, zone)
            checks.append(room("keep-in zones", float(gap.bound[0]), f"{name}, zones[{number}]", float(gap.time[0])))
    side = workspace.inside(flown, mission.workspace)
    checks.append(room("workspace", float(side.bound[0]), name, float(side.time[0])))
    if mission.dimension == 2:
        value, time = workspace.altitude_error(flown, float(fleet.altitudes(mission)[robot]))
        checks.append(check("altitude", value, 0.0, "m", "<=", name, time, DISTANCE_TOLERANCE))
    return [*checks, *_end_checks(mission, robot, flown)]


def _end_checks(mission: Mission, robot: int, flown: PiecewisePolynomial) -> Iterable[Check]:
    """That the search begins where the mission says and, if it says so, ends there."""
    name = mission.robots[robot].name
    for kind, time, point in (
        ("start point", 0.0, fleet.starts(mission)[robot]),
        ("end point", flown.duration, fleet.ends(mission)[robot]),
    ):
        if np.isfinite(point).all():
            offset = flown.evaluate(np.array([time]))[0, : mission.dimension] - point
            yield check(kind, float(np.linalg.norm(offset)), 0.0, "m", "<=", name, time, DISTANCE_TOLERANCE)


def transitions(mission: Mission, flown: Mapping[str, PiecewisePolynomial]) -> list[Check]:
    """Take-off, transfer and landing: distances between columns and moves, and what is in the way of them."""
    names = list(flown)
    starts = np.stack([trajectory.evaluate(np.zeros(1))[0, :3] for trajectory in flown.values()])
    starts[:, :2] = ways.starts(mission)
    ends = np.stack([trajectory.evaluate(np.array([trajectory.duration]))[0, :3] for trajectory in flown.values()])
    hover = np.column_stack([ways.pads(mission), starts[:, 2]])  # everybody rises to the height of the start first
    checks = []
    moves = {"take-off": (hover, hover), "transfer": (hover, starts), "landing": (ends, ends)}
    for name, (begin, end) in moves.items():
        distance, pair = ways.smallest_distance(begin[:, :2], end[:, :2])
        if pair is not None:
            where = ways.names_of(pair, names)
            checks.append(room(f"{name} separation", distance, where, limit=mission.limits.separation))
    paths = {"take-off": (on_floor(hover), hover), "transfer": (hover, starts), "landing": (ends, on_floor(ends))}
    clearances = [
        room(f"{phase} obstacles", obstacles.segment_clearance(begin[k], end[k], thing), f"{name}, {label}")
        for phase, (begin, end) in paths.items()
        for k, name in enumerate(names)
        for _, label, thing in _in_the_way(mission, name)
    ]
    return [*checks, *worst(clearances)]


def on_floor(points: Array) -> Array:
    """The same points (N, 3) at height 0."""
    return np.asarray(points * np.array([1.0, 1.0, 0.0]))


def _in_the_way(mission: Mission, name: str) -> Iterable[tuple[str, str, Obstacle | KeepOutZone]]:
    """Kind of check, label and shape of everything a robot stays out of."""
    for number, obstacle in enumerate(mission.obstacles):
        yield "obstacles", f"obstacles[{number}]", obstacle
    for number, zone in enumerate(mission.zones):
        if isinstance(zone, KeepOutZone) and (not zone.robots or name in zone.robots):
            yield "keep-out zones", f"zones[{number}]", zone
