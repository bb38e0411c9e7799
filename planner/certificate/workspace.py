"""Whether robots stay in the workspace."""

from __future__ import annotations

import numpy as np

from missions.schema import Workspace
from planner.certificate.bernstein import Minimum, minimise
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-4  # [m]


def inside(trajectory: PiecewisePolynomial, workspace: Workspace) -> Minimum:
    """Smallest distance to a side of the workspace [m], negative outside; one group."""
    nu = len(workspace.lower)
    points = control_points(trajectory.coefficients[:, :nu], trajectory.durations)  # (M, ν, 8)
    lower, upper = np.array(workspace.lower)[:, None], np.array(workspace.upper)[:, None]
    sides = np.concatenate([points - lower, upper - points], axis=1)  # (M, 2ν, 8)
    rows = sides.shape[1]
    knots = trajectory.knots()
    start, end = np.repeat(knots[:-1], rows), np.repeat(knots[1:], rows)
    group = np.zeros(len(start), dtype=np.intp)
    return minimise(sides.reshape(len(start), -1), start, end, group, 1, RESOLUTION)
