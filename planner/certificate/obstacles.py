"""How close robots come to obstacles and to the edges of zones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from missions.arrays import Array
from missions.obstacles import CircleObstacle, KeepInZone, KeepOutZone, Obstacle
from missions.obstacles import label as named
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


def nearest(
    trajectory: PiecewisePolynomial, things: Iterable[tuple[str, Obstacle | KeepOutZone]]
) -> tuple[str, Minimum] | None:
    """The one of many shapes a robot comes closest to, by label, and how close; None without shapes.

    Shapes are taken in the order of the gaps between boxes around them and around the pieces; those whose gap is
    larger than a proven distance need no proof of their own.
    """
    points = control_points(trajectory.coefficients[:, :3], trajectory.durations)
    low, high = points.min(axis=-1), points.max(axis=-1)
    candidates = [(_box_gap(low, high, body(thing)), label, thing) for label, thing in things]
    best: tuple[str, Minimum] | None = None
    for gap, label, thing in sorted(candidates, key=lambda candidate: candidate[0]):
        if best is not None and gap > best[1].bound[0]:
            break
        found = clearance(trajectory, thing)
        if best is None or found.bound[0] < best[1].bound[0]:
            best = label, found
    return best


def _box_gap(low: Array, high: Array, solid_: Solid) -> float:
    """Smallest distance between boxes (M, 3) and the box around a solid [m]."""
    lower = np.array([*(solid_.vertices.min(axis=0) - solid_.radius), solid_.low])
    upper = np.array([*(solid_.vertices.max(axis=0) + solid_.radius), solid_.high])
    gap = np.maximum(np.maximum(lower - high, low - upper), 0.0)
    return float(np.sqrt(np.einsum("md,md->m", gap, gap)).min()) * (1.0 - 1e-12)


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
        yield named(number, obstacle), obstacle
    for number, zone in enumerate(mission.zones):
        if isinstance(zone, KeepOutZone) and (not zone.robots or robot in zone.robots):
            yield f"zones[{number}]", zone


def body(obstacle: Obstacle | KeepOutZone) -> Solid:
    """What an obstacle or a zone fills; zones reach from floor to ceiling."""
    return Solid(outline(obstacle)) if isinstance(obstacle, KeepOutZone) else solid(obstacle)
