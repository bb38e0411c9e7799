"""Long smooth trajectories that no trajectory memory holds at once."""

import math

import numpy as np

from planner.trajectory.piecewise import PiecewisePolynomial


def smooth(pieces, seed=0, length=1.5, origin=(0.0, 0.0, 0.0)):
    """A C³ curve in three axes, of random pieces, that starts and ends at rest."""
    rng = np.random.default_rng(seed)
    durations = rng.uniform(0.6, 1.4, pieces) * length
    states = rng.normal(0.0, 0.2, (pieces + 1, 4, 3)) * np.array([1.0, 1.0, 0.3, 0.1])[None, :, None]
    states[[0, -1], 1:] = 0.0
    states[:, 0] += origin
    return through(durations, states)


def through(durations, states):
    """Septic Hermite pieces through states (M+1, 4, 3): position, velocity, acceleration, jerk at the joints."""
    coefficients = np.zeros((len(durations), 4, 8))
    for piece, T in enumerate(durations):
        rows = [
            [math.perm(k, d) * t ** (k - d) if k >= d else 0.0 for k in range(8)] for t in (0.0, T) for d in range(4)
        ]
        coefficients[piece, :3] = np.linalg.solve(np.array(rows), np.concatenate(states[piece : piece + 2])).T
    return PiecewisePolynomial(np.array(durations), coefficients)
