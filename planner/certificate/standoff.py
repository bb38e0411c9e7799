"""How far robots get from a surface, with proof: branch and bound over its points.

The distance to one point is convex, so along a piece of curve it is at most the largest of those of its Bernstein
points; the distance to the surface is at most that to any of its points. With the point nearest to the middle of the
piece, the bound closes as pieces are halved.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import ROUNDING, Minimum
from planner.certificate.branching import smallest
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


def farthest(trajectory: PiecewisePolynomial, surface: Array) -> Minimum:
    """Largest distance of a robot's centre to the nearest of points (J, 3) [m], negated: a minimum; one group."""

    def look(points: Array) -> tuple[Array, Array]:
        away = _distances(points[..., [0, -1]], surface).min(axis=-1)  # (B, 2)
        nearest = surface[_distances(points.mean(axis=-1)[..., None], surface)[:, 0].argmin(axis=-1)]
        size = np.abs(points).max(axis=(1, 2)) + np.abs(nearest).max(axis=1)
        return -away, -(np.linalg.norm(points - nearest[..., None], axis=1).max(axis=-1) + ROUNDING * size)

    points = control_points(trajectory.coefficients[:, :3], trajectory.durations)  # (M, 3, 8)
    knots = trajectory.knots()
    return smallest(points, knots[:-1], knots[1:], look, RESOLUTION)


def _distances(x: Array, surface: Array) -> Array:
    """(B, K, J) between points x (B, 3, K) and those of a surface (J, 3)."""
    return np.asarray(np.linalg.norm(x.swapaxes(1, 2)[:, :, None] - surface, axis=-1))
