"""Trajectories of least snap through waypoints (Mellinger and Kumar, Minimum snap trajectory generation, ICRA 2011).

For given times t_k and points p_k, every axis minimises ∫ (d⁴p/dt⁴)² dt over C³ splines of degree 7 with p(t_k) = p_k
and velocity, acceleration and jerk zero at both ends: a linear system in the inner velocities, accelerations and jerks.

Times that are not given start from the distances between the points; then pieces that stay below the limits get
shorter, against the others, and all are stretched together until the proven speed and acceleration are allowed.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from missions.arrays import Array, frozen
from planner.certificate.motion import largest_acceleration, largest_speed
from planner.interchange.errors import InterchangeError
from planner.trajectory.bezier import control_points
from planner.trajectory.blocks import solve_blocks
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.spline import SepticSpline, derivative_points, local

_ROUNDS = 30  # of sharing out the time
_SHRINK = (0.7, 0.5)  # of a piece in a round: at most to this share, by this power of what it could
_CUTS = 2  # halvings of a piece, for close bounds
_HEADROOM = 1e-3  # of the limits, for whole milliseconds
_SLACK = 0.99  # share of the limits from which on nobody is told to hurry
_STRETCHES = 20


def minimum_snap(times: Array, points: Array) -> PiecewisePolynomial:
    """The trajectory of least snap.

    Args:
        times: (K,) increasing [s].
        points: (K, 4) x, y, z [m], yaw [rad].
    """
    spline = SepticSpline(times)
    h = spline.durations
    snap = derivative_points(4) @ spline.points / h[:, None, None] ** 4  # (K-1, 4, 8) control points of p⁗
    Q = h[:, None, None] * (snap.swapaxes(1, 2) @ _gram() @ snap)  # (K-1, 8, 8) of the numbers at both ends
    x = np.zeros((4, len(times), 4))  # axes, knots, p v a j
    x[:, :, 0] = points.T
    if len(times) > 2:
        before, after = Q[:-1, 5:], Q[1:, 1:4]  # rows of v, a, j at the inner knots
        diagonal = before[:, :, 5:] + after[:, :, 1:4]
        right = (before @ local(x)[:, :-1, :, None] + after @ local(x)[:, 1:, :, None])[..., 0]  # (4, K-2, 3)
        found = solve_blocks(diagonal[None], after[None, :-1, :, 5:], -right.transpose(1, 2, 0)[None])
        x[:, 1:-1, 1:] = found[0].transpose(2, 0, 1)
    return PiecewisePolynomial(h, spline.coefficients(x))


def choose_times(points: Array, speed: float, acceleration: float) -> Array:
    """Times of waypoints, on whole milliseconds, at which the trajectory of least snap keeps the limits.

    Args:
        points: (K, 4), as above; consecutive ones are not equal.
        speed: largest Euclidean speed [m/s].
        acceleration: largest acceleration along an axis [m/s²].

    Returns:
        (K,) [s], from 0.

    Raises:
        InterchangeError: consecutive points are equal, or so close together that no times were found.
    """
    lengths = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
    if not lengths.all():
        raise InterchangeError(f"waypoint {int(np.argmin(lengths)) + 2} is the one before; allowed: another point")
    h = np.maximum(lengths / speed, np.sqrt(lengths / acceleration))
    h = np.maximum(h, 1e-3 * float(h.sum()))
    best, shortest = h, math.inf
    for _ in range(_ROUNDS):
        need = _stretch(minimum_snap(_knots(h), points), speed, acceleration)
        worst = float(need.max())
        if worst * h.sum() < shortest:
            best, shortest = worst * h, worst * float(h.sum())
        h = worst * h * np.maximum((need / worst) ** _SHRINK[1], _SHRINK[0])
    allowed: Array | None = None
    for _ in range(_STRETCHES):
        times = np.round(_knots(best), 3)
        if not (np.diff(times) > 0.0).all():
            best = 2.0 * best
            continue
        trajectory = minimum_snap(times, points)
        fast, hard = largest_speed(trajectory).value / speed, largest_acceleration(trajectory).value / acceleration
        ratio = max(fast, math.sqrt(hard))
        allowed = times if ratio <= 1.0 else allowed
        if _SLACK <= ratio <= 1.0:
            break
        best = best * ratio * (1.0 + _HEADROOM)
    if allowed is not None:
        return allowed
    raise InterchangeError(
        f"no times keep these waypoints within {speed:g} m/s and {acceleration:g} m/s²; are they too close together?"
    )


def _stretch(trajectory: PiecewisePolynomial, speed: float, acceleration: float) -> Array:
    """(M,) by what factor each piece would have to be longer, by bounds on its derivatives, alone."""
    h = trajectory.durations
    points = control_points(trajectory.coefficients[:, :3], h)  # (M, 3, 8)
    v = np.linalg.norm(points @ derivative_points(1, _CUTS).T, axis=1).max(axis=1) / h
    a = np.abs(points @ derivative_points(2, _CUTS).T).max(axis=(1, 2)) / h**2
    need: Array = np.maximum(np.maximum(v / speed, np.sqrt(a / acceleration)), 1e-6)
    return need


def _knots(durations: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(durations)])


@functools.cache
def _gram() -> Array:
    """(4, 4) integrals of products of the cubic Bernstein polynomials on [0, 1]."""
    i = range(4)
    return frozen([[math.comb(3, a) * math.comb(3, b) / math.comb(6, a + b) / 7.0 for b in i] for a in i])
