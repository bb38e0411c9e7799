"""Where robots are: apart, in their places, clear of what is in the way."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from missions import fleet
from missions.obstacles import KeepInZone, KeepOutZone
from missions.schema import Mission
from planner.certificate import motion, obstacles, standoff, workspace
from planner.certificate.checks import DISTANCE_TOLERANCE, check, names_of, room
from planner.certificate.record import Check
from planner.certificate.separation import Approaches, closest_approaches
from planner.trajectory.piecewise import PiecewisePolynomial


def with_downwash(mission: Mission, flown: Sequence[PiecewisePolynomial], approaches: Approaches) -> Approaches:
    """Closest approaches as separation counts them: vertical distances shortened to the downwash ellipsoid's."""
    scale = fleet.vertical_scale(mission)
    if scale == 1.0:
        return approaches
    return closest_approaches(flown, np.array([0.0, mission.horizon.duration]), np.array([1.0, 1.0, scale]))


def separation(mission: Mission, approaches: Approaches) -> list[Check]:
    """The pair that comes closest, by approaches :func:`with_downwash`."""
    if not approaches.pairs:
        return []
    pair, period = np.unravel_index(np.argmin(approaches.bound), approaches.bound.shape)
    names = [robot.name for robot in mission.robots]
    where = names_of(approaches.pairs[pair], names)
    value, time = approaches.bound[pair, period], float(approaches.time[pair, period])
    return [room("separation", value, where, time, mission.limits.separation)]


def of_robot(mission: Mission, robot: int, flown: PiecewisePolynomial) -> list[Check]:
    """Obstacles, zones, stand-off, workspace, altitude, start and end of one robot."""
    name, checks = mission.robots[robot].name, []
    in_the_way = list(obstacles.in_the_way(mission, name))
    for kind, zones in (("obstacles", False), ("keep-out zones", True)):
        closest = obstacles.nearest(flown, (x for x in in_the_way if isinstance(x[1], KeepOutZone) is zones))
        if closest is not None:
            label, gap = closest
            checks.append(room(kind, float(gap.bound[0]), f"{name}, {label}", float(gap.time[0])))
    for number, zone in enumerate(mission.zones):
        if isinstance(zone, KeepInZone) and (not zone.robots or name in zone.robots):
            gap = obstacles.inside_zone(flown, zone)
            checks.append(room("keep-in zones", float(gap.bound[0]), f"{name}, zones[{number}]", float(gap.time[0])))
    if mission.object is not None and mission.object.far is not None and mission.object.surface is not None:
        away = standoff.farthest(flown, mission.object.surface.points)
        distance, time = -float(away.bound[0]), float(away.time[0])
        checks.append(check("stand-off", distance, mission.object.far, "m", "<=", name, time, DISTANCE_TOLERANCE))
    side = workspace.inside(flown, mission.workspace)
    checks.append(room("workspace", float(side.bound[0]), name, float(side.time[0])))
    if mission.dimension == 2:
        error = motion.largest_offset(flown, 2, float(fleet.altitudes(mission)[robot]))
        checks.append(check("altitude", error.value, 0.0, "m", "<=", name, error.time, DISTANCE_TOLERANCE))
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
