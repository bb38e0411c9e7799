"""How close robots come to obstacles and to the edges of zones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missions.arrays import Array
from missions.obstacles import CircleObstacle, KeepInZone, KeepOutZone, Obstacle
from missions.schema import Mission
from missions.shapes import Solid, half_planes, outline, solid
from planner.certificate.bernstein import Minimum, minimise, root, square_sum
from planner.certificate.convex import closest
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


def clearance(trajectory: PiecewisePolynomial, obstacle: Obstacle | KeepOutZone) -> Minimum:
    """Smallest distance of a robot's centre to an obstacle's surface [m], negative inside; one group."""
    points = control_points(trajectory.coefficients[:, :3], trajectory.durations)  # (M, 3, 8)
    knots = trajectory.knots()
    if not isinstance(obstacle, CircleObstacle):
        return closest(points, knots[:-1], knots[1:], body(obstacle), RESOLUTION)
    relative = points[:, :2] - np.array(obstacle.center)[:, None]

    def outside(squares: Array) -> Array:
        """Distance to the circle from squared distances to its centre."""
        return root(squares) - obstacle.radius

    group = np.zeros(len(points), dtype=np.intp)
    return minimise(square_sum(relative), knots[:-1], knots[1:], group, 1, RESOLUTION, outside)


def inside_zone(trajectory: PiecewisePolynomial, zone: KeepInZone) -> Minimum:
    """Smallest distance of a robot's centre to an edge of the zone it stays in [m], negative outside; one group."""
    points = control_points(trajectory.coefficients[:, :2], trajectory.durations)  # (M, 2, 8)
    normals, offsets = half_planes(outline(zone))
    sides = offsets[:, None] - np.einsum("ea,maj->mej", normals, points)  # (M, E, 8)
    edges, knots = len(normals), trajectory.knots()
    start, end = np.repeat(knots[:-1], edges), np.repeat(knots[1:], edges)
    group = np.zeros(len(start), dtype=np.intp)
    return minimise(sides.reshape(len(start), -1), start, end, group, 1, RESOLUTION)


def in_the_way(mission: Mission, robot: str) -> Iterator[tuple[str, Obstacle | KeepOutZone]]:
    """Label and shape of everything a robot stays out of, on the ground and in the air."""
    for number, obstacle in enumerate(mission.obstacles):
        yield f"obstacles[{number}]", obstacle
    for number, zone in enumerate(mission.zones):
        if isinstance(zone, KeepOutZone) and (not zone.robots or robot in zone.robots):
            yield f"zones[{number}]", zone


def body(obstacle: Obstacle | KeepOutZone) -> Solid:
    """What an obstacle or a zone fills; zones reach from floor to ceiling."""
    return Solid(outline(obstacle)) if isinstance(obstacle, KeepOutZone) else solid(obstacle)
