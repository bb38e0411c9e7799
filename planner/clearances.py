"""The constraints of a mission's geometry and limits, tightened by margins.

Margins never exceed the room at a start or at an end that is given: robots stand still there, and what is given can be
no closer than it is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from missions import fleet
from missions.arrays import Array
from missions.obstacles import CircleObstacle, KeepOutZone
from missions.obstacles import label as named
from missions.schema import Mission
from missions.shapes import Solid, half_planes, heights, outline, solid
from planner.connectivity.pairs import all_pairs
from planner.constraints.acceleration import ControlBound
from planner.constraints.base import Constraint
from planner.constraints.obstacles import Obstacles
from planner.constraints.paths import When
from planner.constraints.separation import Separation
from planner.constraints.solids import Outside
from planner.constraints.speed import Speed
from planner.constraints.standoff import NearSurface
from planner.constraints.workspace import Inside
from planner.constraints.zones import InsideZone
from planner.margins import Margins
from planner.slow import speed_limits

LOOK, MOST_LOOKS = 0.05, 64  # [m] between points of a path that are compared with solids; points a step
COVERED = 1.5e-3  # [m] by which paths may come closer between samples than at them: margins cover it


def clearances(mission: Mission, margins: Margins, *, when: When | None = None) -> tuple[Constraint, ...]:
    """Distances to keep at every instant: robots, obstacles, zones, and what is below at the end.

    Where steps are so short that samples say it all but :data:`COVERED`, robots and circles are looked at there only:
    it is half the price.

    Args:
        mission: what is asked for.
        margins: how much more is planned.
        when: robots and circles are looked at in any case, because the search goes on from what it finds.
    """
    return (
        *_separation(mission, margins, when),
        *_circles(mission, margins, when),
        *_solids(mission, margins),
        *_zones(mission, margins),
        *_landing(mission, margins),
        *_stand_off(mission, margins),
    )


def looks_between(constraints: Iterable[Constraint]) -> bool:
    """Whether robots or circles are looked at between samples, too."""
    return any(c.when is When.ALWAYS for c in constraints if isinstance(c, Separation | Obstacles))


def envelope(mission: Mission, margins: Margins) -> tuple[Constraint, ...]:
    """Workspace, speed and acceleration of every robot."""
    dt, names = mission.horizon.dt, _names(mission)
    given = _given(mission)
    room = margins.workspace + _bulge(mission, dt)[:, None]  # (N, 1)
    lower = np.minimum(np.array(mission.workspace.lower) + room, np.nanmin(given, axis=0))
    upper = np.maximum(np.array(mission.workspace.upper) - room, np.nanmax(given, axis=0))
    accelerations = fleet.accelerations(mission)
    return (
        Inside(lower, upper, names, dt),
        Speed(speed_limits(mission, margins), names, dt),
        ControlBound(
            accelerations * (1.0 - margins.acceleration), names, dt, tolerance=0.01 * float(accelerations.min())
        ),
    )


# --------------------------------------------------------------------------------------------- between robots


def _separation(mission: Mission, margins: Margins, when: When | None) -> Iterable[Constraint]:
    pairs, a = all_pairs(len(mission.robots)), mission.limits.separation
    if len(pairs) == 0 or a <= 0.0:
        return
    b = mission.limits.vertical_separation or a
    if mission.dimension == 3:
        scale: Array | None = np.array([1.0, 1.0, a / b])
        least = np.full(len(pairs), a)
        extra = margins.separation * max(1.0, a / b)
    else:
        # In layers the vertical distance of a pair is given: what is left is a circle, or nothing.
        z = fleet.altitudes(mission)
        high: Array = (z[pairs[:, 0]] - z[pairs[:, 1]]) / b
        apart = np.asarray(np.abs(high) < 1.0)
        pairs, scale, extra = pairs[apart], None, margins.separation
        least = a * np.sqrt(1.0 - high[apart] ** 2)
    if len(pairs):
        distance = np.minimum(least + extra, _room(mission, pairs, scale))
        when = when or _when(mission, distance)
        yield Separation(pairs, distance, _names(mission), mission.horizon.dt, scale, when)


def _landing(mission: Mission, margins: Margins) -> Iterable[Constraint]:
    """Straight down from the end: nobody and nothing below. In one plane the other constraints say that already."""
    names, dt = _names(mission), mission.horizon.dt
    pairs, a = all_pairs(len(names)), mission.limits.separation
    if fleet.at_different_heights(mission) and len(pairs) and a > 0.0:
        scale = np.ones(mission.dimension)
        scale[2:] = 0.0
        free = np.asarray(np.isnan(fleet.ends(mission)).any(axis=1))
        pairs = pairs[free[pairs].any(axis=1)]  # two ends that are given are what they are
        distance = np.full(len(pairs), a + margins.separation)
        if len(pairs):
            yield Separation(pairs, distance, names, dt, scale, When.END, name="landing separation")
    for number, obstacle in enumerate(mission.obstacles):
        base, top = heights(obstacle)
        over = np.flatnonzero(_may_be_above(mission, top))
        if len(over) and base < top < np.inf:
            keep = np.minimum(margins.obstacle, _room_beside(mission, solid(obstacle).column(), at_starts=False)[over])
            label = named(number, obstacle)
            yield Outside(
                solid(obstacle).column(), over, keep, label, names, dt, when=When.END, name="landing obstacles"
            )


def _room(mission: Mission, pairs: NDArray[np.intp], scale: Array | None) -> Array:
    """(P,) distance of each pair at starts and given ends [m], as the constraint measures it."""
    given = _given(mission) * (1.0 if scale is None else scale)
    apart = np.linalg.norm(given[:, pairs[:, 0]] - given[:, pairs[:, 1]], axis=-1)  # (2, P)
    return np.asarray(np.nanmin(apart, axis=0))


# --------------------------------------------------------------------------------------------- obstacles and zones


def _circles(mission: Mission, margins: Margins, when: When | None) -> Iterable[Constraint]:
    circles = [obstacle for obstacle in mission.obstacles if isinstance(obstacle, CircleObstacle)]
    if not circles:
        return
    center = np.array([circle.center for circle in circles], dtype=np.float64)
    radius = np.array([circle.radius for circle in circles]) + margins.obstacle
    apart = np.linalg.norm(_given(mission)[..., None, :2] - center, axis=-1)  # (2, N, O)
    radius = np.minimum(radius, np.nanmin(apart, axis=0))
    yield Obstacles(center, radius, _names(mission), mission.horizon.dt, when or _when(mission, radius))


def _solids(mission: Mission, margins: Margins) -> Iterable[Constraint]:
    """One constraint an obstacle that is no circle; in a 2-D search for those who fly between its base and top."""
    for number, obstacle in enumerate(mission.obstacles):
        if isinstance(obstacle, CircleObstacle):
            continue
        body, robots = solid(obstacle), np.arange(len(mission.robots))
        if mission.dimension == 2:
            z = fleet.altitudes(mission)
            robots, body = np.flatnonzero((body.low < z) & (z < body.high)), body.column()
        if len(robots):
            keep = np.minimum(margins.obstacle, _room_beside(mission, body)[robots])
            yield Outside(
                body, robots, keep, named(number, obstacle), _names(mission), mission.horizon.dt, _looks(mission)
            )


def _stand_off(mission: Mission, margins: Margins) -> Iterable[Constraint]:
    """No farther from the object than the mission says; starts and given ends are where they are."""
    item, names, dt = mission.object, _names(mission), mission.horizon.dt
    if item is None or item.far is None or item.surface is None:
        return
    points = item.surface.points
    given = np.linalg.norm(_given(mission)[:, :, None] - points, axis=-1).min(axis=-1)  # (2, N)
    # An acceleration's component away from the surface is at most √3 times an axis's.
    room = margins.obstacle + math.sqrt(3.0) * _bulge(mission, dt)
    yield NearSurface(points, np.maximum(item.far - room, np.nanmax(given, axis=0)), names, dt)


def _zones(mission: Mission, margins: Margins) -> Iterable[Constraint]:
    names, dt = _names(mission), mission.horizon.dt
    for number, zone in enumerate(mission.zones):
        robots = np.array([i for i, name in enumerate(names) if not zone.robots or name in zone.robots], dtype=np.intp)
        label = f"zones[{number}]"
        if isinstance(zone, KeepOutZone):
            body = Solid(outline(zone))
            keep = np.minimum(margins.obstacle, _room_beside(mission, body)[robots])
            yield Outside(body, robots, keep, label, names, dt, _looks(mission), name="keep-out zone")
        else:
            normals, offsets = half_planes(outline(zone))
            at_given = np.nanmax(_given(mission)[:, robots, :2] @ normals.T, axis=0)  # (R, E)
            # Samples are half a step apart; an acceleration's component along a normal is at most √2 times an axis's.
            bulge = _bulge(mission, 0.5 * dt)[robots, None] * math.sqrt(2.0)
            room = np.maximum(offsets - margins.workspace - bulge, at_given)
            yield InsideZone(normals, room, robots, label, names, 0.5 * dt)


def _room_beside(mission: Mission, body: Solid, *, at_starts: bool = True) -> Array:
    """(N,) distance of starts and given ends to a solid [m]; inf where neither counts."""
    given = fleet.in_space(mission, _given(mission))
    distance = body.distance(np.moveaxis(np.nan_to_num(given), -1, 0)).value
    distance = np.where(np.isnan(given[..., 0]), np.inf, distance)
    return np.asarray((distance if at_starts else distance[1:]).min(axis=0))


def _may_be_above(mission: Mission, top: float) -> Array:
    """(N,) whether robots may fly above a height [m]."""
    if mission.dimension == 3:
        return np.full(len(mission.robots), mission.workspace.upper[2] > top)
    return np.asarray(fleet.altitudes(mission) >= top)


def _bulge(mission: Mission, h: float) -> Array:
    """(N,) how far a path bulges out along an axis between samples ``h`` [s] apart [m]: u h²/8."""
    return np.asarray(fleet.accelerations(mission) * (h * h / 8.0))


def _when(mission: Mission, distance: Array) -> When:
    """When distances [m] have to be looked at: between samples too, if somebody passing by at full speed comes closer.

    Samples are half a step apart: halfway between two at distance ε, who flies straight is √(ε² − (v dt/4)²) away. Two
    robots at full speed in opposite directions lose four times as much; then the certificate says so, and the margin
    grows.
    """
    half_way = 0.25 * mission.horizon.dt * float(fleet.speeds(mission).max())
    return When.SAMPLES if half_way**2 <= COVERED * (2.0 * float(distance.min()) - COVERED) else When.ALWAYS


def _looks(mission: Mission) -> int:
    """Points of a step at which solids are looked at: ``LOOK`` apart at full speed."""
    way = float(fleet.speeds(mission).max()) * mission.horizon.dt
    return min(max(2, math.ceil(way / LOOK - 1e-9)), MOST_LOOKS)


def _given(mission: Mission) -> Array:
    """(2, N, ν) starts and ends [m]; NaN for ends that are free."""
    return np.stack([fleet.starts(mission), fleet.ends(mission)])


def _names(mission: Mission) -> tuple[str, ...]:
    return tuple(robot.name for robot in mission.robots)
