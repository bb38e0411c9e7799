"""Long smooth trajectories that no trajectory memory holds at once."""

import numpy as np

from planner.trajectory.piecewise import PiecewisePolynomial
from planner.trajectory.spline import SepticSpline


def smooth(pieces, seed=0, length=1.5, origin=(0.0, 0.0, 0.0)):
    """A C³ curve in three axes, of random pieces, that starts and ends at rest."""
    rng = np.random.default_rng(seed)
    knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.6, 1.4, pieces) * length)])
    spline = SepticSpline(knots)
    states = rng.normal(0.0, 0.2, (pieces + 1, 4, 3)) * np.array([1.0, 1.0, 0.3, 0.1])[None, :, None]
    states[[0, -1], 1:] = 0.0
    states[:, 0] += origin
    coefficients = np.zeros((pieces, 4, 8))
    coefficients[:, :3] = spline.coefficients(states.reshape(-1, 3))
    return PiecewisePolynomial(np.diff(knots), coefficients)
