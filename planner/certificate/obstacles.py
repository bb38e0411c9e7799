"""How close robots come to obstacles."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from missions.schema import CircleObstacle, Obstacle
from planner.certificate.bernstein import Minimum, minimise, root, square_sum
from planner.certificate.errors import CertificateError
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


def clearance(trajectory: PiecewisePolynomial, obstacle: Obstacle) -> Minimum:
    """Smallest distance of a robot's centre to an obstacle's surface [m], negative inside; one group.

    Raises:
        CertificateError: a shape this certificate cannot judge.
    """
    if not isinstance(obstacle, CircleObstacle):
        raise CertificateError(f"obstacle of type {type(obstacle).__name__}: the certificate knows circles only")
    points = control_points(trajectory.coefficients[:, :2], trajectory.durations)  # (M, 2, 8)
    relative = points - np.array(obstacle.center[:2])[:, None]

    def outside(squares: Array) -> Array:
        """Distance to the circle from squared distances to its centre."""
        return root(squares) - obstacle.radius

    knots = trajectory.knots()
    group = np.zeros(len(points), dtype=np.intp)
    return minimise(square_sum(relative), knots[:-1], knots[1:], group, 1, RESOLUTION, outside)


def segment_clearance(begin: Array, end: Array, obstacle: Obstacle) -> float:
    """Smallest distance of the straight way from begin to end, both (2,) [m], to an obstacle's surface [m]."""
    if not isinstance(obstacle, CircleObstacle):
        raise CertificateError(f"obstacle of type {type(obstacle).__name__}: the certificate knows circles only")
    center = np.array(obstacle.center[:2])
    way = end - begin
    length2 = float(way @ way)
    s = float(np.clip((center - begin) @ way / length2, 0.0, 1.0)) if length2 > 0 else 0.0
    return float(np.linalg.norm(begin + s * way - center)) - obstacle.radius
