"""Piecewise polynomials: the one representation of motion between the planner and the drones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array


@dataclass(frozen=True)
class PiecewisePolynomial:
    """One robot's trajectory as polynomial pieces of degree 7 in x, y, z and yaw.

    Attributes:
        durations: (M,) [s], positive.
        coefficients: (M, 4, 8) ascending powers of the time since the piece's start; axes x, y, z [m], yaw [rad].
    """

    durations: Array
    coefficients: Array

    def __post_init__(self) -> None:
        durations = np.array(self.durations, dtype=np.float64)
        coefficients = np.array(self.coefficients, dtype=np.float64)
        pieces = len(durations)
        if durations.ndim != 1 or pieces == 0 or coefficients.shape != (pieces, 4, 8):
            raise ValueError(
                f"a piecewise polynomial has durations (M,) and coefficients (M, 4, 8); "
                f"got {durations.shape} and {coefficients.shape}"
            )
        if not (np.isfinite(durations).all() and np.isfinite(coefficients).all() and (durations > 0).all()):
            raise ValueError("durations must be positive and all numbers finite")
        durations.setflags(write=False)
        coefficients.setflags(write=False)
        object.__setattr__(self, "durations", durations)
        object.__setattr__(self, "coefficients", coefficients)

    @property
    def pieces(self) -> int:
        """M: number of pieces."""
        return len(self.durations)

    @property
    def duration(self) -> float:
        """Total duration [s]."""
        return float(self.durations.sum())

    def knots(self) -> Array:
        """(M+1,) start times of the pieces and the end [s]."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Values (len(t), 4) of x, y, z, yaw or a time derivative of them.

        Times before the start give the first point, times after the end the last one (derivatives are zero there),
        as the firmware holds still. At a joint the later piece answers.
        """
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        knots = self.knots()
        piece = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, self.pieces - 1)
        tau = np.clip(t - knots[piece], 0.0, self.durations[piece])
        c = self.coefficients[piece]  # (len(t), 4, 8)
        out = np.zeros((len(t), 4))
        for k in range(7, derivative - 1, -1):  # Horner
            out = out * tau[:, None] + math.perm(k, derivative) * c[:, :, k]
        if derivative:
            out[(t < 0.0) | (t > knots[-1])] = 0.0
        return out


def concatenated(parts: Sequence[PiecewisePolynomial]) -> PiecewisePolynomial:
    """Trajectories flown one right after another, as one; at least one."""
    return PiecewisePolynomial(
        np.concatenate([part.durations for part in parts]), np.concatenate([part.coefficients for part in parts])
    )
