"""How far robots get from a surface, with proof: branch and bound over its points.

The distance to one point is convex, so along a piece of curve it is at most the largest of those of its Bernstein
points; the distance to the surface is at most that to any of its points. With the point nearest to the middle of the
piece, the bound closes as pieces are halved.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import MOST_OPEN, ROUNDING, ROUNDS, Minimum, halves
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


def farthest(trajectory: PiecewisePolynomial, surface: Array) -> Minimum:
    """Largest distance of a robot's centre to the nearest of points (J, 3) [m], negated: a minimum; one group."""
    points = control_points(trajectory.coefficients[:, :3], trajectory.durations)  # (M, 3, 8)
    knots = trajectory.knots()
    start, end = knots[:-1], knots[1:]
    most, when, proven = -np.inf, 0.0, -np.inf
    left, right = halves(points.shape[-1] - 1)
    for _ in range(ROUNDS):
        distance = _distances(points[..., [0, -1]], surface).min(axis=-1)  # (B, 2)
        piece, side = np.unravel_index(int(distance.argmax()), distance.shape)
        if distance[piece, side] > most:
            most, when = float(distance[piece, side]), float((start, end)[side][piece])
        nearest = surface[_distances(points.mean(axis=-1)[..., None], surface)[:, 0].argmin(axis=-1)]
        size = np.abs(points).max(axis=(1, 2)) + np.abs(nearest).max(axis=1)
        high = np.linalg.norm(points - nearest[..., None], axis=1).max(axis=-1) + ROUNDING * size
        open_ = high > most + RESOLUTION
        proven = max(proven, float(high[~open_].max(initial=-np.inf)))
        points, start, end, high = points[open_], start[open_], end[open_], high[open_]
        if len(points) == 0:
            break
        if len(points) > MOST_OPEN:  # the bound stays a bound, only wider than the resolution
            proven = max(proven, float(high.max()))
            break
        middle = (start + end) / 2
        points = np.concatenate([points @ left.T, points @ right.T])
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        high = np.concatenate([high, high])
    else:
        proven = max(proven, float(high.max()))
    return Minimum(-np.array([max(proven, most)]), -np.array([most]), np.array([when]))


def _distances(x: Array, surface: Array) -> Array:
    """(B, K, J) between points x (B, 3, K) and those of a surface (J, 3)."""
    return np.asarray(np.linalg.norm(x.swapaxes(1, 2)[:, :, None] - surface, axis=-1))
