"""Checks of obstacles and zones: shapes that enclose something, and convex polygons that are convex."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.errors import MissionError
from missions.obstacles import BoxObstacle, CylinderObstacle, PolygonObstacle
from missions.records import did_you_mean
from missions.schema import Mission, Vector
from missions.shapes import counter_clockwise, half_planes, solid

ErrorAt = Callable[[str, str], MissionError]
THINNEST = 1e-3  # [m] less is a slip of the pen, not a thing
_GRID = 61  # points an axis on which something has to be free


def check_shapes(mission: Mission, error: ErrorAt) -> None:
    """Check every obstacle and zone by itself, and that the obstacles leave room.

    Raises:
        MissionError: the first thing found wrong.
    """
    for k, obstacle in enumerate(mission.obstacles):
        where = f"obstacles[{k}]"
        if isinstance(obstacle, BoxObstacle):
            _check_box(obstacle, where, error)
        if isinstance(obstacle, PolygonObstacle):
            _check_polygon(obstacle.vertices, where, error)
        if isinstance(obstacle, CylinderObstacle | PolygonObstacle) and obstacle.height is not None:
            _check_height(obstacle.base, obstacle.height, where, error)
    names = [robot.name for robot in mission.robots]
    for k, zone in enumerate(mission.zones):
        _check_polygon(zone.vertices, f"zones[{k}]", error)
        for j, name in enumerate(zone.robots):
            if name not in names:
                reason = f"unknown robot {name!r}{did_you_mean(name, names)}; known robots: {', '.join(names)}"
                raise error(reason, f"zones[{k}].robots[{j}]")
    if mission.obstacles:
        _check_room(mission, error)


def _check_box(box: BoxObstacle, where: str, error: ErrorAt) -> None:
    if len(box.lower) != len(box.upper):
        raise error(f"got {len(box.upper)} numbers; allowed: {len(box.lower)}, as 'lower' has", f"{where}.upper")
    for axis, (low, high) in enumerate(zip(box.lower, box.upper, strict=True)):
        if not high - low >= THINNEST:
            reason = f"got {high:g} over a lower corner of {low:g}; allowed: at least {low + THINNEST:g} [m]"
            raise error(reason, f"{where}.upper[{axis}]")


def _check_height(base: float, height: float, where: str, error: ErrorAt) -> None:
    if not height - base >= THINNEST:
        reason = f"got {height:g} over a base at {base:g}; allowed: at least {base + THINNEST:g} [m]"
        raise error(reason, f"{where}.height")


def _check_polygon(vertices: tuple[Vector, ...], where: str, error: ErrorAt) -> None:
    """Convex, once around, and thicker than a line."""
    where = f"{where}.vertices"
    for j, vertex in enumerate(vertices):
        if len(vertex) != 2:
            raise error(f"got {len(vertex)} numbers; allowed: 2, (x, y) [m]", f"{where}[{j}]")
        if math.dist(vertex, vertices[j - 1]) < THINNEST:
            before = (j - 1) % len(vertices)
            raise error(f"got {_show(vertex)}, the same corner as [{before}]; allowed: another one", f"{where}[{j}]")
    points = np.array(vertices, dtype=np.float64)
    if bent := _bent(points):
        index, turns = bent
        if turns != 1:
            raise error(f"the corners go around {turns} times; allowed: once, in order", where)
        reason = f"got {_show(vertices[index])}, where the polygon turns back; allowed: a convex polygon"
        raise error(f"{reason} (cut it into convex ones)", f"{where}[{index}]")
    points = counter_clockwise(points)
    normals, offsets = half_planes(points)
    width = float((offsets[:, None] - normals @ points.T).max(axis=1).min())
    if width < THINNEST:
        raise error(f"got a polygon {width:.2g} m wide; allowed: at least {THINNEST:g} [m]", where)


def _bent(points: Array) -> tuple[int, int] | None:
    """A corner that turns the other way than most, and how often the polygon goes around; None if convex."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.arctan2(cross, np.einsum("va,va->v", before, after))
    turns = round(abs(float(turn.sum())) / (2.0 * np.pi))
    way = math.copysign(1.0, float(turn.sum()))
    wrong = turn * way < -1e-9
    if turns == 1 and not wrong.any():
        return None
    if turns > 1 and not wrong.any():
        return 0, turns
    return int(np.argmin(turn * way)), 1


def _check_room(mission: Mission, error: ErrorAt) -> None:
    """Some point of the workspace, at some height where somebody flies, is free."""
    lower, upper = mission.workspace.lower, mission.workspace.upper
    heights = np.linspace(lower[2], upper[2], 9) if mission.dimension == 3 else np.unique(fleet.altitudes(mission))
    axes = [np.linspace(low, high, _GRID) for low, high in zip(lower[:2], upper[:2], strict=True)]
    x = np.stack(np.meshgrid(*axes, heights, indexing="ij"))
    free = np.ones(x.shape[1:], dtype=bool)
    for obstacle in mission.obstacles:
        free &= solid(obstacle).distance(x).value >= 0.0
    if not free.any():
        raise error("the obstacles cover the whole workspace", "obstacles")


def _show(point: Vector) -> str:
    return f"({', '.join(f'{value:g}' for value in point)})"
