"""Degree-7 splines that are C³ by construction: septic Hermite pieces.

The unknowns are position, velocity, acceleration and jerk at the knots. The 8 control points of a piece of length h
are linear in the 8 numbers at its two ends, so whatever the unknowns are, pieces agree up to jerk at every joint; and
what is fixed (start, end, rest) is simply no unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.trajectory.bezier import power_coefficients

_STATE = 4  # position, velocity, acceleration, jerk


@dataclass(frozen=True)
class SepticSpline:
    """The linear maps of a C³ spline of degree 7 on given knots.

    A vector of unknowns s has 4 numbers a knot: p, v σ, a σ², j σ³ (σ = mean piece length, so that all are lengths).

    Attributes:
        knots: (M+1,) [s].
    """

    knots: Array

    @property
    def durations(self) -> Array:
        """(M,) lengths of the pieces [s]."""
        return np.diff(self.knots)

    @property
    def scale(self) -> float:
        """σ: mean length of a piece [s]."""
        return float(self.knots[-1] - self.knots[0]) / (len(self.knots) - 1)

    def points(self) -> Array:
        """(M, 8, 4(M+1)) map from unknowns to the control points of every piece."""
        h = self.durations
        pieces = len(h)
        ratio = h / self.scale
        out = np.zeros((pieces, 8, _STATE * (pieces + 1)))
        for k in range(_STATE):  # derivative k contributes C(i,k)/C(7,k) h^k/k! to control point i of its own half
            for i in range(k, _STATE):
                weight = math.comb(i, k) / math.comb(7, k) * ratio**k / math.factorial(k)
                m = np.arange(pieces)
                out[m, i, _STATE * m + k] = weight
                out[m, 7 - i, _STATE * (m + 1) + k] = (-1) ** k * weight
        return out

    def at(self, t: Array, derivative: int = 0) -> Array:
        """(len(t), 4(M+1)) map from unknowns to a derivative at times t inside the knots."""
        h = self.durations
        piece = np.clip(np.searchsorted(self.knots, t, side="right") - 1, 0, len(h) - 1)
        points = differences(self.points(), h, derivative)  # (M, 8-derivative, n)
        basis = bernstein((t - self.knots[piece]) / h[piece], 7 - derivative)
        out = np.zeros((len(t), points.shape[-1]))
        for m in range(len(h)):
            mine = piece == m
            local = slice(_STATE * m, _STATE * (m + 2))
            out[mine, local] = basis[mine] @ points[m][:, local]
        return out

    def coefficients(self, unknowns: Array) -> Array:
        """(M, axes, 8) ascending powers of the pieces, from (4(M+1), axes) unknowns."""
        points = np.moveaxis(self.points() @ unknowns, 1, 2)
        return power_coefficients(points, self.durations)


def differences(points: Array, durations: Array, order: int) -> Array:
    """Control points of a derivative: (M, n+1-order, ...) from (M, n+1, ...) and the lengths (M,) [s]."""
    for _ in range(order):
        degree = points.shape[1] - 1
        points = degree * np.diff(points, axis=1) / durations.reshape((-1,) + (1,) * (points.ndim - 1))
    return points


def bernstein(u: Array, degree: int) -> Array:
    """(len(u), degree+1) Bernstein polynomials at u in [0, 1]."""
    i = np.arange(degree + 1)
    binomials = np.array([math.comb(degree, k) for k in i], dtype=np.float64)
    basis: Array = binomials * u[:, None] ** i * (1.0 - u[:, None]) ** (degree - i)
    return basis
