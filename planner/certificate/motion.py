"""How fast robots move, how hard they accelerate, and whether pieces join and rest at both ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.certificate.bernstein import derivative, minimise, negative_root, square_sum
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m/s], [m/s²]

_POSITION = slice(0, 3)


@dataclass(frozen=True)
class Worst:
    """A largest value and when it occurs [s]."""

    value: float
    time: float


def largest_speed(trajectory: PiecewisePolynomial, axes: slice = _POSITION) -> Worst:
    """Largest speed [m/s], Euclidean over the axes."""
    points = control_points(trajectory.coefficients[:, axes], trajectory.durations)
    squares = square_sum(derivative(points, trajectory.durations))  # (M, 13)
    knots = trajectory.knots()
    group = np.zeros(len(squares), dtype=np.intp)
    smallest = minimise(-squares, knots[:-1], knots[1:], group, 1, RESOLUTION, negative_root)
    return Worst(-float(smallest.bound[0]), float(smallest.time[0]))


def largest_acceleration(trajectory: PiecewisePolynomial) -> Worst:
    """Largest acceleration along any axis [m/s²]."""
    h = trajectory.durations
    points = derivative(derivative(control_points(trajectory.coefficients[:, _POSITION], h), h), h)  # (M, 3, 6)
    both = np.concatenate([points, -points], axis=1)
    knots = trajectory.knots()
    start, end = np.repeat(knots[:-1], 6), np.repeat(knots[1:], 6)
    group = np.zeros(len(start), dtype=np.intp)
    smallest = minimise(both.reshape(-1, 6), start, end, group, 1, RESOLUTION)
    return Worst(-float(smallest.bound[0]), float(smallest.time[0]))


def largest_offset(trajectory: PiecewisePolynomial, axis: int, value: float) -> Worst:
    """Largest distance of one axis (2: height, 3: yaw) from a value it should keep, in the axis's unit."""
    points = control_points(trajectory.coefficients[:, axis], trajectory.durations) - value
    both, knots = np.concatenate([points, -points]), trajectory.knots()  # the smallest of both is the largest distance
    start, end, group = np.tile(knots[:-1], 2), np.tile(knots[1:], 2), np.zeros(len(both), dtype=np.intp)
    smallest = minimise(both, start, end, group, 1, RESOLUTION)
    return Worst(-float(smallest.bound[0]), float(smallest.time[0]))


def largest_jump(trajectory: PiecewisePolynomial, order: int, axes: slice = _POSITION) -> Worst:
    """Largest jump of a derivative (0 position, 1 velocity, 2 acceleration) at a joint, Euclidean over the axes."""
    if trajectory.pieces == 1:
        return Worst(0.0, 0.0)
    begin, end = _ends(trajectory, order)
    jumps = np.linalg.norm((begin[1:] - end[:-1])[:, axes], axis=1)
    worst = int(np.argmax(jumps))
    return Worst(float(jumps[worst]), float(trajectory.knots()[worst + 1]))


def largest_at_ends(trajectory: PiecewisePolynomial, order: int) -> Worst:
    """Largest norm of a derivative at the start and at the end of the trajectory."""
    begin, end = _ends(trajectory, order)
    first, last = (float(np.linalg.norm(value[_POSITION])) for value in (begin[0], end[-1]))
    return Worst(first, 0.0) if first >= last else Worst(last, trajectory.duration)


def _ends(trajectory: PiecewisePolynomial, order: int) -> tuple[Array, Array]:
    """(M, 4) values of a derivative at the beginnings and ends of all pieces."""
    points = control_points(trajectory.coefficients, trajectory.durations)
    for _ in range(order):
        points = derivative(points, trajectory.durations)
    return points[..., 0], points[..., -1]
